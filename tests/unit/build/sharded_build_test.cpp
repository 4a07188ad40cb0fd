// A build in parts with plugins that a test can follow: when it is refused, and what it asks for.
#include "vantage/build/sharded_build.hpp"
#include "vantage/kit/map_parts.hpp"

#include <doctest/doctest.h>

#include <fcntl.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <numeric>
#include <set>

#include "build/plan.hpp"
#include "support/fakes.hpp"
#include "support/real_data.hpp"
#include "vantage/kit/file_system.hpp"

namespace vantage {
namespace {

/// Points in memory, given part by part.
class PartsInMemory final : public MapParts {
 public:
  explicit PartsInMemory(PointCloud points) : points_(std::move(points)) {}
  [[nodiscard]] Bounds3 bounds() const noexcept override { return bounds_of(points_); }
  [[nodiscard]] std::uint64_t points() const noexcept override { return points_.size(); }
  [[nodiscard]] Result<void> pass(MapVisitor& visitor) const noexcept override {
    return visitor.see(points_);
  }
  [[nodiscard]] std::uint64_t points_in(const Bounds2& area) const override {
    return static_cast<std::uint64_t>(
        std::ranges::count_if(points_, [&](const Point& p) { return area.contains(p.head<2>()); }));
  }
  [[nodiscard]] Result<MapPart> read(const Bounds2& area) const override {
    most_read = std::max(most_read, points_in(area));
    PointCloud inside;
    std::vector<MapPart::Run> runs;
    for (std::size_t k = 0; k < points_.size(); ++k) {
      if (!area.contains(points_[k].head<2>())) continue;
      runs.push_back({k, inside.size()});
      inside.push_back(points_[k]);
    }
    return MapPart(std::move(inside), std::move(runs));
  }

  mutable std::uint64_t most_read = 0;  ///< points, by one call

 private:
  PointCloud points_;
};

constexpr int kStrips = 20;

/// Counts how often it is asked.
class CountedGround final : public GroundFilter {
 public:
  explicit CountedGround(int& calls) : calls_(calls) {}
  [[nodiscard]] Result<IndexList> ground(PointsView cloud) const noexcept override {
    ++calls_;
    return test::FlatGround().ground(cloud);
  }
  [[nodiscard]] double reach() const noexcept override { return 0.0; }

 private:
  int& calls_;
};

class SeesWithin final : public VisibilityOperator {
 public:
  [[nodiscard]] Result<std::unique_ptr<VisibilityScene>> prepare(
      PointsView map, const VisibilityLimits& limits) const noexcept override {
    VANTAGE_CHECK(check_points(map, "the map"));  // as every operator of the project
    return test::SeesNear().prepare(map, limits);
  }
  [[nodiscard]] double reach(const VisibilityLimits& limits) const noexcept override {
    return limits.max_range;
  }
};

/// Of a build whose sensor reaches so far [m].
BuildParams params_to(double max_range) {
  BuildParams params;
  params.max_range = max_range;
  params.effective_config = "of a test";
  return params;
}

/// The plugins of strips. @param calls  counts the calls of the ground filter
BuildPlugins plugins_of_strips(
    int& calls, const std::shared_ptr<test::Memory>& memory = std::make_shared<test::Memory>()) {
  BuildPlugins plugins;
  plugins.partitioner = test::in_process<test::Strips, Partitioner>(kStrips);
  plugins.ground = test::in_process<CountedGround, GroundFilter>(calls);
  plugins.visibility = test::in_process<SeesWithin, VisibilityOperator>();
  plugins.store = test::in_process<test::MemoryStore, MapStore>(memory);
  return plugins;
}

/// 20 strips of level ground, one of them with a crowd above it.
PointCloud crowded_strips(int crowded) {
  PointCloud map;
  for (int x = 0; x < 10 * kStrips; ++x) {
    for (int y = 0; y < 20; ++y) {
      map.emplace_back(x + 0.5, y + 0.5, 0.0);
      for (int z = 1; z <= 6 && x / 10 == crowded; ++z) map.emplace_back(x + 0.5, y + 0.5, z);
    }
  }
  return map;
}

struct Question {
  Region region;
  std::uint64_t enough;
};

/// Asks what regions show before it cuts strips.
class Asks final : public Partitioner {
 public:
  using Answers = std::vector<Result<std::uint64_t>>;
  Asks(const std::vector<Question>& questions, Answers& answers)
      : questions_(questions), answers_(answers) {}
  [[nodiscard]] Result<Partition> partition(const MapPasses& map, PointsView trajectory,
                                            const MapSurvey& survey) const noexcept override {
    answers_.clear();
    for (const auto& [region, enough] : questions_) {
      answers_.push_back(survey.observable_points(region, enough));
    }
    return test::Strips(kStrips).partition(map, trajectory, survey);
  }

