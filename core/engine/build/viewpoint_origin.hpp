#pragma once

#include <variant>
#include <vector>

#include "vantage/engine/viewpoints.hpp"

namespace vantage {

/// Viewpoints wherever there is ground, as the paper has it.
struct OverGround {
  double sensor_height = 1.0;  ///< h_s [m]
};
/// Viewpoints over the ground that a robot can get to; see `reachable_ground`.
struct OverReachableGround {
  double sensor_height = 1.0;  ///< h_s [m]
  double max_step = 0.3;       ///< [m]
};
/// Viewpoints where the sensor was while mapping, or beside it; see `places_along`.
struct AlongTrajectory {
  std::vector<double> lateral_offsets{0.0};  ///< to the left of the direction of travel [m]
};

/// Where viewpoints come from, each with what belongs to it alone. The keys of [viewpoints] say the
/// same by a source and by keys that exclude each other.
using ViewpointOrigin = std::variant<OverGround, OverReachableGround, AlongTrajectory>;

/// Precondition: `params` is valid.
[[nodiscard]] ViewpointOrigin origin_of(const ViewpointParams& params);

}  // namespace vantage
