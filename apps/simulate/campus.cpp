#include "simulate/campus.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>

#include "simulate/objects.hpp"
#include "simulate/random.hpp"

namespace vantage::simulation {
namespace {

using Eigen::Vector2d;

constexpr double kVerge = 2.4;         // beside a street, for cars, lamps and trees in a row [m]
constexpr double kVergeMiddle = 1.25;  // from the edge of the street [m]
constexpr double kBorder = 0.8;        // kept empty along the border of the campus [m]
constexpr double kGap = 2.6;           // between buildings and anything else [m]

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// The land between streets, counter-clockwise; side k runs from corner k to corner k + 1.
struct Block {
  std::array<Vector2d, 4> corners;
  std::array<bool, 4> has_street;

  [[nodiscard]] const Vector2d& corner(std::size_t k) const { return corners[k % 4]; }
  [[nodiscard]] Vector2d along(std::size_t k) const {
    return (corner(k + 1) - corner(k)).normalized();
  }
  /// Unit vector to the left of side k.
  [[nodiscard]] Vector2d inward(std::size_t k) const {
    const Vector2d a = along(k);
    return {-a.y(), a.x()};
  }
  [[nodiscard]] double area() const {
    return 0.5 * (cross(corners[1] - corners[0], corners[2] - corners[0]) +
                  cross(corners[2] - corners[0], corners[3] - corners[0]));
  }
  [[nodiscard]] bool contains(const Vector2d& p, double margin) const {
    for (std::size_t k = 0; k < 4; ++k) {
      if (inward(k).dot(p - corners[k]) < margin) return false;
    }
    return true;
  }
  [[nodiscard]] bool contains(const Plot& plot, double margin) const {
    for (const double u : {-1.0, 1.0}) {
      for (const double v : {-1.0, 1.0}) {
        if (!contains(plot.at(u * plot.half.x(), v * plot.half.y()), margin)) return false;
      }
    }
    return true;
  }
};

/// The land between the streets around (i - 1, j - 1) and (i, j), without the verges. Nothing if it
/// is too small to use.
std::optional<Block> block_between(const StreetGrid& streets, double street_width, int i, int j) {
  const std::array nodes{streets.node(i - 1, j - 1), streets.node(i, j - 1), streets.node(i, j),
                         streets.node(i - 1, j)};
  Block block{nodes,
              {!streets.is_border_y(j - 1), !streets.is_border_x(i), !streets.is_border_y(j),
               !streets.is_border_x(i - 1)}};
  std::array<Vector2d, 4> corners;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto inset = [&](std::size_t side) {
      return block.has_street[side] ? street_width / 2.0 + kVerge : kBorder;
    };
    // Where the sides before and after the corner meet after both move inwards.
    const std::size_t before = (k + 3) % 4;
    Eigen::Matrix2d normals;
    normals << block.inward(before).transpose(), block.inward(k).transpose();
    corners[k] = block.corners[k] + normals.inverse() * Vector2d(inset(before), inset(k));
  }
  block.corners = corners;
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector2d side = nodes[(k + 1) % 4] - nodes[k];
    if ((block.corner(k + 1) - block.corner(k)).dot(side.normalized()) < 3.0) return std::nullopt;
  }
  return block;
}

template <class T>
void append(std::vector<T>& to, std::vector<T> from) {
  to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
}

void append(Campus& campus, Tree tree) {
  append(campus.solids, std::move(tree.wood));
  append(campus.leaves, std::move(tree.leaves));
}

bool is_free(const Plot& plot, const std::vector<Plot>& taken) {
  return std::none_of(taken.begin(), taken.end(),
                      [&](const Plot& other) { return overlap(plot, other); });
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
      if (k % 4 == 1) {
        append(campus_.solids, make_lamp(middle, outward, terrain_, random_));
      } else if (random_.chance(params_.parked_cars)) {
        const double direction = random_.chance(0.8) ? 1.0 : -1.0;
        append(campus_.solids, make_car(middle + random_.uniform(-0.5, 0.5) * along,
                                        direction * along, terrain_, random_));
      } else if (random_.chance(0.3)) {
        append(campus_, make_tree(middle, params_.leaf_area_density, terrain_, random_));
      } else if (random_.chance(0.15)) {
        append(campus_.solids, make_sign(middle, along, terrain_, random_));
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
      append(campus_.solids, make_wall(plot, terrain_, random_));
      taken_.push_back(plot);
    }
  }

  [[nodiscard]] Vector2d somewhere() {
    return block_.corners[0] + random_.uniform() * (block_.corners[1] - block_.corners[0]) +
           random_.uniform() * (block_.corners[3] - block_.corners[0]);
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
      Vector2d half(random_.uniform(kSmallest, std::min(largest, room.x())),
                    random_.uniform(kSmallest, std::min(largest, room.y())));
      if (shape == BuildingShape::round_tower) half.setConstant(std::min(5.5, half.minCoeff()));
      const Vector2d free = room - half;
      const Eigen::Rotation2Dd turn(random_.uniform(-0.03, 0.03));
      const Vector2d along = turn * block_.along(0);
      Plot plot{middle, along, half};
      plot.centre = plot.at(free.x() * random_.symmetric(), free.y() * random_.symmetric());
      // A gable shows its ridge along the longer side.
      if (half.y() > half.x()) plot = {plot.centre, plot.across(), {half.y(), half.x()}};
      if (!block_.contains(plot, kMargin) || !is_free(plot.grown(kGap), taken_)) continue;
      append(campus_.solids, make_building(shape, plot, terrain_, random_));
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
    append(campus_, make(plot.centre, params_.leaf_area_density, terrain_, random_));
    taken_.push_back(plot.grown(0.5));
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

Campus make_campus(const CampusParams& params, std::uint64_t seed, const StreetGrid& streets,
                   const Terrain& terrain) {
  Campus campus;
  std::vector<Plot> bridges;
  for (const OverpassShape& shape : plan_overpasses(params, streets, terrain)) {
    append(campus.solids, make_overpass(shape, terrain));
    campus.overpasses.push_back(
        {shape.centre, shape.direction, shape.half_span, shape.half_width, shape.underside});
    bridges.push_back(plot_of(shape));
  }
  for (int j = 0; j <= streets.streets_y(); ++j) {
    for (int i = 0; i <= streets.streets_x(); ++i) {
      const auto block = block_between(streets, params.street_width, i, j);
      if (!block) continue;
      Campus part =
          BlockFiller(params, terrain, *block, bridges, Random(hash(seed, Purpose::block, i, j)))
              .fill();
      append(campus.solids, std::move(part.solids));
      append(campus.leaves, std::move(part.leaves));
    }
  }
  return campus;
}

}  // namespace vantage::simulation
