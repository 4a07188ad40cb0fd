#include "build/blocks.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <utility>

namespace vantage {
namespace {

bool needs_nothing(const Bounds2& area) { return !(area.min.array() <= area.max.array()).all(); }

Bounds2 union_of(std::span<const std::uint32_t> regions, const std::vector<Bounds2>& areas) {
  Bounds2 all;
  for (const std::uint32_t r : regions) {
    if (needs_nothing(areas[r])) continue;
    all.extend(areas[r].min);
    all.extend(areas[r].max);
  }
  return all;
}

}  // namespace

Bounds2 with_margin(const Bounds2& area, double margin) noexcept {
  if (needs_nothing(area)) return area;
  const Eigen::Vector2d around = Eigen::Vector2d::Constant(margin);
  return {area.min - around, area.max + around};
}

std::vector<std::uint32_t> owners_in(const RegionBlock& block, PointsView points,
                                     const Partition& partition) {
  const auto nobody = static_cast<std::uint32_t>(block.regions.size());
  std::vector<std::uint32_t> place(partition.size(), nobody);
  for (std::uint32_t k = 0; k < nobody; ++k) place[block.regions[k]] = k;
  std::vector<std::uint32_t> owners(points.size(), nobody);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size()), [&](const auto& range) {
    for (std::size_t k = range.begin(); k != range.end(); ++k) {
      if (const auto region = partition.locate(points[k])) owners[k] = place[region->value];
    }
  });
  return owners;
}

void halve(std::span<std::uint32_t> regions, const std::vector<Eigen::Vector2d>& middles,
           const std::function<std::optional<Bounds2>(std::span<const std::uint32_t>)>& box_of) {
  const std::optional<Bounds2> box = box_of(regions);
  if (!box) return;
  const Eigen::Vector2d size = box->max - box->min;
  const Eigen::Index axis = size.x() >= size.y() ? 0 : 1;
  const auto middle = regions.begin() + static_cast<std::ptrdiff_t>(regions.size() / 2);
  std::nth_element(regions.begin(), middle, regions.end(), [&](std::uint32_t a, std::uint32_t b) {
    return middles[a][axis] != middles[b][axis] ? middles[a][axis] < middles[b][axis] : a < b;
  });
  halve({regions.begin(), middle}, middles, box_of);
  halve({middle, regions.end()}, middles, box_of);
}

RegionNeed largest_need(const MapParts& map, std::span<const std::uint32_t> regions,
                        const std::vector<Bounds2>& areas) {
  RegionNeed most{.region = regions.front()};
  for (const std::uint32_t r : regions) {
    const std::uint64_t points = needs_nothing(areas[r]) ? 0 : map.points_in(areas[r]);
    if (points > most.points) most = {r, points};
  }
  return most;
}

tl::unexpected<Error> does_not_fit(const std::string& label, std::uint64_t points,
                                   std::uint64_t memory, std::uint64_t bytes_a_point,
                                   std::uint64_t enough) {
  constexpr std::uint64_t kMiB = std::uint64_t{1} << 20U;
  const auto rounded_up = [](std::uint64_t bytes) {
    return std::to_string((bytes + kMiB - 1) / kMiB) + " MiB";
  };
  if (points > kMostBlockPoints) {
    return fail(ErrorCode::invalid_input,
                "region '" + label + "' and what decides about it are " + std::to_string(points) +
                    " points, but no more than " + std::to_string(kMostBlockPoints) +
                    " can be worked on at once: make the regions or max_range smaller");
  }
  const std::uint64_t bytes = points * bytes_a_point;
  return fail(
      ErrorCode::invalid_input,
      "region '" + label + "' and what decides about it are " + std::to_string(points) +
          " points, which takes " + rounded_up(bytes) + ", but the build may use " +
          std::to_string(memory / kMiB) + " MiB: allow more memory" +
          (enough > bytes ? " (" + rounded_up(enough) + " is enough for all regions)" : "") +
          ", or make the regions or max_range smaller");
}

Result<std::vector<RegionBlock>> blocks_of(const MapParts& map, const Partition& partition,
                                           std::span<const std::uint32_t> wanted,
                                           const std::vector<Bounds2>& areas, std::uint64_t memory,
                                           std::uint64_t bytes_a_point) {
  RegionBlock without_points;
  std::vector<std::uint32_t> regions;
  for (const std::uint32_t r : wanted) {
    (needs_nothing(areas[r]) ? without_points.regions : regions).push_back(r);
  }
  std::ranges::sort(without_points.regions);
  std::vector<RegionBlock> blocks;
  if (!without_points.regions.empty()) blocks.push_back(std::move(without_points));
  if (regions.empty()) return blocks;
  const RegionNeed need = largest_need(map, regions, areas);
  const std::uint64_t most = std::min(memory / bytes_a_point, kMostBlockPoints);
  if (need.points > most) {
    return does_not_fit(partition.regions()[need.region].label, need.points, memory, bytes_a_point);
  }
  std::vector<Eigen::Vector2d> middles;
  for (const Bounds2& area : areas) middles.emplace_back(0.5 * (area.min + area.max));
  halve(regions, middles, [&](std::span<const std::uint32_t> some) -> std::optional<Bounds2> {
    const Bounds2 area = union_of(some, areas);
    if (some.size() > 1 && map.points_in(area) > most) return area;
    RegionBlock block{{some.begin(), some.end()}, area};
    std::ranges::sort(block.regions);
    blocks.push_back(std::move(block));
    return std::nullopt;
  });
  return blocks;
}

}  // namespace vantage
