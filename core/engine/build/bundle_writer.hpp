#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "atlas/site_trials.hpp"
#include "build/condense.hpp"
#include "build/plan.hpp"
#include "stopwatch.hpp"
#include "vantage/engine/build.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Writes the bundle of a plan: regions, the index of places, and an atlas.
class BundleWriter {
 public:
  /// Begins the bundle, keeps the index of places, and makes ready what measures the atlas, if it
  /// is wanted and the store can keep it. All arguments but `hits_at` are borrowed.
  /// @param hits_at  only used during this call
  /// Errors: those of the store, of `hits_at` and of the matcher.
  [[nodiscard]] static Result<BundleWriter> begin(const BuildPlan& plan, BuildPlugins& plugins,
                                                  const BuildParams& params, const HitsAt& hits_at);

  /// Stores a region, runs the atlas's trials in it, and counts what it cost.
  /// @param map    of the indices that `finished` has
  /// @param among  points that each of its viewpoints tested
  /// Errors: those of the matcher and of the store.
  [[nodiscard]] Result<void> take(std::uint32_t region, PointsView map, Finished finished,
                                  std::uint64_t among);
  /// Keeps the atlas and the attachments of the parameters, and makes the bundle visible.
  [[nodiscard]] Result<BuildReport> commit() &&;

 private:
  BundleWriter(const BuildPlan& plan, BuildPlugins& plugins) : plan_(&plan), plugins_(&plugins) {}
  [[nodiscard]] Result<void> prepare_atlas(const BuildParams& params, const HitsAt& hits_at);

  const BuildPlan* plan_;
  BuildPlugins* plugins_;
  const decltype(BuildParams::attachments)* attachments_ = nullptr;
  std::optional<SiteTrials> trials_;
  BuildReport report_;
  std::optional<PredictedErrors> predicted_;  // none: no selector chooses elements
  Stopwatch stopwatch_;
  CpuStopwatch cpu_;
};

}  // namespace vantage
