#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "simulate/pace.hpp"
#include "simulate/params.hpp"
#include "simulate/route.hpp"
#include "vantage/result.hpp"

namespace vantage::simulation {

/// The sensor is carried along the route before a scan, without noticing it.
struct Kidnap {
  std::size_t scan;  ///< the first one at the new place
  double ahead;      ///< how far ahead of the driven distance the sensor is, from this scan to the
                     ///< next kidnap [m]; >= 0
};

/// A disc in plan view without map points. Campus frame [m].
struct Hole {
  Eigen::Vector2d centre;
  double radius;

  [[nodiscard]] bool contains(const Eigen::Vector2d& p) const noexcept {
    return (p - centre).squaredNorm() <= radius * radius;
  }
};

/// From one scan to the next [s].
[[nodiscard]] double seconds_per_scan(const WorldParams& params) noexcept;
/// The number of scans of a drive; at least 1.
[[nodiscard]] std::size_t number_of_scans(const WorldParams& params, const Pace& pace) noexcept;

/// The events that make localization hard on a drive.
struct Events {
  std::vector<Kidnap> kidnaps;  ///< `scan` ascending
  std::vector<Hole> holes;      ///< in driving order
};

/// Spreads `drive.kidnaps` and `map.holes` evenly over the drive.
///
/// A kidnap ends on the route, at a distance of at least 0.3 of the campus's mean extent from where
/// it began, with a heading at least 45 degrees different. Each hole has its own part of the drive,
/// all parts being equal, and its centre on the route there, as near as possible to the middle of
/// that part. The start and the places where kidnaps end are more than 20 m outside every hole, and
/// holes do not overlap. If the drive is long enough, the sensor leaves each hole before the next
/// kidnap.
/// @param pace  of the drive
/// @return      the same for the same parameters
/// Errors: `invalid_config` if there are more events than fit.
[[nodiscard]] Result<Events> plan_events(const Route& route, const WorldParams& params,
                                         const Pace& pace);

}  // namespace vantage::simulation
