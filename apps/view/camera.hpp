#pragma once

#include "vantage/point_cloud.hpp"

namespace vantage::view {

/// Where a picture is taken from.
struct Camera {
  Eigen::Vector3d lookat = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d front = Eigen::Vector3d::UnitZ();  ///< from `lookat` to the eye, unit length
  double distance = 1.0;                             ///< between both [m]
};

/// An oblique view from above onto the longer side of the points, z up, as near as it can be with
/// all but stray points (beyond the 0.2 % quantiles) in the picture.
/// @param vertical_fov  [rad]
/// @param aspect        width / height of the picture
[[nodiscard]] Camera oblique_view(PointsView points, double vertical_fov, double aspect);

}  // namespace vantage::view
