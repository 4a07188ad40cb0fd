#include "build/regions.hpp"

#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <span>
#include <utility>

#include "build/progress.hpp"

namespace vantage {
namespace {

/// One run over the regions.
class Run {
 public:
  Run(const RegionsToBuild& regions, const Partition& partition, Sight& sight,
      const Condenser& condenser, Meter& meter, const TakeRegion& take)
      : regions_(regions),
        partition_(partition),
        sight_(sight),
        condenser_(condenser),
        meter_(meter),
        take_(take) {}

  Result<void> all() {
    if (std::ranges::any_of(regions_.which,
                            [&](std::uint32_t r) { return !regions_.viewpoints[r].empty(); })) {
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
                          return std::make_shared<Item>(Item{regions_.which[k], seen_from(k)});
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
    Result<Condensed> condensed;
  };

  [[nodiscard]] std::size_t count() const noexcept { return regions_.which.size(); }

  /// Runs for several regions at once.
  Result<Condensed> seen_from(std::size_t k) {
    const PointCloud& viewpoints = regions_.viewpoints[regions_.which[k]];
    const auto inside =
        regions_.inside.begin.empty() ? std::span<const std::uint32_t>{} : regions_.inside[k];
    const RegionProgress of_region(meter_, viewpoints.size());
    auto condensed =
        sight_.observable(inside, viewpoints, &of_region).and_then([&](auto&& observable) {
          return condenser_.thin(std::move(observable), viewpoints);
        });
    if (condensed)
      of_region.advanced(viewpoints.size());  // viewpoints that the plugin did not report
    ++seen_;
    return condensed;
  }

  void hand_on(Item& item) {
    if (seen_ == count()) sight_.release();
    outcome_ = std::move(item.condensed).and_then([&](Condensed&& condensed) {
      return take_(item.region, std::move(condensed));
    });
    if (outcome_) {
      meter_.region_done();
      return;
    }
    outcome_ = fail(std::move(outcome_).error().during(
        "building region '" + partition_[RegionId{item.region}].label + "'"));
    stop_ = true;
  }

  const RegionsToBuild& regions_;
  const Partition& partition_;
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

Result<void> build_regions(const RegionsToBuild& regions, const Partition& partition, Sight& sight,
                           const Condenser& condenser, Meter& meter, const TakeRegion& take) {
  return Run(regions, partition, sight, condenser, meter, take).all();
}

}  // namespace vantage
