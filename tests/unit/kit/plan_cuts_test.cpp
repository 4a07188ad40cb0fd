#include "vantage/kit/plan_cuts.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "vantage/kit/map_in_memory.hpp"

namespace vantage {
namespace {

using Eigen::Vector2d;
using Cut = Result<std::optional<PlanCut>>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A map in tiles of a width, of which only one is in memory at a time.
class Tiles final : public MapPasses {
 public:
  Tiles(PointCloud points, double width) : points_(std::move(points)), width_(width) {}
  [[nodiscard]] Bounds3 bounds() const noexcept override { return bounds_of(points_); }
  [[nodiscard]] std::uint64_t points() const noexcept override { return points_.size(); }
  [[nodiscard]] Result<void> pass(MapVisitor& visitor) const noexcept override {
    return pass_over({{-kInfinity, -kInfinity}, {kInfinity, kInfinity}}, visitor);
  }
  [[nodiscard]] Result<void> pass_over(const Bounds2& area,
                                       MapVisitor& visitor) const noexcept override {
    PointCloud shown;
    for (const Point& p : points_) {
      const Vector2d low = (p.head<2>() / width_).array().floor() * width_;
      const bool far = ((low.array() + width_) < area.min.array()).any() ||
                       (low.array() > area.max.array()).any();
      if (!far) shown.push_back(p);
    }
    shown_ += shown.size();
    return visitor.see(shown);
  }
  [[nodiscard]] std::uint64_t shown() const noexcept { return shown_; }

