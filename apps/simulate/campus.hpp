#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "simulate/objects.hpp"
#include "simulate/params.hpp"
#include "simulate/solid.hpp"
#include "simulate/street_grid.hpp"
#include "simulate/terrain.hpp"

namespace vantage::simulation {

/// A bridge across a street, with ramps on both sides [m].
struct Overpass {
  Eigen::Vector2d centre;     ///< in the middle of the street below
  Eigen::Vector2d direction;  ///< unit, of the deck; across the street
  double half_span;           ///< of the deck, to where the ramps begin
  double half_width;          ///< of the deck
  double underside;           ///< height of the deck's lower side
};

/// One thing that stands on the ground: a building, a tree, a car.
struct Thing {
  Surface kind;
  Plot plot;                                                 ///< where it stands
  std::size_t first_solid, end_solid, first_leaf, end_leaf;  ///< of the campus: [first, end)
};

/// A place beside a street where a car may park, between the lamps.
struct ParkingPlace {
  Eigen::Vector2d middle;
  Eigen::Vector2d along;  ///< unit, of the street
};

/// Everything that stands on the ground. Campus frame [m].
struct Campus {
  std::vector<Solid> solids;
  std::vector<Leaf> leaves;
  std::vector<Overpass> overpasses;  ///< at least one over every route in the layout `streets`
  std::vector<Thing> things;         ///< every solid and leaf belongs to one, in their order
  std::vector<ParkingPlace> free_parking;

  void add(Surface kind, const Plot& plot, std::vector<Solid> thing_solids,
           std::vector<Leaf> thing_leaves = {});
  void add(Campus part);
};

/// The campus without some of its things.
/// @param gone  for each thing
[[nodiscard]] Campus without(const Campus& campus, const std::vector<bool>& gone);

/// Fills the blocks between the streets. The same parameters and seed give the same campus.
[[nodiscard]] Campus make_campus(const CampusParams& params, std::uint64_t seed,
                                 const StreetGrid& streets, const Terrain& terrain);

}  // namespace vantage::simulation
