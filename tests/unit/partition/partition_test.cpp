#include "vantage/partition.hpp"
#include "support/cut.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "vantage/kit/overloaded.hpp"
#include "vantage/kit/regions.hpp"

namespace vantage {
namespace {

using Eigen::Vector2d;
using test::kInfinity;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Region box(std::string label, Vector2d min, Vector2d max, HeightInterval height = {}) {
  return {std::move(label), HalfOpenBox{min, max}, height};
}
Region polygon(std::string label, std::vector<Vector2d> corners) {
  return {std::move(label), ConvexPolygon{std::move(corners)}, {}};
}

Partition made(std::vector<Region> regions) {
  auto partition = Partition::from(std::move(regions));
  REQUIRE_MESSAGE(partition, to_string(partition.error()));
  return *std::move(partition);
}

void refuses(std::vector<Region> regions, const std::string& because) {
  const auto partition = Partition::from(std::move(regions));
  REQUIRE(!partition);
  CHECK(partition.error().code == ErrorCode::invalid_input);
  CHECK_MESSAGE(partition.error().message.find(because) != std::string::npos,
                partition.error().message);
  CHECK(partition.error().message.find('\n') == std::string::npos);
}

std::optional<RegionId> id(std::uint32_t value) { return RegionId{value}; }

/// The definition of `locate`, word for word.
std::optional<RegionId> first_that_contains(const Partition& partition, const Vector2d& p) {
  for (std::uint32_t r = 0; r < partition.size(); ++r) {
    if (contains(partition.regions()[r].footprint, p)) return RegionId{r};
  }
  return std::nullopt;
}

RegionId nearest_by_distance(const Partition& partition, const Vector2d& p) {
  RegionId best;
  for (std::uint32_t r = 1; r < partition.size(); ++r) {
    if (distance(partition.regions()[r].footprint, p) < distance(partition[best].footprint, p)) {
      best = RegionId{r};
    }
  }
  return best;
}

/// Grid cells of n x n, with edges computed once for both neighbours.
std::vector<Region> grid(int n, double width, const Vector2d& origin) {
  std::vector<Region> regions;
  const auto edge = [&](int i, double from) { return from + i * width; };
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      regions.push_back(box("c" + std::to_string(i) + "_" + std::to_string(j),
                            {edge(i, origin.x()), edge(j, origin.y())},
                            {edge(i + 1, origin.x()), edge(j + 1, origin.y())}));
    }
  }
  return regions;
}

TEST_CASE("an empty partition locates nothing") {
  const Partition none;
  CHECK(none.size() == 0);
  CHECK(!none.locate(Vector2d(0, 0)));
  CHECK(!none.locate(Point(0, 0, 0)));
  CHECK(!nearest_region(none, Vector2d(0, 0)));
}

TEST_CASE("a moved-from partition locates nothing") {
  Partition from = made({box("a", {0, 0}, {1, 1})});
  const Partition to = std::move(from);
  CHECK(to.locate(Vector2d(0.5, 0.5)) == id(0));
  CHECK(!from.locate(Vector2d(0.5, 0.5)));  // NOLINT(bugprone-use-after-move)
}

TEST_CASE("a copy answers like the original") {
  const Partition original = made(grid(4, 1.0, {0, 0}));
  const Partition copy = original;
  CHECK(copy.locate(Vector2d(2.5, 3.5)) == id(14));
  CHECK(copy[RegionId{14}].label == original[RegionId{14}].label);
}

