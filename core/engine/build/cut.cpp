#include "build/cut.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <string>
#include <utility>

namespace vantage {
namespace {

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

}  // namespace

Result<Cut> cut(PointsView map, const Places& places, const Partition& partition,
                const BuildParams& params) {
  VANTAGE_TRY(auto region_of, regions_of(map, partition));
  const auto owner = [&](std::uint32_t k) { return region_of[k]; };
  Cut result;
  if (params.scope == VisibilityScope::region) {
    result.inside = grouped(
        map.size(), partition.size(), [](std::size_t k) { return static_cast<std::uint32_t>(k); },
        owner);
  }
  const auto regions = static_cast<std::uint32_t>(partition.size());
  if (!places.own.empty()) {
    region_of.clear();
    for (const Point& p : places.own) {
      const auto region = partition.locate(p);
      region_of.push_back(region ? region->value : regions);
    }
  }
  const Groups places_of = grouped(
      places.which.size(), regions + 1, [&](std::size_t i) { return places.which[i]; },
      owner);  // g_ij
  result.places_outside = places_of[regions].size();
  if (result.places_outside == places.which.size()) {
    return fail(ErrorCode::invalid_input,
                "the whole trajectory lies outside all regions, so no viewpoint can be placed: is "
                "the trajectory in the frame of the map?");
  }
  std::vector<Result<PointCloud>> viewpoints(partition.size());
  tbb::parallel_for(std::size_t{0}, partition.size(), [&](std::size_t r) {
    viewpoints[r] = viewpoints_over(places.points, places_of[r], params.viewpoints);
  });
  result.viewpoints.reserve(partition.size());
  for (auto& of_region : viewpoints) {
    VANTAGE_TRY(result.viewpoints.emplace_back(), std::move(of_region));
  }
  return result;
}

}  // namespace vantage
