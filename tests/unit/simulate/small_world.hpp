#pragma once

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "simulate/drive.hpp"
#include "simulate/params.hpp"
#include "simulate/world.hpp"
#include "vantage/engine/config.hpp"

namespace vantage::simulation::test {

inline constexpr double kRadians = std::numbers::pi / 180.0;  ///< of a degree

/// The smallest campus, quick to make.
inline WorldParams small_world(std::uint64_t seed = 3) {
  WorldParams params;
  params.seed = seed;
  params.campus.size_x = 64.0;
  params.campus.size_y = 70.0;
  params.campus.ground_relief = 2.0;
  params.map.point_spacing = 0.25;
  params.lidar.motion_distortion = false;
  return params;
}

/// Streets and an overpass on a plane, and nothing else.
inline WorldParams bare_world() {
  WorldParams params = small_world();
  params.campus.ground_relief = 0.0;
  params.campus.building_density = 0.0;
  params.campus.trees_per_hectare = 0.0;
  params.campus.parked_cars = 0.0;
  params.campus.wall_share = 0.0;
  return params;
}

inline World make_world(const WorldParams& params, Day day = Day::map) {
  auto world = World::create(params, day);
  REQUIRE_MESSAGE(world, to_string(world.error()));
  return *std::move(world);
}

inline Drive make_drive(const World& world, const WorldParams& params) {
  auto drive = Drive::create(world, params);
  REQUIRE_MESSAGE(drive, to_string(drive.error()));
  return *std::move(drive);
}

/// To the nearest surface of the ground and of the solids within `reach` [m].
inline double distance_to_surface(const World& world, const Point& p, double reach) {
  double nearest = std::abs(p.z() - world.terrain().height(p.x(), p.y()));
  for (const Solid& solid : world.campus().solids) {
    if ((p.array() < solid.bounds.min.array() - reach).any() ||
        (p.array() > solid.bounds.max.array() + reach).any()) {
      continue;
    }
    nearest = std::min(nearest, std::abs(solid.signed_distance(p)));
  }
  return nearest;
}

/// The parameters of a world in this text, `w.toml`, must be refused with a message that holds
/// `part`.
inline void check_refused(const std::string& text, const std::string& part) {
  CAPTURE(text);
  const auto table = parse_toml(text, "w.toml");
  const auto world = table ? parse_world(*table) : fail(table.error());
  REQUIRE_FALSE(world);
  CHECK(world.error().code == ErrorCode::invalid_config);
  const std::string message = to_string(world.error());
  CAPTURE(message);
  CHECK(message.find(part) != std::string::npos);
}

}  // namespace vantage::simulation::test
