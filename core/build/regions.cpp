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

/// One run over the regions of a block.
class Run {
 public:
  Run(const RegionBlock& block, const BuildPlan& plan, Groups inside, Sight& sight,
      const Condenser& condenser, Meter& meter, const TakeRegion& take)
      : which_(block.regions),
        plan_(plan),
        inside_(std::move(inside)),
        sight_(sight),
        condenser_(condenser),
        meter_(meter),
        take_(take) {}

  Result<void> all() {
    if (std::ranges::any_of(which_,
                            [&](std::uint32_t r) { return !plan_.viewpoints[r].empty(); })) {
      VANTAGE_CHECK(sight_.prepare());
    }
    const auto tokens = static_cast<std::size_t>(tbb::this_task_arena::max_concurrency()) + 1;
    tbb::parallel_pipeline(
        tokens, tbb::make_filter<void, std::size_t>(tbb::filter_mode::serial_in_order,
                                                    [&](tbb::flow_control& flow) {
                                                      if (next_ == count() || stop_) flow.stop();
                                                      return next_++;
                                                    }) &
                    tbb::make_filter<std::size_t, std::shared_ptr<Item>>(
                        tbb::filter_mode::parallel,
                        [&](std::size_t k) {
                          return std::make_shared<Item>(Item{which_[k], seen_from(k)});
                        }) &
                    tbb::make_filter<std::shared_ptr<Item>, void>(
                        tbb::filter_mode::serial_in_order, [&](const std::shared_ptr<Item>& item) {
                          if (outcome_) hand_on(*item);
                        }));
    return std::move(outcome_);
  }

 private:
  struct Item {
    std::uint32_t region;
    Result<BuiltRegion> built;
  };

  [[nodiscard]] std::size_t count() const noexcept { return which_.size(); }

  /// Runs for several regions at once.
  Result<BuiltRegion> seen_from(std::size_t k) {
    const PointCloud& viewpoints = plan_.viewpoints[which_[k]];
    const auto inside = inside_.begin.empty() ? std::span<const std::uint32_t>{} : inside_[k];
    const RegionProgress of_region(meter_, viewpoints.size());
    auto built = sight_.observable(inside, viewpoints, &of_region).and_then([&](auto observable) {
      return condenser_.thin(std::move(observable), viewpoints);
    });
    if (built) of_region.advanced(viewpoints.size());  // those that the plugin did not report
    ++seen_;
    return built;
  }

  void hand_on(Item& item) {
    if (seen_ == count()) sight_.release();
    outcome_ =
        std::move(item.built)
            .and_then([&](BuiltRegion&& built) { return condenser_.finish(std::move(built)); })
            .and_then([&](BuiltRegion&& built) { return take_(item.region, std::move(built)); });
    if (outcome_) {
      meter_.region_done();
      return;
    }
    outcome_ = fail(std::move(outcome_).error().during(
        "building region '" + plan_.partition[RegionId{item.region}].label + "'"));
    stop_ = true;
  }

  const std::vector<std::uint32_t>& which_;
  const BuildPlan& plan_;
  Groups inside_;
  Sight& sight_;
  const Condenser& condenser_;
  Meter& meter_;
  const TakeRegion& take_;
  std::atomic<bool> stop_{false};
  std::atomic<std::size_t> seen_{0};  // regions
  std::size_t next_ = 0;
  Result<void> outcome_{};
};

}  // namespace

Result<void> build_block(const RegionBlock& block, const BuildPlan& plan, VisibilityScope scope,
                         Sight& sight, const Condenser& condenser, Meter& meter,
                         const TakeRegion& take) {
  Groups inside;
  if (scope == VisibilityScope::region) inside = points_inside(block, sight.map(), plan.partition);
  return Run(block, plan, std::move(inside), sight, condenser, meter, take).all();
}

}  // namespace vantage
