#include "build/condense.hpp"

#include <utility>

#include "vantage/build/thinning.hpp"
#include "vantage/kit/index_set.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {
namespace {

/// Many indices are kept as bits while points are copied, because bits are smaller.
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

}  // namespace

Result<Condenser> Condenser::over(PointsView map, const BuildPlugins& plugins,
                                  const BuildParams& params, Sparse sparse) {
  Condenser condenser(map, params);
  if (map.empty() || params.content == StoredContent::points) return condenser;
  auto whole = plugins.matcher->prepare(map);
  if (!whole) {
    const bool is_sparse = whole.error().code == ErrorCode::too_few_matches;
    if (is_sparse && sparse == Sparse::accept) return condenser;
    return fail(std::move(whole).error());
  }
  condenser.whole_ = in_library_of(plugins.matcher, *std::move(whole));
  auto offered =
      plugins.selector ? condenser.whole_->excerpt_of({}, {}) : condenser.whole_->excerpt({});
  if (!offered) return fail(std::move(offered).error());
  if (plugins.selector) {
    condenser.selection_ = std::make_unique<Selection>(*condenser.whole_, *plugins.selector,
                                                       params.selection, params.max_range, map);
  }
  return condenser;
}

Result<BuiltRegion> Condenser::thin(Observable observable,
                                    std::span<const Point> viewpoints) const {
  ViewCounts& kept = observable.kept;
  BuiltRegion region{.seen = observable.seen, .skipped = observable.skipped};
  if (selection_ && !kept.points.empty()) {
    VANTAGE_TRY(Selected selected, selection_->of(points_of(map_, kept.points), viewpoints));
    region.prepared = std::move(selected.prepared);
    region.errors = std::move(selected.errors);
  }
  if (!params_.thinning) {
    region.points = kept.points.size();
    region.stored = std::move(kept);
    return region;
  }
  ViewCounts& stored = region.stored;
  stored.points = thinned(map_, kept.points, *params_.thinning);
  region.points = stored.points.size();
  if (!kept.views.empty()) {
    stored.views.reserve(stored.points.size());
    for (std::size_t from = 0; const std::uint32_t k : stored.points) {
      while (kept.points[from] != k) ++from;
      stored.views.push_back(kept.views[from]);
    }
  }
  if (whole_ && !selection_) region.observable = std::move(kept.points);
  return region;
}

Result<BuiltRegion> Condenser::finish(BuiltRegion region) const {
  // The prepared map stands for all that was seen, not for what thinning left.
  IndexList observable = std::exchange(region.observable, {});
  const IndexList& all = observable.empty() ? region.stored.points : observable;
  if (whole_ && !selection_ && !all.empty()) {
    VANTAGE_TRY(PreparedMap prepared, whole_->excerpt(points_of(map_, all)));
    if (prepared.elements > 0) region.prepared = std::move(prepared);
  }
  if (params_.content == StoredContent::prepared) region.stored = {};
  return region;
}

RegionMap region_map_of(PointsView map, BuiltRegion region, PointCloud viewpoints) {
  return {.points = points_of(map, std::move(region.stored.points)),
          .viewpoints = std::move(viewpoints),
          .prepared = std::move(region.prepared),
          .views = std::move(region.stored.views)};
}

}  // namespace vantage
