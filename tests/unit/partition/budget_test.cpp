#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "support/cut.hpp"
#include "support/plugins.hpp"
#include "support/text.hpp"

namespace vantage {
namespace {

using conformance::RangeSurvey;
using test::box_of;
using test::has;
using test::kInfinity;
using test::plugin;

PluginPtr<Partitioner> budget(const std::string& params) {
  return plugin<Partitioner>("budget", params);
}

Partition made(const std::string& params, const PointCloud& map, double range) {
  return test::cut_by("budget", params, map, {}, range);
}

std::string refused(const std::string& params, const PointCloud& map, double range) {
  const auto partition = test::cut(budget(params), map, {}, range);
  REQUIRE(!partition);
  CHECK(partition.error().code == ErrorCode::invalid_input);
  return partition.error().message;
}

/// What every answer must keep: each point owned, no region without one, none over the budget.
void keeps_its_word(const Partition& partition, const PointCloud& map, double range,
                    std::uint64_t max_points) {
  std::vector<int> points(partition.size());
  for (const Point& p : map) {
    const auto owner = partition.locate(p);
    REQUIRE(owner);
    ++points[owner->value];
  }
  CHECK(std::count(points.begin(), points.end(), 0) == 0);
  const RangeSurvey survey(map, range);
  for (const Region& region : partition.regions()) {
    CHECK(survey.observable_points(region, max_points).value() <= max_points);
  }
}

PointCloud lattice(int nx, int ny, double step, double offset = 0.0) {
  PointCloud map;
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) map.emplace_back(offset + i * step, offset + j * step, 0.0);
  }
  return map;
}

/// Answers by a function of the region, and counts how often it was asked.
class ScriptedSurvey final : public MapSurvey {
 public:
  using Answer = std::function<Result<std::uint64_t>(const Region&, std::uint64_t)>;
  explicit ScriptedSurvey(Answer answer) : answer_(std::move(answer)) {}

  Result<PointCloud> viewpoints() const noexcept override { return PointCloud{}; }
  Result<Bounds3> ground_bounds() const noexcept override { return Bounds3{}; }
  Result<IndexList> visible(const Point&) const noexcept override { return IndexList{}; }
  Result<std::uint64_t> observable_points(const Region& region,
                                          std::uint64_t enough) const noexcept override {
    ++calls;
    return answer_(region, enough);
  }
  mutable std::size_t calls = 0;

 private:
  Answer answer_;
};

TEST_CASE("a map that fits is one region, one point more is cut in two") {
  // Two heaps of ten points, out of sight of each other.
  PointCloud map;
  for (int k = 0; k < 10; ++k) {
    map.emplace_back(0.1 * k, 0, 0);
    map.emplace_back(100 + 0.1 * k, 0, 0);
  }
  const Partition whole = made("max_points = 20", map, 15.0);
  REQUIRE(whole.size() == 1);
  CHECK(whole[RegionId{0}].label == "cell");

  const Partition halves = made("max_points = 19", map, 15.0);
  REQUIRE(halves.size() == 2);
  CHECK(halves[RegionId{0}].label == "cell_0");
  CHECK(halves[RegionId{1}].label == "cell_1");
  CHECK(box_of(halves, 0).max.x() == doctest::Approx(50.45));
  CHECK(box_of(halves, 0).max.x() == box_of(halves, 1).min.x());
  keeps_its_word(halves, map, 15.0, 10);
}

TEST_CASE("what is seen counts, not what is owned") {
  // 40 m of line; a region of 20 m sees 5 m beyond its end.
  const PointCloud map = lattice(400, 1, 0.1);
  CHECK(made("max_points = 250", map, 5.0).size() == 2);
  CHECK(made("max_points = 220", map, 5.0).size() == 4);
}

