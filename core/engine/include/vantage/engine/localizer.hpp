#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "vantage/api.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/engine/confidence.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/engine/localizer_params.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/engine/prepared_scan.hpp"
#include "vantage/map_store.hpp"
#include "vantage/pose.hpp"
#include "vantage/relocalizer.hpp"
#include "vantage/result.hpp"
#include "vantage/scan_matcher.hpp"
#include "vantage/track/rotation.hpp"
#include "vantage/track/samples.hpp"

namespace vantage {

struct BundleRelocalizer;

enum class Tracking : std::uint8_t {
  tracked,    ///< the risk is at most LocalizerParams::max_risk
  uncertain,  ///< neither tracked nor lost
  lost,       ///< the sensor is probably at none of the poses that are followed, or nothing matched
};
[[nodiscard]] VANTAGE_API const char* to_string(Tracking) noexcept;

/// The result for one scan.
struct ScanReport {
  double stamp = 0.0;  ///< [s]
  Tracking tracking = Tracking::lost;
  std::string reason;    ///< why the scan is uncertain or lost; empty if tracked
  bool has_pose = true;  ///< false: the sensor has not been found yet; the poses have no meaning
  Pose T_map_scan;       ///< the estimate if tracked, otherwise the best guess
  /// Integrity risk: the probability that `T_map_scan` is off by more than the alert limit.
  double risk = 1.0;
  /// Whether the poses that are followed were compared with all other places of the map, or cannot
  /// be. Before that, a scan is not tracked, whatever its risk.
  bool compared = false;
  Pose T_map_scan_predicted;
  bool recovered = false;  ///< the first tracked scan after lost ones

  RegionId region;             ///< the region whose map the scan was matched against
  bool switched = false;       ///< the region is not that of the scan before, or is the first
  bool outside = false;        ///< the last pose was in no region with a map; the region stays
  bool blocked = false;        ///< the map was not ready: the scan loaded it or waited for it
  double seconds_stall = 0.0;  ///< time for which the scan waited for its map
  double seconds_load = 0.0, seconds_prepare = 0.0;  ///< of the new map, on any thread
  std::size_t map_points = 0;                        ///< N_point of Eq. 13
  std::size_t held_bytes = 0;  ///< memory of all maps that are ready now, including those ahead

  std::size_t scan_points = 0;     ///< N of Eq. 12, after thinning
  std::size_t dropped_points = 0;  ///< points that are not finite or farther than 10 km
  /// T_align: the alignments at the predictions of all hypotheses, and undistortion in between.
  double seconds_align = 0.0;
  /// How often the whole scan was aligned: again after a sweep was undistorted by the motion that
  /// the alignment before had shown. 0 if there was no prediction.
  std::uint32_t passes = 0;
  /// Time since the scan before for which odometry contradicted the motion that is known, and did
  /// not count.
  double seconds_doubted = 0.0;
  std::uint64_t dropped_samples = 0;  ///< of IMU and odometry, too late or twice, since the opening
  /// Time that the scan spent on the search for a lost sensor, or waited for one that runs in the
  /// background (LocalizerParams::live); 0 for a scan that needed none.
  double seconds_search = 0.0;
  bool searching = false;  ///< a search is under way: its answer comes with a later scan
  /// Why the last search failed, or left places out whose maps cannot be used; empty if it did not.
  std::string search_failure;
  double seconds_verdict = 0.0;              ///< weighing and comparing the poses that are followed
  std::optional<Alignment> alignment;        ///< none if nothing matched
  std::optional<PoseConfidence> confidence;  ///< of `T_map_scan`; none without a pose
  double lcp = 0.0;                          ///< Eq. 13
};

/// Where a sensor is between two scans, and how it moves.
struct SensorMotion {
  double stamp = 0.0;  ///< [s]
  Pose T_map_sensor;
  /// Of x, y, z and of the rotation about the sensor, map axes [m, rad].
  Eigen::Matrix<double, 6, 6, Eigen::DontAlign> covariance;
  Twist twist;  ///< of the sensor, in its own frame [m/s, rad/s]
};

/// Localizes scans, one after the other, against the map of the current region (Sec. 2.4). Results
/// depend only on the scans, the bundle and the parameters, not on timing or threads, unless
/// LocalizerParams::live is set. Then searches run in a thread of the object.
/// Not thread safe: use one object per robot. It may be moved or destroyed at any time; a search
/// that is under way then goes on, or is ended.
class VANTAGE_API Localizer {
 public:
  /// @param relocalizer  the one that made the bundle's index of places, if there is an index.
  ///                     None: a lost sensor is not searched for
  /// Errors: `invalid_input` if the maps of all regions are empty.
  [[nodiscard]] static Result<Localizer> open(Bundle bundle, PluginPtr<ScanMatcher> matcher,
                                              PluginPtr<Relocalizer> relocalizer,
                                              const LocalizerParams& params);
  /// The same with the [matcher], the [relocalizer] and the [localizer] of a configuration. Without
  /// a [relocalizer], it takes the one that made the bundle's index of places. If that is another
  /// one, the first search makes an index from the bundle's points; without points, that is
  /// `invalid_config`.
  /// Errors: those above; a missing table or plugin, or a wrong parameter.
  [[nodiscard]] static Result<Localizer> open(Bundle bundle, const Config& config,
                                              const PluginLoader& plugins);
  /// The same with the bundle that the configuration names. Errors: those above and those of
  /// Bundle::open.
  [[nodiscard]] static Result<Localizer> open(const Config& config, const PluginLoader& plugins);
  Localizer(Localizer&&) noexcept;
  Localizer& operator=(Localizer&&) noexcept;
  ~Localizer();

