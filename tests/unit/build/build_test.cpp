#include "vantage/build/build.hpp"

#include <doctest/doctest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <initializer_list>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "support/fakes.hpp"

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
  progress.erase(std::unique(progress.begin(), progress.end()), progress.end());
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
  CHECK(memory->maps[0].viewpoints.size() == 10);
  CHECK(report->regions[0].points == expected.size());
}

namespace {

/// Of the whole map it excerpts how many points it was prepared from and how many were seen.
class CountingMatcher final : public ScanMatcher {
 public:
  [[nodiscard]] Result<std::unique_ptr<MatchTarget>> prepare(
      PointsView map) const noexcept override {
    class Target final : public MatchTarget {
     public:
      explicit Target(std::size_t points) : points_(points) {}
      [[nodiscard]] Result<Alignment> align(PointsView, const Pose&) const noexcept override {
        return Alignment{};
      }
      [[nodiscard]] Result<ScanScore> score(PointsView, const Pose&) const noexcept override {
        return ScanScore{};
      }
      [[nodiscard]] std::size_t bytes() const noexcept override { return 1; }
      [[nodiscard]] std::size_t elements() const noexcept override { return points_; }
      [[nodiscard]] Result<PreparedMap> excerpt(PointsView seen) const noexcept override {
        return PreparedMap{
            .bytes = {static_cast<std::byte>(points_), static_cast<std::byte>(seen.size())},
            .elements = seen.size()};
      }

     private:
      std::size_t points_;
    };
    return std::make_unique<Target>(map.size());
  }
};

}  // namespace

TEST_CASE("a bundle keeps points, what the matcher makes of the whole map around them, or both") {
  const PointCloud map = map_with_a_gap();
  const auto built = [&](StoredContent content) {
    auto memory = std::make_shared<test::Memory>();
    auto p = plugins(memory);
    p.matcher = test::in_process<CountingMatcher, ScanMatcher>();
    auto with = params();
    with.content = content;
    const auto report = build_region_maps(map, {}, p, with);
    REQUIRE_MESSAGE(report, to_string(report.error()));
    CHECK(report->regions[0].points > 0);  // as seen, stored or not
    return memory;
  };
  const auto points = built(StoredContent::points), prepared = built(StoredContent::prepared),
             both = built(StoredContent::both);
  const std::size_t seen = points->maps[0].points.size();
  REQUIRE(seen > 0);
  CHECK(points->maps[0].prepared.bytes.empty());
  CHECK(prepared->maps[0].points.empty());
  CHECK(prepared->maps[0].viewpoints == points->maps[0].viewpoints);
  const PreparedMap expected{
      .bytes = {static_cast<std::byte>(map.size()), static_cast<std::byte>(seen)},
      .elements = seen};
  CHECK(prepared->maps[0].prepared == expected);
  CHECK(prepared->maps[1].prepared.bytes.empty());  // nothing is seen there
  CHECK(both->maps[0].points == points->maps[0].points);
  CHECK(both->maps[0].prepared == expected);
}

TEST_CASE("prepared content of a matcher that has none is an error, and nothing is stored") {
  const auto memory = std::make_shared<test::Memory>();
  auto p = plugins(memory);
  p.matcher = test::in_process<test::TruthMatcher, ScanMatcher>(std::make_shared<test::Truth>());
  auto with = params();
  with.content = StoredContent::prepared;
  const auto report = build_region_maps(map_with_a_gap(), {}, p, with);
  REQUIRE_FALSE(report);
  CHECK(report.error().code == ErrorCode::unsupported);
  CHECK_FALSE(memory->begun);
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
        "no ground was found in the map, so no viewpoint can be placed; "
        "viewpoints.source = \"trajectory\" needs no ground");
  CHECK_FALSE(memory->begun);
}

namespace {

BuildParams along_trajectory() {
  BuildParams p = params();
  p.viewpoints = {.source = ViewpointSource::trajectory, .voxel_size = 2.0};
  return p;
}

/// To the east at y = 2, through the strips of the map with a gap and 10 m beyond.
PointCloud drive_through() {
  PointCloud path;
  for (int k = 5; k < 400; ++k) path.push_back({0.1 * k, 2.5, 1.5});
  return path;
}

}  // namespace

