#pragma once

#include "vantage/point_cloud.hpp"

namespace vantage::view {

/// The viewpoint of a picture.
struct Camera {
  Eigen::Vector3d lookat = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d front = Eigen::Vector3d::UnitZ();  ///< from `lookat` to the eye, unit length
  double distance = 1.0;                             ///< between `lookat` and the eye [m]
};

/// An oblique view from above onto the longer side of the points, z up. It is as near as possible
/// with all points in the picture except stray ones (beyond the 0.2 % quantiles).
/// @param vertical_fov  [rad]
/// @param aspect        width / height of the picture
[[nodiscard]] Camera oblique_view(PointsView points, double vertical_fov, double aspect);

}  // namespace vantage::view
