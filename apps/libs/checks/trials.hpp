#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "checks/note.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/io/scan_source.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"
#include "vantage/track/samples.hpp"

namespace vantage::checks {

/// So many scans in a row show whether scans fit a map.
inline constexpr std::size_t kScansToTry = 10;

/// How some scans fit a map when the sensor may be anywhere at the first of them.
struct Fit {
  std::size_t scans = 0;  ///< that were tried
  std::size_t tracked = 0;
  std::size_t found = 0;  ///< their risk is at most 0.1; a single scan is hardly ever tracked
  double coverage = 0.0;  ///< median over the scans that have a pose
  double nvtl = 0.0;      ///< the same
  [[nodiscard]] double goodness() const { return coverage * nvtl; }
  std::optional<Pose> first_tracked;  ///< T_map_scan
  std::size_t first = 0;              ///< the number of that scan
};
/// Scans that follow each other by more than a second are looked for one by one.
/// @param imu  its samples, in order of time; may be empty
/// Errors: those of the localizer.
[[nodiscard]] Result<Fit> fit_of(const Bundle& bundle, const Config& config,
                                 const PluginLoader& plugins,
                                 std::span<const io::StampedScan> scans,
                                 std::span<const ImuSample> imu);

/// Whether scans are found with a change that are not without it: three more of them.
[[nodiscard]] inline bool finds_more(const Fit& changed, const Fit& unchanged) {
  return changed.found >= unchanged.found + 3;
}
/// Whether scans fit a map clearly better with a change than without it.
/// @param enough  so many scans have to be tracked or found with the change
[[nodiscard]] bool fits_better(const Fit& changed, const Fit& unchanged, std::size_t enough);

/// The note on scans that fit clearly better if they are made a little smaller or larger; none
/// otherwise.
/// @param as_they_are  the result of fit_of with the same IMU
[[nodiscard]] Result<std::optional<Note>> try_scales(const Bundle& bundle, const Config& config,
                                                     const PluginLoader& plugins,
                                                     std::span<const io::StampedScan> scans,
                                                     std::span<const ImuSample> imu,
                                                     const Fit& as_they_are);

/// The note on scans that are found nowhere, whatever is changed: none or one of at least three.
[[nodiscard]] std::optional<Note> note_on_place(const Fit& fit);

/// Tries what users get wrong: mirrored axes, a sensor upside down, other axes, feet, centimetres
/// and millimetres, without an IMU. The note names the change with which the scans fit the map
/// clearly better; none if they do with no change.
/// @param as_they_are  the result of fit_of without a change
[[nodiscard]] Result<std::optional<Note>> try_changes(const Bundle& bundle, const Config& config,
                                                      const PluginLoader& plugins,
                                                      std::span<const io::StampedScan> scans,
                                                      const Fit& as_they_are);

}  // namespace vantage::checks
