#include "vantage/engine/build.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <chrono>
#include <exception>
#include <limits>
#include <memory>
#include <mutex>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <variant>

#include "build/adaptive_viewpoints.hpp"
#include "build/plan_index.hpp"
#include "stopwatch.hpp"
#include "vantage/index_set.hpp"
#include "vantage/map_survey.hpp"

namespace vantage {
namespace {

/// What the regions need from the map.
struct Work {
  Groups inside;                       // P_ij of Eq. 3, only for VisibilityScope::region
  std::vector<PointCloud> viewpoints;  // Eq. 5, by RegionId
  std::uint64_t places_outside = 0;    // of all regions
};

/// Where viewpoints come from: some of the points of a cloud.
struct Places {
  PointsView points;  // the map or `own`
  IndexList which;    // into `points`: the ground, or all
  PointCloud own;     // along the trajectory
  std::uint64_t ground_points = 0;
  std::uint64_t unreachable_viewpoints = 0;
};

/// Plugins are not trusted with indices: a wrong index would make the build read past the map.
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

/// Plugins are not trusted with view counts either.
Result<void> check_views(const ViewCounts& counts, std::size_t viewpoints) {
  if (counts.views.size() == counts.points.size() &&
      std::all_of(counts.views.begin(), counts.views.end(),
                  [&](std::uint32_t views) { return views > 0 && views <= viewpoints; })) {
    return {};
  }
  return fail(ErrorCode::internal,
              "the visibility plugin broke its contract: every point that is seen has from 1 to " +
                  std::to_string(viewpoints) + " views");
}

/// The region that owns each map point.
Result<std::vector<std::uint32_t>> regions_of(PointsView map, const Partition& partition) {
  std::vector<std::uint32_t> region_of(map.size());
  std::atomic<std::size_t> first_without = map.size();
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, map.size()), [&](const auto& range) {
    for (std::size_t k = range.begin(); k != range.end(); ++k) {
      if (const auto region = partition.locate(map[k])) {
        region_of[k] = region->value;
        continue;
      }
      std::size_t first = first_without;
      while (k < first && !first_without.compare_exchange_weak(first, k)) {
      }
    }
  });
  if (first_without != map.size()) {
    return fail(ErrorCode::internal,
                "the partitioner plugin broke its contract: no region owns map point " +
                    std::to_string(first_without));
  }
  return region_of;
}

/// Eq. 3, and the viewpoints of every region (Eqs. 4-5).
Result<Work> cut(PointsView map, const Places& places, const Partition& partition,
                 const BuildParams& params) {
  VANTAGE_TRY(auto region_of, regions_of(map, partition));
  const auto owner = [&](std::uint32_t k) { return region_of[k]; };
  Work work;
  if (params.scope == VisibilityScope::region) {
    work.inside = grouped(
        map.size(), partition.size(), [](std::size_t k) { return static_cast<std::uint32_t>(k); },
        owner);
  }
  const auto regions = static_cast<std::uint32_t>(partition.size());
  if (params.viewpoints.source == ViewpointSource::trajectory) {
    region_of.clear();
    for (const Point& p : places.points) {
      const auto region = partition.locate(p);
      region_of.push_back(region ? region->value : regions);
    }
  }
  const Groups places_of = grouped(
      places.which.size(), regions + 1, [&](std::size_t i) { return places.which[i]; },
      owner);  // g_ij
  work.places_outside = places_of[regions].size();
  if (work.places_outside == places.which.size()) {
    return fail(ErrorCode::invalid_input,
                "the whole trajectory lies outside of all regions, so there is nowhere to put a "
                "viewpoint: is it in the frame of the map?");
  }
  std::vector<Result<PointCloud>> viewpoints(partition.size());
  tbb::parallel_for(std::size_t{0}, partition.size(), [&](std::size_t r) {
    viewpoints[r] = viewpoints_over(places.points, places_of[r], params.viewpoints);
  });
  work.viewpoints.reserve(partition.size());
  for (auto& of_region : viewpoints) {
    VANTAGE_TRY(work.viewpoints.emplace_back(), std::move(of_region));
  }
  return work;
}

