#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "build/condense.hpp"
#include "build/plan.hpp"
#include "vantage/build/build.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Writes the bundle of a plan: regions and the index of places.
class BundleWriter {
 public:
  /// Begins the bundle, and keeps the index of places. All arguments are borrowed.
  /// Errors: those of the store.
  [[nodiscard]] static Result<BundleWriter> begin(const BuildPlan& plan,
                                                  const BuildPlugins& plugins,
                                                  const BuildParams& params);

  /// Stores a region, and counts what it cost.
  /// @param map  of the region's indices
  /// Errors: those of the store.
  [[nodiscard]] Result<void> take(std::uint32_t region, PointsView map, BuiltRegion built);
  /// Keeps the attachments of the parameters, and makes the bundle visible. The report lacks what
  /// the writer cannot know: the time that visibility took, and choosing elements.
  /// Errors: those of the store; `too_few_matches` if prepared maps are stored and none has an
  /// element, though points are seen.
  [[nodiscard]] Result<BuildReport> commit() &&;

 private:
  BundleWriter(const BuildPlan& plan, const BuildParams& params, PluginPtr<MapWriter> bundle)
      : plan_(&plan), params_(&params), bundle_(std::move(bundle)) {}

  const BuildPlan* plan_;
  const BuildParams* params_;
  PluginPtr<MapWriter> bundle_;
  BuildReport report_;
  std::optional<PredictedErrors> predicted_;  // none: no selector chooses elements
};

}  // namespace vantage
