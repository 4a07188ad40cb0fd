#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "build/condense.hpp"
#include "build/plan.hpp"
#include "stopwatch.hpp"
#include "vantage/engine/build.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Writes the bundle of a plan: regions and the index of places.
class BundleWriter {
 public:
  /// Begins the bundle, and keeps the index of places. All arguments are borrowed.
  /// Errors: those of the store.
  [[nodiscard]] static Result<BundleWriter> begin(const BuildPlan& plan, BuildPlugins& plugins,
                                                  const BuildParams& params);

  /// Stores a region, and counts what it cost.
  /// @param map    of the indices that `finished` has
  /// @param among  points that each of its viewpoints tested
  /// Errors: those of the store.
  [[nodiscard]] Result<void> take(std::uint32_t region, PointsView map, Finished finished,
                                  std::uint64_t among);
  /// Keeps the attachments of the parameters, and makes the bundle visible.
  [[nodiscard]] Result<BuildReport> commit() &&;

 private:
  BundleWriter(const BuildPlan& plan, BuildPlugins& plugins) : plan_(&plan), plugins_(&plugins) {}

  const BuildPlan* plan_;
  BuildPlugins* plugins_;
  const decltype(BuildParams::attachments)* attachments_ = nullptr;
  BuildReport report_;
  std::optional<PredictedErrors> predicted_;  // none: no selector chooses elements
  Stopwatch stopwatch_;
  CpuStopwatch cpu_;
};

}  // namespace vantage