TEST_CASE("what is no partition is refused") {
  refuses({}, "needs a region");
  SUBCASE("labels") {
    for (const std::string label :
         {"", ".hidden", "a/b", "a b", "a\n", "ä", "a\\b", "..", "a:b", "a*"}) {
      CAPTURE(label);
      refuses({box(label, {0, 0}, {1, 1})}, "label");
    }
    refuses({box(std::string(201, 'x'), {0, 0}, {1, 1})}, "label");
    refuses({box("a", {0, 0}, {1, 1}), box("a", {1, 0}, {2, 1})}, "same label");
    made({box("x+001_y-002.v2", {0, 0}, {1, 1}), box(std::string(200, 'x'), {0, 0}, {1, 1})});
  }
  SUBCASE("boxes") {
    refuses({box("a", {0, 0}, {0, 1})}, "empty");
    refuses({box("a", {0, 0}, {1, -1})}, "empty");
    refuses({box("a", {0, 0}, {1, kInfinity})}, "not finite");
    refuses({box("a", {kNaN, 0}, {1, 1})}, "not finite");
  }
  SUBCASE("polygons") {
    refuses({polygon("a", {})}, "at least 3 corners");
    refuses({polygon("a", {{0, 0}, {1, 0}})}, "at least 3 corners");
    refuses({polygon("a", {{0, 0}, {1, 0}, {kNaN, 1}})}, "not finite");
    refuses({polygon("clockwise", {{0, 0}, {0, 1}, {1, 1}, {1, 0}})}, "counter-clockwise");
    refuses({polygon("dented", {{0, 0}, {2, 0}, {1, 0.5}, {2, 2}, {0, 2}})}, "not convex");
    refuses({polygon("line", {{0, 0}, {1, 1}, {2, 2}})}, "no area");
    refuses({polygon("twice", {{0, 0}, {1, 0}, {1, 0}, {0, 1}})}, "coincide");
    std::vector<Vector2d> star;
    for (int k = 0; k < 5; ++k) star.emplace_back(std::cos(k * 2.513274), std::sin(k * 2.513274));
    refuses({polygon("star", star)}, "crosses itself");
  }
  SUBCASE("heights") {
    refuses({box("a", {0, 0}, {1, 1}, {2.0, 2.0})}, "height");
    refuses({box("a", {0, 0}, {1, 1}, {kNaN, 2.0})}, "height");
  }
}

TEST_CASE("the error names the region") {
  const auto partition = Partition::from({box("fine", {0, 0}, {1, 1}), box("bad", {0, 0}, {0, 0})});
  REQUIRE(!partition);
  CHECK(partition.error().message.find("region 1 ('bad')") != std::string::npos);
}

TEST_CASE("corners on a straight line are still a convex polygon") {
  made({polygon("a", {{0, 0}, {1, 0}, {2, 0}, {2, 2}, {0, 2}})});
  // 0.1 + 0.2 and the like: the middle corner lies an ulp inside.
  made(
      {polygon("b", {{5e6, 5e6}, {5e6 + 0.3, 5e6 + 0.1}, {5e6 + 0.6, 5e6 + 0.2}, {5e6, 5e6 + 1}})});
}

TEST_CASE("boxes are half-open and tile exactly") {
  for (const double offset : {0.0, -1e3, 1e6, 5e6}) {
    CAPTURE(offset);
    constexpr int kCells = 40;
    constexpr double kWidth = 0.1;
    const Vector2d origin = Vector2d::Constant(offset);
    const std::vector<Region> regions = grid(kCells, kWidth, origin);
    const Partition partition = made(regions);
    for (int j = 0; j < kCells; ++j) {
      for (int i = 0; i < kCells; ++i) {
        const auto& cell =
            std::get<HalfOpenBox>(regions[static_cast<std::size_t>(j * kCells + i)].footprint);
        const auto own = static_cast<std::uint32_t>(j * kCells + i);
        CHECK(partition.locate(cell.min) == id(own));
        const Vector2d last(std::nextafter(cell.max.x(), -kInfinity),
                            std::nextafter(cell.max.y(), -kInfinity));
        CHECK(partition.locate(last) == id(own));
        if (i + 1 < kCells)
          CHECK(partition.locate(Vector2d(cell.max.x(), cell.min.y())) == id(own + 1));
      }
    }
    const double end = offset + kCells * kWidth;
    CHECK(!partition.locate(Vector2d(end, offset)));
    CHECK(!partition.locate(Vector2d(std::nextafter(offset, -kInfinity), offset)));
  }
}

