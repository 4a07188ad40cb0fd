#include "build/sight.hpp"

#include <tbb/task_arena.h>

#include <algorithm>
#include <bit>
#include <utility>
#include <vector>

#include "build/adaptive_viewpoints.hpp"
#include "build/plugin_checks.hpp"

namespace vantage {

/// The points among which a region's visibility is decided, ready for queries.
struct Sight::Scope {
  PointsView points;
  const VisibilityScene* scene = nullptr;  // none without points: plugins refuse to prepare none
  PointCloud own_points;  // the region's own points; `points` views either them or the map
  PluginPtr<VisibilityScene> own_scene;

  [[nodiscard]] Result<IndexList> seen_from(std::span<const Point> viewpoints,
                                            const VisibilityProgress* progress) const {
    if (scene == nullptr) return IndexList();
    VANTAGE_TRY(IndexList seen, scene->visible_from_any(viewpoints, progress));
    VANTAGE_CHECK(check_indices(seen, points.size(), "visibility"));
    return seen;
  }
  /// @param count_views  whether `views` is filled in
  [[nodiscard]] Result<ViewCounts> views_from(std::span<const Point> viewpoints, bool count_views,
                                              const VisibilityProgress* progress) const {
    ViewCounts counts;
    if (scene == nullptr) return counts;
    if (!count_views) {
      VANTAGE_TRY(counts.points, seen_from(viewpoints, progress));
      return counts;
    }
    VANTAGE_TRY(counts, scene->view_counts(viewpoints, progress));
    VANTAGE_CHECK(check_indices(counts.points, points.size(), "visibility"));
    VANTAGE_CHECK(check_views(counts, viewpoints.size()));
    return counts;
  }
};

namespace {

/// What two groups of viewpoints see together; `views` of both or of neither.
ViewCounts joined(const ViewCounts& a, const ViewCounts& b) {
  const bool counted = !a.views.empty() || !b.views.empty();
  ViewCounts all;
  all.points.reserve(a.points.size() + b.points.size());
  if (counted) all.views.reserve(all.points.capacity());
  for (std::size_t i = 0, j = 0; i < a.points.size() || j < b.points.size();) {
    const bool in_a = j == b.points.size() || (i < a.points.size() && a.points[i] <= b.points[j]);
    const bool in_b = i == a.points.size() || (j < b.points.size() && b.points[j] <= a.points[i]);
    all.points.push_back(in_a ? a.points[i] : b.points[j]);
    if (counted) all.views.push_back((in_a ? a.views[i] : 0) + (in_b ? b.views[j] : 0));
    i += in_a ? 1 : 0;
    j += in_b ? 1 : 0;
  }
  return all;
}

/// How many points are seen from `needed` viewpoints; all of them where views were not counted.
std::size_t often_seen(const ViewCounts& counts, std::size_t needed) {
  if (counts.views.empty()) return counts.points.size();
  return static_cast<std::size_t>(
      std::count_if(counts.views.begin(), counts.views.end(),
                    [&](std::uint32_t views) { return views >= needed; }));
}

void keep_often_seen(ViewCounts& counts, std::size_t needed) {
  if (counts.views.empty()) return;
  std::size_t to = 0;
  for (std::size_t from = 0; from < counts.points.size(); ++from) {
    if (counts.views[from] < needed) continue;
    counts.points[to] = counts.points[from];
    counts.views[to++] = counts.views[from];
  }
  counts.points.resize(to);
  counts.views.resize(to);
}

/// 0 .. n - 1 in an order whose every prefix is spread over the whole: counts with the bits
/// reversed.
std::vector<std::size_t> spread_order(std::size_t n) {
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

/// Viewpoints far apart come first, and each batch has more of them: a region that shows too much
/// is detected early.
std::vector<PointCloud> growing_batches(std::span<const Point> viewpoints) {
  std::vector<PointCloud> batches;
  std::size_t size = 1;
  for (const std::size_t i : spread_order(viewpoints.size())) {
    if (batches.empty() || batches.back().size() == size) {
      size = std::size_t{1} << batches.size();
      batches.emplace_back();
    }
    batches.back().push_back(viewpoints[i]);
  }
  return batches;
}

tl::unexpected<Error> no_scene() {
  return fail(ErrorCode::internal,
              "the visibility plugin broke its contract: prepare gave no scene and no error");
}

}  // namespace

Result<void> Sight::prepare() const {
  if (params_.scope != VisibilityScope::map || map_.empty()) return {};
  return map_scene().map([](const VisibilityScene*) {});
}

Result<IndexList> Sight::visible(const Point& viewpoint) const {
  VANTAGE_TRY(const auto* scene, map_scene());
  VANTAGE_TRY(IndexList seen, scene->visible(viewpoint));
  VANTAGE_CHECK(check_indices(seen, map_.size(), "visibility"));
  return seen;
}

Result<Observable> Sight::look(std::span<const std::uint32_t> inside,
                               std::span<const Point> viewpoints, std::uint64_t enough,
                               bool keep_views, const VisibilityProgress* progress) const {
  Observable observable;
  if (viewpoints.empty()) return observable;
  VANTAGE_TRY(const Scope scope, scope_of(inside));
  ViewCounts& kept = observable.kept;
  if (const ViewpointParams& which = params_.viewpoints; which.min_gain > 0.0 && !counts_views()) {
    const auto seen_from = [&](std::span<const Point> some) {
      return scope.seen_from(some, progress);
    };
    VANTAGE_TRY(AdaptiveSight sight, see_adaptively(viewpoints, which.voxel_size, which.min_gain,
                                                    scope.points.size(), seen_from, enough));
    observable.seen = sight.seen.size();
    observable.skipped = sight.skipped;
    kept.points = std::move(sight.seen);
  } else {
    // If a region has fewer viewpoints, all of them must see a point.
    const auto needed = std::min<std::size_t>(params_.min_views, viewpoints.size());
    const bool count_views = needed > 1 || keep_views;
    if (enough == kAll) {
      // All viewpoints in one call, because a scene uses what it learned from earlier viewpoints.
      VANTAGE_TRY(kept, scope.views_from(viewpoints, count_views, progress));
    } else {
      for (const PointCloud& batch : growing_batches(viewpoints)) {
        VANTAGE_TRY(const ViewCounts more, scope.views_from(batch, count_views, progress));
        kept = joined(kept, more);
        if (often_seen(kept, needed) > enough) break;
      }
    }
    observable.seen = kept.points.size();
    keep_often_seen(kept, needed);
    if (!keep_views) kept.views = {};
  }
  if (params_.scope == VisibilityScope::region) {
    for (std::uint32_t& k : kept.points) k = inside[k];
  }
  return observable;
}

Result<Sight::Scope> Sight::scope_of(std::span<const std::uint32_t> inside) const {
  Scope scope;
  // The viewpoints of a block may stand far from all points, those of a region outside its own.
  if (params_.scope == VisibilityScope::map ? map_.empty() : inside.empty()) return scope;
  // A region that owns every point uses the map's scene, without a copy of the map.
  if (params_.scope == VisibilityScope::map || inside.size() == map_.size()) {
    scope.points = map_;
    VANTAGE_TRY(scope.scene, map_scene());
    return scope;
  }
  scope.own_points = select(map_, inside);
  scope.points = scope.own_points;
  VANTAGE_TRY(scope.own_scene, scene_of(scope.points));
  scope.scene = scope.own_scene.get();
  return scope;
}

Result<PluginPtr<VisibilityScene>> Sight::scene_of(PointsView points) const {
  VANTAGE_TRY(auto prepared, visibility_->prepare(points, limits_));
  if (!prepared) return no_scene();
  return in_library_of(visibility_, std::move(prepared));
}

/// The scene of the whole map, prepared at the first query.
Result<const VisibilityScene*> Sight::map_scene() const {
  const std::scoped_lock lock(mutex_);
  if (!map_scene_) {
    // Isolated: while this thread waits for its own tasks, it must not take up another task of
    // the build. That task would come here and wait for the lock that this thread holds.
    auto prepared = tbb::this_task_arena::isolate([&] { return scene_of(map_); });
    if (!prepared) return fail(std::move(prepared).error());
    map_scene_ = *std::move(prepared);
  }
  return map_scene_.get();
}

}  // namespace vantage