TEST_CASE("viewpoints along a trajectory need neither ground nor a filter for it") {
  PointCloud map = map_with_a_gap();
  std::erase_if(map, [](const Point& p) { return p.z() < 0.1; });
  const auto memory = std::make_shared<test::Memory>();
  auto p = plugins(memory);
  p.ground = nullptr;
  const auto report = build_region_maps(map, drive_through(), p, along_trajectory());
  REQUIRE_MESSAGE(report, to_string(report.error()));
  CHECK(report->ground_points == 0);
  CHECK(report->viewpoints == 15);  // one in 2 m
  CHECK(report->places_outside == 100);
  CHECK(report->regions_without_viewpoints == 0);
  for (std::uint32_t r = 0; r < 3; ++r) {
    const PointCloud path = drive_through();
    CHECK(memory->maps[r].viewpoints.size() == 5);
    PointCloud expected;
    for (const Point& point : map) {
      const auto near = [&](const Point& q) { return (point - q).norm() <= 6.0; };
      if (std::any_of(memory->maps[r].viewpoints.begin(), memory->maps[r].viewpoints.end(), near)) {
        expected.push_back(point);
      }
    }
    CHECK(memory->maps[r].points == expected);
    for (const Point& q : memory->maps[r].viewpoints) {
      CHECK(std::find(path.begin(), path.end(), q) != path.end());
    }
  }
}

TEST_CASE("a region that the trajectory does not enter has an empty map and is counted") {
  const PointCloud map = map_with_a_gap();
  const auto memory = std::make_shared<test::Memory>();
  auto p = plugins(memory);
  const auto report =
      build_region_maps(map, PointCloud{{5, 2, 1}, {25, 2, 1}}, p, along_trajectory());
  REQUIRE_MESSAGE(report, to_string(report.error()));
  CHECK(report->viewpoints == 2);
  CHECK(report->regions_without_viewpoints == 1);
  CHECK(memory->maps[1].points.empty());
}

TEST_CASE("a region whose viewpoints see no point is counted; if all are so, nothing is stored") {
  const PointCloud map = map_with_a_gap();
  const auto memory = std::make_shared<test::Memory>();
  auto p = plugins(memory);
  const auto report =
      build_region_maps(map, PointCloud{{5, 2, 1}, {25, 2, 100}}, p, along_trajectory());
  REQUIRE_MESSAGE(report, to_string(report.error()));
  CHECK(report->regions_that_see_nothing == 1);
  CHECK(report->regions_without_viewpoints == 1);
  CHECK(memory->maps[2].points.empty());

  const auto none = std::make_shared<test::Memory>();
  auto q = plugins(none);
  BuildParams high = params();
  high.viewpoints.sensor_height = 180.0;
  const auto blind = build_region_maps(map, {}, q, high);
  REQUIRE_FALSE(blind);
  CHECK(blind.error().message ==
        "no viewpoint sees a point of the map: look at viewpoints.sensor_height and "
        "visibility.max_range");
  CHECK_FALSE(none->committed);
}

TEST_CASE("a trajectory that viewpoints cannot come from is refused before anything is stored") {
  const PointCloud map = map_with_a_gap();
  const auto memory = std::make_shared<test::Memory>();
  auto p = plugins(memory);
  CHECK(build_region_maps(map, {}, p, along_trajectory()).error().message ==
        "viewpoints.source is \"trajectory\", but there is no trajectory");
  CHECK(build_region_maps(map, PointCloud{{500, 0, 0}}, p, along_trajectory()).error().message ==
        "the whole trajectory lies outside all regions, so no viewpoint can be placed: is the "
        "trajectory in the frame of the map?");
  CHECK_FALSE(memory->begun);
}

TEST_CASE("ground that is not reachable has no viewpoint, whatever regions it is cut into") {
  const PointCloud map = map_with_a_gap();  // the gap is 10 m wide
  for (const bool east : {false, true}) {
    const auto memory = std::make_shared<test::Memory>();
    auto p = plugins(memory);
    BuildParams with = params();
    with.viewpoints.reachable = true;
    with.viewpoints.height_offsets = {0.0, 0.5};
    const auto report = build_region_maps(map, PointCloud{{east ? 22.0 : 2.0, 2.0, 1.0}}, p, with);
    REQUIRE_MESSAGE(report, to_string(report.error()));
    CHECK(report->ground_points == 80);
    CHECK(report->unreachable_voxels == 10);  // whatever stands over a voxel
    CHECK(report->viewpoints == 20);
    CHECK(memory->maps[east ? 0 : 2].viewpoints.empty());
    CHECK(memory->maps[east ? 2 : 0].viewpoints.size() == 20);
  }
}

