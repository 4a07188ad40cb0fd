#pragma once

#include "simulate/block.hpp"
#include "simulate/campus.hpp"
#include "simulate/params.hpp"
#include "simulate/street_grid.hpp"
#include "simulate/terrain.hpp"

/// What stands in a campus whose layout is not `streets`. Campus frame [m].
namespace vantage::simulation {

inline constexpr double kRowPitch = 12.0;     ///< from one house of a row to the next [m]
inline constexpr double kTunnelMouth = 15.0;  ///< from a tunnel to the next crossing, at least [m]

/// Rows of equal houses along the sides of a block whose street runs along y, a house every
/// kRowPitch, evenly around the middle of the side.
[[nodiscard]] Campus make_rows(const Block& block, const Terrain& terrain);

/// A part of a street, from one crossing to the next.
struct Street {
  Eigen::Vector2d from, to;
};
/// The second street of route 0, over which the tunnel is built.
[[nodiscard]] Street tunnel_street(const StreetGrid& streets);

/// A tunnel over the middle of that street: two smooth walls and a ceiling.
[[nodiscard]] Campus make_tunnel(const CampusParams& params, const StreetGrid& streets,
                                 const Terrain& terrain);

/// The campus without what stands within `square_radius` of its centre.
[[nodiscard]] Campus without_square(const Campus& campus, const CampusParams& params);

}  // namespace vantage::simulation
