#include "build/regions.hpp"

#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <memory>
#include <span>
#include <utility>

#include "build/progress.hpp"

namespace vantage {
namespace {

/// One run over all regions.
class Run {
 public:
  Run(PointsView map, Sight& sight, const Cut& cut, const Condenser& condenser, MapStore& store,
      SiteTrials* trials, BuildReport report,
      const std::function<void(const BuildProgress&)>& progress)
      : map_(map),
        sight_(sight),
        cut_(cut),
        condenser_(condenser),
        store_(store),
        trials_(trials),
        report_(std::move(report)),
        meter_({.regions_done = 0,
                .regions = cut.viewpoints.size(),
                .viewpoints_done = 0,
                .viewpoints = report_.viewpoints},
               progress) {
    report_.regions.assign(regions(), {});
    report_.seen.assign(regions(), 0);
  }

  Result<BuildReport> all() {
    const auto tokens = static_cast<std::size_t>(tbb::this_task_arena::max_concurrency()) + 1;
    tbb::parallel_pipeline(
        tokens, tbb::make_filter<void, std::uint32_t>(tbb::filter_mode::serial_in_order,
                                                      [&](tbb::flow_control& flow) {
                                                        if (next_ == regions() || stop_)
                                                          flow.stop();
                                                        return next_++;
                                                      }) &
                    tbb::make_filter<std::uint32_t, std::shared_ptr<Item>>(
                        tbb::filter_mode::parallel,
                        [&](std::uint32_t r) {
                          return std::make_shared<Item>(Item{r, seen_from_region(r)});
                        }) &
                    tbb::make_filter<std::shared_ptr<Item>, void>(
                        tbb::filter_mode::serial_in_order, [&](const std::shared_ptr<Item>& item) {
                          if (outcome_) put(*item);
                        }));
    if (!outcome_) return fail(std::move(outcome_).error());
    return std::move(report_);
  }

 private:
  struct Item {
    std::uint32_t region;
    Result<Condensed> condensed;
  };

  [[nodiscard]] std::uint32_t regions() const noexcept {
    return static_cast<std::uint32_t>(cut_.viewpoints.size());
  }
  [[nodiscard]] bool among_own_points() const noexcept { return !cut_.inside.begin.empty(); }

  /// Runs for several regions at once.
  Result<Condensed> seen_from_region(std::uint32_t r) {
    const PointCloud& viewpoints = cut_.viewpoints[r];
    const auto inside = among_own_points() ? cut_.inside[r] : std::span<const std::uint32_t>{};
    const RegionProgress of_region(meter_, viewpoints.size());
    auto condensed = sight_.observable(inside, viewpoints, &of_region).map([&](auto&& observable) {
      return condenser_.thin(std::move(observable));
    });
    if (condensed)
      of_region.advanced(viewpoints.size());  // viewpoints that the plugin did not report
    ++seen_;
    return condensed;
  }

  void put(Item& item) {
    if (seen_ == regions()) sight_.release();
    outcome_ = store(item.region, std::move(item.condensed));
    if (outcome_) return;
    outcome_ = fail(std::move(outcome_).error().during(
        "building region '" + report_.partition[RegionId{item.region}].label + "'"));
    stop_ = true;
  }

  Result<void> store(std::uint32_t r, Result<Condensed> seen) {
    VANTAGE_TRY(Condensed condensed, std::move(seen));
    const std::size_t viewpoints = cut_.viewpoints[r].size();
    const std::size_t among = among_own_points() ? cut_.inside[r].size() : map_.size();
    report_.seen[r] = condensed.seen;
    report_.skipped_viewpoints += condensed.skipped;
    report_.points_times_viewpoints +=
        static_cast<double>(viewpoints - condensed.skipped) * static_cast<double>(among);
    RegionSummary& summary = report_.regions[r];
    summary.points = condensed.stored.points.size();
    summary.viewpoints = viewpoints;
    VANTAGE_TRY(const RegionMap region_map,
                condenser_.region_map(std::move(condensed), cut_.viewpoints[r]));
    summary.elements = region_map.prepared.elements;
    VANTAGE_CHECK(store_.put(RegionId{r}, region_map));
    if (trials_ != nullptr) VANTAGE_CHECK(trials_->run_in(RegionId{r}, region_map));
    meter_.region_done();
    return {};
  }

  PointsView map_;
  Sight& sight_;
  const Cut& cut_;
  const Condenser& condenser_;
  MapStore& store_;
  SiteTrials* trials_;
  BuildReport report_;
  Meter meter_;
  std::atomic<bool> stop_{false};
  std::atomic<std::uint32_t> seen_{0};  // regions
  std::uint32_t next_ = 0;
  Result<void> outcome_{};
};

}  // namespace

Result<BuildReport> build_regions(PointsView map, Sight& sight, const Cut& cut,
                                  const Condenser& condenser, MapStore& store, SiteTrials* trials,
                                  BuildReport report,
                                  const std::function<void(const BuildProgress&)>& progress) {
  return Run(map, sight, cut, condenser, store, trials, std::move(report), progress).all();
}

}  // namespace vantage