namespace {

/// Asks about every strip before it cuts, and keeps the answers.
class AsksFirst final : public Partitioner {
 public:
  struct Answers {
    PointCloud viewpoints;
    std::vector<std::uint64_t> points, points_if_three_are_enough;
    std::vector<IndexList> visible;
    Result<Bounds3> ground;
  };
  explicit AsksFirst(std::shared_ptr<Answers> answers) : answers_(std::move(answers)) {}
  [[nodiscard]] Result<Partition> partition(const MapPasses& map, PointsView trajectory,
                                            const MapSurvey& survey) const noexcept override {
    VANTAGE_TRY(auto strips, test::Strips(3).partition(map, trajectory, survey));
    for (const Region& region : strips.regions()) {
      VANTAGE_TRY(answers_->points.emplace_back(), survey.observable_points(region, 10000));
      VANTAGE_TRY(answers_->points_if_three_are_enough.emplace_back(),
                  survey.observable_points(region, 3));
    }
    VANTAGE_TRY(answers_->viewpoints, survey.viewpoints());
    answers_->ground = survey.ground_bounds();
    for (const Point& q : answers_->viewpoints) {
      VANTAGE_TRY(answers_->visible.emplace_back(), survey.visible(q));
    }
    return strips;
  }

 private:
  std::shared_ptr<Answers> answers_;
};

}  // namespace