  [[nodiscard]] const RegionDirectory& regions() const noexcept;
  /// As in use.
  [[nodiscard]] const LocalizerParams& params() const noexcept;

  /// Sets the sensor's pose for the next scan, makes the map of that place ready, and forgets all
  /// motion.
  /// Errors: `invalid_input` for a pose that is not a rigid transform; a region map that cannot be
  /// loaded or prepared.
  [[nodiscard]] Result<void> start(const Pose& T_map_scan);
  /// Declares that the sensor may be anywhere in the bundle: the next scans search for it. Forgets
  /// all motion.
  void start_anywhere();

  /// Takes in what the robot's own sensors of motion measured, in any order between two scans. Give
  /// a scan after the samples that were taken during its sweep; samples of before the middle of the
  /// last sweep are dropped and counted.
  /// Errors: `invalid_input` for a sample with a number that is not finite, or a pose that is no
  /// rigid transform.
  [[nodiscard]] Result<void> add(const ImuSample& sample);
  [[nodiscard]] Result<void> add(const OdometrySample& sample);

  /// Predicts the pose at the middle of the sweep (see MotionFilter), removes the sensor's own
  /// motion from the points, chooses the region of the
  /// last estimate (Eq. 11), switches maps if the region changed, and matches the scan. A scan that
  /// cannot be matched keeps the prediction as its pose. While there is doubt, the scans search for
  /// other poses in a growing circle. What a search finds later than within
  /// LocalizerParams::search_budget is moved by the motion since, and aligned again with the scan
  /// of that moment. A search that fails is reported and begun again. Localization continues in
  /// every case.
  /// Errors: `invalid_input` before a start, for a stamp that does not increase, for a prior that
  /// is no rigid transform or has a deviation that is not positive, or for times that do not belong
  /// to the points; a region map that cannot be loaded or prepared.
  [[nodiscard]] Result<ScanReport> localize(const Scan& scan);

  /// Where the sensor is at a moment after the last scan, by that scan and by the samples since.
  /// None unless the last scan was tracked, and for a moment before one that was asked for earlier.
  [[nodiscard]] std::optional<SensorMotion> motion_at(double stamp);

 private:
  struct State;
  [[nodiscard]] static Result<Localizer> of(Bundle bundle, PluginPtr<ScanMatcher> matcher,
                                            BundleRelocalizer relocalizer,
                                            const LocalizerParams& params);
  explicit Localizer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace vantage
