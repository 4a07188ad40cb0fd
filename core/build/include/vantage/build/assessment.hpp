#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>

#include "vantage/api.hpp"
#include "vantage/engine/atlas.hpp"
#include "vantage/engine/build_params.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/engine/matcher_choice.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/relocalizer.hpp"
#include "vantage/result.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {

class MapParts;

/// What an assessment made and what it cost.
struct AssessmentReport {
  Atlas atlas;
  double seconds = 0;       ///< wall clock
  double core_seconds = 0;  ///< processor time of all threads
};

/// Measures how well a sensor can be localized in a finished bundle, and keeps the answer in it as
/// its Atlas. Scans are rendered from the map that the bundle was built of, and not from what the
/// bundle keeps of it: a real scan also has what a region map lacks, and prepared maps have no
/// points. The atlas does not depend on the number of threads, or on how much of the map is in
/// memory.
///
///     VANTAGE_TRY(Assessment assessment, Assessment::prepare(bundle, config, plugins));
///     VANTAGE_TRY(const AssessmentReport report, assessment.run(map));
class VANTAGE_API Assessment {
 public:
  /// @param config  [matcher] is that of the later localization, [atlas] says where to measure
  /// Errors: `invalid_config` for a configuration without a [matcher], and for a matcher that
  /// cannot use the bundle's prepared maps; a plugin that cannot be loaded.
  [[nodiscard]] static Result<Assessment> prepare(Bundle bundle, const Config& config,
                                                  const PluginLoader& plugins);
  /// Uses a matcher that was opened elsewhere.
  /// @param choice     the matcher's name and parameters, which the atlas keeps
  /// @param places     where places that look alike are searched for; none: they are not
  /// @param max_range  of the sensor [m]
  Assessment(Bundle bundle, PluginPtr<ScanMatcher> matcher, MatcherChoice choice,
             PluginPtr<RelocalizerIndex> places, const AtlasParams& params = {},
             double max_range = std::numeric_limits<double>::infinity());

  /// Called with the number of steps done so far and of all, two for each site, from one thread at
  /// a time. It must not use TBB.
  using Progress = std::function<void(std::size_t, std::size_t)>;
  /// Measures, and puts the atlas into the bundle, in place of an earlier one. If it fails, the
  /// bundle is as it was.
  /// @param map  N points, map frame [m]: that of the bundle
  /// Errors: `invalid_input` for another map than that of the bundle, or if the bundle was built
  /// again meanwhile; `unsupported` for a store that keeps no attachments; those of the store and
  /// of the matcher, except `too_few_matches`.
  [[nodiscard]] Result<AssessmentReport> run(PointsView map, const Progress& progress = {});
  /// The same for a map of which only the part around a site is read at a time.
  [[nodiscard]] Result<AssessmentReport> run(const MapParts& map, const Progress& progress = {});
  /// How far around a site that reads the map, in plan view [m].
  [[nodiscard]] double reach() const noexcept;

 private:
  [[nodiscard]] Result<void> check_map(std::uint64_t points, const Bounds3& bounds) const;

  Bundle bundle_;
  PluginPtr<ScanMatcher> matcher_;
  MatcherChoice choice_;
  PluginPtr<RelocalizerIndex> places_;
  AtlasParams params_;
  double max_range_;
};

}  // namespace vantage
