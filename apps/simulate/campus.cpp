#include "simulate/campus.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "simulate/block.hpp"
#include "simulate/layouts.hpp"
#include "simulate/objects.hpp"
#include "simulate/random.hpp"

namespace vantage::simulation {
namespace {

using Eigen::Vector2d;

template <class T>
void append(std::vector<T>& to, std::vector<T> from) {
  to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
}

/// One block with the verges of its sides.
class BlockFiller {
 public:
  BlockFiller(const CampusParams& params, const Terrain& terrain, const Block& block,
              std::vector<Plot> taken, Random random)
      : params_(params),
        terrain_(terrain),
        block_(block),
        taken_(std::move(taken)),
        random_(random) {}

  [[nodiscard]] Campus fill() && {
    for (std::size_t side = 0; side < 4; ++side) {
      if (block_.has_street[side]) line_verge(side);
    }
    for (std::size_t side = 0; side < 4; ++side) place_walls(side);
    place_buildings();
    place_plants();
    return std::move(campus_);
  }

 private:
  void line_verge(std::size_t side) {
    constexpr double kPlace = 6.0, kCornerClearance = 3.0;
    const Vector2d along = block_.along(side), outward = -block_.inward(side);
    const double length = (block_.corner(side + 1) - block_.corner(side)).norm();
    const int places = static_cast<int>((length - 2.0 * kCornerClearance) / kPlace);
    for (int k = 0; k < places; ++k) {
      const double at = length / 2.0 + (k + 0.5 - places / 2.0) * kPlace;
      const Vector2d middle = block_.corner(side) + at * along + (kVerge - kVergeMiddle) * outward;
      if (!is_free({middle, along, {2.8, 1.1}}, taken_)) continue;
      const Plot post{middle, along, {0.3, 0.3}};
      if (k % 4 == 1) {
        campus_.add(Surface::pole, post, make_lamp(middle, outward, terrain_, random_));
      } else if (random_.chance(params_.parked_cars)) {
        const double direction = random_.chance(0.8) ? 1.0 : -1.0;
        const Vector2d centre = middle + random_.uniform(-0.5, 0.5) * along;
        campus_.add(Surface::car, {centre, along, {2.4, 0.95}},
                    make_car(centre, direction * along, terrain_, random_));
      } else if (random_.chance(0.3)) {
        add(post, make_tree(middle, params_.leaf_area_density, terrain_, random_));
      } else if (random_.chance(0.15)) {
        campus_.add(Surface::pole, post, make_sign(middle, along, terrain_, random_));
      } else {
        campus_.free_parking.push_back({middle, along});
      }
    }
  }

  void place_walls(std::size_t side) {
    constexpr double kHalfThickness = 0.14;
    const Vector2d along = block_.along(side), inward = block_.inward(side);
    const double length = (block_.corner(side + 1) - block_.corner(side)).norm();
    double at = 1.5;
    while (at + 4.0 < length - 1.5) {
      const double piece = std::min(random_.uniform(6.0, 14.0), length - 1.5 - at);
      const Plot plot{block_.corner(side) + (at + piece / 2.0 - 0.7) * along + 0.3 * inward,
                      along,
                      {piece / 2.0 - 0.7, kHalfThickness}};
      at += piece;
      if (!random_.chance(params_.wall_share) || !is_free(plot.grown(0.3), taken_)) continue;
      campus_.add(Surface::wall, plot, make_wall(plot, terrain_, random_));
      taken_.push_back(plot);
    }
  }

  [[nodiscard]] Vector2d somewhere() {
    const double v = random_.uniform(), u = random_.uniform();
    return block_.corners[0] + u * (block_.corners[1] - block_.corners[0]) +
           v * (block_.corners[3] - block_.corners[0]);
  }

