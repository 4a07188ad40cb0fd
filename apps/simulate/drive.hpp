#pragma once

#include <cstddef>

#include "simulate/params.hpp"
#include "simulate/route.hpp"
#include "simulate/world.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage::simulation {

/// The sensor's way through the world: along a route at constant speed, upright on the slope of the
/// ground, x forward, y left. Borrows the world.
/// Thread safety: const methods may run on one object from many threads at once.
class Drive {
 public:
  /// Errors: `invalid_config` for a route that the campus does not have.
  [[nodiscard]] static Result<Drive> create(const World& world, const WorldParams& params);

  [[nodiscard]] const Route& route() const noexcept { return route_; }
  /// How many scans are recorded; at least 1.
  [[nodiscard]] std::size_t scans() const noexcept { return scans_; }
  /// When scan i (its first firing) is taken [s].
  [[nodiscard]] double stamp(std::size_t i) const noexcept;
  /// Driven until a moment, in plan [m].
  [[nodiscard]] double distance(double stamp) const noexcept;
  /// T_campus_sensor at a moment [s].
  [[nodiscard]] Pose pose(double stamp) const noexcept;

 private:
  Drive(const World& world, const WorldParams& params, Route route);

  const World* world_;
  Route route_;
  double speed_, start_time_, seconds_per_scan_, height_;
  std::size_t scans_;
};

}  // namespace vantage::simulation
