#pragma once

#include <Eigen/Core>
#include <limits>

#include "vantage/pose.hpp"

namespace vantage {

/// An absolute measurement of where a sensor is, for example by GNSS. Its errors may last over many
/// scans; they are no random noise that averages out.
struct PosePrior {
  Pose T_map_sensor;
  /// Standard deviations along the axes of the map [m]; infinite where nothing is known.
  Eigen::Vector3d sigma_translation =
      Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  /// Standard deviation of the heading, about the map's z [rad]; infinite if it is unknown. Roll
  /// and pitch are not used.
  double sigma_heading = std::numeric_limits<double>::infinity();
};

}  // namespace vantage