  void place_buildings() {
    constexpr int kTries = 300;
    constexpr double kMargin = 2.2, kSmallest = 2.8;
    const Vector2d across = block_.corners[3] - block_.corners[0];
    const Vector2d room =
        Vector2d((block_.corners[1] - block_.corners[0]).norm(), across.norm()) / 2.0 -
        Vector2d::Constant(kMargin);
    if (room.minCoeff() < kSmallest) return;
    const Vector2d middle =
        (block_.corners[0] + block_.corners[1] + block_.corners[2] + block_.corners[3]) / 4.0;
    const double target = params_.building_density * block_.area();
    double built = 0.0;
    for (int k = 0; k < kTries && built < target; ++k) {
      const double kind = random_.uniform();
      const BuildingShape shape = kind < 0.42   ? BuildingShape::box
                                  : kind < 0.66 ? BuildingShape::l_shape
                                  : kind < 0.74 ? BuildingShape::round_tower
                                                : BuildingShape::gabled;
      // First the large ones, then those that still fit between.
      const double largest = std::lerp(13.0, 4.0, static_cast<double>(k) / kTries);
      const double half_y = random_.uniform(kSmallest, std::min(largest, room.y()));
      Vector2d half(random_.uniform(kSmallest, std::min(largest, room.x())), half_y);
      if (shape == BuildingShape::round_tower) half.setConstant(std::min(5.5, half.minCoeff()));
      const Vector2d free = room - half;
      const Eigen::Rotation2Dd turn(random_.uniform(-0.03, 0.03));
      const Vector2d along = turn * block_.along(0);
      Plot plot{middle, along, half};
      const Vector2d at = free.cwiseProduct(random_.vector<2>(&Random::symmetric));
      plot.centre = plot.at(at.x(), at.y());
      // A gable shows its ridge along the longer side.
      if (half.y() > half.x()) plot = {plot.centre, plot.across(), {half.y(), half.x()}};
      if (!block_.contains(plot, kMargin) || !is_free(plot.grown(kGap), taken_)) continue;
      campus_.add(Surface::building, plot, make_building(shape, plot, terrain_, random_));
      taken_.push_back(plot);
      built += 4.0 * half.prod();
    }
  }

  void place_plants() {
    const double expected = params_.trees_per_hectare * block_.area() / 1e4;
    const int trees = static_cast<int>(expected + random_.uniform());
    for (int k = 0; k < trees; ++k) plant(1.8, make_tree);
    for (int k = 0; k < trees / 2; ++k) plant(1.0, make_bush);
  }

  template <class Make>
  void plant(double clearance, Make make) {
    const Plot plot{somewhere(), block_.along(0), {0.3, 0.3}};
    if (!block_.contains(plot.centre, 0.9) || !is_free(plot.grown(clearance), taken_)) return;
    add(plot, make(plot.centre, params_.leaf_area_density, terrain_, random_));
    taken_.push_back(plot.grown(0.5));
  }

  void add(const Plot& plot, Tree tree) {
    campus_.add(Surface::vegetation, plot, std::move(tree.wood), std::move(tree.leaves));
  }