TEST_CASE("what the survey tells a partitioner is what the bundle then holds") {
  const PointCloud map = map_with_a_gap();
  std::vector<BuildParams> cases{params(VisibilityScope::map), params(VisibilityScope::region),
                                 along_trajectory(), params()};
  cases.back().viewpoints.reachable = true;
  PointCloud drive = drive_through();
  std::erase_if(drive, [](const Point& p) { return p.x() >= 30.0; });  // in no strip
  for (const BuildParams& with : cases) {
    const auto memory = std::make_shared<test::Memory>();
    const auto answers = std::make_shared<AsksFirst::Answers>();
    auto p = plugins(memory);
    p.partitioner = test::in_process<AsksFirst, Partitioner>(answers);
    const auto report = build_region_maps(map, drive, p, with);
    REQUIRE_MESSAGE(report, to_string(report.error()));
    REQUIRE(answers->points.size() == 3);
    for (std::uint32_t r = 0; r < 3; ++r) {
      CHECK(answers->points[r] == memory->maps[r].points.size());
      const bool few = memory->maps[r].points.size() <= 3;
      CHECK((answers->points_if_three_are_enough[r] > 3) == !few);
      CHECK(answers->points_if_three_are_enough[r] <= answers->points[r]);
    }
    if (with.viewpoints.source == ViewpointSource::trajectory) {
      REQUIRE_FALSE(answers->ground.has_value());
      CHECK(answers->ground.error().code == ErrorCode::unsupported);
    } else {
      REQUIRE_MESSAGE(answers->ground, to_string(answers->ground.error()));
      CHECK(answers->ground->min == Point(0.5, 0.5, 0.0));
      CHECK(answers->ground->max == Point(29.5, 3.5, 0.0));
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

TEST_CASE("statistical outliers are kept from the ground filter, and stay in the map") {
  PointCloud map = map_with_a_gap();
  const Point stray(5.0, 2.0, -4.0);
  map.insert(map.begin() + 3, stray);
  const auto built = [&](const std::optional<OutlierParams>& outliers) {
    const auto memory = std::make_shared<test::Memory>();
    auto p = plugins(memory);
    BuildParams with = params();
    with.outliers = outliers;
    const auto report = build_region_maps(map, {}, p, with);
    REQUIRE_MESSAGE(report, to_string(report.error()));
    CHECK(report->map_points == map.size());
    CHECK(std::ranges::count(memory->maps[0].points, stray) == 1);
    return *report;
  };
  CHECK(built({}).ground_points == 81);
  const BuildReport without = built(OutlierParams{.neighbours = 4, .ratio = 2.0});
  CHECK(without.ground_points == 80);
  CHECK(without.viewpoints == 20);

  const auto memory = std::make_shared<test::Memory>();
  auto p = plugins(memory);
  BuildParams with = params();
  with.outliers = OutlierParams{.neighbours = 4, .ratio = -1000.0};  // all points are outliers
  const auto report = build_region_maps(map, {}, p, with);
  REQUIRE(!report);
  CHECK(report.error().message.find("no ground was found") == 0);
}

namespace {

/// SeesNear that keeps what it was asked.
class Asked final : public VisibilityOperator {
 public:
  struct Log {
    std::mutex mutex;
    std::vector<const Point*> prepared;  // the first point of each map
    PointCloud viewpoints;
  };
  explicit Asked(std::shared_ptr<Log> log) : log_(std::move(log)) {}
  [[nodiscard]] Result<std::unique_ptr<VisibilityScene>> prepare(
      PointsView map, const VisibilityLimits& limits) const noexcept override {
    class Scene final : public SceneByViewpoint {
     public:
      Scene(PointsView map, std::unique_ptr<VisibilityScene> sees, std::shared_ptr<Log> log)
          : SceneByViewpoint(map.size()), sees_(std::move(sees)), log_(std::move(log)) {}
      [[nodiscard]] Result<IndexList> visible(const Point& viewpoint) const noexcept override {
        const std::scoped_lock lock(log_->mutex);
        log_->viewpoints.push_back(viewpoint);
        return sees_->visible(viewpoint);
      }

     private:
      std::unique_ptr<VisibilityScene> sees_;
      std::shared_ptr<Log> log_;
    };
    VANTAGE_TRY(auto sees, test::SeesNear().prepare(map, limits));
    const std::scoped_lock lock(log_->mutex);
    log_->prepared.push_back(map.data());
    return std::make_unique<Scene>(map, std::move(sees), log_);
  }

 private:
  std::shared_ptr<Log> log_;
};

/// A floor of 10 x 100 points a metre apart, then 10 x 10.
PointCloud long_floor() {
  PointCloud map;
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < (y < 10 ? 20 : 10); ++x) map.push_back({x + 0.5, y - 50 + 0.5, 0.0});
  }
  return map;
}

}  // namespace

TEST_CASE("regions share no work: one scene, no viewpoint twice, and the cost is counted") {
  const PointCloud map = map_with_a_gap();
  for (const VisibilityScope scope : {VisibilityScope::map, VisibilityScope::region}) {
    const auto log = std::make_shared<Asked::Log>();
    auto p = plugins(std::make_shared<test::Memory>());
    p.visibility = test::in_process<Asked, VisibilityOperator>(log);
    const auto report = build_region_maps(map, {}, p, params(scope));
    REQUIRE_MESSAGE(report, to_string(report.error()));
    PointCloud& asked = log->viewpoints;
    CHECK(asked.size() == report->viewpoints);
    const auto before = [](const Point& a, const Point& b) {
      return std::pair(a.x(), a.y()) < std::pair(b.x(), b.y());
    };
    std::sort(asked.begin(), asked.end(), before);
    CHECK(std::adjacent_find(asked.begin(), asked.end()) == asked.end());
    const bool whole = scope == VisibilityScope::map;
    CHECK(log->prepared.size() == (whole ? 1 : 2));  // the middle strip has no viewpoint
    // 10 viewpoints in each of two strips, which own 40 and 44 points.
    CHECK(report->points_times_viewpoints == (whole ? 20.0 * 85.0 : 10.0 * 40.0 + 10.0 * 44.0));
    CHECK(report->core_seconds_visibility > 0.0);
    CHECK(report->core_seconds_a_viewpoint_and_million_points() ==
          doctest::Approx(1e6 * report->core_seconds_visibility / report->points_times_viewpoints));
  }
  CHECK(BuildReport{}.core_seconds_a_viewpoint_and_million_points() == 0.0);
}

TEST_CASE("a region that owns the whole map is decided on the map itself, not on a copy") {
  const PointCloud map = long_floor();
  const auto log = std::make_shared<Asked::Log>();
  auto p = plugins(std::make_shared<test::Memory>());
  p.partitioner = test::in_process<test::Strips, Partitioner>(2);
  p.visibility = test::in_process<Asked, VisibilityOperator>(log);
  REQUIRE(build_region_maps(map, {}, p, params(VisibilityScope::region)));
  CHECK(std::count(log->prepared.begin(), log->prepared.end(), map.data()) == 0);
  log->prepared.clear();
  const PointCloud one_strip(map.end() - 10, map.end());
  REQUIRE(build_region_maps(one_strip, {}, p, params(VisibilityScope::region)));
  CHECK(log->prepared == std::vector<const Point*>{one_strip.data()});
}

namespace {

/// SeesNear that is asked in its own way about all viewpoints of a region, and counts how often.
class AskedAtOnce final : public VisibilityOperator {
 public:
  using Report = std::function<void(std::size_t viewpoints, const VisibilityProgress&)>;
  /// @param report  what it says of its viewpoints, once it has seen what they see
  AskedAtOnce(std::shared_ptr<std::atomic<int>> calls, Report report)
      : calls_(std::move(calls)), report_(std::move(report)) {}
  [[nodiscard]] Result<std::unique_ptr<VisibilityScene>> prepare(
      PointsView map, const VisibilityLimits& limits) const noexcept override {
    class Scene final : public SceneByViewpoint {
     public:
      Scene(PointsView map, std::unique_ptr<VisibilityScene> sees, const AskedAtOnce& asked)
          : SceneByViewpoint(map.size()), sees_(std::move(sees)), asked_(asked) {}
      [[nodiscard]] Result<IndexList> visible(const Point& viewpoint) const noexcept override {
        return sees_->visible(viewpoint);
      }
      [[nodiscard]] Result<IndexList> visible_from_any(
          std::span<const Point> viewpoints,
          const VisibilityProgress* progress) const noexcept override {
        ++*asked_.calls_;
        auto seen = sees_->visible_from_any(viewpoints, nullptr);
        if (progress != nullptr) asked_.report_(viewpoints.size(), *progress);
        return seen;
      }

     private:
      std::unique_ptr<VisibilityScene> sees_;
      const AskedAtOnce& asked_;
    };
    VANTAGE_TRY(auto sees, test::SeesNear().prepare(map, limits));
    return std::make_unique<Scene>(map, std::move(sees), *this);
  }

 private:
  std::shared_ptr<std::atomic<int>> calls_;
  Report report_;
};

BuildParams one_metre() {
  BuildParams p = params();
  p.viewpoints.voxel_size = 1.0;
  p.max_range = 3.0;
  return p;
}

/// What a build over the long floor in two strips says: 1000 viewpoints in one, 100 in the other.
std::vector<BuildProgress> said_over(const AskedAtOnce::Report& report) {
  auto p = plugins(std::make_shared<test::Memory>(), 0, 1e9, 2);
  p.visibility = test::in_process<AskedAtOnce, VisibilityOperator>(
      std::make_shared<std::atomic<int>>(0), report);
  std::vector<BuildProgress> said;
  const auto built = build_region_maps(long_floor(), {}, p, one_metre(),
                                       [&](const BuildProgress& now) { said.push_back(now); });
  REQUIRE_MESSAGE(built, to_string(built.error()));
  return said;
}

/// From nothing to 2 regions of 1100 viewpoints, exactly, and never back.
void check_counts(const std::vector<BuildProgress>& said) {
  REQUIRE(said.size() >= 3);
  CHECK(said.front().viewpoints_done == 0);
  CHECK(said.front().regions_done == 0);
  CHECK(said.back().viewpoints_done == 1100);
  CHECK(said.back().regions_done == 2);
  for (std::size_t i = 0; i < said.size(); ++i) {
    CHECK(said[i].viewpoints == 1100);
    CHECK(said[i].regions == 2);
    CHECK(said[i].viewpoints_done <= 1100);
    if (i == 0) continue;
    CHECK(said[i].viewpoints_done >= said[i - 1].viewpoints_done);
    CHECK(said[i].regions_done >= said[i - 1].regions_done);
  }
}

}  // namespace

TEST_CASE("a region is one call of visible_from_any, however many viewpoints it has") {
  const auto calls = std::make_shared<std::atomic<int>>(0);
  auto p = plugins(std::make_shared<test::Memory>(), 0, 1e9, 2);
  p.visibility = test::in_process<AskedAtOnce, VisibilityOperator>(
      calls, [](std::size_t, const VisibilityProgress&) {});
  const auto report = build_region_maps(long_floor(), {}, p, one_metre());
  REQUIRE_MESSAGE(report, to_string(report.error()));
  CHECK(report->viewpoints == 1100);
  CHECK(*calls == 2);
}

TEST_CASE("progress moves within a region of many viewpoints, and the map is none the worse") {
  const PointCloud map = long_floor();
  for (const std::size_t threads : {1U, 2U, 4U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const auto memory = std::make_shared<test::Memory>();
    auto p = plugins(memory, 0, 1e9, 2);
    std::vector<BuildProgress> said;
    const auto start = std::chrono::steady_clock::now();
    const auto report = build_region_maps(map, {}, p, one_metre(),
                                          [&](const BuildProgress& now) { said.push_back(now); });
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    REQUIRE_MESSAGE(report, to_string(report.error()));
    check_counts(said);
    const auto within = std::count_if(said.begin(), said.end(), [](const BuildProgress& now) {
      return now.regions_done == 0 && now.viewpoints_done > 0;
    });
    CHECK(within >= 10);
    // The start, two regions, a hundred hundredths, ten a second.
    CHECK(static_cast<double>(said.size()) <= 103.0 + 10.0 * took.count());

    PointCloud expected;
    for (const Point& point : map) {
      const double dx = std::max(0.0, point.x() - 9.5);  // of the last viewpoint of strip 0
      if (dx * dx + 1.0 <= 9.0) expected.push_back(point);
    }
    CHECK(memory->maps[0].points == expected);
  }
}

TEST_CASE("the counts are exact whatever a visibility plugin reports") {
  const auto nothing = [](std::size_t, const VisibilityProgress&) {};
  const auto at_once = [](std::size_t n, const VisibilityProgress& p) { p.advanced(n); };
  const auto half = [](std::size_t n, const VisibilityProgress& p) { p.advanced(n / 2); };
  const auto too_much = [](std::size_t n, const VisibilityProgress& p) {
    for (std::size_t i = 0; i < n; ++i) p.advanced(i);
    p.advanced(std::numeric_limits<std::size_t>::max());
  };
  const auto one_by_one = [](std::size_t n, const VisibilityProgress& p) {
    for (std::size_t i = 0; i < n; ++i) p.advanced(1);
  };
  for (const AskedAtOnce::Report& report :
       std::initializer_list<AskedAtOnce::Report>{nothing, at_once, half, too_much, one_by_one}) {
    check_counts(said_over(report));
  }
}

namespace {

/// Four threads report a quarter of the viewpoints each.
void report_from_threads(std::size_t viewpoints, const VisibilityProgress& progress,
                         const std::function<void()>& thread_done) {
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (std::size_t i = 0; i < viewpoints / 4; ++i) progress.advanced(1);
      thread_done();
    });
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace

TEST_CASE("progress is told from one thread at a time") {
  std::atomic<int> inside{0}, most{0};
  auto p = plugins(std::make_shared<test::Memory>(), 0, 1e9, 2);
  p.visibility = test::in_process<AskedAtOnce, VisibilityOperator>(
      std::make_shared<std::atomic<int>>(0), [](std::size_t n, const VisibilityProgress& progress) {
        report_from_threads(n, progress, [] {});
      });
  std::vector<BuildProgress> said;
  const auto report =
      build_region_maps(long_floor(), {}, p, one_metre(), [&](const BuildProgress& now) {
        most = std::max<int>(most, ++inside);
        said.push_back(now);
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        --inside;
      });
  REQUIRE_MESSAGE(report, to_string(report.error()));
  CHECK(most == 1);
  check_counts(said);
}

TEST_CASE("a slow listener keeps nobody from going on") {
  std::mutex mutex;
  std::condition_variable changed;
  int threads_done = 0;
  bool listening = false, went_on = true;
  auto p = plugins(std::make_shared<test::Memory>(), 0, 1e9, 1);
  p.visibility = test::in_process<AskedAtOnce, VisibilityOperator>(
      std::make_shared<std::atomic<int>>(0),
      [&](std::size_t n, const VisibilityProgress& progress) {
        report_from_threads(n, progress, [&] {
          const std::scoped_lock lock(mutex);
          ++threads_done;
          changed.notify_all();
        });
      });
  PointCloud one_strip = long_floor();
  std::erase_if(one_strip, [](const Point& point) { return point.x() > 10.0; });
  const auto report =
      build_region_maps(one_strip, {}, p, one_metre(), [&](const BuildProgress& now) {
        if (now.viewpoints_done == 0 || listening) return;
        listening = true;
        std::unique_lock lock(mutex);
        went_on =
            changed.wait_for(lock, std::chrono::seconds(20), [&] { return threads_done == 3; });
      });
  REQUIRE_MESSAGE(report, to_string(report.error()));
  CHECK(listening);
  CHECK(went_on);
}

TEST_CASE("what a listener throws comes out of the build, from within a region too") {
  for (const std::size_t from : {std::size_t{0}, std::size_t{50}, std::size_t{1100}}) {
    const auto memory = std::make_shared<test::Memory>();
    auto p = plugins(memory, 0, 1e9, 2);
    CHECK_THROWS_WITH_AS(
        static_cast<void>(build_region_maps(long_floor(), {}, p, one_metre(),
                                            [&](const BuildProgress& now) {
                                              if (now.viewpoints_done >= from) {
                                                throw std::runtime_error("the disk is full");
                                              }
                                            })),
        "the disk is full", std::runtime_error);
    CHECK_FALSE(memory->committed);
  }
}

TEST_CASE("more points than an index can count are refused before any is looked at") {
  const Point only = Point::Zero();
  const PointsView too_many(&only, std::size_t{0xffff'ffff});  // never read
  CHECK(check_points(too_many, "the map").error().message ==
        "the map has 4294967295 points, more than the 4294967295 that can be indexed");
}

TEST_CASE("a visibility plugin's wrong index is an error also where the kit joins viewpoints") {
  class WrongIndex final : public SceneByViewpoint {
   public:
    WrongIndex() : SceneByViewpoint(10) {}
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
  CHECK(
      build_region_maps(map, {}, too_few_regions, params())
          .error()
          .message.starts_with(
              "the partitioner plugin broke its contract: no region owns 44 of the 85 map points"));
  auto failing_visibility = plugins(memory, 0, 12.0);
  const auto failed = build_region_maps(map, {}, failing_visibility, params());
  CHECK(to_string(failed.error()) == "error: too far east (while building region 'strip2')");
  CHECK_FALSE(memory->committed);
}

namespace {

/// What is stored of the first strip of the map with a gap.
struct Built {
  RegionMap map;
  RegionSummary summary;
  std::uint64_t seen = 0;
};

Built first_strip(const BuildParams& with) {
  const auto memory = std::make_shared<test::Memory>();
  auto p = plugins(memory);
  p.matcher = test::in_process<CountingMatcher, ScanMatcher>();
  const auto report = build_region_maps(map_with_a_gap(), {}, p, with);
  REQUIRE_MESSAGE(report, to_string(report.error()));
  return {memory->maps[0], report->regions[0], report->seen[0]};
}

/// By hand: how many of the first strip's viewpoints see a point.
std::uint32_t views_of(const Point& point) {
  std::uint32_t views = 0;
  for (int x = 1; x < 10; x += 2) {
    for (int y = 1; y < 4; y += 2) views += (point - Point(x, y, 1.0)).norm() <= 6.0 ? 1 : 0;
  }
  return views;
}

}  // namespace

TEST_CASE("min_views keeps the points that so many viewpoints see, or all where there are fewer") {
  auto with = params();
  const Built all = first_strip(with);
  CHECK(all.seen == all.map.points.size());
  for (const std::uint32_t min_views : {2U, 5U, 10U, 1000U}) {
    CAPTURE(min_views);
    with.min_views = min_views;
    const Built built = first_strip(with);
    PointCloud expected;
    for (const Point& point : all.map.points) {
      if (views_of(point) >= std::min(min_views, 10U)) expected.push_back(point);  // 10 viewpoints
    }
    CHECK_FALSE(expected.empty());
    CHECK(built.map.points == expected);
    CHECK(built.map.views.empty());
    CHECK(built.summary.points == expected.size());
    CHECK(built.seen == all.seen);
  }
}

TEST_CASE("views are stored beside their points, whatever is left out") {
  for (const VisibilityScope scope : {VisibilityScope::map, VisibilityScope::region}) {
    auto with = params(scope);
    with.views = true;
    for (const std::uint32_t min_views : {1U, 3U}) {
      with.min_views = min_views;
      for (const bool thin : {false, true}) {
        with.thinning.reset();
        if (thin) with.thinning = ThinningParams{.voxel_size = 3.0, .budget = {}};
        const Built built = first_strip(with);
        REQUIRE_FALSE(built.map.points.empty());
        REQUIRE(built.map.views.size() == built.map.points.size());
        for (std::size_t i = 0; i < built.map.points.size(); ++i) {
          CHECK(built.map.views[i] == views_of(built.map.points[i]));
          CHECK(built.map.views[i] >= min_views);
        }
      }
    }
  }
}

TEST_CASE("thinning takes of what min_views has kept, and the matcher still gets all of that") {
  auto with = params();
  with.min_views = 3;
  const Built kept = first_strip(with);
  with.thinning = ThinningParams{.voxel_size = {}, .budget = 20};
  with.content = StoredContent::both;
  const Built built = first_strip(with);
  CHECK(built.seen == kept.seen);
  CHECK(built.summary.points == built.map.points.size());
  CHECK(built.map.points.size() <= 20);
  CHECK(built.map.points.size() > 10);
  CHECK(built.map.prepared.elements == kept.map.points.size());
  IndexList all(kept.map.points.size());
  for (std::uint32_t k = 0; k < all.size(); ++k) all[k] = k;
  CHECK(built.map.points == select(kept.map.points, thinned(kept.map.points, all, *with.thinning)));
}

TEST_CASE("the survey counts what min_views keeps") {
  const PointCloud map = map_with_a_gap();
  for (const VisibilityScope scope : {VisibilityScope::map, VisibilityScope::region}) {
    for (const std::uint32_t min_views : {2U, 7U}) {
      const auto memory = std::make_shared<test::Memory>();
      const auto answers = std::make_shared<AsksFirst::Answers>();
      auto p = plugins(memory);
      p.partitioner = test::in_process<AsksFirst, Partitioner>(answers);
      auto with = params(scope);
      with.min_views = min_views;
      REQUIRE(build_region_maps(map, {}, p, with));
      for (std::uint32_t r = 0; r < 3; ++r) {
        CHECK(answers->points[r] == memory->maps[r].points.size());
        CHECK(answers->points_if_three_are_enough[r] <= answers->points[r]);
      }
    }
  }
}

TEST_CASE("a visibility plugin that counts more viewpoints than there are is named") {
  class CountsTooMany final : public VisibilityOperator {
   public:
    [[nodiscard]] Result<std::unique_ptr<VisibilityScene>> prepare(
        PointsView map, const VisibilityLimits&) const noexcept override {
      class Scene final : public SceneByViewpoint {
       public:
        explicit Scene(std::size_t points) : SceneByViewpoint(points) {}
        [[nodiscard]] Result<IndexList> visible(const Point&) const noexcept override {
          return IndexList{0};
        }
        [[nodiscard]] Result<ViewCounts> view_counts(
            std::span<const Point> viewpoints, const VisibilityProgress*) const noexcept override {
          return ViewCounts{.points = {0},
                            .views = {static_cast<std::uint32_t>(viewpoints.size() + 1)}};
        }
      };
      return std::make_unique<Scene>(map.size());
    }
  };
  auto p = plugins(std::make_shared<test::Memory>());
  p.visibility = test::in_process<CountsTooMany, VisibilityOperator>();
  auto with = params();
  with.min_views = 2;
  CHECK(build_region_maps(map_with_a_gap(), {}, p, with)
            .error()
            .message.starts_with("the visibility plugin broke its contract: every point"));
}

TEST_CASE("adaptive spacing: skipped viewpoints are counted and kept, for any number of threads") {
  PointCloud map = long_floor();
  std::vector<PointCloud> first_maps;
  for (const std::size_t threads : {1U, 2U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const auto all = std::make_shared<test::Memory>(), few = std::make_shared<test::Memory>();
    const auto log = std::make_shared<Asked::Log>();
    auto p = plugins(all, 0, 1e9, 2);
    auto q = plugins(few, 0, 1e9, 2);
    q.visibility = test::in_process<Asked, VisibilityOperator>(log);
    BuildParams with = one_metre();
    with.max_range = 12.0;  // neighbours see nearly the same
    const auto expected = build_region_maps(map, {}, p, with);
    with.viewpoints.min_gain = 0.3;
    std::vector<BuildProgress> said;
    const auto report =
        build_region_maps(map, {}, q, with, [&](const BuildProgress& now) { said.push_back(now); });
    REQUIRE(expected);
    REQUIRE_MESSAGE(report, to_string(report.error()));
    CHECK(expected->skipped_viewpoints == 0);
    CHECK(report->viewpoints == expected->viewpoints);
    CHECK(report->skipped_viewpoints > report->viewpoints / 2);
    CHECK(log->viewpoints.size() == report->viewpoints - report->skipped_viewpoints);
    CHECK(report->points_times_viewpoints ==
          static_cast<double>(log->viewpoints.size()) * static_cast<double>(map.size()));
    CHECK(said.back().viewpoints_done == report->viewpoints);
    for (std::uint32_t r = 0; r < 2; ++r) {
      CHECK(few->maps[r].viewpoints == all->maps[r].viewpoints);
      CHECK(few->maps[r].points.size() > 0.9 * static_cast<double>(all->maps[r].points.size()));
    }
    first_maps.push_back(few->maps[0].points);
  }
  CHECK(first_maps[0] == first_maps[1]);
}

TEST_CASE(
    "adaptive spacing: the survey asks the viewpoints that the build asks, and counts alike") {
  const PointCloud map = long_floor();
  for (const VisibilityScope scope : {VisibilityScope::map, VisibilityScope::region}) {
    const auto memory = std::make_shared<test::Memory>();
    const auto answers = std::make_shared<AsksFirst::Answers>();
    auto p = plugins(memory);
    p.partitioner = test::in_process<AsksFirst, Partitioner>(answers);
    BuildParams with = one_metre();
    with.max_range = 12.0;
    with.scope = scope;
    with.viewpoints.min_gain = 0.9;
    const auto report = build_region_maps(map, {}, p, with);
    REQUIRE_MESSAGE(report, to_string(report.error()));
    CHECK(report->skipped_viewpoints > report->viewpoints / 2);
    for (std::uint32_t r = 0; r < 3; ++r) {
      const std::size_t held = memory->maps[r].points.size();
      CHECK(answers->points[r] == held);
      CHECK((answers->points_if_three_are_enough[r] > 3) == (held > 3));
    }
  }
}

TEST_CASE("adaptive spacing keeps to P_ij with scope \"region\"") {
  const PointCloud map = long_floor();
  const auto memory = std::make_shared<test::Memory>();
  auto p = plugins(memory, 0, 1e9, 2);
  BuildParams with = one_metre();
  with.max_range = 12.0;
  with.scope = VisibilityScope::region;
  with.viewpoints.min_gain = 0.3;
  const auto report = build_region_maps(map, {}, p, with);
  REQUIRE_MESSAGE(report, to_string(report.error()));
  CHECK(report->skipped_viewpoints > 0);
  REQUIRE_FALSE(memory->maps[1].points.empty());
  for (const Point& point : memory->maps[1].points) CHECK(point.x() >= 10.0);
}
