#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "localize/hypothesis.hpp"
#include "localize/pose_search.hpp"
#include "localize/recovery.hpp"
#include "localize/sweep_matching.hpp"
#include "localize/verdict.hpp"
#include "localize/weighing.hpp"
#include "vantage/engine/localizer.hpp"
#include "vantage/engine/region_maps.hpp"
#include "vantage/engine/regions_ahead.hpp"

namespace vantage {

/// What a localizer holds, and the steps of a scan.
struct Localizer::State {
  State(Bundle the_bundle, PluginPtr<ScanMatcher> the_matcher, BundleRelocalizer the_relocalizer,
        const LocalizerParams& the_params);

  Bundle bundle;
  PluginPtr<ScanMatcher> matcher;
  BundleRelocalizer relocalizer;
  std::shared_ptr<const RegionDirectory> directory = bundle.directory();
  LocalizerParams params;
  RegionsAhead ahead;
  RegionMaps maps;  // uses bundle and matcher

  MotionInputs inputs;
  MotionNoise noise;

  bool started = false;
  std::optional<double> stamp;         // of the last scan
  std::optional<double> middle;        // of its sweep [s]
  std::vector<Hypothesis> hypotheses;  // the first is the one that is reported
  double elsewhere = 1.0;              // the belief that the sensor is at none of them
  Eigen::Vector3d up_at_start = Eigen::Vector3d::UnitZ();  // in the sensor frame

  std::optional<MotionFilter> since;  // the last scan, if it was tracked; up to the last question

  std::shared_ptr<const ReadyRegion> map;  // of `region`
  RegionId region;

  Weighing weighing;
  bool was_lost = false;       // since the last tracked scan
  std::string search_failure;  // ScanReport::search_failure
  Recovery recovery{{bundle, relocalizer, matcher, ahead, maps, params},
                    params};  // last: may be running

  /// The motion until the middle of a sweep, of a sensor that may be anywhere. Nothing is known of
  /// its speed, so it begins at rest, unless odometry says more.
  [[nodiscard]] MotionFilter unplaced(double now) const;
  /// The direction that points up, in the sensor frame: by the accelerometer, otherwise by the pose
  /// of the start. Nothing for a sensor that is held at a tilt.
  [[nodiscard]] std::optional<Eigen::Vector3d> up(double now) const;
  /// Predicts every hypothesis at the middle of a sweep.
  /// @param stamp_of_scan  where a sensor begins that was started [s]
  void predict(double stamp_of_scan, double now);
  /// The motion that a scan is undistorted by before it is matched.
  [[nodiscard]] Result<Sweep> sweep_of(const Scan& scan, const SweepTime& time,
                                       const MotionFilter& motion) const;
  /// Makes a region's map the one that scans are matched against.
  Result<void> use(RegionId next, ScanReport& report);
  Result<void> expect_what_is_ahead();
  /// Matches a sweep at each hypothesis's prediction. The points become those of the first. Where
  /// the sweep fits at another place around a prediction, too, that becomes a hypothesis. A
  /// hypothesis in a region whose map cannot be used stays without an alignment.
  Result<void> match(Sweep& sweep, ScanReport& report);
  /// What a scan told.
  struct Told {
    bool weighed = false;       ///< the hypotheses were weighed with it
    bool contradicted = false;  ///< its prior says that the sensor is elsewhere
  };
  /// Lets a scan that was matched decide how much each hypothesis is believed.
  /// Errors: those of the matcher.
  [[nodiscard]] Result<Told> weigh(const PreparedScan& prepared,
                                   const std::optional<PosePrior>& prior, ScanReport& report);
  /// Makes the map of the best hypothesis the current one.
  Result<void> use_best(ScanReport& report);
  /// How the sensor moved since the scan before. @param expected  the motion without this scan
  [[nodiscard]] Pose step(const MotionFilter& expected) const;
  /// @param weighed  whether the scan was
  void begin_search(const Scan& scan, const PreparedScan& prepared, bool weighed);
  /// Adds what the search under way found to the hypotheses, once it is known. A search that failed
  /// finds nothing.
  /// @param expected  the sensor's motion without this scan
  Result<void> take_finds(const Scan& scan, const Sweep& sweep, const MotionFilter& expected);
  /// Every hypothesis takes the scan in. @param best  the motion of the one that is reported
  void move_on(const MotionFilter& best);
  /// @param lost  the sensor may be anywhere
  void forget_everything(bool lost);

 private:
  /// Tells a hypothesis what a prior and the direction that points up say of it.
  void see(const std::optional<PosePrior>& prior, Hypothesis& one) const;
  /// Whether one of the hypotheses is at a pose.
  [[nodiscard]] bool follows(const Pose& T_map_scan) const;
  /// @param h       the hypothesis around whose prediction they are
  /// @param points  that were aligned
  void follow_rivals(std::size_t h, std::vector<Alignment> rivals, std::size_t points);
  /// Tells a hypothesis how well wrong poses fit around here, and whether the search found it.
  void learn(const SearchAnswer& answer, double missed, Hypothesis& one) const;
  /// @return nothing if nothing matches there, or if that pose is followed already
  [[nodiscard]] Result<std::optional<Hypothesis>> hypothesis_at(const Find& find,
                                                                const Sweep& sweep,
                                                                const MotionFilter& expected) const;
};

}  // namespace vantage
