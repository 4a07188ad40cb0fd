#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "build/atlas/sites.hpp"
#include "build/atlas/virtual_lidar.hpp"
#include "localize/evidence.hpp"
#include "vantage/engine/atlas.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/map_store.hpp"
#include "vantage/result.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {

/// Measures an atlas: virtual scans of the sites are aligned with the regions' maps, from right and
/// from wrong starts. Results do not depend on the number of threads or on the order of the
/// regions.
class SiteTrials {
 public:
  /// Makes the scans of all sites, and looks for places from which they may seem to come.
  /// @param places   of the map; none: no wrong starts
  /// @param matcher  borrowed
  /// @param step     called after the scans of each site are made and again after the trials from
  ///                 around it, from any thread
  /// Errors: those of `hits_at`, and of the matcher, except `too_few_matches`.
  [[nodiscard]] static Result<SiteTrials> prepare(const Partition& partition,
                                                  const std::vector<SitePlace>& sites,
                                                  const HitsAt& hits_at,
                                                  const RelocalizerIndex* places,
                                                  const PluginPtr<ScanMatcher>& matcher,
                                                  std::function<void()> step);

  /// The regions that trials are run in, ascending.
  [[nodiscard]] std::vector<RegionId> regions() const;
  /// Runs all trials in the map of one region; call it once for each of `regions`. It may be called
  /// for several of them at the same time.
  /// Errors: those of ScanMatcher::restore and of the matcher, except `too_few_matches`.
  [[nodiscard]] Result<void> run_in(RegionId region, const RegionMap& map);

  /// What was measured. Call it after the last region.
  [[nodiscard]] Atlas atlas(const MatcherChoice& matcher) const;

 private:
  /// Where an alignment ended.
  struct Trial {
    Alignment alignment;
    std::optional<Evidence> evidence;
  };
  using Trials = std::vector<std::optional<Trial>>;  // nothing: nothing matched
  struct SiteState {
    SitePlace place;
    Pose truth;  // upright, with some heading
    PointCloud hits = {};
    std::optional<Fit> to_itself = {};  // of the first of its scans
    std::vector<Pose> rivals = {};
    Trials right = {};  // from around the truth
    double basin = 0.0;
    Trials wrong = {};  // one for each rival
  };
  struct Scan;

  SiteTrials(const PluginPtr<ScanMatcher>& matcher, std::function<void()> step)
      : matcher_(matcher), step_(std::move(step)) {}

  [[nodiscard]] Result<void> look_around(SiteState& site, const RelocalizerIndex* places) const;
  /// None: nothing matches in the map.
  [[nodiscard]] Result<PluginPtr<MatchTarget>> target_of(const RegionMap& map) const;
  [[nodiscard]] Result<Scan> scan_of(const SiteState& site, std::size_t variant) const;
  /// @param points, scored  of a scan; no evidence without scored ones
  [[nodiscard]] Result<std::optional<Trial>> tried(const MatchTarget& target, const Fit& to_itself,
                                                   PointsView points, PointsView scored,
                                                   const Pose& start) const;
  [[nodiscard]] Result<void> try_right(const MatchTarget& target, SiteState& site) const;
  [[nodiscard]] Result<void> try_rivals(const MatchTarget& target, SiteState& site,
                                        const std::vector<std::size_t>& which) const;

  [[nodiscard]] static std::optional<SitePrecision> precision_of(const SiteState& site);
  [[nodiscard]] static std::vector<AlikePlace> alike_of(const SiteState& site);
  /// Adds the evidence's shares of the trials that ended right and of those that ended wrong.
  static void add_shares(const SiteState& site, std::vector<double>& right,
                         std::vector<double>& wrong);

  const PluginPtr<ScanMatcher>& matcher_;
  std::function<void()> step_;
  std::vector<SiteState> sites_;
  struct InRegion {
    std::vector<std::size_t> own;                             // sites
    std::vector<std::pair<std::size_t, std::size_t>> rivals;  // site, rival of it
  };
  std::vector<InRegion> by_region_;
};

}  // namespace vantage
