#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <thread>

#include "support/cut.hpp"
#include "support/plugins.hpp"
#include "vantage/kit/map_in_memory.hpp"
#include "vantage/map_survey.hpp"

namespace vantage {
namespace {

using test::kInfinity;
using test::labels;
using test::plugin;

PluginPtr<Partitioner> grid(const std::string& params) {
  return plugin<Partitioner>("uniform_grid", params);
}

Partition made(const PluginPtr<Partitioner>& partitioner, const PointCloud& map) {
  auto partition = test::cut(partitioner, map);
  REQUIRE_MESSAGE(partition, to_string(partition.error()));
  return *std::move(partition);
}

/// Multiples of a step, computed as a map maker would: i * step, not by adding up.
PointCloud lattice(double step, int n, double offset = 0.0) {
  PointCloud points;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) points.emplace_back(offset + i * step, offset + j * step, 0.0);
  }
  return points;
}

TEST_CASE("cells that hold a point become regions, by rows") {
  const PointCloud map{{25, 5, 0}, {5, 5, 0}, {5, 25, 0}, {6, 6, 9}, {-1, 5, 0}};
  const Partition partition = made(grid("cell_width = 10.0\norigin = [0.0, 0.0]"), map);
  CHECK(labels(partition) ==
        std::vector<std::string>{"x-001_y+000", "x+000_y+000", "x+002_y+000", "x+000_y+002"});
  const auto& cell = std::get<HalfOpenBox>(partition.regions()[2].footprint);
  CHECK(cell.min == Eigen::Vector2d(20, 0));
  CHECK(cell.max == Eigen::Vector2d(30, 10));
  CHECK(partition.locate(Point(6, 6, 9)) == RegionId{1});
  CHECK(!partition.locate(Point(15, 5, 0)));
}

TEST_CASE("the grid begins at the map's minimum unless an origin is given") {
  const PointCloud map{{3.5, -7.25, 1}, {14, 2, 1}};
  const Partition partition = made(grid("cell_width = 10"), map);
  const auto& first = std::get<HalfOpenBox>(partition.regions()[0].footprint);
  CHECK(first.min == Eigen::Vector2d(3.5, -7.25));
  CHECK(labels(partition) == std::vector<std::string>{"x+000_y+000", "x+001_y+000"});
}

/// A survey that knows the ground only.
class GroundSurvey final : public MapSurvey {
 public:
  explicit GroundSurvey(Result<Bounds3> ground) : ground_(std::move(ground)) {}
  [[nodiscard]] Result<PointCloud> viewpoints() const noexcept override { return PointCloud{}; }
  [[nodiscard]] Result<Bounds3> ground_bounds() const noexcept override { return ground_; }
  [[nodiscard]] Result<IndexList> visible(const Point&) const noexcept override {
    return IndexList{};
  }
  [[nodiscard]] Result<std::uint64_t> observable_points(const Region&,
                                                        std::uint64_t) const noexcept override {
    return 0;
  }

 private:
  Result<Bounds3> ground_;
};

TEST_CASE("origin = \"ground\": the grid begins where the ground begins") {
  const PointCloud map{{-7, 0.5, 3}, {2.5, 1.25, 0}, {12, 14, 0}};
  const auto partitioner = grid("cell_width = 10\norigin = \"ground\"");
  const auto partition = partitioner->partition(MapInMemory(map), {},
                                                GroundSurvey(Bounds3{{2.5, 1.25, 0}, {12, 14, 0}}));
  REQUIRE_MESSAGE(partition, to_string(partition.error()));
  CHECK(labels(*partition) ==
        std::vector<std::string>{"x-001_y-001", "x+000_y+000", "x+000_y+001"});
  CHECK(std::get<HalfOpenBox>(partition->regions()[1].footprint).min == Eigen::Vector2d(2.5, 1.25));

  const auto none = partitioner->partition(
      MapInMemory(map), {}, GroundSurvey(fail(ErrorCode::unsupported, "there is no ground")));
  REQUIRE(!none);
  CHECK(none.error().code == ErrorCode::unsupported);
  CHECK(none.error().message ==
        "there is no ground: give the origin as [x, y] instead of \"ground\"");
}

TEST_CASE("every map point is located, also the ones on cell edges and the greatest") {
  for (const double offset : {0.0, 0.05, -3.0, 1e6, 5e6}) {
    for (const std::string params :
         {"cell_width = 0.1", "cell_width = 0.1\norigin = [0.0, 0.0]", "cell_width = 0.3",
          "cell_width = 0.7\norigin = [0.1, -0.1]"}) {
      CAPTURE(offset);
      CAPTURE(params);
      const PointCloud map = lattice(0.1, 60, offset);
      const Partition partition = made(grid(params), map);
      std::vector<int> points(partition.size());
      for (const Point& p : map) {
        const auto owner = partition.locate(p);
        REQUIRE(owner);
        ++points[owner->value];
      }
      CHECK(std::count(points.begin(), points.end(), 0) == 0);  // no region without a point
    }
  }
}

TEST_CASE("cells tile: each ends on the number where its neighbour begins") {
  const PointCloud map = lattice(0.1, 60, 1e6);
  const Partition partition = made(grid("cell_width = 0.1\norigin = [999999.97, 999999.97]"), map);
  std::set<double> begins, ends;
  for (const Region& region : partition.regions()) {
    const auto& cell = std::get<HalfOpenBox>(region.footprint);
    begins.insert(cell.min.x());
    ends.insert(cell.max.x());
  }
  REQUIRE(begins.size() >= 60);
  for (auto begin = std::next(begins.begin()); begin != begins.end(); ++begin) {
    CHECK(ends.contains(*begin));
  }
}

