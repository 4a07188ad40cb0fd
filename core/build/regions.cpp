#include "build/regions.hpp"

#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "build/plan_index.hpp"

namespace vantage {
namespace {

/// P_ij of Eq. 3 of the regions of a block, by place in the block.
Groups points_inside(const RegionBlock& block, PointsView map, const Partition& partition) {
  const std::vector<std::uint32_t> owners = owners_in(block, map, partition);
  return grouped(
      map.size(), block.regions.size() + 1,
      [](std::size_t k) { return static_cast<std::uint32_t>(k); },
      [&](std::uint32_t k) { return owners[k]; });
}

}  // namespace

Result<void> build_block(const RegionBlock& block, const BuildPlan& plan, VisibilityScope scope,
                         Sight& sight, const Condenser& condenser, Meter& meter,
                         const TakeRegion& take) {
  const std::vector<std::uint32_t>& regions = block.regions;
  Groups inside;
  if (scope == VisibilityScope::region) inside = points_inside(block, sight.map(), plan.partition);
  if (std::ranges::any_of(regions, [&](std::uint32_t r) { return !plan.viewpoints[r].empty(); })) {
    VANTAGE_CHECK(sight.prepare());
  }
  struct Item {
    std::uint32_t region;
    Result<BuiltRegion> built;
  };
  std::size_t next = 0;
  std::atomic<std::size_t> seen{0};  // regions
  std::atomic<bool> stop{false};
  Result<void> outcome{};

  const auto begin = [&](tbb::flow_control& flow) {
    if (next == regions.size() || stop) flow.stop();
    return next++;
  };
  const auto see = [&](std::size_t k) {  // runs for several regions at once
    const PointCloud& viewpoints = plan.viewpoints[regions[k]];
    const auto own = inside.begin.empty() ? std::span<const std::uint32_t>{} : inside[k];
    const RegionProgress of_region(meter, viewpoints.size());
    auto built = sight.observable(own, viewpoints, &of_region).and_then([&](auto observable) {
      return condenser.thin(std::move(observable), viewpoints);
    });
    if (built) of_region.advanced(viewpoints.size());  // those that the plugin did not report
    ++seen;
    return std::make_shared<Item>(Item{regions[k], std::move(built)});
  };
  const auto hand_on = [&](const std::shared_ptr<Item>& item) {
    if (!outcome) return;
    if (seen == regions.size()) sight.release();
    outcome =
        std::move(item->built)
            .and_then([&](BuiltRegion&& built) { return condenser.finish(std::move(built)); })
            .and_then([&](BuiltRegion&& built) { return take(item->region, std::move(built)); });
    if (outcome) {
      meter.region_done();
      return;
    }
    outcome = fail(std::move(outcome).error().during(
        "building region '" + plan.partition[RegionId{item->region}].label + "'"));
    stop = true;
  };
  using tbb::filter_mode;
  tbb::parallel_pipeline(
      static_cast<std::size_t>(tbb::this_task_arena::max_concurrency()) + 1,
      tbb::make_filter<void, std::size_t>(filter_mode::serial_in_order, begin) &
          tbb::make_filter<std::size_t, std::shared_ptr<Item>>(filter_mode::parallel, see) &
          tbb::make_filter<std::shared_ptr<Item>, void>(filter_mode::serial_in_order, hand_on));
  return outcome;
}

}  // namespace vantage