TEST_CASE("where footprints overlap or touch, the lowest id owns the place") {
  const Partition overlap = made({box("small", {4, 4}, {5, 5}), box("large", {0, 0}, {1000, 1000}),
                                  box("later", {4, 4}, {6, 6})});
  CHECK(overlap.locate(Vector2d(4.5, 4.5)) == id(0));
  CHECK(overlap.locate(Vector2d(5.5, 5.5)) == id(1));
  const Partition reversed =
      made({box("large", {0, 0}, {1000, 1000}), box("small", {4, 4}, {5, 5})});
  CHECK(reversed.locate(Vector2d(4.5, 4.5)) == id(0));

  const Partition touching =
      made({polygon("right", {{0, 0}, {1, 0}, {1, 1}}), polygon("left", {{0, 0}, {1, 1}, {0, 1}})});
  CHECK(touching.locate(Vector2d(0.5, 0.5)) == id(0));
  CHECK(touching.locate(Vector2d(0, 0)) == id(0));
  CHECK(touching.locate(Vector2d(0.25, 0.75)) == id(1));
}

TEST_CASE("triangles that share edges leave no crack between them") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> angle(0.0, 6.28), radius(0.5, 3.0), along(0.0, 1.0);
  for (const double offset : {0.0, 5e6}) {
    // A fan round a centre: every spoke is the border of two triangles.
    const Vector2d centre(offset + 0.1, -offset + 0.3);
    std::vector<double> angles(17);
    for (double& a : angles) a = angle(random);
    std::sort(angles.begin(), angles.end());
    std::vector<Vector2d> rim;
    for (const double a : angles) {
      rim.push_back(centre + radius(random) * Vector2d(std::cos(a), std::sin(a)));
    }
    std::vector<Region> fan;
    for (std::size_t k = 0; k + 1 < rim.size(); ++k) {
      fan.push_back(polygon("t" + std::to_string(k), {centre, rim[k], rim[k + 1]}));
    }
    const Partition partition = made(fan);
    for (std::size_t k = 1; k + 1 < rim.size(); ++k) {
      for (int n = 0; n < 200; ++n) {
        // Beside the spoke by the rounding of the coordinates, on one side or the other.
        const Vector2d p = centre + 0.99 * along(random) * (rim[k] - centre);
        const auto owner = partition.locate(p);
        REQUIRE(owner);
        CHECK((owner->value == k - 1 || owner->value == k || (p - centre).norm() < 1e-6));
      }
    }
  }
}

TEST_CASE("a union of boxes is one region of any shape") {
  // An L around a box: they tile 0..3 x 0..2.
  const HalfOpenBox foot{{0, 0}, {3, 1}}, leg{{0, 1}, {1, 2}}, rest{{1, 1}, {3, 2}};
  const auto partition =
      Partition::from({{"rest", rest, {}}, {"corner", BoxUnion{{foot, leg}}, {}}});
  REQUIRE_MESSAGE(partition, to_string(partition.error()));
  for (double x = 0.0; x < 3.0; x += 0.25) {
    for (double y = 0.0; y < 2.0; y += 0.25) {
      const bool in_rest = x >= 1 && y >= 1;
      CHECK(partition->locate(Vector2d(x, y)) == RegionId{in_rest ? 0U : 1U});
      CHECK(contains((*partition)[RegionId{1}].footprint, Vector2d(x, y)) == !in_rest);
    }
  }
  CHECK_FALSE(partition->locate(Vector2d(3, 0.5)).has_value());
  CHECK(distance((*partition)[RegionId{1}].footprint, Vector2d(2, 3)) ==
        doctest::Approx(std::sqrt(2.0)));
  CHECK(distance((*partition)[RegionId{1}].footprint, Vector2d(-1, 1.5)) == 1.0);
  CHECK(nearest_region(*partition, Vector2d(0.5, 7)) == RegionId{1});
  CHECK(Partition::from({{"none", BoxUnion{}, {}}}).error().message ==
        "region 0 ('none'): the union holds no box");
  CHECK(Partition::from({{"flat", BoxUnion{{foot, {{0, 0}, {1, 0}}}}, {}}})
            .error()
            .message.starts_with("region 0 ('flat'): the box is empty"));
}

