#include "vantage/build.hpp"

#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <memory>
#include <mutex>
#include <span>

#include "stopwatch.hpp"
#include "vantage/map_observer.hpp"

namespace vantage {
namespace {

/// What one region needs from the map.
struct RegionWork {
  IndexList inside;       // P_ij of Eq. 3, only for VisibilityScope::region
  PointCloud viewpoints;  // Eq. 5
};

/// A plugin is not trusted to keep its promise about indices: a wrong one would read past the map.
Result<void> check_indices(const IndexList& indices, std::size_t size, const char* who) {
  for (std::size_t i = 0; i < indices.size(); ++i) {
    if (indices[i] >= size || (i > 0 && indices[i] <= indices[i - 1])) {
      return fail(ErrorCode::internal, std::string("the ") + who +
                                           " plugin broke its contract: its indices must ascend "
                                           "strictly and stay below " +
                                           std::to_string(size));
    }
  }
  return {};
}

/// Eq. 3, and the viewpoints of every region (Eqs. 4-5).
Result<std::vector<RegionWork>> cut(PointsView map, const IndexList& ground,
                                    const Partition& partition, const BuildParams& params) {
  std::vector<RegionWork> work(partition.size());
  std::vector<std::uint32_t> region_of(map.size());
  for (std::size_t k = 0; k < map.size(); ++k) {
    const auto region = partition.locate(map[k]);
    if (!region) {
      return fail(ErrorCode::internal,
                  "the partitioner plugin broke its contract: no region owns map point " +
                      std::to_string(k));
    }
    region_of[k] = region->value;
    if (params.scope == VisibilityScope::region) {
      work[region->value].inside.push_back(static_cast<std::uint32_t>(k));
    }
  }
  std::vector<PointCloud> ground_of(partition.size());  // g_ij
  for (const std::uint32_t k : ground) ground_of[region_of[k]].push_back(map[k]);
  for (std::size_t r = 0; r < work.size(); ++r) {
    VANTAGE_TRY(work[r].viewpoints, viewpoints_over(ground_of[r], params.viewpoints));
  }
  return work;
}

/// What the build knows before it cuts: the ground, and what can be seen. Answers the partitioner
/// and then serves the build itself, so that what a partitioner was told is what the bundle will
/// hold.
class BuildObserver final : public MapObserver {
 public:
  /// Finds the ground. All arguments are borrowed.
  static Result<std::unique_ptr<BuildObserver>> over(PointsView map, const BuildPlugins& plugins,
                                                     const BuildParams& params) {
    auto observer = std::make_unique<BuildObserver>(map, plugins, params);
    VANTAGE_TRY(observer->ground_, plugins.ground->ground(map));
    VANTAGE_CHECK(check_indices(observer->ground_, map.size(), "ground"));
    if (observer->ground_.empty()) {
      return fail(ErrorCode::invalid_input,
                  "no ground was found in the map, so there is nowhere to put a viewpoint");
    }
    return observer;
  }
  BuildObserver(PointsView map, const BuildPlugins& plugins, const BuildParams& params)
      : map_(map),
        plugins_(plugins),
        params_(params),
        limits_{.map_bounds = bounds_of(map), .max_range = params.max_range} {}

  [[nodiscard]] const IndexList& ground() const noexcept { return ground_; }
  [[nodiscard]] const VisibilityLimits& limits() const noexcept { return limits_; }

  [[nodiscard]] Result<PointCloud> viewpoints() const noexcept override {
    return guarded([&] { return viewpoints_over(select(map_, ground_), params_.viewpoints); });
  }

  [[nodiscard]] Result<IndexList> visible(const Point& viewpoint) const noexcept override {
    return guarded([&]() -> Result<IndexList> {
      VANTAGE_TRY(const auto* scene, map_scene());
      VANTAGE_TRY(IndexList seen, scene->visible(viewpoint));
      VANTAGE_CHECK(check_indices(seen, map_.size(), "visibility"));
      return seen;
    });
  }

  [[nodiscard]] Result<std::uint64_t> observable_points(
      const Region& region, std::uint64_t enough) const noexcept override {
    return guarded([&] { return count(region, enough); });
  }

  /// V_ij, Eq. 10.
  [[nodiscard]] Result<RegionMap> observable_map(const RegionWork& work) const {
    RegionMap region_map;
    region_map.viewpoints = static_cast<std::uint32_t>(work.viewpoints.size());
    if (work.viewpoints.empty()) return region_map;
    VANTAGE_TRY(const Scope scope, scope_of(work.inside));
    VANTAGE_TRY(const IndexList seen, scope.seen_from(work.viewpoints));
    region_map.points = select(scope.points, seen);
    return region_map;
  }

