#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "vantage/api.hpp"
#include "vantage/localizer_params.hpp"
#include "vantage/map_store.hpp"
#include "vantage/plugin_loader.hpp"
#include "vantage/pose.hpp"
#include "vantage/prepared_scan.hpp"
#include "vantage/result.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {

enum class Tracking : std::uint8_t {
  tracked,  ///< the pose comes from matching
  lost,     ///< the pose is only predicted
};
[[nodiscard]] VANTAGE_API const char* to_string(Tracking) noexcept;

/// What became of one scan.
struct ScanReport {
  double stamp = 0.0;
  Tracking tracking = Tracking::lost;
  std::string reason;  ///< why the scan is lost; empty if tracked
  Pose T_map_scan;     ///< estimated if tracked, predicted if lost
  Pose T_map_scan_predicted;
  RegionId region;              ///< whose map was matched against
  bool switched = false;        ///< the region's map was loaded for this scan
  bool outside = false;         ///< the last pose lay in no region with a map: the old one was kept
  std::size_t map_points = 0;   ///< N_point of Eq. 13
  std::size_t scan_points = 0;  ///< N of Eq. 12, after thinning
  std::size_t dropped_points = 0;                                         ///< non-finite
  double seconds_align = 0.0, seconds_load = 0.0, seconds_prepare = 0.0;  ///< T_align, ...
  std::optional<Alignment> alignment;  ///< none if nothing matched
  double lcp = 0.0;                    ///< Eq. 13
};

/// Localizes scans one after the other against the region map of the moment (Sec. 2.4).
/// Not thread safe; one object a robot.
class VANTAGE_API Localizer {
 public:
  /// Opens the bundle. Errors: those of MapStore::index; `invalid_input` for a bundle without
  /// points.
  [[nodiscard]] static Result<Localizer> open(PluginPtr<MapStore> store,
                                              PluginPtr<ScanMatcher> matcher,
                                              const LocalizerParams& params);
  Localizer(Localizer&&) noexcept;
  Localizer& operator=(Localizer&&) noexcept;
  ~Localizer();

  [[nodiscard]] const MapIndex& index() const noexcept;

  /// Says where the sensor is at the next scan; forgets all motion.
  /// Errors: `invalid_input` for a pose that is no rigid transform.
  [[nodiscard]] Result<void> start(const Pose& T_map_scan);

  /// Predicts the pose (odometry, else constant velocity), picks the region of the last estimate
  /// (Eq. 11), switches maps if it changed, and matches. A scan that cannot be matched is reported
  /// as lost and the prediction stands in for it; localization goes on.
  /// Errors: `invalid_input` before `start` or for a stamp that does not increase; a region map
  /// that cannot be loaded or prepared.
  [[nodiscard]] Result<ScanReport> localize(const Scan& scan);

 private:
  struct State;
  explicit Localizer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace vantage
