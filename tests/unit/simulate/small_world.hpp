#pragma once

#include <doctest/doctest.h>

#include "simulate/drive.hpp"
#include "simulate/params.hpp"
#include "simulate/world.hpp"

namespace vantage::simulation::test {

/// The smallest campus, quick to make.
inline WorldParams small_world(std::uint64_t seed = 3) {
  WorldParams params;
  params.seed = seed;
  params.campus.size_x = 64.0;
  params.campus.size_y = 70.0;
  params.campus.ground_relief = 2.0;
  params.map.point_spacing = 0.25;
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

inline World make_world(const WorldParams& params) {
  auto world = World::create(params);
  REQUIRE_MESSAGE(world, to_string(world.error()));
  return *std::move(world);
}

inline Drive make_drive(const World& world, const WorldParams& params) {
  auto drive = Drive::create(world, params);
  REQUIRE_MESSAGE(drive, to_string(drive.error()));
  return *std::move(drive);
}

}  // namespace vantage::simulation::test