 private:
  /// The points among which a region's visibility is decided, ready to be asked.
  struct Scope {
    PointsView points;
    const VisibilityScene* scene = nullptr;
    PointCloud own_points;  // of the region; what `points` views unless it views the map
    PluginPtr<VisibilityScene> own_scene;

    [[nodiscard]] Result<IndexList> seen_from(std::span<const Point> viewpoints) const {
      VANTAGE_TRY(IndexList seen, scene->visible_from_any(viewpoints));
      VANTAGE_CHECK(check_indices(seen, points.size(), "visibility"));
      return seen;
    }
  };

  [[nodiscard]] Result<Scope> scope_of(const IndexList& inside) const {
    Scope scope;
    if (params_.scope == VisibilityScope::map) {
      scope.points = map_;
      VANTAGE_TRY(scope.scene, map_scene());
      return scope;
    }
    scope.own_points = select(map_, inside);
    scope.points = scope.own_points;
    VANTAGE_TRY(auto prepared, plugins_.visibility->prepare(scope.points, limits_));
    if (!prepared) return no_scene();
    scope.own_scene = in_library_of(plugins_.visibility, std::move(prepared));
    scope.scene = scope.own_scene.get();
    return scope;
  }

  static tl::unexpected<Error> no_scene() {
    return fail(ErrorCode::internal,
                "the visibility plugin broke its contract: prepare gave no scene and no error");
  }

  /// The scene of the whole map, prepared when it is first asked for.
  [[nodiscard]] Result<const VisibilityScene*> map_scene() const {
    const std::scoped_lock lock(mutex_);
    if (!map_scene_) {
      // Isolated: while it waits for its own tasks, this thread must not take up another of the
      // build's, which would come here and wait for the lock that this one holds.
      auto prepared = tbb::this_task_arena::isolate(
          [&] { return plugins_.visibility->prepare(map_, limits_); });
      if (!prepared) return fail(std::move(prepared).error());
      if (!*prepared) return no_scene();
      map_scene_ = in_library_of(plugins_.visibility, *std::move(prepared));
    }
    return map_scene_.get();
  }

  [[nodiscard]] Result<std::uint64_t> count(const Region& region, std::uint64_t enough) const {
    const auto owns = [&](const Point& p) {
      return region.height.contains(p.z()) && contains(region.footprint, p.head<2>());
    };
    PointCloud ground;  // g_ij
    for (const std::uint32_t k : ground_) {
      if (owns(map_[k])) ground.push_back(map_[k]);
    }
    VANTAGE_TRY(const PointCloud viewpoints, viewpoints_over(ground, params_.viewpoints));
    if (viewpoints.empty()) return 0;
    IndexList inside;  // P_ij
    if (params_.scope == VisibilityScope::region) {
      for (std::uint32_t k = 0; k < map_.size(); ++k) {
        if (owns(map_[k])) inside.push_back(k);
      }
    }
    VANTAGE_TRY(const Scope scope, scope_of(inside));

    // Far-apart viewpoints first, and more of them each time: a region that shows too much is found
    // out early.
    std::vector<bool> seen(scope.points.size());
    std::uint64_t total = 0;
    PointCloud batch;
    std::size_t batch_size = 1;
    for (const std::size_t i : spread_order(viewpoints.size())) {
      batch.push_back(viewpoints[i]);
      if (batch.size() < batch_size) continue;
      VANTAGE_CHECK(add(scope, batch, seen, total));
      if (total > enough) return total;
      batch.clear();
      batch_size *= 2;
    }
    VANTAGE_CHECK(add(scope, batch, seen, total));
    return total;
  }

  static Result<void> add(const Scope& scope, const PointCloud& batch, std::vector<bool>& seen,
                          std::uint64_t& total) {
    if (batch.empty()) return {};
    VANTAGE_TRY(const IndexList indices, scope.seen_from(batch));
    for (const std::uint32_t k : indices) {
      if (!seen[k]) ++total;
      seen[k] = true;
    }
    return {};
  }

  /// 0 .. n - 1, every prefix of it spread over the whole: counting with the bits reversed.
  static std::vector<std::size_t> spread_order(std::size_t n) {
    const auto bits = static_cast<int>(std::bit_width(n));
    std::vector<std::size_t> order;
    order.reserve(n);
    for (std::size_t i = 0; i < std::size_t{1} << bits; ++i) {
      std::size_t reversed = 0;
      for (int bit = 0; bit < bits; ++bit) reversed |= ((i >> bit) & 1U) << (bits - 1 - bit);
      if (reversed < n) order.push_back(reversed);
    }
    return order;
  }