TEST_CASE("no region shows more than the budget, at any distance from the origin") {
  for (const double offset : {0.0, -17.3, 1e6, -5e6}) {
    for (const std::uint64_t max_points : {150U, 400U, 1599U}) {
      CAPTURE(offset);
      CAPTURE(max_points);
      const PointCloud map = lattice(40, 40, 1.0, offset);
      const Partition partition = made("max_points = " + std::to_string(max_points), map, 4.0);
      CHECK(partition.size() > 1);
      keeps_its_word(partition, map, 4.0, max_points);
    }
  }
}

TEST_CASE("random maps with heaps and empty places keep every clause") {
  std::mt19937 random(6);
  for (int round = 0; round < 20; ++round) {
    CAPTURE(round);
    std::normal_distribution<double> spread(0.0, 1.0 + round);
    std::uniform_real_distribution<double> centre(-60.0, 60.0);
    PointCloud map;
    for (int heap = 0; heap < 8; ++heap) {
      const Point at(centre(random), centre(random), 0.0);
      for (int k = 0; k < 40; ++k) map.push_back(at + Point(spread(random), spread(random), 0));
    }
    keeps_its_word(made("max_points = 160", map, 6.0), map, 6.0, 160);
  }
}

TEST_CASE("a budget that cannot be kept is an error that says where, how much and what to do") {
  PointCloud map(7, Point(30.5, -4, 2));
  map.emplace_back(0, 0, 0);
  const std::string message = refused("max_points = 5", map, 2.0);
  CHECK(has(message, "to (30.50, 0.00) m shows 7 points, more than max_points = 5"));
  CHECK(has(message, "min_width = 2.00 m"));
  CHECK(has(message, "raise max_points or lower visibility.max_range"));
  CHECK(made("max_points = 7", map, 2.0).size() == 2);
}

TEST_CASE("the error's number is exact, although counting may stop early") {
  const PointCloud map{{0, 0, 0}, {0.5, 0, 0}};
  const ScriptedSurvey survey([](const Region&, std::uint64_t enough) {
    return Result<std::uint64_t>(std::min<std::uint64_t>(enough + (enough < 1000 ? 1 : 0), 1000));
  });
  const auto partition = budget("max_points = 10")->partition(MapInMemory(map), {}, survey);
  REQUIRE(!partition);
  CHECK(has(partition.error().message, "shows 1000 points"));
}

TEST_CASE("no piece is narrower than min_width") {
  const PointCloud map = lattice(30, 30, 0.5);
  // Regions of 15, 7.5, 3.75 and 1.875 m: the last is narrower than 2 m.
  const std::string message = refused("max_points = 120", map, 2.0);
  CHECK(has(message, "cannot be cut into two"));
  const Partition partition = made("max_points = 120\nmin_width = 1.5", map, 2.0);
  keeps_its_word(partition, map, 2.0, 120);
  for (std::uint32_t r = 0; r < partition.size(); ++r) {
    CHECK((box_of(partition, r).max - box_of(partition, r).min).minCoeff() > 1.5 - 1e-9);
  }
  // A heap near a corner: the cut moves away from the middle of the points to keep the width.
  PointCloud heap(3, Point(0, 0, 0));
  heap.emplace_back(3, 0, 0);
  const ScriptedSurvey survey([](const Region& region, std::uint64_t) {
    return Result<std::uint64_t>(
        contains(region.footprint, {0, 0}) && contains(region.footprint, {3, 0}) ? 2U : 1U);
  });
  const auto corner =
      budget("max_points = 1\nmin_width = 1.0")->partition(MapInMemory(heap), {}, survey);
  REQUIRE(corner);
  CHECK(box_of(*corner, 0).max.x() == 1.5);
}

TEST_CASE("the survey is asked once a region and once a cut") {
  const PointCloud map = lattice(64, 1, 1.0);
  const ScriptedSurvey survey([](const Region& region, std::uint64_t enough) {
    CHECK(enough == 5);
    const auto& box = std::get<HalfOpenBox>(region.footprint);
    return Result<std::uint64_t>(box.max.x() - box.min.x() > 10.0 ? 6U : 5U);
  });
  const auto partition = budget("max_points = 5")->partition(MapInMemory(map), {}, survey);
  REQUIRE(partition);
  CHECK(partition->size() == 8);
  CHECK(survey.calls == 2 * partition->size() - 1);
}