/// Keeps the points that enough viewpoints see. If a region has fewer viewpoints, all must see a
/// point.
void keep_often_seen(ViewCounts& counts, std::size_t min_views, std::size_t viewpoints) {
  const std::size_t needed = std::min(min_views, viewpoints);
  std::size_t to = 0;
  for (std::size_t from = 0; from < counts.points.size(); ++from) {
    if (counts.views[from] < needed) continue;
    counts.points[to] = counts.points[from];
    counts.views[to++] = counts.views[from];
  }
  counts.points.resize(to);
  counts.views.resize(to);
}

/// What the build knows before it cuts: the ground or path, and what can be seen. It answers the
/// partitioner and then serves the build itself, so the bundle will hold what the partitioner was
/// told.
class BuildSurvey final : public MapSurvey {
 public:
  /// Finds the places for viewpoints. All arguments are borrowed.
  static Result<std::unique_ptr<BuildSurvey>> over(PointsView map, PointsView trajectory,
                                                   const BuildPlugins& plugins,
                                                   const BuildParams& params) {
    auto survey = std::make_unique<BuildSurvey>(map, plugins, params);
    Places& places = survey->places_;
    if (params.viewpoints.source == ViewpointSource::trajectory) {
      if (trajectory.empty()) {
        return fail(ErrorCode::invalid_input,
                    "viewpoints are to come from the trajectory, but there is none");
      }
      VANTAGE_TRY(places.own, places_along(trajectory, params.viewpoints));
      places.points = places.own;
      places.which.resize(places.own.size());
      std::iota(places.which.begin(), places.which.end(), 0U);
      return survey;
    }
    VANTAGE_TRY(places.which, plugins.ground->ground(map));
    VANTAGE_CHECK(check_indices(places.which, map.size(), "ground"));
    if (places.which.empty()) {
      return fail(ErrorCode::invalid_input,
                  "no ground was found in the map, so there is nowhere to put a viewpoint; "
                  "viewpoints.source = \"trajectory\" needs none");
    }
    places.points = map;
    places.ground_points = places.which.size();
    if (params.viewpoints.reachable) VANTAGE_CHECK(survey->keep_reachable(trajectory));
    return survey;
  }
  BuildSurvey(PointsView map, const BuildPlugins& plugins, const BuildParams& params)
      : map_(map),
        plugins_(plugins),
        params_(params),
        limits_{.map_bounds = bounds_of(map), .max_range = params.max_range} {}

  [[nodiscard]] const Places& places() const noexcept { return places_; }
  [[nodiscard]] const VisibilityLimits& limits() const noexcept { return limits_; }

