#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "simulate/events.hpp"
#include "simulate/pace.hpp"
#include "simulate/params.hpp"
#include "simulate/roughness.hpp"
#include "simulate/route.hpp"
#include "simulate/world.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage::simulation {

/// The sensor's motion through the world: along a route, upright on the slope of the ground, x
/// forward, y left, unless the ground is rough or the sensor turns on the spot. A kidnap moves it
/// from one place on the route to another. The sensor may be mounted in another orientation than
/// that of the body, which moves like this. Borrows the world.
/// Thread safety: const methods may run on one object from many threads at once.
class Drive {
 public:
  /// Errors: `invalid_config` for a route that the campus does not have, and those of plan_events.
  [[nodiscard]] static Result<Drive> create(const World& world, const WorldParams& params);

  [[nodiscard]] const Route& route() const noexcept { return route_; }
  [[nodiscard]] const Pace& pace() const noexcept { return pace_; }
  /// The number of recorded scans; at least 1.
  [[nodiscard]] std::size_t scans() const noexcept { return scans_; }
  /// When scan i (its first firing) is taken [s].
  [[nodiscard]] double stamp(std::size_t i) const noexcept;
  /// The number of scan i among all sweeps of the sensor, also those that are not kept.
  [[nodiscard]] std::size_t sweep_number(std::size_t i) const noexcept { return scan_every_ * i; }
  /// The distance driven until a moment, in plan view [m].
  [[nodiscard]] double distance(double stamp) const noexcept;
  /// T_campus_sensor at a moment [s].
  [[nodiscard]] Pose pose(double stamp) const noexcept;

  /// When the last scan's sweep ends [s].
  [[nodiscard]] double end() const noexcept;
  /// T_campus_sensor as if no kidnap lay between then and another moment. Moments are counted from
  /// the first scan's stamp, so that differences of poses are exact for large stamps, too [s].
  [[nodiscard]] Pose pose_near(double seconds, double moment) const noexcept;

  /// Whether scan i is the first one after a kidnap, which happens at its stamp.
  [[nodiscard]] bool is_kidnapped(std::size_t i) const noexcept;
  /// T_campus_sensor at scan i's stamp, as if no kidnap had happened at that moment.
  [[nodiscard]] Pose pose_driven_on(std::size_t i) const noexcept;
  /// In driving order.
  [[nodiscard]] std::span<const Kidnap> kidnaps() const noexcept { return events_.kidnaps; }
  /// The places where the map has no points.
  [[nodiscard]] std::span<const Hole> holes() const noexcept { return events_.holes; }
  /// Whether the sensor is above a hole at scan i's stamp.
  [[nodiscard]] bool is_in_hole(std::size_t i) const noexcept;

 private:
  Drive(const World& world, const WorldParams& params, Route route, Pace pace, Events events);
  /// How far ahead of the driven distance the sensor is [m].
  [[nodiscard]] double ahead(double stamp) const noexcept;
  /// T_campus_sensor a time after the first scan's stamp [s].
  [[nodiscard]] Pose pose_on_route(double seconds, double ahead) const noexcept;

  const World* world_;
  Route route_;
  Pace pace_;
  Roughness roughness_;
  Events events_;
  double start_time_, seconds_per_scan_, seconds_per_sweep_, height_;
  std::optional<Pose> T_body_sensor_;  // none: the frames are the same
  std::size_t scans_, scan_every_;
};

}  // namespace vantage::simulation