TEST_CASE("what the survey reports is passed on") {
  const ScriptedSurvey survey([](const Region&, std::uint64_t) -> Result<std::uint64_t> {
    return fail(ErrorCode::internal, "no eyes");
  });
  const auto partition =
      budget("max_points = 5")->partition(MapInMemory(lattice(3, 3, 1.0)), {}, survey);
  REQUIRE(!partition);
  CHECK(partition.error().code == ErrorCode::internal);
  CHECK(partition.error().message == "no eyes");
}

TEST_CASE("one point, one place, a line and places a step apart have regions") {
  CHECK(made("max_points = 1", {{5e6, -5e6, 1}}, 15.0).size() == 1);
  CHECK(made("max_points = 50", PointCloud(50, Point(-3, 1e6, 0)), 15.0).size() == 1);
  const PointCloud line = lattice(1, 100, 1.0, 1e6);
  keeps_its_word(made("max_points = 30", line, 5.0), line, 5.0, 30);
  const double step = std::nextafter(1e6, kInfinity);
  const PointCloud close{{1e6, 0, 0}, {step, 0, 0}};
  const ScriptedSurvey survey([&](const Region& region, std::uint64_t) {
    return Result<std::uint64_t>(
        contains(region.footprint, {1e6, 0}) && contains(region.footprint, {step, 0}) ? 2U : 1U);
  });
  CHECK(budget("max_points = 1\nmin_width = 0.0")
            ->partition(MapInMemory(close), {}, survey)
            ->size() == 2);
}

TEST_CASE("the order of the points does not matter, nor the sign of zero") {
  PointCloud map = lattice(30, 30, 0.75, -11.25);
  for (int k = 0; k < 40; ++k)
    map.emplace_back(k % 2 == 0 ? 0.0 : -0.0, k % 3 == 0 ? -0.0 : 0.0, k);
  const Partition before = made("max_points = 250", map, 4.0);
  CHECK(before.size() > 4);
  std::mt19937 random(5);
  for (int round = 0; round < 3; ++round) {
    std::shuffle(map.begin(), map.end(), random);
    CHECK(made("max_points = 250", map, 4.0).regions() == before.regions());
  }
}

TEST_CASE("bad maps and parameters are refused") {
  CHECK(has(refused("max_points = 10", {}, 15.0), "the map"));
  refused("max_points = 10", {{0, 0, 0}, {0, std::nan(""), 0}}, 15.0);
  refused("max_points = 10", {{0, 0, 0}, {0, 0, kInfinity}}, 15.0);
  for (const std::string params :
       {"", "max_points = 0", "max_points = -1", "max_points = 1.5", "max_point = 10",
        "max_points = 10\nmin_width = -1.0", "max_points = 10\nmin_width = nan"}) {
    CAPTURE(params);
    CHECK_THROWS((void)budget(params));
  }
}

TEST_CASE("more regions than anybody wants are an error that names the parameter") {
  const PointCloud map = lattice(1'000'001, 1, 1.0);
  const ScriptedSurvey survey([](const Region& region, std::uint64_t) {
    const auto& box = std::get<HalfOpenBox>(region.footprint);
    const double points = std::ceil(box.max.x()) - std::ceil(box.min.x());
    return Result<std::uint64_t>(static_cast<std::uint64_t>(points));
  });
  const auto partition =
      budget("max_points = 1\nmin_width = 0.0")->partition(MapInMemory(map), {}, survey);
  REQUIRE(!partition);
  CHECK(partition.error().message == "max_points = 1 cuts the map into more than 1000000 regions");
}

}  // namespace
}  // namespace vantage