TEST_CASE("a point on an edge belongs to the cell that begins there, one below it does not") {
  const auto partitioner = grid("cell_width = 0.1\norigin = [0.0, 0.0]");
  for (int i = -100; i < 100; ++i) {
    const double edge = i * 0.1;
    const PointCloud map{{edge, 0.05, 0}, {std::nextafter(edge, -kInfinity), 0.05, 0}};
    const Partition partition = made(partitioner, map);
    REQUIRE(partition.size() == 2);
    CHECK(partition.locate(map[0]) == RegionId{1});
    CHECK(partition.locate(map[1]) == RegionId{0});
    CHECK(std::get<HalfOpenBox>(partition.regions()[1].footprint).min.x() == edge);
  }
}

TEST_CASE("random maps are located whole, far from the origin too") {
  std::mt19937 random(11);
  for (const double offset : {0.0, 1e6, -5e6}) {
    std::uniform_real_distribution<double> coordinate(offset - 80, offset + 80);
    PointCloud map;
    for (int k = 0; k < 5000; ++k) map.emplace_back(coordinate(random), coordinate(random), 0.0);
    for (const std::string width : {"0.013", "1.1", "10", "33.3", "1e4"}) {
      const Partition partition = made(grid("cell_width = " + width), map);
      for (const Point& p : map) REQUIRE(partition.locate(p));
    }
  }
}

TEST_CASE("the order of the points does not matter") {
  std::mt19937 random(5);
  PointCloud map = lattice(0.37, 50);
  const auto partitioner = grid("cell_width = 2.0");
  const Partition before = made(partitioner, map);
  std::shuffle(map.begin(), map.end(), random);
  const Partition after = made(partitioner, map);
  CHECK(labels(before) == labels(after));
  for (std::size_t r = 0; r < before.size(); ++r) {
    const auto& a = std::get<HalfOpenBox>(before.regions()[r].footprint);
    const auto& b = std::get<HalfOpenBox>(after.regions()[r].footprint);
    CHECK(a.min == b.min);
    CHECK(a.max == b.max);
  }
}

TEST_CASE("labels keep one width, so that files sort by cell") {
  const PointCloud map{{0.5, 0.5, 0}, {1234.5, 0.5, 0}, {7.5, 0.5, 0}};
  const auto all = labels(made(grid("cell_width = 1.0"), map));
  CHECK(all == std::vector<std::string>{"x+0000_y+0000", "x+0007_y+0000", "x+1234_y+0000"});
  CHECK(std::is_sorted(all.begin(), all.end()));
}

TEST_CASE("one point makes one region") {
  const Partition partition = made(grid("cell_width = 5"), {{5e6, 5e6, 100}});
  CHECK(labels(partition) == std::vector<std::string>{"x+000_y+000"});
  CHECK(partition.locate(Point(5e6, 5e6, 100)) == RegionId{0});
}

TEST_CASE("bad maps are refused") {
  const auto partitioner = grid("cell_width = 5");
  const auto code = [&](const PointCloud& map) {
    const auto partition = test::cut(partitioner, map);
    REQUIRE(!partition);
    return partition.error().code;
  };
  CHECK(code({}) == ErrorCode::invalid_input);
  CHECK(code({{0, 0, 0}, {0, std::nan(""), 0}}) == ErrorCode::invalid_input);
  CHECK(code({{0, 0, 0}, {0, 0, kInfinity}}) == ErrorCode::invalid_input);
}

TEST_CASE("a width that is too small for the map is an error that says so") {
  const auto refused = [](const std::string& params, const PointCloud& map) {
    const auto partition = test::cut(grid(params), map);
    REQUIRE(!partition);
    CHECK(partition.error().code == ErrorCode::invalid_input);
    return partition.error().message;
  };
  const auto has = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
  };
  // Indices beyond 2^31.
  CHECK(has(refused("cell_width = 1e-6", {{0, 0, 0}, {1e4, 0, 0}}), "cell_width = 1e-06 m"));
  CHECK(has(refused("cell_width = 1.0", {{0, 0, 0}, {1e300, 0, 0}}), "too small"));
  // A cell narrower than the rounding of its coordinates.
  CHECK(has(refused("cell_width = 1e-300", {{5, 5, 0}}), "too small"));
  CHECK(has(refused("cell_width = 1e-9", {{5e6, 5e6, 0}}), "rounding"));
  // More regions than anybody wants.
  PointCloud many;
  for (int k = 0; k < 1'000'001; ++k) many.emplace_back(k, 0.0, 0.0);
  CHECK(has(refused("cell_width = 0.5", many), "1000000 regions"));
}

TEST_CASE("bad parameters are refused") {
  for (const std::string params : {"", "cell_width = 0.0", "cell_width = -1", "cell_width = inf",
                                   "cell_width = '10'", "cell_width = 1.0\norigin = [1.0]",
                                   "cell_width = 1.0\norigin = [1.0, nan]", "cell_wdth = 1.0"}) {
    CAPTURE(params);
    CHECK_THROWS((void)grid(params));
  }
}

TEST_CASE("threads that share a partitioner agree") {
  const auto partitioner = grid("cell_width = 0.7");
  const PointCloud map = lattice(0.1, 60);
  const auto expected = labels(made(partitioner, map));
  std::vector<std::vector<std::string>> got(4);
  std::vector<std::thread> threads;
  for (auto& out : got) {
    threads.emplace_back([&] { out = labels(test::cut(partitioner, map).value()); });
  }
  for (std::thread& thread : threads) thread.join();
  for (const auto& out : got) CHECK(out == expected);
}

}  // namespace
}  // namespace vantage
