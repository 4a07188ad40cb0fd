#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "simulate/params.hpp"
#include "simulate/route.hpp"
#include "vantage/result.hpp"

namespace vantage::simulation {

/// The sensor is carried along the route before a scan, without noticing.
struct Kidnap {
  std::size_t scan;  ///< the first one at the new place
  double ahead;      ///< of what has been driven, from this scan on to the next kidnap [m]; >= 0
};

/// A disc in the plan without map points. Campus frame [m].
struct Hole {
  Eigen::Vector2d centre;
  double radius;

  [[nodiscard]] bool contains(const Eigen::Vector2d& p) const noexcept {
    return (p - centre).squaredNorm() <= radius * radius;
  }
};

/// What makes localization hard on a drive.
struct Events {
  std::vector<Kidnap> kidnaps;  ///< `scan` ascending
  std::vector<Hole> holes;      ///< in driving order
};

/// Spreads `drive.kidnaps` and `map.holes` evenly over the drive.
///
/// A kidnap ends on the route at least 0.3 of the campus's mean extent away from where it began,
/// with a heading at least 45 degrees off. Each hole has its own equal part of the drive and its
/// centre there on the route, as near as can be to that part's middle; the start and the places
/// where kidnaps end are more than 20 m outside of every hole, holes do not overlap, and where the
/// drive is long enough the sensor drives out of each one before the next kidnap.
/// @param scans            of the drive
/// @param metres_per_scan  driven from one to the next
/// @return                 the same for the same parameters
/// Errors: `invalid_config` for more than fit.
[[nodiscard]] Result<Events> plan_events(const Route& route, const WorldParams& params,
                                         std::size_t scans, double metres_per_scan);

}  // namespace vantage::simulation
