#include "simulate/layouts.hpp"

#include <algorithm>
#include <cmath>

namespace vantage::simulation {
namespace {

constexpr double kDepthOfFoundations = 0.6;  // [m]

/// A box over a plot, between two heights.
Solid upright_box(Surface surface, const Plot& plot, double bottom, double top) {
  const Pose frame = pose_from_xyz_rpy({plot.centre.x(), plot.centre.y(), 0.0},
                                       {0.0, 0.0, std::atan2(plot.along.y(), plot.along.x())});
  return make_box(surface, frame, {-plot.half.x(), -plot.half.y(), bottom},
                  {plot.half.x(), plot.half.y(), top});
}

struct Heights {
  double lowest, highest;
};

Heights ground_below(const Plot& plot, const Terrain& terrain) {
  constexpr double kStep = 0.5;
  Heights heights{terrain.height(plot.centre), terrain.height(plot.centre)};
  for (double u = -plot.half.x(); u <= plot.half.x(); u += kStep) {
    for (double v = -plot.half.y(); v <= plot.half.y(); v += kStep) {
      const double z = terrain.height(plot.at(u, v));
      heights = {std::min(heights.lowest, z), std::max(heights.highest, z)};
    }
  }
  return heights;
}

}  // namespace

Campus make_rows(const Block& block, const Terrain& terrain) {
  const Eigen::Vector2d half(4.0, 3.0);
  constexpr double kHeight = 7.0, kFrontGarden = 1.0;
  Campus campus;
  for (const std::size_t side : {std::size_t{1}, std::size_t{3}}) {
    if (!block.has_street[side]) continue;
    const int houses = static_cast<int>(block.length(side) / kRowPitch);
    for (int k = 0; k < houses; ++k) {
      const double at = block.length(side) / 2.0 + (k + 0.5 - houses / 2.0) * kRowPitch;
      const Plot plot{block.corner(side) + at * block.along(side) +
                          (kFrontGarden + half.y()) * block.inward(side),
                      block.along(side), half};
      const bool is_clear =
          std::none_of(campus.things.begin(), campus.things.end(),
                       [&](const Thing& other) { return overlap(plot.grown(kGap), other.plot); });
      if (!block.contains(plot, 0.5) || (side == 3 && !is_clear)) continue;
      const Heights ground = ground_below(plot, terrain);
      campus.add(Surface::building, plot,
                 {upright_box(Surface::building, plot, ground.lowest - kDepthOfFoundations,
                              ground.highest + kHeight)});
    }
  }
  return campus;
}

Street tunnel_street(const StreetGrid& streets) {
  const auto route = streets.route(0).value();  // every campus has it
  return {route[1], route[2]};
}

Campus make_tunnel(const CampusParams& params, const StreetGrid& streets, const Terrain& terrain) {
  constexpr double kThickness = 0.3;
  const auto [from, to] = tunnel_street(streets);
  const double edge = params.street_width / 2.0;
  const Plot inside{
      (from + to) / 2.0, (to - from).normalized(), {params.tunnel_length / 2.0, edge}};
  const Heights ground = ground_below(inside, terrain);
  const double ceiling = ground.highest + params.overpass_clearance;
  std::vector<Solid> solids;
  for (const double side : {-1.0, 1.0}) {
    const Plot wall{inside.at(0.0, side * (edge + kThickness / 2.0)),
                    inside.along,
                    {inside.half.x(), kThickness / 2.0}};
    // Into the ceiling, so that no ray slips between them.
    solids.push_back(upright_box(Surface::wall, wall, ground.lowest - kDepthOfFoundations,
                                 ceiling + kThickness / 2.0));
  }
  const Plot roof{inside.centre, inside.along, {inside.half.x(), edge + kThickness + 0.1}};
  solids.push_back(upright_box(Surface::overpass, roof, ceiling, ceiling + kThickness));
  Campus campus;
  // The verges stay empty: what is in them would stand in the walls.
  const Plot whole{inside.centre, inside.along, {inside.half.x(), edge + kVerge}};
  campus.add(Surface::overpass, whole, std::move(solids));
  return campus;
}

Campus without_square(const Campus& campus, const CampusParams& params) {
  const double radius = params.square_radius;
  const auto is_outside = [&](const auto& p) {
    return p.template head<2>().squaredNorm() >= radius * radius;
  };
  std::vector<bool> gone;
  for (const Thing& thing : campus.things) {
    bool inside = thing.plot.centre.norm() < radius;
    for (std::size_t k = thing.first_solid; k < thing.end_solid && !inside; ++k) {
      for (const Face& face : campus.solids[k].faces) {
        inside = inside || !std::all_of(face.corners.begin(), face.corners.end(), is_outside);
      }
    }
    for (std::size_t k = thing.first_leaf; k < thing.end_leaf && !inside; ++k) {
      inside = !std::all_of(campus.leaves[k].begin(), campus.leaves[k].end(), is_outside);
    }
    gone.push_back(inside);
  }
  return without(campus, gone);
}

}  // namespace vantage::simulation
