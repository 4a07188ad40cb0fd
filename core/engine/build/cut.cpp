#include "build/cut.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <numeric>
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

/// 0, 1, ..., count - 1.
std::vector<std::uint32_t> every(std::uint32_t count) {
  std::vector<std::uint32_t> all(count);
  std::iota(all.begin(), all.end(), 0U);
  return all;
}

}  // namespace

Result<void> viewpoints_of_groups(PointsView points, const Groups& groups,
                                  std::span<const std::uint32_t> regions,
                                  const ViewpointParams& params,
                                  std::vector<PointCloud>& viewpoints) {
  std::vector<Result<PointCloud>> made(regions.size());
  tbb::parallel_for(std::size_t{0}, regions.size(),
                    [&](std::size_t g) { made[g] = viewpoints_over(points, groups[g], params); });
  for (std::size_t g = 0; g < regions.size(); ++g) {
    VANTAGE_TRY(viewpoints[regions[g]], std::move(made[g]));
  }
  return {};
}

Result<std::uint64_t> viewpoints_along(const Places& places, const Partition& partition,
                                       const ViewpointParams& params,
                                       std::vector<PointCloud>& viewpoints) {
  const auto regions = static_cast<std::uint32_t>(partition.size());
  std::vector<std::uint32_t> region_of;
  for (const Point& p : places.own) {
    const auto region = partition.locate(p);
    region_of.push_back(region ? region->value : regions);
  }
  const Groups places_of = grouped(
      places.which.size(), regions + 1, [&](std::size_t i) { return places.which[i]; },
      [&](std::uint32_t k) { return region_of[k]; });  // g_ij
  const std::uint64_t outside = places_of[regions].size();
  if (outside == places.which.size()) {
    return fail(ErrorCode::invalid_input,
                "the whole trajectory lies outside all regions, so no viewpoint can be placed: is "
                "the trajectory in the frame of the map?");
  }
  VANTAGE_CHECK(viewpoints_of_groups(places.own, places_of, every(regions), params, viewpoints));
  return outside;
}

Result<Cut> cut(PointsView map, const Places& places, const Partition& partition,
                const BuildParams& params) {
  VANTAGE_TRY(const auto region_of, regions_of(map, partition));
  const auto owner = [&](std::uint32_t k) { return region_of[k]; };
  Cut result;
  if (params.scope == VisibilityScope::region) {
    result.inside = grouped(
        map.size(), partition.size(), [](std::size_t k) { return static_cast<std::uint32_t>(k); },
        owner);
  }
  const auto regions = static_cast<std::uint32_t>(partition.size());
  result.viewpoints.resize(regions);
  if (!places.own.empty()) {
    VANTAGE_TRY(result.places_outside,
                viewpoints_along(places, partition, params.viewpoints, result.viewpoints));
    return result;
  }
  const Groups ground = grouped(
      places.which.size(), regions, [&](std::size_t i) { return places.which[i]; },
      owner);  // g_ij
  VANTAGE_CHECK(viewpoints_of_groups(places.points, ground, every(regions), params.viewpoints,
                                     result.viewpoints));
  return result;
}

}  // namespace vantage