TEST_CASE("a storey owns its heights") {
  const Partition partition = made({box("road", {0, 0}, {9, 9}, {-kInfinity, 4.0}),
                                    box("bridge", {0, 0}, {9, 9}, {4.0, kInfinity})});
  CHECK(partition.locate(Point(1, 1, 0)) == id(0));
  CHECK(partition.locate(Point(1, 1, 4)) == id(1));
  CHECK(partition.locate(Point(1, 1, std::nextafter(4.0, 0.0))) == id(0));
  CHECK(partition.locate(Vector2d(1, 1)) == id(0));
  const Partition gap = made({box("road", {0, 0}, {9, 9}, {0.0, 4.0})});
  CHECK(!gap.locate(Point(1, 1, 5)));
  CHECK(gap.locate(Vector2d(1, 1)) == id(0));
}

TEST_CASE("a place that is no number is nowhere") {
  const Partition partition = made(grid(3, 1.0, {0, 0}));
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    CHECK(!partition.locate(Vector2d(bad, 0.5)));
    CHECK(!partition.locate(Vector2d(0.5, bad)));
    CHECK(!partition.locate(Point(0.5, 0.5, bad)));
    CHECK(!nearest_region(partition, Vector2d(0.5, bad)));
    CHECK(distance(partition.regions()[0].footprint, {bad, 0.5}) == kInfinity);
    CHECK(!contains(partition.regions()[0].footprint, {bad, 0.5}));
  }
  for (const double far : {1e18, -1e18, 1e300, -1e308}) {
    CHECK(!partition.locate(Vector2d(far, 0.5)));
    CHECK(nearest_region(partition, Vector2d(far, 0.5)).has_value());
  }
}

TEST_CASE("locate and nearest agree with their definitions for regions of every size and place") {
  std::mt19937 random(3);
  for (const double offset : {0.0, 5e6}) {
    std::uniform_real_distribution<double> place(-500.0, 500.0), exponent(-2.0, 2.7),
        unit(0.0, 1.0);
    std::vector<Region> regions;
    for (int k = 0; k < 300; ++k) {
      const Vector2d centre(offset + place(random), offset + place(random));
      const double width = std::pow(10.0, exponent(random)),
                   height = std::pow(10.0, exponent(random));
      const std::string label = "r" + std::to_string(k);
      if (k % 2 == 0) {
        regions.push_back(box(label, centre, centre + Vector2d(width, height)));
        continue;
      }
      std::vector<Vector2d> corners;
      for (int c = 0; c < 3 + k % 5; ++c) {
        const double a = 2.0 * M_PI * c / (3 + k % 5) + 0.3;
        corners.push_back(centre + Vector2d(width * std::cos(a), height * std::sin(a)));
      }
      regions.push_back(polygon(label, corners));
    }
    const Partition partition = made(regions);
    int inside = 0;
    const auto check = [&](const Vector2d& p) {
      const auto expected = first_that_contains(partition, p);
      inside += expected ? 1 : 0;
      CHECK(partition.locate(p) == expected);
      CHECK(nearest_region(partition, p) == nearest_by_distance(partition, p));
    };
    for (int n = 0; n < 3000; ++n) {
      check({offset + 1.3 * place(random), offset + 1.3 * place(random)});
    }
    for (const Region& region : partition.regions()) {  // where rounding matters
      std::visit(Overloaded{[&](const HalfOpenBox& shape) {
                              check(shape.min);
                              check(shape.max);
                              check({shape.max.x(), shape.min.y()});
                            },
                            [&](const ConvexPolygon& shape) {
                              for (const Vector2d& corner : shape.corners) check(corner);
                            },
                            [](const BoxUnion&) { FAIL("no such region here"); }},
                 region.footprint);
    }
    CHECK(inside > 1000);
  }
}