  const CampusParams& params_;
  const Terrain& terrain_;
  Block block_;
  std::vector<Plot> taken_;
  Random random_;
  Campus campus_;
};

constexpr double kDeckHalfWidth = 2.2;

/// As long as the way down needs, or as there is room before the next street or the border.
double ramp_length(const Terrain& terrain, const StreetGrid& streets, double keep_free,
                   const Vector2d& start, const Vector2d& outward, double top) {
  constexpr double kStep = 0.25;
  const Vector2d side(-outward.y(), outward.x());
  double length = 0.0;
  while (top - kRampSlope * length > terrain.height(start + length * outward)) {
    for (const double s : {-1.0, 1.0}) {
      const Vector2d next = start + (length + kStep) * outward + s * (kDeckHalfWidth + 0.2) * side;
      if ((next.cwiseAbs().array() > terrain.half_size().array() - kBorder).any() ||
          streets.distance_to_street(next) < keep_free) {
        return length;
      }
    }
    length += kStep;
  }
  return length;
}

OverpassShape plan_overpass(const CampusParams& params, const StreetGrid& streets,
                            const Terrain& terrain, const Vector2d& from, const Vector2d& to) {
  const Vector2d street = (to - from).normalized();
  const double edge = params.street_width / 2.0;
  OverpassShape shape{};
  // Away from the corners, where routes leave the middle of the street, and away from the middle of
  // the blocks.
  shape.centre = from + 0.37 * (to - from);
  shape.direction = {-street.y(), street.x()};
  shape.half_width = kDeckHalfWidth;
  shape.half_span = edge + kVerge;
  shape.pillar_distance = edge + 0.6;
  double highest = terrain.height(shape.centre);
  for (double u = -shape.half_span; u <= shape.half_span; u += 0.25) {
    for (double v = -kDeckHalfWidth; v <= kDeckHalfWidth; v += 0.25) {
      highest = std::max(highest, terrain.height(shape.centre + u * shape.direction + v * street));
    }
  }
  shape.underside = highest + params.overpass_clearance + 0.05;  // also between the samples
  for (int end = 0; end < 2; ++end) {
    const Vector2d outward = (end == 0 ? -1.0 : 1.0) * shape.direction;
    const Vector2d start = shape.centre + shape.half_span * outward;
    shape.ramp_lengths[end] =
        std::max(1.0, ramp_length(terrain, streets, edge + kVerge - 0.05, start, outward,
                                  shape.underside + kDeckThickness));
  }
  return shape;
}

/// Overpasses such that every route passes under at least one, but not at its very start.
std::vector<OverpassShape> plan_overpasses(const CampusParams& params, const StreetGrid& streets,
                                           const Terrain& terrain) {
  struct Street {
    Vector2d from, to;
  };
  std::vector<Street> crossed;
  std::vector<OverpassShape> shapes;
  for (const auto& route : streets.routes()) {
    const auto is_on_route = [&](const Street& street) {
      for (std::size_t k = 0; k < route.size(); ++k) {
        const Vector2d &a = route[k], &b = route[(k + 1) % route.size()];
        if ((a == street.from && b == street.to) || (a == street.to && b == street.from)) {
          return true;
        }
      }
      return false;
    };
    if (std::any_of(crossed.begin(), crossed.end(), is_on_route)) continue;
    crossed.push_back({route[1], route[2]});
    shapes.push_back(plan_overpass(params, streets, terrain, route[1], route[2]));
  }
  return shapes;
}

Plot plot_of(const OverpassShape& shape) {
  const double back = shape.half_span + shape.ramp_lengths[0];
  const double front = shape.half_span + shape.ramp_lengths[1];
  return {shape.centre + (front - back) / 2.0 * shape.direction,
          shape.direction,
          {(front + back) / 2.0 + 0.3, shape.half_width + 0.6}};
}

}  // namespace

void Campus::add(Surface kind, const Plot& plot, std::vector<Solid> thing_solids,
                 std::vector<Leaf> thing_leaves) {
  things.push_back({kind, plot, solids.size(), solids.size() + thing_solids.size(), leaves.size(),
                    leaves.size() + thing_leaves.size()});
  append(solids, std::move(thing_solids));
  append(leaves, std::move(thing_leaves));
}

void Campus::add(Campus part) {
  for (Thing thing : part.things) {
    thing.first_solid += solids.size();
    thing.end_solid += solids.size();
    thing.first_leaf += leaves.size();
    thing.end_leaf += leaves.size();
    things.push_back(thing);
  }
  append(solids, std::move(part.solids));
  append(leaves, std::move(part.leaves));
  append(overpasses, std::move(part.overpasses));
  append(free_parking, std::move(part.free_parking));
}

Campus without(const Campus& campus, const std::vector<bool>& gone) {
  Campus kept;
  kept.overpasses = campus.overpasses;
  kept.free_parking = campus.free_parking;
  for (std::size_t k = 0; k < campus.things.size(); ++k) {
    if (gone[k]) continue;
    const Thing& thing = campus.things[k];
    const auto part = [](const auto& all, std::size_t first, std::size_t end) {
      return std::vector(all.begin() + static_cast<std::ptrdiff_t>(first),
                         all.begin() + static_cast<std::ptrdiff_t>(end));
    };
    kept.add(thing.kind, thing.plot, part(campus.solids, thing.first_solid, thing.end_solid),
             part(campus.leaves, thing.first_leaf, thing.end_leaf));
  }
  return kept;
}

Campus make_campus(const CampusParams& params, std::uint64_t seed, const StreetGrid& streets,
                   const Terrain& terrain) {
  Campus campus;
  if (params.layout == Layout::streets) {
    for (const OverpassShape& shape : plan_overpasses(params, streets, terrain)) {
      campus.add(Surface::overpass, plot_of(shape), make_overpass(shape, terrain));
      campus.overpasses.push_back(
          {shape.centre, shape.direction, shape.half_span, shape.half_width, shape.underside});
    }
  } else if (params.layout == Layout::tunnel) {
    campus.add(make_tunnel(params, streets, terrain));
  }
  std::vector<Plot> taken;
  for (const Thing& thing : campus.things) taken.push_back(thing.plot);
  for (int j = 0; j <= streets.streets_y(); ++j) {
    for (int i = 0; i <= streets.streets_x(); ++i) {
      const auto block = block_between(streets, params.street_width, i, j);
      if (!block) continue;
      const bool is_end = j == 0 || j == streets.streets_y();
      if (params.layout == Layout::rows && !is_end) {
        campus.add(make_rows(*block, terrain));
        continue;
      }
      campus.add(
          BlockFiller(params, terrain, *block, taken, Random(hash(seed, Purpose::block, i, j)))
              .fill());
    }
  }
  return params.layout == Layout::square ? without_square(campus, params) : campus;
}

}  // namespace vantage::simulation
