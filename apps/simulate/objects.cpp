#include "simulate/objects.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>

namespace vantage::simulation {
namespace {

using Eigen::Vector2d;
using Profile = std::vector<Vector2d>;

constexpr double kFoundation = 0.6;  // how deep things reach into the ground [m]

Pose upright(const Vector2d& position, double z, const Vector2d& along) {
  return pose_from_xyz_rpy({position.x(), position.y(), z},
                           {0.0, 0.0, std::atan2(along.y(), along.x())});
}

struct GroundUnder {
  double lowest, highest;
};

GroundUnder ground_under(const Plot& plot, const Terrain& terrain) {
  GroundUnder ground{terrain.height(plot.centre), terrain.height(plot.centre)};
  const auto steps = [](double half) { return std::max(2, static_cast<int>(2.0 * half)); };
  const int nu = steps(plot.half.x()), nv = steps(plot.half.y());
  for (int i = 0; i <= nu; ++i) {
    for (int j = 0; j <= nv; ++j) {
      const double z = terrain.height(
          plot.at(plot.half.x() * (2.0 * i / nu - 1.0), plot.half.y() * (2.0 * j / nv - 1.0)));
      ground.lowest = std::min(ground.lowest, z);
      ground.highest = std::max(ground.highest, z);
    }
  }
  return ground;
}

/// A body's frame at the plot's centre with z = 0 at the highest ground under it.
struct Site {
  Pose frame;
  double bottom;  // of foundations, below every ground point of the plot
  double hx, hy;
};

Site site_of(const Plot& plot, const Terrain& terrain) {
  const GroundUnder ground = ground_under(plot, terrain);
  return {upright(plot.centre, ground.highest, plot.along),
          ground.lowest - ground.highest - kFoundation, plot.half.x(), plot.half.y()};
}

constexpr double kFloor = 3.2;  // height of a storey [m]

/// String courses between the storeys: slabs that stick out of the walls slightly.
std::vector<Solid> make_courses(const Pose& frame, const Vector2d& min, const Vector2d& max,
                                double height) {
  constexpr double kDepth = 0.12, kThickness = 0.25;
  std::vector<Solid> courses;
  for (double z = kFloor; z + kThickness < height - 1.0; z += kFloor) {
    courses.push_back(make_box(Surface::building, frame, {min.x() - kDepth, min.y() - kDepth, z},
                               {max.x() + kDepth, max.y() + kDepth, z + kThickness}));
  }
  return courses;
}

std::vector<Solid> joined(std::vector<Solid> a, std::vector<Solid> b) {
  a.insert(a.end(), std::make_move_iterator(b.begin()), std::make_move_iterator(b.end()));
  return a;
}

std::vector<Solid> box_building(const Site& site, Random& random) {
  const auto& [frame, bottom, hx, hy] = site;
  const double height = kFloor * std::floor(random.uniform(1.0, 6.0)) + 0.6;
  std::vector<Solid> solids = make_courses(frame, {-hx, -hy}, {hx, hy}, height);
  solids.push_back(make_box(Surface::building, frame, {-hx, -hy, bottom}, {hx, hy, height}));

  const double pitch = random.uniform(3.5, 6.0);
  const int pilasters = static_cast<int>(2.0 * (hx - 0.8) / pitch);
  for (int k = 0; k <= pilasters; ++k) {
    const double x = (k - pilasters / 2.0) * pitch;
    for (const double side : {-1.0, 1.0}) {
      const double inner = side * (hy - 0.2), outer = side * (hy + 0.35);
      solids.push_back(make_box(Surface::building, frame,
                                {x - 0.25, std::min(inner, outer), bottom},
                                {x + 0.25, std::max(inner, outer), height - 0.5}));
    }
  }
  // The entrance: a canopy on two posts, between two pilasters or on a short side.
  const double door = random.uniform(-0.5, 0.5) * hy;
  solids.push_back(make_box(Surface::building, frame, {hx - 0.2, door - 1.6, 2.6},
                            {hx + 1.8, door + 1.6, 2.85}));
  for (const double side : {-1.4, 1.4}) {
    solids.push_back(make_box(Surface::building, frame,
                              {hx + 1.5, door + side - 0.08, bottom - 0.5},
                              {hx + 1.66, door + side + 0.08, 2.7}));
  }
  // Plant room on the roof.
  const double u = random.uniform(0.2, 0.4) * hx, v = random.uniform(0.2, 0.4) * hy;
  const double x = random.uniform(-0.4, 0.4) * hx, y = random.uniform(-0.4, 0.4) * hy;
  solids.push_back(make_box(Surface::building, frame, {x - u, y - v, height - 0.3},
                            {x + u, y + v, height + random.uniform(1.5, 2.8)}));
  return solids;
}

std::vector<Solid> l_building(const Site& site, Random& random) {
  const auto& [frame, bottom, hx, hy] = site;
  const double wing_y = random.uniform(0.4, 0.55) * 2.0 * hy;
  const double wing_x = random.uniform(0.35, 0.5) * 2.0 * hx;
  const double height = kFloor * std::floor(random.uniform(2.0, 5.0)) + 0.6;
  const double lower = height - kFloor * std::floor(random.uniform(0.0, 2.0)) - 0.4;
  std::vector<Solid> solids =
      joined(make_courses(frame, {-hx, -hy}, {hx, -hy + wing_y}, height),
             make_courses(frame, {-hx + 0.3, -hy + wing_y}, {-hx + wing_x, hy}, lower));
  solids.push_back(
      make_box(Surface::building, frame, {-hx, -hy, bottom}, {hx, -hy + wing_y, height}));
  // Set back slightly, so that no two surfaces coincide.
  solids.push_back(make_box(Surface::building, frame, {-hx + 0.3, -hy + wing_y - 0.4, bottom - 0.1},
                            {-hx + wing_x, hy, lower}));
  return solids;
}

std::vector<Solid> round_tower(const Site& site, Random& random) {
  const double radius = std::min(site.hx, site.hy);
  const double height = random.uniform(9.0, 22.0);
  const std::array rings{Vector2d(radius, site.bottom), Vector2d(radius, height),
                         Vector2d(0.0, height + radius * random.uniform(0.4, 1.1))};
  std::vector<Solid> solids{make_turned(Surface::building, site.frame, 24, rings)};
  const std::array cornice{Vector2d(radius + 0.3, height - 0.9),
                           Vector2d(radius + 0.3, height - 0.4)};
  solids.push_back(make_turned(Surface::building, site.frame, 24, cornice));
  return solids;
}

std::vector<Solid> gabled_building(const Site& site, Random& random) {
  const auto& [frame, bottom, hx, hy] = site;
  const double eaves = kFloor * std::floor(random.uniform(1.0, 3.99)) + 0.4;
  const double ridge = eaves + hy * random.uniform(0.55, 0.9);
  // The profile is drawn in the plane across the ridge, so the body's frame is turned by 90
  // degrees.
  const Pose turned = frame * pose_from_xyz_rpy(Point::Zero(), {0, 0, std::numbers::pi / 2.0});
  const Profile profile{{-hy, bottom}, {hy, bottom}, {hy, eaves}, {0.0, ridge}, {-hy, eaves}};
  std::vector<Solid> solids = make_courses(frame, {-hx, -hy}, {hx, hy}, eaves);
  solids.push_back(make_profile(Surface::building, turned, profile, -hx, hx));
  const double x = random.uniform(-0.7, 0.7) * hx, y = random.uniform(0.2, 0.5) * hy;
  solids.push_back(make_box(Surface::building, frame, {x - 0.4, y - 0.35, eaves},
                            {x + 0.4, y + 0.35, ridge + 0.8}));
  if (random.chance(0.5)) {  // a porch
    const double door = random.uniform(-0.6, 0.6) * hx;
    solids.push_back(make_box(Surface::building, frame, {door - 1.3, -hy - 1.4, bottom - 0.5},
                              {door + 1.3, -hy + 0.3, 2.7}));
  }
  return solids;
}

std::vector<Leaf> make_leaves(const Point& centre, const Point& radii, double leaf_area_density,
                              Random& random) {
  constexpr double kLeaf = 0.22;  // circumradius of a leaf (or a tuft of them) [m]
  const double leaf_area = 0.75 * std::numbers::sqrt3 * kLeaf * kLeaf;
  const double volume = 4.0 / 3.0 * std::numbers::pi * radii.prod();
  const auto count = static_cast<std::size_t>(leaf_area_density * volume / leaf_area);
  std::vector<Leaf> leaves;
  leaves.reserve(count);
  while (leaves.size() < count) {
    const Point p = random.vector<3>(&Random::symmetric);
    if (p.squaredNorm() > 1.0) continue;
    // A regular triangle in a random plane.
    const double z = random.symmetric(), phi = 2.0 * std::numbers::pi * random.uniform();
    const double r = std::sqrt(1.0 - z * z);
    const Eigen::Vector3d normal(r * std::cos(phi), r * std::sin(phi), z);
    const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
    const double turn = 2.0 * std::numbers::pi * random.uniform();
    Leaf leaf;
    for (int k = 0; k < 3; ++k) {
      const double angle = turn + 2.0 * std::numbers::pi * k / 3.0;
      leaf[static_cast<std::size_t>(k)] =
          centre + p.cwiseProduct(radii) + kLeaf * (std::cos(angle) * u + std::sin(angle) * v);
    }
    leaves.push_back(leaf);
  }
  return leaves;
}

}  // namespace

bool overlap(const Plot& a, const Plot& b) noexcept {
  const Vector2d between = b.centre - a.centre;
  for (const Vector2d& axis : {a.along, a.across(), b.along, b.across()}) {
    const auto reach = [&](const Plot& plot) {
      return plot.half.x() * std::abs(plot.along.dot(axis)) +
             plot.half.y() * std::abs(plot.across().dot(axis));
    };
    if (std::abs(between.dot(axis)) > reach(a) + reach(b)) return false;
  }
  return true;
}

std::vector<Solid> make_building(BuildingShape shape, const Plot& plot, const Terrain& terrain,
                                 Random& random) {
  const Site site = site_of(plot, terrain);
  switch (shape) {
    case BuildingShape::box: return box_building(site, random);
    case BuildingShape::l_shape: return l_building(site, random);
    case BuildingShape::round_tower: return round_tower(site, random);
    case BuildingShape::gabled: return gabled_building(site, random);
  }
  return {};
}

std::vector<Solid> make_car(const Vector2d& centre, const Vector2d& along, const Terrain& terrain,
                            Random& random) {
  const Eigen::Vector3d up = terrain.normal(centre);
  const Eigen::Vector3d ahead =
      (Eigen::Vector3d(along.x(), along.y(), 0.0) - up * up.head<2>().dot(along)).normalized();
  Eigen::Matrix3d axes;
  axes << ahead, up.cross(ahead), up;
  Pose frame;
  frame.rotation = Eigen::Quaterniond(axes).normalized();
  frame.translation = {centre.x(), centre.y(), terrain.height(centre)};

  const bool is_van = random.chance(0.25);
  const double hx = random.uniform(1.9, 2.3), hy = 0.86;
  std::vector<Solid> solids;
  if (is_van) {
    const double roof = random.uniform(1.85, 2.2);
    const Profile body{{-hx, 0.25}, {hx, 0.25}, {hx, 0.95}, {hx - 0.7, roof}, {-hx, roof}};
    solids.push_back(make_profile(Surface::car, frame, body, -hy, hy));
  } else {
    const double roof = random.uniform(1.38, 1.55);
    const Profile body{{-hx, 0.25},      {hx, 0.25},        {hx, 0.6},
                       {hx - 0.3, 0.78}, {-hx + 0.1, 0.86}, {-hx, 0.7}};
    solids.push_back(make_profile(Surface::car, frame, body, -hy, hy));
    const Profile cabin{{-hx + 0.35, 0.7}, {hx - 1.0, 0.7}, {hx - 1.7, roof}, {-hx + 0.9, roof}};
    solids.push_back(make_profile(Surface::car, frame, cabin, -hy + 0.12, hy - 0.12));
  }
  constexpr double kWheel = 0.32;
  for (const double x : {-0.62 * hx, 0.62 * hx}) {
    for (const double y : {-hy + 0.08, hy - 0.08}) {
      Profile wheel;
      for (int k = 0; k < 10; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / 10.0;
        wheel.emplace_back(x + kWheel * std::cos(angle), kWheel + kWheel * std::sin(angle));
      }
      solids.push_back(make_profile(Surface::car, frame, wheel, y - 0.1, y + 0.1));
    }
  }
  return solids;
}

std::vector<Solid> make_lamp(const Vector2d& foot, const Vector2d& towards, const Terrain& terrain,
                             Random& random) {
  const Pose frame = upright(foot, terrain.height(foot), towards);
  const double height = random.uniform(5.5, 7.5);
  const std::array mast{Vector2d(0.1, -kFoundation), Vector2d(0.06, height)};
  const std::array base{Vector2d(0.18, -kFoundation), Vector2d(0.16, 0.5)};
  return {make_turned(Surface::pole, frame, 8, mast), make_turned(Surface::pole, frame, 8, base),
          make_box(Surface::pole, frame, {-0.03, -0.04, height - 0.2}, {1.3, 0.04, height - 0.1}),
          make_box(Surface::pole, frame, {1.2, -0.15, height - 0.25}, {1.9, 0.15, height - 0.08})};
}

std::vector<Solid> make_sign(const Vector2d& foot, const Vector2d& along, const Terrain& terrain,
                             Random& random) {
  const Pose frame = upright(foot, terrain.height(foot), along);
  const double height = random.uniform(2.3, 2.8), half = random.uniform(0.25, 0.45);
  const std::array post{Vector2d(0.035, -kFoundation), Vector2d(0.035, height)};
  return {make_turned(Surface::pole, frame, 6, post),
          make_box(Surface::pole, frame, {0.02, -half, height - 0.6}, {0.05, half, height - 0.05})};
}

std::vector<Solid> make_wall(const Plot& plot, const Terrain& terrain, Random& random) {
  const double height = random.uniform(0.7, 2.2);
  const int panels = std::max(1, static_cast<int>(std::lround(plot.half.x())));
  const double length = 2.0 * plot.half.x() / panels;
  std::vector<Solid> solids;
  for (int k = 0; k < panels; ++k) {
    // Every second panel is thicker, like a pillar, so that no two panels share a face.
    const double thickness = plot.half.y() * (k % 2 == 0 ? 1.0 : 0.7);
    const Plot panel{plot.at((k + 0.5) * length - plot.half.x(), 0.0),
                     plot.along,
                     {length / 2.0 + (k % 2 == 0 ? 0.02 : 0.0), thickness}};
    const Site site = site_of(panel, terrain);
    solids.push_back(make_box(Surface::wall, site.frame, {-site.hx, -site.hy, site.bottom},
                              {site.hx, site.hy, height + (k % 2 == 0 ? 0.08 : 0.0)}));
  }
  return solids;
}

Tree make_tree(const Vector2d& foot, double leaf_area_density, const Terrain& terrain,
               Random& random) {
  const double z = terrain.height(foot);
  const double radius_z = random.uniform(1.4, 3.0), radius_y = random.uniform(1.4, 2.6);
  const Point radii(random.uniform(1.4, 2.6), radius_y, radius_z);
  const double clear = random.uniform(2.3, 3.0);
  const double trunk = random.uniform(0.1, 0.22);
  const std::array rings{Vector2d(trunk * 1.3, -kFoundation),
                         Vector2d(trunk * 0.6, clear + radii.z())};
  Tree tree;
  tree.wood.push_back(
      make_turned(Surface::vegetation, upright(foot, z, Vector2d::UnitX()), 7, rings));
  tree.leaves =
      make_leaves({foot.x(), foot.y(), z + clear + radii.z()}, radii, leaf_area_density, random);
  return tree;
}

Tree make_bush(const Vector2d& foot, double leaf_area_density, const Terrain& terrain,
               Random& random) {
  const double radius_z = random.uniform(0.4, 0.8), radius_y = random.uniform(0.5, 0.9);
  const Point radii(random.uniform(0.5, 0.9), radius_y, radius_z);
  const Point centre(foot.x(), foot.y(), terrain.height(foot) + 0.7 * radii.z());
  return {{}, make_leaves(centre, radii, 3.0 * leaf_area_density, random)};
}

std::vector<Solid> make_overpass(const OverpassShape& shape, const Terrain& terrain) {
  const double top = shape.underside + kDeckThickness;
  const double hw = shape.half_width;
  const Pose frame = upright(shape.centre, 0.0, shape.direction);
  constexpr double kOverlap = 0.3, kParapet = 1.0, kParapetHalf = 0.12;

  std::vector<Solid> solids;
  const double span = shape.half_span;
  solids.push_back(make_box(Surface::overpass, frame, {-span - kOverlap, -hw, shape.underside},
                            {span + kOverlap, hw, top}));
  for (const double side : {-1.0, 1.0}) {
    const double y = side * (hw - 0.3);
    solids.push_back(make_box(Surface::overpass, frame,
                              {-span - kOverlap / 2, y - kParapetHalf, top - 0.2},
                              {span + kOverlap / 2, y + kParapetHalf, top + kParapet}));
    for (const double end : {-1.0, 1.0}) {
      const Pose pillar =
          frame * pose_from_xyz_rpy({end * shape.pillar_distance, side * (hw - 0.6), 0.0},
                                    Eigen::Vector3d::Zero());
      const double ground = terrain.height(pillar.translation.head<2>());
      const std::array rings{Vector2d(0.3, ground - kFoundation),
                             Vector2d(0.3, shape.underside + 0.2)};
      solids.push_back(make_turned(Surface::overpass, pillar, 10, rings));
    }
  }
  for (int end = 0; end < 2; ++end) {
    const double length = shape.ramp_lengths[end];
    const Vector2d outward = (end == 0 ? -1.0 : 1.0) * shape.direction;
    const Plot under{shape.centre + outward * (span + length / 2.0), outward, {length / 2.0, hw}};
    const double bottom = ground_under(under, terrain).lowest - kFoundation;
    const Pose ramp = upright(shape.centre, 0.0, outward);
    const double z_end = std::max(top - kRampSlope * length, bottom + 0.1);
    // Slightly wider than the deck, and below its surface where both overlap, so that they share no
    // face.
    const Profile body{
        {span, bottom}, {span + length, bottom}, {span + length, z_end}, {span, top - 0.01}};
    solids.push_back(make_profile(Surface::overpass, ramp, body, -hw - 0.15, hw + 0.15));
    const Profile parapet{{span + kOverlap / 2 + 0.02, top - 0.4},
                          {span + length - 0.2, z_end - 0.3},
                          {span + length - 0.2, z_end + kParapet},
                          {span + kOverlap / 2 + 0.02, top + kParapet - 0.02}};
    for (const double side : {-1.0, 1.0}) {
      const double y = side * (hw - 0.3);
      solids.push_back(make_profile(Surface::overpass, ramp, parapet, y - kParapetHalf - 0.02,
                                    y + kParapetHalf + 0.02));
    }
  }
  return solids;
}

}  // namespace vantage::simulation