 private:
  const std::vector<Question>& questions_;
  Answers& answers_;
};

TEST_CASE("sharded build: blocks tell what a region shows, or that a part of it is enough") {
  const PartsInMemory map(crowded_strips(13));
  const PointCloud points = crowded_strips(13);
  const auto box = [](double from, double to) { return HalfOpenBox{{from, -5.0}, {to, 25.0}}; };
  constexpr std::uint64_t kAll = 1'000'000;
  // A block of 200 kB has fewer points than half of the map.
  const std::vector<Question> fitting{{{"a", box(20.0, 30.0), {}}, kAll},
                                      {{"b", box(23.0, 26.0), {}}, kAll},
                                      {{"crowded", box(130.0, 140.0), {}}, kAll},
                                      {{"above", box(131.0, 139.0), {2.5, 4.5}}, kAll},
                                      {{"empty", box(300.0, 310.0), {}}, kAll}};
  const std::vector<Question> large{{{"half", box(0.0, 100.0), {}}, 800},
                                    {{"half", box(0.0, 100.0), {}}, 1500},
                                    {{"half", box(0.0, 100.0), {}}, kAll}};
  const auto ask = [&](const std::vector<Question>& questions, BuildParams params, bool in_parts) {
    int calls = 0;
    Asks::Answers answers;
    BuildPlugins plugins = plugins_of_strips(calls);
    plugins.partitioner = test::in_process<Asks, Partitioner>(questions, answers);
    params.max_range = 4.0;
    params.effective_config = "of a test";
    const test::TemporaryFolder folder;
    if (in_parts) {
      const auto build =
          ShardedBuild::open(map, {}, plugins, params,
                             {.parts = folder.path() / "parts", .map_key = 1, .memory = 200'000});
      REQUIRE_MESSAGE(build, to_string(build.error()));
    } else {
      const auto built = build_region_maps(points, {}, plugins, params);
      REQUIRE_MESSAGE(built, to_string(built.error()));
    }
    return answers;
  };
  BuildParams views;
  views.min_views = 2;
  for (const BuildParams& params : {BuildParams(), views}) {
    const auto expected = ask(fitting, params, false), got = ask(fitting, params, true);
    REQUIRE(got.size() == fitting.size());
    for (std::size_t k = 0; k < got.size(); ++k) {
      CAPTURE(fitting[k].region.label);
      REQUIRE_MESSAGE(got[k], to_string(got[k].error()));
      CHECK(*got[k] == *expected[k]);
    }
    CHECK(*expected[0] > 200);
    CHECK(*expected[4] == 0);
  }
  CHECK(map.most_read * kBytesAGroundPoint <= 200'000);

  const auto expected = ask(large, {}, false), got = ask(large, {}, true);
  for (const std::size_t k : {0U, 1U}) {
    REQUIRE_MESSAGE(got[k], to_string(got[k].error()));
    CHECK(*got[k] > large[k].enough);
    CHECK(*got[k] <= *expected[2]);
  }
  REQUIRE_FALSE(got[2]);
  CHECK(got[2].error().code == ErrorCode::invalid_input);
  CHECK(got[2].error().message.find("'half'") != std::string::npos);
  // What at least two viewpoints of a block see may be seen by more of the region.
  for (const auto& refused : ask(large, views, true)) {
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == ErrorCode::invalid_input);
  }
  CHECK(map.most_read * kBytesAGroundPoint <= 200'000);

  const std::vector<Question> malformed{{{"none", box(30.0, 20.0), {}}, kAll}};
  CHECK(ask(malformed, {}, true)[0].error().code == ErrorCode::invalid_input);
}

TEST_CASE("sharded build: too little memory is told after the first block, of the largest region") {
  for (const int crowded : {0, 13, 19}) {
    CAPTURE(crowded);
    const PartsInMemory map(crowded_strips(crowded));
    int calls = 0;
    BuildPlugins plugins = plugins_of_strips(calls);
    BuildParams params = params_to(4.0);
    const test::TemporaryFolder folder;
    const auto open = [&](std::uint64_t memory, const char* parts) {
      calls = 0;
      return ShardedBuild::open(map, {}, plugins, params,
                                {.parts = folder.path() / parts, .map_key = 1, .memory = memory});
    };
    // Ground fits: the crowded strip has 1,400 points of 56 bytes. What it sees does not.
    const auto refused = open(100'000, "small");
    REQUIRE_FALSE(refused.has_value());
    CHECK(refused.error().code == ErrorCode::invalid_input);
    const std::string name = "region 'strip" + std::to_string(crowded) + "'";
    CHECK_MESSAGE(refused.error().message.find(name) != std::string::npos, refused.error().message);
    CHECK(calls == 1);

    const auto planned = open(1'000'000'000, "large");
    REQUIRE_MESSAGE(planned, to_string(planned.error()));
    const std::uint64_t least = planned->least_memory();
    CHECK(least > 100'000);
    CHECK(least < 88 * map.points() / 3);
    CHECK(open(least, "least").has_value());
    CHECK(calls > 1);
    CHECK_FALSE(open(least - 1, "less").has_value());
    CHECK(calls == 1);
    // A plan that is there may be read with any memory; the shard is then refused.
    auto again = open(least - 1, "large");
    REQUIRE(again);
    CHECK(again->build({1, 1}).error().message.find(name) != std::string::npos);
  }
}

TEST_CASE("sharded build: the store gets from blocks what it gets from a map in memory") {
  const PointCloud points = crowded_strips(13);
  for (const auto scope : {VisibilityScope::map, VisibilityScope::region}) {
    CAPTURE(scope);
    int calls = 0;
    BuildParams params = params_to(4.0);
    params.scope = scope;
    params.min_views = 2;
    params.views = true;

    const auto whole = std::make_shared<test::Memory>();
    BuildPlugins for_whole = plugins_of_strips(calls, whole);
    const auto wanted = build_region_maps(points, {}, for_whole, params);
    REQUIRE_MESSAGE(wanted, to_string(wanted.error()));
    CHECK(calls == 1);

    calls = 0;
    const PartsInMemory parts(points);
    const auto merged = std::make_shared<test::Memory>();
    BuildPlugins for_parts = plugins_of_strips(calls, merged);
    const test::TemporaryFolder folder;
    auto build =
        ShardedBuild::open(parts, {}, for_parts, params,
                           {.parts = folder.path() / "parts", .map_key = 1, .memory = 200'000});
    REQUIRE_MESSAGE(build, to_string(build.error()));
    CHECK(calls > 1);  // blocks
    for (const std::size_t shard : {2, 1}) REQUIRE(build->build({shard, 2}));
    const auto report = build->merge();
    REQUIRE_MESSAGE(report, to_string(report.error()));

    CHECK(merged->committed);
    REQUIRE(merged->maps.size() == whole->maps.size());
    for (const auto& of_whole : whole->maps) {
      const auto& region = of_whole.first;
      const auto& map = of_whole.second;
      CAPTURE(region);
      CHECK(merged->maps[region].points == map.points);
      CHECK(merged->maps[region].viewpoints == map.viewpoints);
      CHECK(merged->maps[region].views == map.views);
    }
    CHECK(report->seen == wanted->seen);
    CHECK(report->ground_points == wanted->ground_points);
    CHECK(report->points_times_viewpoints == wanted->points_times_viewpoints);
  }
}

TEST_CASE("sharded build: viewpoints far from all points are counted, in parts as in memory") {
  PointCloud points = crowded_strips(13);
  std::erase_if(points, [](const Point& p) { return p.x() > 40.0 && p.x() < 70.0; });
  const PointCloud trajectory{{54, 5, 1}, {56, 5, 1}, {154, 5, 1}, {156, 5, 1}};
  for (const auto scope : {VisibilityScope::map, VisibilityScope::region}) {
    for (const bool views : {false, true}) {
      CAPTURE(scope);
      CAPTURE(views);
      int calls = 0;
      BuildParams params = params_to(4.0);
      params.viewpoints = {.source = ViewpointSource::trajectory, .voxel_size = 1.0};
      params.scope = scope;
      params.views = views;

      const auto whole = std::make_shared<test::Memory>();
      BuildPlugins for_whole = plugins_of_strips(calls, whole);
      const auto wanted = build_region_maps(points, trajectory, for_whole, params);
      REQUIRE_MESSAGE(wanted, to_string(wanted.error()));
      CHECK(wanted->regions_that_see_nothing == 1);

      const PartsInMemory parts(points);
      const auto merged = std::make_shared<test::Memory>();
      BuildPlugins for_parts = plugins_of_strips(calls, merged);
      const test::TemporaryFolder folder;
      auto build =
          ShardedBuild::open(parts, trajectory, for_parts, params,
                             {.parts = folder.path() / "parts", .map_key = 1, .memory = 200'000});
      REQUIRE_MESSAGE(build, to_string(build.error()));
      // The first shard has only the strip where nothing is.
      for (const std::size_t shard : {1, 2}) {
        const auto built = build->build({shard, 2});
        REQUIRE_MESSAGE(built, to_string(built.error()));
      }
      const auto report = build->merge();
      REQUIRE_MESSAGE(report, to_string(report.error()));
      CHECK(report->regions_that_see_nothing == 1);
      CHECK(report->seen == wanted->seen);
      CHECK(report->points_times_viewpoints == wanted->points_times_viewpoints);
      CHECK(merged->maps[5].points.empty());
      CHECK(merged->maps[5].viewpoints.size() == 2);
      for (const std::uint32_t r : {5U, 15U}) {
        CHECK(merged->maps[r].points == whole->maps[r].points);
        CHECK(merged->maps[r].viewpoints == whole->maps[r].viewpoints);
        CHECK(merged->maps[r].views == whole->maps[r].views);
      }
    }
  }
}

TEST_CASE("sharded build: a shard with nothing left to build needs no file, even beside another") {
  const PartsInMemory map(crowded_strips(13));
  int calls = 0;
  BuildPlugins plugins = plugins_of_strips(calls);
  BuildParams params = params_to(4.0);
  const test::TemporaryFolder folder;
  const auto parts = folder.path() / "parts";
  auto build = ShardedBuild::open(map, {}, plugins, params,
                                  {.parts = parts, .map_key = 1, .memory = 200'000});
  REQUIRE_MESSAGE(build, to_string(build.error()));
  CHECK(build->build({1, 1}).value() == kStrips);
  const io::Descriptor other = io::Descriptor::of(parts / "shard_1_of_1.parts", O_RDWR);
  REQUIRE(other.open());
  REQUIRE(io::lock_file(other, io::Wait::no) == 0);
  const auto again = build->build({1, 1});
  REQUIRE_MESSAGE(again, to_string(again.error()));
  CHECK(*again == 0);
  CHECK_FALSE(std::filesystem::exists(parts / "shard_1_of_1-2.parts"));
}

/// Says that it has ten million times as many points.
class CountsMany final : public MapParts {
 public:
  explicit CountsMany(PointCloud points) : few_(std::move(points)) {}
  [[nodiscard]] Bounds3 bounds() const noexcept override { return few_.bounds(); }
  [[nodiscard]] std::uint64_t points() const noexcept override { return few_.points(); }
  [[nodiscard]] Result<void> pass(MapVisitor& visitor) const noexcept override {
    return few_.pass(visitor);
  }
  [[nodiscard]] std::uint64_t points_in(const Bounds2& area) const override {
    return 10'000'000 * few_.points_in(area);
  }
  [[nodiscard]] Result<MapPart> read(const Bounds2& area) const override { return few_.read(area); }

 private:
  PartsInMemory few_;
};

TEST_CASE("a build in parts is refused without a configuration, by which builds are told apart") {
  const PartsInMemory map(crowded_strips(-1));
  int calls = 0;
  BuildPlugins plugins = plugins_of_strips(calls);
  const BuildParams params;
  const test::TemporaryFolder folder;
  const auto parts = folder.path() / "parts";
  const auto build = ShardedBuild::open(map, {}, plugins, params, {.parts = parts});
  REQUIRE_FALSE(build);
  CHECK(build.error().code == ErrorCode::invalid_input);
  CHECK_FALSE(std::filesystem::exists(parts));
}

TEST_CASE("a plan refuses a region with more points than indices of 32 bits, whatever the memory") {
  const CountsMany map(crowded_strips(-1));
  for (const double range : {4.0, 9.0}) {
    int calls = 0;
    BuildPlugins plugins = plugins_of_strips(calls);
    BuildParams params = params_to(range);
    const test::TemporaryFolder folder;
    const auto build = ShardedBuild::open(
        map, {}, plugins, params,
        {.parts = folder.path() / "parts", .map_key = 1, .memory = std::uint64_t{1} << 50U});
    CHECK(build.has_value() == (range == 4.0));
    if (!build) {
      CHECK(build.error().message.find("can be worked on at once") != std::string::npos);
      CHECK_FALSE(std::filesystem::exists(folder.path() / "parts" / "plan"));
    }
  }
}

/// Its elements are the square metres with at least three points.
class MatchesCrowds final : public ScanMatcher {
 public:
  /// @param least_bytes  of what is stored, however few the elements are
  explicit MatchesCrowds(std::size_t least_bytes = 0) : least_bytes_(least_bytes) {}
  [[nodiscard]] double reach() const noexcept override { return 1.5; }
  [[nodiscard]] Result<std::unique_ptr<MatchTarget>> prepare(
      PointsView map) const noexcept override {
    std::map<Cell, std::uint32_t> counts;
    for (const Point& p : map) ++counts[cell_of(p)];
    std::erase_if(counts, [](const auto& cell) { return cell.second < 3; });
    if (counts.empty()) return fail(ErrorCode::too_few_matches, "the map is too sparse");
    std::vector<Cell> cells;
    for (const auto& cell : counts) cells.push_back(cell.first);
    return std::make_unique<Target>(std::move(cells), least_bytes_);
  }

 private:
  using Cell = std::pair<std::int16_t, std::int16_t>;
  static Cell cell_of(const Point& p) {
    return {static_cast<std::int16_t>(std::floor(p.x())),
            static_cast<std::int16_t>(std::floor(p.y()))};
  }

  class Target final : public MatchTarget {
   public:
    Target(std::vector<Cell> cells, std::size_t least_bytes)
        : cells_(std::move(cells)), least_bytes_(least_bytes) {}
    [[nodiscard]] Result<Alignment> align(PointsView, const Pose&) const noexcept override {
      return Alignment{};
    }
    [[nodiscard]] Result<ScanScore> score(PointsView, const Pose&) const noexcept override {
      return ScanScore{};
    }
    [[nodiscard]] std::size_t bytes() const noexcept override { return 1; }
    [[nodiscard]] std::size_t elements() const noexcept override { return cells_.size(); }
    [[nodiscard]] Result<PreparedMap> excerpt(PointsView seen) const noexcept override {
      std::vector<std::uint32_t> all;
      VANTAGE_TRY(const std::vector<MapElement> elements, elements_at(seen));
      for (const MapElement& element : elements) all.push_back(element.number);
      return excerpt_of(all, all);
    }
    [[nodiscard]] Result<std::vector<MapElement>> elements_at(
        PointsView seen) const noexcept override {
      std::set<Cell> belong;
      for (const Point& p : seen) belong.insert(cell_of(p));
      std::vector<MapElement> elements;
      for (std::uint32_t k = 0; k < cells_.size(); ++k) {
        if (!belong.contains(cells_[k])) continue;
        elements.push_back({k, {cells_[k].first + 0.5, cells_[k].second + 0.5, 0.0}, 3});
      }
      return elements;
    }
    [[nodiscard]] Result<std::vector<Pull>> pulls(PointsView, const Pose&) const noexcept override {
      return std::vector<Pull>();
    }
    [[nodiscard]] Result<PreparedMap> excerpt_of(
        std::span<const std::uint32_t> seen,
        std::span<const std::uint32_t> kept) const noexcept override {
      PreparedMap map{.bytes = {static_cast<std::byte>(seen.size())}, .elements = kept.size()};
      for (const std::uint32_t k : kept) {
        for (const std::int16_t x : {cells_[k].first, cells_[k].second}) {
          map.bytes.push_back(static_cast<std::byte>(x));
        }
      }
      map.bytes.resize(std::max(map.bytes.size(), least_bytes_));
      return map;
    }

   private:
    std::vector<Cell> cells_;
    std::size_t least_bytes_;
  };

  std::size_t least_bytes_;
};

class TakesTheFirst final : public Selector {
 public:
  [[nodiscard]] Result<std::vector<std::uint32_t>> order(const RegionElements&,
                                                         std::size_t most) const noexcept override {
    std::vector<std::uint32_t> first(most);
    std::iota(first.begin(), first.end(), 0U);
    return first;
  }
};

TEST_CASE("sharded build: what is too sparse for the matcher does not depend on blocks") {
  for (const bool select : {false, true}) {
    CAPTURE(select);
    int calls = 0;
    const auto plugins_for = [&](const std::shared_ptr<test::Memory>& memory) {
      BuildPlugins plugins = plugins_of_strips(calls, memory);
      plugins.matcher = test::in_process<MatchesCrowds, ScanMatcher>();
      if (select) plugins.selector = test::in_process<TakesTheFirst, Selector>();
      return plugins;
    };
    BuildParams params = params_to(4.0);
    params.content = StoredContent::prepared;
    params.selection.share = 0.5;
    const auto in_memory = [&](const PointCloud& points, const auto& memory) {
      BuildPlugins plugins = plugins_for(memory);
      return build_region_maps(points, {}, plugins, params);
    };
    const auto in_parts = [&](const PointCloud& points, const auto& memory) -> Result<BuildReport> {
      const PartsInMemory parts(points);
      BuildPlugins plugins = plugins_for(memory);
      const test::TemporaryFolder folder;
      VANTAGE_TRY(
          auto build,
          ShardedBuild::open(parts, {}, plugins, params,
                             {.parts = folder.path() / "parts", .map_key = 1, .memory = 200'000}));
      CHECK(calls > 1);  // blocks
      VANTAGE_CHECK(build.estimate());
      for (const std::size_t shard : {2, 1}) VANTAGE_CHECK(build.build({shard, 2}));
      return build.merge();
    };
    const auto whole = std::make_shared<test::Memory>(), merged = std::make_shared<test::Memory>();
    const auto wanted = in_memory(crowded_strips(13), whole);
    REQUIRE_MESSAGE(wanted, to_string(wanted.error()));
    const auto report = in_parts(crowded_strips(13), merged);
    REQUIRE_MESSAGE(report, to_string(report.error()));
    for (std::uint32_t r = 0; r < kStrips; ++r) {
      CAPTURE(r);
      const RegionMap& map = merged->maps[r];
      CHECK(map.prepared == whole->maps[r].prepared);
      CHECK(map.prepared.bytes.empty() == (r < 12 || r > 14));
      CHECK(map.prepared.bytes.empty() == (map.prepared.elements == 0));
      CHECK(map.points.empty());
      CHECK(report->regions[r].points == wanted->regions[r].points);
      CHECK(report->regions[r].points > 0);
    }

    // Nowhere is a crowd.
    const auto none = std::make_shared<test::Memory>();
    for (const auto& refused :
         {in_memory(crowded_strips(-1), none), in_parts(crowded_strips(-1), none)}) {
      REQUIRE_FALSE(refused);
      CHECK(refused.error().code == ErrorCode::too_few_matches);
      CHECK(refused.error().message.find("the map is too sparse") != std::string::npos);
    }
    CHECK_FALSE(none->committed);
  }
}

TEST_CASE("elements that take no bytes are all kept if what is stored fits, else one of them is") {
  for (const std::uint32_t budget : {2000U, 500U}) {
    CAPTURE(budget);
    int calls = 0;
    const auto memory = std::make_shared<test::Memory>();
    BuildPlugins plugins = plugins_of_strips(calls, memory);
    plugins.matcher = test::in_process<MatchesCrowds, ScanMatcher>(std::size_t{1000});
    plugins.selector = test::in_process<TakesTheFirst, Selector>();
    BuildParams params = params_to(4.0);
    params.content = StoredContent::prepared;
    params.selection.max_bytes = budget;
    const auto report = build_region_maps(crowded_strips(13), {}, plugins, params);
    REQUIRE_MESSAGE(report, to_string(report.error()));
    CHECK(memory->maps[13].prepared.bytes.size() == 1000);
    CHECK((memory->maps[13].prepared.elements > 1) == (budget == 2000));
    CHECK(memory->maps[13].prepared.elements > 0);
  }
}

TEST_CASE("a build in memory measures the time of choosing elements as a part of its own") {
  // Most of that time makes surfaces of the points, before any region is looked at.
  PointCloud map;
  for (int x = 0; x < 400; ++x) {
    for (int y = 0; y < 200; ++y) {
      for (int z = 0; z < 3; ++z) map.emplace_back(0.5 * x, 0.5 * y, 0.5 * z);
    }
  }
  int calls = 0;
  BuildPlugins plugins = plugins_of_strips(calls);
  plugins.matcher = test::in_process<MatchesCrowds, ScanMatcher>();
  plugins.selector = test::in_process<TakesTheFirst, Selector>();
  BuildParams params;
  params.viewpoints = {.source = ViewpointSource::trajectory, .voxel_size = 1.0};
  params.max_range = 4.0;
  params.content = StoredContent::prepared;
  params.selection.share = 0.5;
  const auto report = build_region_maps(map, PointCloud{{5, 5, 1}}, plugins, params);
  REQUIRE_MESSAGE(report, to_string(report.error()));
  CHECK(report->core_seconds_selection > 0.0);
  CHECK(report->core_seconds_visibility > 0.0);
  CHECK(report->seconds_visibility > 0.0);
}

TEST_CASE("sharded build: merge refuses a map that no viewpoint sees, and keeps the parts") {
  const PartsInMemory map(crowded_strips(13));
  const auto memory = std::make_shared<test::Memory>();
  int calls = 0;
  BuildPlugins plugins = plugins_of_strips(calls, memory);
  BuildParams params = params_to(4.0);
  params.viewpoints.sensor_height = 180.0;
  const test::TemporaryFolder folder;
  const auto parts = folder.path() / "parts";
  auto build = ShardedBuild::open(map, {}, plugins, params,
                                  {.parts = parts, .map_key = 1, .memory = 1'000'000'000});
  REQUIRE_MESSAGE(build, to_string(build.error()));
  for (const std::size_t shard : {1, 2}) REQUIRE(build->build({shard, 2}));
  const auto refused = build->merge();
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message.starts_with("no viewpoint sees a point of the map"));
  CHECK_FALSE(memory->committed);
  CHECK(std::filesystem::exists(parts));
}

}  // namespace
}  // namespace vantage