TEST_CASE("the bounds of a footprint hold all of it and no more") {
  const auto check = [](const Footprint& footprint, const Vector2d& min, const Vector2d& max) {
    const Bounds2 bounds = bounds_of(footprint);
    CHECK(bounds.min == min);
    CHECK(bounds.max == max);
  };
  check(HalfOpenBox{{-1, 2}, {3, 4}}, {-1, 2}, {3, 4});
  check(BoxUnion{{{{0, 0}, {1, 1}}, {{2, -1}, {3, 0}}}}, {0, -1}, {3, 1});
  check(ConvexPolygon{{{0, 0}, {3, 0}, {0, 4}}}, {0, 0}, {3, 4});
  const Vector2d nothing = Vector2d::Constant(kInfinity);
  check(ConvexPolygon{}, nothing, -nothing);
  check(BoxUnion{}, nothing, -nothing);
}

TEST_CASE("distance is zero inside and nowhere else") {
  const Footprint unit = HalfOpenBox{{0, 0}, {1, 1}};
  CHECK(distance(unit, {0.5, 0.5}) == 0.0);
  CHECK(distance(unit, {0.0, 0.0}) == 0.0);
  CHECK(distance(unit, {1.0, 0.5}) > 0.0);
  CHECK(distance(unit, {1.0, 0.5}) < 1e-12);
  CHECK(distance(unit, {3.0, 0.5}) == 2.0);
  CHECK(distance(unit, {4.0, 5.0}) == 5.0);
  CHECK(distance(unit, {-3.0, -4.0}) == 5.0);

  const Footprint triangle = ConvexPolygon{{{0, 0}, {4, 0}, {0, 4}}};
  CHECK(distance(triangle, {1, 1}) == 0.0);
  CHECK(distance(triangle, {2, 2}) == 0.0);
  CHECK(distance(triangle, {4, 4}) == doctest::Approx(std::sqrt(8.0)));
  CHECK(distance(triangle, {-3, -4}) == doctest::Approx(5.0));
  CHECK(distance(triangle, {2, -1}) == doctest::Approx(1.0));
}

TEST_CASE("a region that holds a place is the nearest one, also on an edge") {
  const Partition partition = made(grid(3, 1.0, {0, 0}));
  CHECK(nearest_region(partition, Vector2d(1.0, 0.5)) == partition.locate(Vector2d(1.0, 0.5)));
  CHECK(nearest_region(partition, Vector2d(3.0, 0.5)) == id(2));
  CHECK(nearest_region(partition, Vector2d(-5.0, -5.0)) == id(0));
  CHECK(nearest_region(partition, Vector2d(1.0, -5.0)) == id(0));  // as near to 1: the lower id
}

TEST_CASE("regions of one size far apart and of extreme sizes are found") {
  const Partition partition = made({
      box("here", {0, 0}, {1, 1}),
      box("there", {5e6, -5e6}, {5e6 + 1, -5e6 + 1}),
      box("moon", {3.8e15, 3.8e15}, {3.8e15 + 1, 3.8e15 + 1}),
      box("speck", {10, 10}, {10 + 1e-9, 10 + 1e-9}),
      box("everything", {-1e308, -1e308}, {1e308, 1e308}),
  });
  CHECK(partition.locate(Vector2d(0.5, 0.5)) == id(0));
  CHECK(partition.locate(Vector2d(5e6 + 0.5, -5e6 + 0.5)) == id(1));
  CHECK(partition.locate(Vector2d(3.8e15 + 0.5, 3.8e15 + 0.5)) == id(2));
  CHECK(partition.locate(Vector2d(10 + 5e-10, 10 + 5e-10)) == id(3));
  CHECK(partition.locate(Vector2d(-1e300, 7)) == id(4));
}

TEST_CASE("many regions: a hundred thousand cells beside one that is as large as all of them") {
  std::vector<Region> regions = grid(316, 1.0, {5e6, 5e6});
  const auto cells = static_cast<std::uint32_t>(regions.size());
  regions.push_back(box("rest", {0, 0}, {1e7, 1e7}));
  const Partition partition = made(regions);
  for (std::uint32_t r = 0; r < cells; r += 7) {
    const auto& cell = std::get<HalfOpenBox>(regions[r].footprint);
    REQUIRE(partition.locate(Vector2d(0.5 * (cell.min + cell.max))) == id(r));
  }
  CHECK(partition.locate(Vector2d(1, 1)) == id(cells));
}

}  // namespace
}  // namespace vantage
