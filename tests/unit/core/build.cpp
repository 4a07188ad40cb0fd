#include "vantage/build.hpp"

#include <doctest/doctest.h>
#include <tbb/global_control.h>

#include <limits>

#include "fakes.hpp"

using namespace vantage;

namespace {

/// A floor of 30 x 4 points a metre apart and a wall at x = 25.5; no floor where 10 <= x < 20.
PointCloud map_with_a_gap() {
  PointCloud map;
  for (int x = 0; x < 30; ++x) {
    for (int y = 0; y < 4; ++y) {
      if (x < 10 || x >= 20) map.push_back({x + 0.5, y + 0.5, 0.0});
    }
  }
  for (int z = 1; z < 5; ++z) map.push_back({25.5, 2.0, 1.0 * z});
  map.push_back({16.0, 2.0, 3.0});  // something hangs over the gap
  return map;
}

BuildPlugins plugins(const std::shared_ptr<test::Memory>& memory, std::uint32_t ground_shift = 0,
                     double limit = 1e9, int strips = 3) {
  BuildPlugins p;
  p.partitioner = test::in_process<test::Strips, Partitioner>(strips);
  p.ground = test::in_process<test::FlatGround, GroundFilter>(ground_shift);
  p.visibility = test::in_process<test::SeesNear, VisibilityOperator>(limit);
  p.store = test::in_process<test::MemoryStore, MapStore>(memory);
  return p;
}

BuildParams params(VisibilityScope scope = VisibilityScope::map) {
  BuildParams p;
  p.viewpoints = {.voxel_size = 2.0, .sensor_height = 1.0};
  p.scope = scope;
  p.max_range = 6.0;
  p.effective_config = "the configuration";
  return p;
}

}  // namespace

TEST_CASE("a build stores every region's observable map, its viewpoints and the configuration") {
  const PointCloud map = map_with_a_gap();
  const auto memory = std::make_shared<test::Memory>();
  auto p = plugins(memory);
  std::vector<std::size_t> progress;
  const auto report = build_region_maps(map, {}, p, params(), [&](const BuildProgress& now) {
    progress.push_back(now.regions_done);
  });
  REQUIRE_MESSAGE(report, to_string(report.error()));
  CHECK(memory->committed);
  CHECK(memory->index.config == "the configuration");
  CHECK(memory->index.map_points == map.size());
  CHECK(memory->maps.size() == 3);
  CHECK(progress == std::vector<std::size_t>{0, 1, 2, 3});

  CHECK(report->ground_points == 80);
  CHECK(report->viewpoints == 20);  // 5 x 2 voxels of 2 m in each of the two strips with floor
  CHECK(report->regions_without_viewpoints == 1);
  CHECK(memory->maps[1].points.empty());

  // By hand: every map point within 6 m of a viewpoint of strip 0, over region borders, in order.
  PointCloud expected;
  for (const Point& point : map) {
    bool seen = false;
    for (int x = 1; x < 10; x += 2) {
      for (int y = 1; y < 4; y += 2) seen |= (point - Point(x, y, 1.0)).norm() <= 6.0;
    }
    if (seen) expected.push_back(point);
  }
  CHECK(memory->maps[0].points == expected);
  CHECK(memory->maps[0].viewpoints == 10);
  CHECK(report->regions[0].points == expected.size());
}

TEST_CASE("scope \"region\" keeps to P_ij (Eq. 9), scope \"map\" reaches beyond the cell") {
  const PointCloud map = map_with_a_gap();
  const auto over_map = std::make_shared<test::Memory>(), inside = std::make_shared<test::Memory>();
  auto p = plugins(over_map);
  auto q = plugins(inside);
  REQUIRE(build_region_maps(map, {}, p, params(VisibilityScope::map)));
  REQUIRE(build_region_maps(map, {}, q, params(VisibilityScope::region)));
  const auto reaches_out = [](const PointCloud& cloud) {
    return std::any_of(cloud.begin(), cloud.end(), [](const Point& x) { return x.x() < 20.0; });
  };
  CHECK(reaches_out(over_map->maps[2].points));
  CHECK_FALSE(reaches_out(inside->maps[2].points));
  CHECK_FALSE(inside->maps[2].points.empty());
}

