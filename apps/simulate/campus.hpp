#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

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

/// Everything that stands on the ground. Campus frame [m].
struct Campus {
  std::vector<Solid> solids;
  std::vector<Leaf> leaves;
  std::vector<Overpass> overpasses;  ///< at least one over every route
};

/// Fills the blocks between the streets. The same parameters and seed give the same campus.
[[nodiscard]] Campus make_campus(const CampusParams& params, std::uint64_t seed,
                                 const StreetGrid& streets, const Terrain& terrain);

}  // namespace vantage::simulation