  [[nodiscard]] Result<PointCloud> viewpoints() const noexcept override {
    return guarded(
        [&] { return viewpoints_over(places_.points, places_.which, params_.viewpoints); });
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

  /// V_ij of Eq. 10.
  struct ObservableMap {
    std::uint64_t seen = 0;   ///< points that at least one viewpoint sees
    ViewCounts kept = {};     ///< map points that enough viewpoints see; `views` if asked for
    std::size_t skipped = 0;  ///< viewpoints that were not asked, see ViewpointParams::min_gain
  };
  /// @param inside  P_ij; used only with VisibilityScope::region
  [[nodiscard]] Result<ObservableMap> observable_map(std::span<const std::uint32_t> inside,
                                                     std::span<const Point> viewpoints,
                                                     const VisibilityProgress& progress) const {
    ObservableMap observable;
    if (viewpoints.empty()) return observable;
    VANTAGE_TRY(const Scope scope, scope_of(inside));
    // All viewpoints in one call, because a scene uses what it learned from earlier viewpoints.
    ViewCounts& kept = observable.kept;
    if (params_.min_views > 1 || params_.views) {
      VANTAGE_TRY(kept, scope.views_from(viewpoints, &progress));
      observable.seen = kept.points.size();
      keep_often_seen(kept, params_.min_views, viewpoints.size());
      if (!params_.views) kept.views = {};
    } else if (const ViewpointParams& which = params_.viewpoints; which.min_gain > 0.0) {
      VANTAGE_TRY(AdaptiveSight sight,
                  see_adaptively(viewpoints, which.voxel_size, which.min_gain, scope.points.size(),
                                 [&](std::span<const Point> some) {
                                   return scope.seen_from(some, &progress);
                                 }));
      observable.seen = sight.seen.size();
      observable.skipped = sight.skipped;
      kept.points = std::move(sight.seen);
    } else {
      VANTAGE_TRY(kept.points, scope.seen_from(viewpoints, &progress));
      observable.seen = kept.points.size();
    }
    if (params_.scope == VisibilityScope::region) {
      for (std::uint32_t& k : kept.points) k = inside[k];
    }
    return observable;
  }

  /// Frees what only a partitioner and `cut` need. Precondition: nothing will be asked after this.
  void release_places() {
    places_ = {};
    place_index_.reset();
    map_index_.reset();
  }
  /// Frees what `observable_map` needs. Precondition: nothing will be asked after this.
  void release_scene() { map_scene_.reset(); }

 private:
  Result<void> keep_reachable(PointsView trajectory) {
    const ViewpointParams& params = params_.viewpoints;
    VANTAGE_TRY(IndexList reachable,
                reachable_ground(map_, places_.which, trajectory, params.max_step));
    VANTAGE_TRY(const PointCloud before, viewpoints_over(map_, places_.which, params));
    VANTAGE_TRY(const PointCloud after, viewpoints_over(map_, reachable, params));
    places_.unreachable_viewpoints = before.size() - after.size();
    places_.which = std::move(reachable);
    return {};
  }

  /// The points among which a region's visibility is decided, ready for queries.
  struct Scope {
    PointsView points;
    const VisibilityScene* scene = nullptr;
    PointCloud own_points;  // the region's own points; `points` views either them or the map
    PluginPtr<VisibilityScene> own_scene;

    [[nodiscard]] Result<IndexList> seen_from(std::span<const Point> viewpoints,
                                              const VisibilityProgress* progress = nullptr) const {
      VANTAGE_TRY(IndexList seen, scene->visible_from_any(viewpoints, progress));
      VANTAGE_CHECK(check_indices(seen, points.size(), "visibility"));
      return seen;
    }
    [[nodiscard]] Result<ViewCounts> views_from(
        std::span<const Point> viewpoints, const VisibilityProgress* progress = nullptr) const {
      VANTAGE_TRY(ViewCounts counts, scene->view_counts(viewpoints, progress));
      VANTAGE_CHECK(check_indices(counts.points, points.size(), "visibility"));
      VANTAGE_CHECK(check_views(counts, viewpoints.size()));
      return counts;
    }
  };

  [[nodiscard]] Result<Scope> scope_of(std::span<const std::uint32_t> inside) const {
    Scope scope;
    // A region that owns every point uses the map's scene, without a copy of the map.
    if (params_.scope == VisibilityScope::map || inside.size() == map_.size()) {
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

  /// The scene of the whole map, prepared at the first query.
  [[nodiscard]] Result<const VisibilityScene*> map_scene() const {
    const std::scoped_lock lock(mutex_);
    if (!map_scene_) {
      // Isolated: while this thread waits for its own tasks, it must not take up another task of
      // the build. That task would come here and wait for the lock that this thread holds.
      auto prepared = tbb::this_task_arena::isolate(
          [&] { return plugins_.visibility->prepare(map_, limits_); });
      if (!prepared) return fail(std::move(prepared).error());
      if (!*prepared) return no_scene();
      map_scene_ = in_library_of(plugins_.visibility, *std::move(prepared));
    }
    return map_scene_.get();
  }

  [[nodiscard]] Result<std::uint64_t> count(const Region& region, std::uint64_t enough) const {
    const PointsView points = places_.points;
    const IndexList places = owned(region, points, index_of_places());  // g_ij
    VANTAGE_TRY(const PointCloud viewpoints, viewpoints_over(points, places, params_.viewpoints));
    if (viewpoints.empty()) return 0;
    IndexList inside;  // P_ij
    if (params_.scope == VisibilityScope::region) inside = owned(region, map_, index_of_map());
    VANTAGE_TRY(const Scope scope, scope_of(inside));

    if (const ViewpointParams& which = params_.viewpoints;
        which.min_gain > 0.0 && params_.min_views == 1 && !params_.views) {
      VANTAGE_TRY(const AdaptiveSight sight,
                  see_adaptively(
                      viewpoints, which.voxel_size, which.min_gain, scope.points.size(),
                      [&](std::span<const Point> some) { return scope.seen_from(some); }, enough));
      return sight.seen.size();
    }
    // Viewpoints far apart come first, and each step asks more of them: a region that shows too
    // much is detected early.
    IndexSet seen(scope.points.size());
    const std::size_t needed = std::min<std::size_t>(params_.min_views, viewpoints.size());
    std::vector<std::uint32_t> views(needed > 1 ? scope.points.size() : 0);
    const auto look = [&](std::span<const Point> batch) -> Result<void> {
      IndexList often;
      if (needed > 1) {
        VANTAGE_TRY(const ViewCounts counts, scope.views_from(batch));
        for (std::size_t i = 0; i < counts.points.size(); ++i) {
          std::uint32_t& total = views[counts.points[i]];
          total += counts.views[i];
          if (total >= needed) often.push_back(counts.points[i]);
        }
      } else {
        VANTAGE_TRY(often, scope.seen_from(batch));
      }
      seen.add(often);
      return {};
    };
    PointCloud batch;
    std::size_t batch_size = 1;
    for (const std::size_t i : spread_order(viewpoints.size())) {
      batch.push_back(viewpoints[i]);
      if (batch.size() < batch_size) continue;
      VANTAGE_CHECK(look(batch));
      if (const std::size_t total = seen.size(); total > enough) return total;
      batch.clear();
      batch_size *= 2;
    }
    if (!batch.empty()) VANTAGE_CHECK(look(batch));
    return seen.size();
  }

  /// The points that a region owns, among those in an index over `points`.
  [[nodiscard]] static IndexList owned(const Region& region, PointsView points,
                                       const PlanIndex& index) {
    const auto [min, max] = bounds_of(region.footprint);
    IndexList inside = index.near(min, max);
    std::erase_if(inside, [&](std::uint32_t k) {
      const Point& p = points[k];
      return !region.height.contains(p.z()) || !contains(region.footprint, p.head<2>());
    });
    return inside;
  }

  [[nodiscard]] const PlanIndex& index_of_places() const {
    std::call_once(places_indexed_, [&] {
      place_index_.emplace(places_.points, places_.which.size(),
                           [&](std::size_t i) { return places_.which[i]; });
    });
    return *place_index_;
  }
  [[nodiscard]] const PlanIndex& index_of_map() const {
    std::call_once(map_indexed_, [&] {
      map_index_.emplace(map_, map_.size(),
                         [](std::size_t k) { return static_cast<std::uint32_t>(k); });
    });
    return *map_index_;
  }

  /// 0 .. n - 1 in an order whose every prefix is spread over the whole: counts with the bits
  /// reversed.
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
  Places places_;
  mutable std::mutex mutex_;
  mutable PluginPtr<VisibilityScene> map_scene_;
  // Only a partitioner that asks about regions needs these.
  mutable std::once_flag places_indexed_, map_indexed_;
  mutable std::optional<PlanIndex> place_index_, map_index_;
};

/// Reports how far a build has come: at every region, and in between after every hundredth of the
/// viewpoints or a tenth of a second.
class Meter {
 public:
  Meter(const BuildProgress& start, const std::function<void(const BuildProgress&)>& listener)
      : step_(std::max<std::size_t>(1, start.viewpoints / 100)), now_(start), listener_(listener) {
    say();
  }

  /// May run from many threads at once. Plugins call this function, so an exception of the listener
  /// is kept until `region_done`.
  void viewpoints_done(std::size_t more) noexcept {
    if (!listener_) return;
    viewpoints_done_ += more;
    if (!due()) return;
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock || !due()) return;  // another thread reports it
    try {
      say();
    } catch (...) {
      thrown_ = std::current_exception();
    }
  }

  void region_done() {
    const std::scoped_lock lock(mutex_);
    if (thrown_) std::rethrow_exception(thrown_);
    ++now_.regions_done;
    say();
  }

 private:
  using Clock = std::chrono::steady_clock;

  [[nodiscard]] bool due() const noexcept {
    return viewpoints_done_ >= said_ + step_ ||
           Clock::now().time_since_epoch() - said_at_.load() >= std::chrono::milliseconds(100);
  }

  void say() {
    if (!listener_ || thrown_) return;
    now_.viewpoints_done = viewpoints_done_;
    said_ = now_.viewpoints_done;
    listener_(now_);
    said_at_ = Clock::now().time_since_epoch();
  }

  const std::size_t step_;
  std::atomic<std::size_t> viewpoints_done_{0}, said_{0};
  std::atomic<Clock::duration> said_at_{Clock::duration::zero()};
  std::mutex mutex_;  // guards the members below
  BuildProgress now_;
  std::exception_ptr thrown_;
  const std::function<void(const BuildProgress&)>& listener_;
};

/// The viewpoints that one region adds: never more than it has, whatever a plugin reports.
class RegionProgress final : public VisibilityProgress {
 public:
  RegionProgress(Meter& meter, std::size_t viewpoints) : meter_(meter), left_(viewpoints) {}

  void advanced(std::size_t viewpoints) const noexcept override {
    std::size_t left = left_, more = 0;
    do {
      more = std::min(left, viewpoints);
    } while (!left_.compare_exchange_weak(left, left - more));
    if (more > 0) meter_.viewpoints_done(more);
  }

 private:
  Meter& meter_;
  mutable std::atomic<std::size_t> left_;
};

/// The points that were seen. Many indices are kept as bits while points are copied, because bits
/// are smaller.
PointCloud points_of(PointsView map, IndexList seen) {
  if (seen.size() < map.size() / 32) return select(map, seen);
  IndexSet set(map.size());
  set.add(seen);
  PointCloud points;
  points.reserve(seen.size());
  seen = IndexList();
  set.for_each([&](std::uint32_t k) { points.push_back(map[k]); });
  return points;
}

/// Puts region maps into the form in which they are stored.
class Condenser {
 public:
  /// Errors: those of ScanMatcher::prepare; `unsupported`.
  [[nodiscard]] static Result<Condenser> over(PointsView map, const BuildPlugins& plugins,
                                              StoredContent content) {
    Condenser condenser(content);
    if (content == StoredContent::points) return condenser;
    VANTAGE_TRY(auto whole, plugins.matcher->prepare(map));
    condenser.whole_ = in_library_of(plugins.matcher, std::move(whole));
    // A matcher that cannot store its maps must fail here, before hours of visibility.
    auto offered = condenser.whole_->excerpt({});
    if (!offered) return fail(std::move(offered).error());
    return condenser;
  }

  /// Whether region maps hold more than points.
  [[nodiscard]] bool prepares() const noexcept { return content_ != StoredContent::points; }

  /// @param observable  the points that the prepared map stands for: the points of `region` or more
  [[nodiscard]] Result<void> apply(RegionMap& region, PointsView observable) const {
    if (!whole_ || observable.empty()) return {};
    VANTAGE_TRY(region.prepared, whole_->excerpt(observable));
    if (content_ == StoredContent::prepared) {
      region.points = {};
      region.views = {};
    }
    return {};
  }

 private:
  explicit Condenser(StoredContent content) : content_(content) {}
  StoredContent content_;
  PluginPtr<MatchTarget> whole_;  // the whole map; none if only points are stored
};

/// What will be stored for a region.
struct BuiltRegion {
  std::uint64_t seen = 0;     // points that at least one viewpoint sees
  ViewCounts stored = {};     // of the map
  IndexList observable = {};  // the points before thinning, if a matcher asks for them
  std::size_t skipped = 0;    // viewpoints
};

/// Takes an observable map and leaves it empty.
BuiltRegion thinned_region(PointsView map, BuildSurvey::ObservableMap observable,
                           const BuildParams& params, const Condenser& condenser) {
  ViewCounts& kept = observable.kept;
  BuiltRegion region{.seen = observable.seen, .skipped = observable.skipped};
  if (!params.thinning) {
    region.stored = std::move(kept);
    return region;
  }
  region.stored.points = thinned(map, kept.points, *params.thinning);
  if (!kept.views.empty()) {
    region.stored.views.reserve(region.stored.points.size());
    for (std::size_t from = 0; const std::uint32_t k : region.stored.points) {
      while (kept.points[from] != k) ++from;
      region.stored.views.push_back(kept.views[from]);
    }
  }
  if (condenser.prepares()) region.observable = std::move(kept.points);
  return region;
}

/// Regions run in parallel and are stored in order; the first failing region decides the error.
/// Regions wait for the store as indices: points are copied for one region at a time.
Result<void> build_all(PointsView map, BuildSurvey& survey, const Work& work,
                       const BuildParams& params, const Condenser& condenser, MapStore& store,
                       BuildReport& report,
                       const std::function<void(const BuildProgress&)>& progress) {
  const auto regions = static_cast<std::uint32_t>(work.viewpoints.size());
  report.regions.assign(regions, {});
  report.seen.assign(regions, 0);
  Meter meter({.regions_done = 0,
               .regions = regions,
               .viewpoints_done = 0,
               .viewpoints = report.viewpoints},
              progress);
  Result<void> outcome{};
  std::atomic<bool> stop{false};
  std::atomic<std::uint32_t> tested{0};
  std::uint32_t next = 0;
  struct Item {
    RegionId region;
    Result<BuiltRegion> built;
  };

  const auto test = [&](std::uint32_t r) {
    const PointCloud& viewpoints = work.viewpoints[r];
    const auto inside =
        work.inside.begin.empty() ? std::span<const std::uint32_t>{} : work.inside[r];
    const RegionProgress of_region(meter, viewpoints.size());
    auto built = survey.observable_map(inside, viewpoints, of_region).map([&](auto&& seen) {
      return thinned_region(map, std::move(seen), params, condenser);
    });
    if (built) of_region.advanced(viewpoints.size());  // viewpoints that the plugin did not report
    ++tested;
    return std::make_shared<Item>(Item{RegionId{r}, std::move(built)});
  };
  const auto put = [&](Item& item) -> Result<void> {
    VANTAGE_TRY(BuiltRegion built, std::move(item.built));
    if (tested == regions) survey.release_scene();
    const std::uint32_t r = item.region.value;
    RegionMap region_map{.points = points_of(map, std::move(built.stored.points)),
                         .viewpoints = work.viewpoints[r],
                         .prepared = {},
                         .views = std::move(built.stored.views)};
    RegionSummary& summary = report.regions[r];
    summary.points = region_map.points.size();
    summary.viewpoints = region_map.viewpoints.size();
    const PointCloud observable = points_of(map, std::move(built.observable));
    VANTAGE_CHECK(condenser.apply(region_map, observable.empty() ? region_map.points : observable));
    summary.elements = region_map.prepared.elements;
    VANTAGE_CHECK(store.put(item.region, region_map));
    report.seen[r] = built.seen;
    report.skipped_viewpoints += built.skipped;
    const bool whole = params.scope == VisibilityScope::map;
    report.points_times_viewpoints +=
        static_cast<double>(region_map.viewpoints.size() - built.skipped) *
        static_cast<double>(whole ? map.size() : work.inside[r].size());
    meter.region_done();
    return {};
  };
  const auto tokens = static_cast<std::size_t>(tbb::this_task_arena::max_concurrency()) + 1;
  tbb::parallel_pipeline(
      tokens,
      tbb::make_filter<void, std::uint32_t>(tbb::filter_mode::serial_in_order,
                                            [&](tbb::flow_control& flow) {
                                              if (next == regions || stop) flow.stop();
                                              return next++;
                                            }) &
          tbb::make_filter<std::uint32_t, std::shared_ptr<Item>>(tbb::filter_mode::parallel, test) &
          tbb::make_filter<std::shared_ptr<Item>, void>(
              tbb::filter_mode::serial_in_order, [&](const std::shared_ptr<Item>& item) {
                if (!outcome) return;
                outcome = put(*item);
                if (outcome) return;
                outcome = fail(std::move(outcome).error().during(
                    "building region '" + report.partition[item->region].label + "'"));
                stop = true;
              }));
  return outcome;
}

}  // namespace

BuildParams BuildParams::from(const Config& config) {
  BuildParams params;
  params.viewpoints = config.viewpoints.value_or(ViewpointParams{});
  if (config.visibility) {
    params.scope = config.visibility->scope;
    params.max_range = config.visibility->max_range.value_or(params.max_range);
    params.min_views = config.visibility->min_views;
  }
  params.thinning = config.thinning;
  if (config.store) {
    params.content = config.store->content;
    params.views = config.store->views;
  }
  return params;
}

Result<BuildPlugins> load_build_plugins(const Config& config, const PluginLoader& loader) {
  constexpr std::string_view kJob = "building region maps";
  VANTAGE_TRY(const auto partitioner, config.need(config.partitioner, "partitioner", kJob));
  VANTAGE_TRY(const auto visibility, config.need(config.visibility, "visibility", kJob));
  VANTAGE_TRY(const StoreConfig store, config.need(config.store, "store", kJob));
  BuildPlugins plugins;
  VANTAGE_TRY(plugins.partitioner, loader.load<Partitioner>(partitioner));
  if (config.viewpoints && config.viewpoints->source == ViewpointSource::trajectory) {
    if (config.map && !config.map->trajectory) {
      return fail(ErrorCode::invalid_config,
                  "missing key 'trajectory' in [map], which viewpoints.source = \"trajectory\" "
                  "needs",
                  SourceLocation{config.file, 0, 0});
    }
  } else {
    VANTAGE_TRY(const auto ground, config.need(config.ground, "ground", kJob));
    VANTAGE_TRY(plugins.ground, loader.load<GroundFilter>(ground));
  }
  VANTAGE_TRY(plugins.visibility, loader.load<VisibilityOperator>(visibility.choice()));
  VANTAGE_TRY(plugins.store, loader.load<MapStore>(store.choice()));
  if (store.content != StoredContent::points) {
    VANTAGE_TRY(const auto matcher,
                config.need(config.matcher, "matcher", "storing prepared region maps"));
    VANTAGE_TRY(plugins.matcher, loader.load<ScanMatcher>(matcher));
  }
  return plugins;
}

Result<BuildReport> build_region_maps(PointsView map, PointsView trajectory, BuildPlugins& plugins,
                                      const BuildParams& params,
                                      const std::function<void(const BuildProgress&)>& progress) {
  VANTAGE_CHECK(check_points(map, "the map"));

  BuildReport report;
  report.map_points = map.size();
  Stopwatch stopwatch;
  VANTAGE_TRY(const auto survey, BuildSurvey::over(map, trajectory, plugins, params));
  report.ground_points = survey->places().ground_points;
  report.unreachable_viewpoints = survey->places().unreachable_viewpoints;
  report.seconds_ground = stopwatch.seconds();

  stopwatch = {};
  VANTAGE_TRY(report.partition, plugins.partitioner->partition(map, trajectory, *survey));
  VANTAGE_TRY(const Work work, cut(map, survey->places(), report.partition, params));
  survey->release_places();
  report.places_outside = work.places_outside;
  const std::size_t regions = report.partition.size();
  for (std::size_t r = 0; r < regions; ++r) {
    const std::size_t viewpoints = work.viewpoints[r].size();
    report.viewpoints += viewpoints;
    if (viewpoints == 0) ++report.regions_without_viewpoints;
  }
  report.seconds_partition = stopwatch.seconds();

  stopwatch = {};
  const CpuStopwatch cpu;
  VANTAGE_TRY(const Condenser condenser, Condenser::over(map, plugins, params.content));
  VANTAGE_CHECK(plugins.store->begin(MapIndex{.partition = report.partition,
                                              .regions = {},
                                              .map_bounds = survey->limits().map_bounds,
                                              .map_points = report.map_points,
                                              .config = params.effective_config}));
  VANTAGE_CHECK(build_all(map, *survey, work, params, condenser, *plugins.store, report, progress));
  VANTAGE_CHECK(plugins.store->commit());
  report.seconds_visibility = stopwatch.seconds();
  report.core_seconds_visibility = cpu.seconds();
  return report;
}

}  // namespace vantage
