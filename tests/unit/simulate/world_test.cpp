#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "simulate/objects.hpp"
#include "simulate/random.hpp"
#include "small_world.hpp"

namespace vantage::simulation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

TEST_CASE("random numbers") {
  SUBCASE("are those of SplitMix64, on every platform") {
    Random random(0);  // the generator's published first outputs
    CHECK(random.next() == 0xe220a8397b1dcdafULL);
    CHECK(random.next() == 0x6e789e6aa1b965f4ULL);
    CHECK(random.next() == 0x06c45d188009454fULL);
  }
  SUBCASE("have the moments of their distributions") {
    Random random(42);
    constexpr int kCount = 200'000;
    double mean = 0, square = 0, fourth = 0, uniform = 0, low = 1, high = 0;
    for (int k = 0; k < kCount; ++k) {
      const double x = random.normal(), u = random.uniform();
      mean += x / kCount;
      square += x * x / kCount;
      fourth += x * x * x * x / kCount;
      uniform += u / kCount;
      low = std::min(low, u);
      high = std::max(high, u);
    }
    CHECK(mean == doctest::Approx(0.0).epsilon(0.01));
    CHECK(square == doctest::Approx(1.0).epsilon(0.01));
    CHECK(fourth == doctest::Approx(3.0).epsilon(0.03));
    CHECK(uniform == doctest::Approx(0.5).epsilon(0.01));
    CHECK(low >= 0.0);
    CHECK(high < 1.0);
  }
  SUBCASE("of neighbouring indices have nothing in common") {
    std::set<std::uint64_t> seen;
    double product = 0;
    for (int i = 0; i < 100; ++i) {
      for (int j = 0; j < 100; ++j) {
        seen.insert(hash(1, i, j));
        product += Random(hash(1, i, j)).symmetric() * Random(hash(1, j, i + 1)).symmetric();
      }
    }
    CHECK(seen.size() == 10'000);
    CHECK(std::abs(product / 10'000) < 0.02);
  }
}

TEST_CASE("solids") {
  SUBCASE("a box knows its inside") {
    const Pose frame = pose_from_xyz_rpy({10, 20, 1}, {0, 0, 0.7});
    const Solid box = make_box(Surface::wall, frame, {-1, -2, 0}, {1, 2, 3});
    CHECK(box.faces.size() == 6);
    CHECK(box.signed_distance(frame * Point(0, 0, 1)) == doctest::Approx(-1.0));
    CHECK(box.signed_distance(frame * Point(0.9, 0, 1.5)) == doctest::Approx(-0.1));
    CHECK(box.signed_distance(frame * Point(0, 0, 3.5)) == doctest::Approx(0.5));
  }
  SUBCASE("every solid of a campus is convex and closed") {
    const World world = test::make_world(test::small_world());
    REQUIRE(world.campus().solids.size() > 100);
    for (const Solid& solid : world.campus().solids) {
      Vector3d area = Vector3d::Zero();
      double outside = 0.0, total = 0.0;
      for (const Face& face : solid.faces) {
        for (std::size_t k = 2; k < face.corners.size(); ++k) {
          area += (face.corners[k - 1] - face.corners[0]).cross(face.corners[k] - face.corners[0]);
        }
        total += area.norm();
        for (const Point& corner : face.corners) {
          outside = std::max(outside, solid.signed_distance(corner));
        }
      }
      CHECK(outside < 1e-9);
      CHECK(area.norm() < 1e-9 * total);  // the areas of a closed surface add up to nothing
    }
  }
  SUBCASE("the index agrees with asking every solid") {
    const World world = test::make_world(test::small_world());
    const auto& solids = world.campus().solids;
    Random random(5);
    int inside = 0;
    for (int k = 0; k < 20'000; ++k) {
      const Point p(32 * random.symmetric(), 35 * random.symmetric(), random.uniform(-1, 8));
      const bool expected = std::any_of(solids.begin(), solids.end(), [&](const Solid& solid) {
        return solid.signed_distance(p) < -1e-6;
      });
      inside += expected ? 1 : 0;
      CHECK(world.solids().is_inside(p) == expected);
    }
    CHECK(inside > 100);
  }
  SUBCASE("overlap of plots") {
    const Plot a{{0, 0}, {1, 0}, {2, 1}};
    const Vector2d diagonal = Vector2d(1, 1).normalized();
    CHECK(overlap(a, {{2.5, 0}, {1, 0}, {1, 1}}));
    CHECK_FALSE(overlap(a, {{3.5, 0}, {1, 0}, {1, 1}}));
    CHECK(overlap(a, {{2.9, 1.4}, diagonal, {1, 1}}));
    // Their boxes along the axes overlap, they do not.
    CHECK_FALSE(overlap(a, {{2.9, 1.9}, diagonal, {1, 1}}));
  }
}

TEST_CASE("the ground") {
  const WorldParams params = test::small_world();
  const World world = test::make_world(params);
  const Terrain& terrain = world.terrain();
  double low = 1e9, high = -1e9;
  Random random(9);
  for (int k = 0; k < 20'000; ++k) {
    const double x = 31.9 * random.symmetric(), y = 34.9 * random.symmetric();
    const double z = terrain.height(x, y);
    low = std::min(low, z);
    high = std::max(high, z);
    // What a ray from just above meets is what height() says.
    const Point above(x, y, z + 0.1);
    if (world.solids().is_inside(above)) continue;
    const auto hit = world.cast(above, -Vector3d::UnitZ(), 10.0);
    REQUIRE(hit);
    if (hit->surface == Surface::ground) CHECK(hit->range == doctest::Approx(0.1).epsilon(1e-3));
    CHECK(hit->range < 0.1 + 1e-4);
  }
  CHECK(high - low <= params.campus.ground_relief);
  CHECK(high - low > 0.9 * params.campus.ground_relief);
  CHECK(terrain.normal({3.0, 4.0}).norm() == doctest::Approx(1.0));
}

TEST_CASE("rays") {
  const World world = test::make_world(test::bare_world());
  SUBCASE("end where a plane is") {
    const Vector3d down_ahead = Vector3d(1, 0, -0.5).normalized();
    const auto hit = world.cast({-31, -33, 2}, down_ahead, 100.0);
    REQUIRE(hit);
    CHECK(hit->surface == Surface::ground);
    CHECK(hit->range == doctest::Approx(2.0 / -down_ahead.z()).epsilon(1e-6));
    CHECK(hit->cos_incidence == doctest::Approx(-down_ahead.z()).epsilon(1e-6));
  }
  SUBCASE("meet nothing in the sky or beyond their reach") {
    CHECK_FALSE(world.cast({0, 0, 1}, Vector3d::UnitZ(), 100.0));
    CHECK_FALSE(world.cast({-31, -33, 2}, -Vector3d::UnitZ(), 1.99));
  }
  SUBCASE("get through some of a tree's leaves, not through its trunk") {
    const Terrain flat(test::bare_world().campus, 1);
    Random random(4);
    const Tree tree = make_tree({0, 0}, 0.6, flat, random);
    REQUIRE(tree.wood.size() == 1);
    Bounds3 crown;
    for (const Leaf& leaf : tree.leaves) {
      for (const Point& corner : leaf) crown.extend(corner);
    }
    CHECK(crown.min.z() > 2.0);
    const Point middle = (crown.min + crown.max) / 2.0;
    int through = 0;
    constexpr int kRays = 2000;
    for (int k = 0; k < kRays; ++k) {  // along y, within half the crown's radius
      const double x = middle.x() + 0.25 * (crown.max.x() - crown.min.x()) * random.symmetric();
      const double z = middle.z() + 0.25 * (crown.max.z() - crown.min.z()) * random.symmetric();
      const bool is_hit = std::any_of(tree.leaves.begin(), tree.leaves.end(), [&](const Leaf& l) {
        const auto side = [&](const Point& a, const Point& b) {
          return (b.x() - a.x()) * (z - a.z()) - (b.z() - a.z()) * (x - a.x());
        };
        const double s0 = side(l[0], l[1]), s1 = side(l[1], l[2]), s2 = side(l[2], l[0]);
        return (s0 > 0 && s1 > 0 && s2 > 0) || (s0 < 0 && s1 < 0 && s2 < 0);
      });
      if (!is_hit) ++through;
    }
    CHECK(through > 0.1 * kRays);
    CHECK(through < 0.7 * kRays);
  }
}

TEST_CASE("a campus has everything that was asked for") {
  const World world = test::make_world(test::small_world());
  std::set<Surface> surfaces;
  for (const Solid& solid : world.campus().solids) surfaces.insert(solid.surface);
  for (const Surface surface : {Surface::building, Surface::wall, Surface::vegetation,
                                Surface::pole, Surface::car, Surface::overpass}) {
    CHECK(surfaces.contains(surface));
  }
  CHECK(world.campus().leaves.size() > 1000);

  SUBCASE("and another seed makes another one") {
    const World other = test::make_world(test::small_world(4));
    CHECK(other.terrain().height(1, 2) != world.terrain().height(1, 2));
    CHECK(other.campus().solids.size() != world.campus().solids.size());
  }
  SUBCASE("and every building stands in the ground, not on stilts") {
    for (const Solid& solid : world.campus().solids) {
      if (solid.surface != Surface::wall) continue;
      for (const Face& face : solid.faces) {
        for (const Point& corner : face.corners) {
          // Every corner of a wall's panel is either deep in the ground or its top.
          const double above = corner.z() - world.terrain().height(corner.head<2>());
          CHECK((above < -0.3 || above > 0.5));
        }
      }
    }
  }
}

TEST_CASE("a world without a single object is its ground, for rays too") {
  const auto table = parse_toml(
      "schema = 1\n[campus]\nlayout = \"square\"\nsquare_radius = 1000.0\nsize_x = 80\n"
      "size_y = 80\n[drive]\nlength = 3.0\n",
      "w.toml");
  REQUIRE(table);
  const auto params = parse_world(*table);
  REQUIRE_MESSAGE(params, to_string(params.error()));
  const World world = test::make_world(*params);
  REQUIRE(world.campus().solids.empty());
  REQUIRE(world.campus().leaves.empty());
  const auto down = world.cast({1.0, 2.0, 50.0}, -Vector3d::UnitZ(), 100.0);
  REQUIRE(down);
  CHECK(down->surface == Surface::ground);
  CHECK(down->range == doctest::Approx(50.0 - world.terrain().height(1.0, 2.0)).epsilon(1e-3));
  CHECK_FALSE(world.cast({1.0, 2.0, 50.0}, Vector3d::UnitZ(), 100.0));
}

}  // namespace
}  // namespace vantage::simulation