  PointsView map_;
  const BuildPlugins& plugins_;
  const BuildParams& params_;
  VisibilityLimits limits_;
  IndexList ground_;
  mutable std::mutex mutex_;
  mutable PluginPtr<VisibilityScene> map_scene_;
};

}  // namespace

BuildParams BuildParams::from(const Config& config) {
  BuildParams params;
  params.viewpoints = config.viewpoints.value_or(ViewpointParams{});
  if (config.visibility) {
    params.scope = config.visibility->scope;
    params.max_range = config.visibility->max_range.value_or(params.max_range);
  }
  return params;
}

Result<BuildPlugins> load_build_plugins(const Config& config, const PluginLoader& loader) {
  constexpr std::string_view kJob = "building region maps";
  VANTAGE_TRY(const auto partitioner, config.need(config.partitioner, "partitioner", kJob));
  VANTAGE_TRY(const auto ground, config.need(config.ground, "ground", kJob));
  VANTAGE_TRY(const auto visibility, config.need(config.visibility, "visibility", kJob));
  VANTAGE_TRY(const auto store, config.need(config.store, "store", kJob));
  BuildPlugins plugins;
  VANTAGE_TRY(plugins.partitioner, loader.load<Partitioner>(partitioner));
  VANTAGE_TRY(plugins.ground, loader.load<GroundFilter>(ground));
  VANTAGE_TRY(plugins.visibility, loader.load<VisibilityOperator>(visibility.choice()));
  VANTAGE_TRY(plugins.store, loader.load<MapStore>(store));
  return plugins;
}

Result<BuildReport> build_region_maps(PointsView map, PointsView trajectory, BuildPlugins& plugins,
                                      const BuildParams& params,
                                      const std::function<void(const BuildProgress&)>& progress) {
  VANTAGE_CHECK(check_points(map, "the map"));

  BuildReport report;
  report.map_points = map.size();
  Stopwatch stopwatch;
  VANTAGE_TRY(const auto observer, BuildObserver::over(map, plugins, params));
  const IndexList& ground = observer->ground();
  report.ground_points = ground.size();
  report.seconds_ground = stopwatch.seconds();

  stopwatch = {};
  VANTAGE_TRY(report.partition, plugins.partitioner->partition(map, trajectory, *observer));
  VANTAGE_TRY(const std::vector<RegionWork> work, cut(map, ground, report.partition, params));
  for (const RegionWork& region : work) {
    report.viewpoints += region.viewpoints.size();
    if (region.viewpoints.empty()) ++report.regions_without_viewpoints;
  }
  report.seconds_partition = stopwatch.seconds();

  stopwatch = {};
  VANTAGE_CHECK(plugins.store->begin(MapIndex{.partition = report.partition,
                                              .regions = {},
                                              .map_bounds = observer->limits().map_bounds,
                                              .map_points = report.map_points,
                                              .config = params.effective_config}));

  // Regions in parallel, stored in order; the first failing region decides the error.
  report.regions.resize(work.size());
  BuildProgress done{.regions = work.size(), .viewpoints = report.viewpoints};
  if (progress) progress(done);
  Result<void> outcome{};
  std::atomic<bool> stop{false};
  std::uint32_t next = 0;
  struct Item {
    RegionId region;
    Result<RegionMap> map;
  };
  const auto tokens = static_cast<std::size_t>(tbb::this_task_arena::max_concurrency()) + 1;
  tbb::parallel_pipeline(
      tokens,
      tbb::make_filter<void, std::uint32_t>(tbb::filter_mode::serial_in_order,
                                            [&](tbb::flow_control& flow) {
                                              if (next == work.size() || stop) flow.stop();
                                              return next++;
                                            }) &
          tbb::make_filter<std::uint32_t, std::shared_ptr<Item>>(
              tbb::filter_mode::parallel,
              [&](std::uint32_t r) {
                return std::make_shared<Item>(Item{RegionId{r}, observer->observable_map(work[r])});
              }) &
          tbb::make_filter<std::shared_ptr<Item>, void>(
              tbb::filter_mode::serial_in_order, [&](const std::shared_ptr<Item>& item) {
                if (!outcome) return;
                const std::uint32_t r = item->region.value;
                if (item->map) {
                  outcome = plugins.store->put(item->region, *item->map);
                } else {
                  outcome = fail(std::move(item->map).error());
                }
                if (!outcome) {
                  outcome = fail(std::move(outcome).error().during(
                      "building region '" + report.partition[item->region].label + "'"));
                  stop = true;
                  return;
                }
                report.regions[r] = {.points = item->map->points.size(),
                                     .viewpoints = item->map->viewpoints,
                                     .bytes = 0};
                ++done.regions_done;
                done.viewpoints_done += item->map->viewpoints;
                if (progress) progress(done);
              }));
  VANTAGE_CHECK(outcome);
  VANTAGE_CHECK(plugins.store->commit());
  report.seconds_visibility = stopwatch.seconds();
  return report;
}

}  // namespace vantage