 private:
  PointCloud points_;
  double width_;
  mutable std::uint64_t shown_ = 0;
};

PlanPart part_of(const HalfOpenBox& box, const Bounds2& tight) {
  PlanPart part;
  part.box = box;
  part.tight = tight;
  part.points = 2;
  return part;
}

/// Parts with more points than this are cut at the median.
Result<Partition> halved(const MapPasses& map, std::uint64_t most, std::uint64_t gather) {
  PlanCutter cutter(map, gather);
  return cutter.cut_up(
      [&](const PlanPart& part) -> Cut {
        if (part.points <= most) return std::nullopt;
        for (const Eigen::Index axis : longer_first(part.box.max - part.box.min)) {
          VANTAGE_TRY(const auto median, cutter.median_cut(axis));
          if (!median) continue;
          if (const auto cut = cut_near(part, axis, *median, 0.0)) return cut;
        }
        return std::nullopt;
      },
      "a test");
}

TEST_CASE("a cut is as near to where it is wanted as the narrowest piece allows") {
  const PlanPart part = part_of({{0.0, 0.0}, {8.0, 1.0}}, {{0.5, 0.0}, {7.5, 1.0}});
  CHECK(cut_near(part, 0, 4.0, 3.0)->at == 4.0);
  CHECK(cut_near(part, 0, 1.0, 3.0)->at == 3.0);
  CHECK(cut_near(part, 0, 7.0, 3.0)->at == 5.0);
  CHECK_FALSE(cut_near(part, 1, 0.5, 0.6));  // no room
}

TEST_CASE("a cut leaves a point on both sides") {
  const PlanPart part = part_of({{0.0, 0.0}, {8.0, 1.0}}, {{2.0, 0.0}, {3.0, 1.0}});
  CHECK(cut_near(part, 0, 3.0, 0.0)->at == 3.0);  // the point at 3 lies above
  CHECK_FALSE(cut_near(part, 0, 2.0, 0.0));
  CHECK_FALSE(cut_near(part, 0, 3.1, 0.0));
  CHECK_FALSE(cut_near(part, 0, 2.5, 3.5));  // the piece would have to end beyond the points
}

TEST_CASE("the longer axis comes first") {
  using Axes = std::array<Eigen::Index, 2>;
  CHECK(longer_first({2.0, 1.0}) == Axes{0, 1});
  CHECK(longer_first({1.0, 2.0}) == Axes{1, 0});
  CHECK(longer_first({1.0, 1.0}) == Axes{0, 1});
}

TEST_CASE("parts are cut until none is to be cut, and come in the order of their labels") {
  const PointCloud points{{0.5, 0, 0}, {1.5, 1, 0}, {2.5, 0, 0}, {3.5, 0, 0}};
  const MapInMemory map(points);
  const auto partition = halved(map, 1, kPointsGathered);
  REQUIRE(partition);
  std::vector<std::string> labels;
  for (const Region& region : partition->regions()) labels.push_back(region.label);
  CHECK(labels == std::vector<std::string>{"cell_00", "cell_01", "cell_10", "cell_11"});
  const auto& below = std::get<HalfOpenBox>(partition->regions()[1].footprint);
  CHECK(below.max.x() == 2.5);

  const auto uncut = halved(map, 4, kPointsGathered);
  REQUIRE(uncut);
  CHECK(uncut->regions().front().label == "cell");
}

TEST_CASE("a map that is passed over is cut as one in memory") {
  std::mt19937 random(5);
  std::normal_distribution<double> x(3.0, 40.0);
  std::uniform_real_distribution<double> y(-1e-3, 30.0);
  PointCloud scattered, lattice, one_place(500, Point(1.0, 2.0, 3.0)), extreme;
  for (int k = 0; k < 4000; ++k) scattered.emplace_back(x(random), y(random), 0.0);
  for (int k = 0; k < 4000; ++k) {
    lattice.emplace_back(std::round(x(random) / 8.0), -std::round(y(random) / 8.0), 0.0);
  }
  for (int k = 0; k < 300; ++k) one_place.emplace_back(1.0 + (k % 3), 2.0, 0.0);
  for (int k = 0; k < 300; ++k) extreme.emplace_back(k % 2 ? 1.7e308 : -1.7e308, k * 5e-324, 0.0);
  for (const PointCloud& points : {scattered, lattice, one_place, extreme}) {
    const Tiles tiles(points, 16.0);
    const MapInMemory memory(points);
    for (const std::uint64_t most : {1000U, 90U, 7U}) {
      const auto expected = halved(memory, most, kPointsGathered);
      REQUIRE(expected);
      for (const std::uint64_t gather : {1U, 10U, 200U, 1U << 20U}) {
        if (gather == 1 && points.size() > 1000) continue;  // slow
        const auto passed = halved(tiles, most, gather);
        REQUIRE_MESSAGE(passed, to_string(passed.error()));
        CHECK(passed->regions() == expected->regions());
      }
    }
  }
}

TEST_CASE("only the tiles around a part are passed over") {
  PointCloud points;
  for (int k = 0; k < 6400; ++k) points.emplace_back(k % 80, k / 80, 0.0);
  const Tiles tiles(points, 10.0);
  REQUIRE(halved(tiles, 100, 1600));
  // Two levels of cuts, each with a histogram of few coordinates and the halves; then all points
  // once. Tiles on borders come twice.
  CHECK(tiles.shown() >= 5 * points.size());
  CHECK(tiles.shown() < 6 * points.size());
}

TEST_CASE("an error ends the cutting, and so do too many regions") {
  const PointCloud two{{0.0, 0, 0}, {1.0, 0, 0}};
  const MapInMemory map(two);
  const auto failing = PlanCutter(map).cut_up(
      [](const PlanPart&) -> Cut { return fail(ErrorCode::internal, "no"); }, "a test");
  REQUIRE_FALSE(failing);
  CHECK(failing.error().message == "no");

  PointCloud line;
  for (int k = 0; k < 1'000'001; ++k) line.emplace_back(k, 0, 0);
  const auto endless = halved(MapInMemory(line), 1, kPointsGathered);
  REQUIRE_FALSE(endless);
  CHECK(endless.error().code == ErrorCode::invalid_input);
  CHECK(endless.error().message == "a test cuts the map into more than 1000000 regions");
}

}  // namespace
}  // namespace vantage
