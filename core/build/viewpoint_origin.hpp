#pragma once

#include <variant>
#include <vector>

#include "vantage/build/viewpoints.hpp"

namespace vantage {

/// Viewpoints over all ground, as in the paper.
struct OverGround {
  double sensor_height = 1.0;  ///< h_s [m]
};
/// Viewpoints over the ground that a robot can reach; see `reachable_ground`.
struct OverReachableGround {
  double sensor_height = 1.0;  ///< h_s [m]
  double max_step = 0.3;       ///< [m]
};
/// Viewpoints where the sensor was while mapping, or beside it; see `places_along`.
struct AlongTrajectory {
  std::vector<double> lateral_offsets{0.0};  ///< to the left of the direction of travel [m]
};

/// Where viewpoints come from. Each alternative holds the parameters that only it uses. The keys of
/// [viewpoints] express the same choice by `source` and by keys that exclude each other.
using ViewpointOrigin = std::variant<OverGround, OverReachableGround, AlongTrajectory>;

/// Precondition: `params` is valid.
[[nodiscard]] ViewpointOrigin origin_of(const ViewpointParams& params);

}  // namespace vantage
