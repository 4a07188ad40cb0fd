#include "build/survey.hpp"

#include <string>

#include "vantage/plugin.hpp"

namespace vantage {
namespace {

/// The points that a region owns, among those in an index over `points`.
IndexList owned(const Region& region, PointsView points, const PlanIndex& index) {
  const Bounds2 bounds = bounds_of(region.footprint);
  IndexList inside = index.near(bounds.min, bounds.max);
  std::erase_if(inside, [&](std::uint32_t k) {
    const Point& p = points[k];
    return !region.height.contains(p.z()) || !contains(region.footprint, p.head<2>());
  });
  return inside;
}

tl::unexpected<Error> not_surveyed(const std::string& what) {
  return fail(ErrorCode::unsupported, what + " is known only once the whole map is in memory");
}

}  // namespace

Result<PointCloud> BuildSurvey::viewpoints() const noexcept {
  return guarded(
      [&] { return viewpoints_over(places_.points, places_.which, params_.viewpoints); });
}

Result<Bounds3> BuildSurvey::ground_bounds() const noexcept {
  if (places_.ground_points == 0) {
    return fail(ErrorCode::unsupported,
                "viewpoints.source = \"trajectory\" finds no ground, so the ground has no bounds");
  }
  Bounds3 bounds;
  for (const std::uint32_t k : places_.which) bounds.extend(places_.points[k]);
  return bounds;
}

Result<IndexList> BuildSurvey::visible(const Point& viewpoint) const noexcept {
  return guarded([&] { return sight_.visible(viewpoint); });
}

Result<std::uint64_t> BuildSurvey::observable_points(const Region& region,
                                                     std::uint64_t enough) const noexcept {
  return guarded([&]() -> Result<std::uint64_t> {
    const IndexList places = owned(region, places_.points, index_of_places());  // g_ij
    VANTAGE_TRY(const PointCloud viewpoints,
                viewpoints_over(places_.points, places, params_.viewpoints));
    IndexList inside;  // P_ij
    if (params_.scope == VisibilityScope::region && !viewpoints.empty()) {
      inside = owned(region, map_, index_of_map());
    }
    return sight_.count(inside, viewpoints, enough);
  });
}

const PlanIndex& BuildSurvey::index_of_places() const {
  std::call_once(places_indexed_, [&] {
    place_index_.emplace(places_.points, places_.which.size(),
                         [&](std::size_t i) { return places_.which[i]; });
  });
  return *place_index_;
}

const PlanIndex& BuildSurvey::index_of_map() const {
  std::call_once(map_indexed_, [&] {
    map_index_.emplace(map_, map_.size(),
                       [](std::size_t k) { return static_cast<std::uint32_t>(k); });
  });
  return *map_index_;
}

Result<PointCloud> NoSurvey::viewpoints() const noexcept { return not_surveyed("viewpoints"); }
Result<Bounds3> NoSurvey::ground_bounds() const noexcept { return not_surveyed("the ground"); }
Result<IndexList> NoSurvey::visible(const Point& /*viewpoint*/) const noexcept {
  return not_surveyed("what a viewpoint sees");
}
Result<std::uint64_t> NoSurvey::observable_points(const Region& /*region*/,
                                                  std::uint64_t /*enough*/) const noexcept {
  return not_surveyed("what a region shows");
}

}  // namespace vantage