TEST_CASE("the bundle does not depend on the number of threads") {
  const PointCloud map = map_with_a_gap();
  std::vector<std::map<std::uint32_t, RegionMap>> results;
  for (const std::size_t threads : {1U, 2U, 3U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const auto memory = std::make_shared<test::Memory>();
    auto p = plugins(memory);
    REQUIRE(build_region_maps(map, {}, p, params()));
    results.push_back(memory->maps);
  }
  for (std::uint32_t r = 0; r < 3; ++r) {
    CHECK(results[0][r].points == results[1][r].points);
    CHECK(results[0][r].points == results[2][r].points);
  }
}

TEST_CASE("a map that cannot be built is refused before anything is stored") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto memory = std::make_shared<test::Memory>();
  auto p = plugins(memory);
  CHECK(build_region_maps({}, {}, p, params()).error().message == "the map has no points");
  CHECK(build_region_maps(PointCloud{{0, 0, nan}}, {}, p, params()).error().message ==
        "the map has a point that is not finite (point 0 of 1, counted from 0)");
  CHECK(build_region_maps(PointCloud{{5, 0, 3}}, {}, p, params()).error().message ==
        "no ground was found in the map, so there is nowhere to put a viewpoint");
  CHECK_FALSE(memory->begun);
}

namespace {

/// Asks about every strip before it cuts, and keeps the answers.
class AsksFirst final : public Partitioner {
 public:
  struct Answers {
    PointCloud viewpoints;
    std::vector<std::uint64_t> points, points_if_three_are_enough;
    std::vector<IndexList> visible;
  };
  explicit AsksFirst(std::shared_ptr<Answers> answers) : answers_(std::move(answers)) {}
  [[nodiscard]] Result<Partition> partition(PointsView map, PointsView trajectory,
                                            const MapObserver& observer) const noexcept override {
    VANTAGE_TRY(auto strips, test::Strips(3).partition(map, trajectory, observer));
    for (const Region& region : strips.regions()) {
      VANTAGE_TRY(answers_->points.emplace_back(), observer.observable_points(region, 1000));
      VANTAGE_TRY(answers_->points_if_three_are_enough.emplace_back(),
                  observer.observable_points(region, 3));
    }
    VANTAGE_TRY(answers_->viewpoints, observer.viewpoints());
    for (const Point& q : answers_->viewpoints) {
      VANTAGE_TRY(answers_->visible.emplace_back(), observer.visible(q));
    }
    return strips;
  }

 private:
  std::shared_ptr<Answers> answers_;
};

}  // namespace

TEST_CASE("what the observer tells a partitioner is what the bundle then holds") {
  const PointCloud map = map_with_a_gap();
  for (const VisibilityScope scope : {VisibilityScope::map, VisibilityScope::region}) {
    const auto memory = std::make_shared<test::Memory>();
    const auto answers = std::make_shared<AsksFirst::Answers>();
    auto p = plugins(memory);
    p.partitioner = test::in_process<AsksFirst, Partitioner>(answers);
    const auto report = build_region_maps(map, {}, p, params(scope));
    REQUIRE_MESSAGE(report, to_string(report.error()));
    REQUIRE(answers->points.size() == 3);
    for (std::uint32_t r = 0; r < 3; ++r) {
      CHECK(answers->points[r] == memory->maps[r].points.size());
      const bool few = memory->maps[r].points.size() <= 3;
      CHECK((answers->points_if_three_are_enough[r] > 3) == !few);
      CHECK(answers->points_if_three_are_enough[r] <= answers->points[r]);
    }
    // Strips and viewpoint voxels share their edges here, so the whole map has the same viewpoints.
    CHECK(answers->viewpoints.size() == report->viewpoints);
    for (std::size_t i = 0; i < answers->viewpoints.size(); ++i) {
      IndexList expected;
      for (std::uint32_t k = 0; k < map.size(); ++k) {
        if ((map[k] - answers->viewpoints[i]).norm() <= 6.0) expected.push_back(k);
      }
      CHECK(answers->visible[i] == expected);
    }
  }
}

TEST_CASE("a visibility plugin's wrong index is an error also where core joins viewpoints") {
  class WrongIndex final : public VisibilityScene {
   public:
    WrongIndex() : VisibilityScene(10) {}
    [[nodiscard]] Result<IndexList> visible(const Point&) const noexcept override {
      return IndexList{3, 10};
    }
  };
  const PointCloud viewpoints(5, Point::Zero());
  CHECK(WrongIndex().visible_from_any(viewpoints).error().code == ErrorCode::internal);
}

TEST_CASE("a plugin that breaks its contract is named, and nothing is committed") {
  const PointCloud map = map_with_a_gap();
  const auto memory = std::make_shared<test::Memory>();
  auto wrong_indices = plugins(memory, 1000);
  CHECK(build_region_maps(map, {}, wrong_indices, params())
            .error()
            .message.starts_with("the ground plugin broke its contract"));
  auto too_few_regions = plugins(memory, 0, 1e9, 2);
  CHECK(build_region_maps(map, {}, too_few_regions, params())
            .error()
            .message.starts_with(
                "the partitioner plugin broke its contract: no region owns map point"));
  auto failing_visibility = plugins(memory, 0, 12.0);
  const auto failed = build_region_maps(map, {}, failing_visibility, params());
  CHECK(to_string(failed.error()) == "error: too far east (while building region 'strip2')");
  CHECK_FALSE(memory->committed);
}
