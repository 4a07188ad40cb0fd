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
  std::size_t scans = 0, tracked = 0;
  double coverage = 0.0;  ///< median over the scans that have a pose
  double nvtl = 0.0;      ///< the same
  [[nodiscard]] double goodness() const { return coverage * nvtl; }
  std::optional<Pose> first_tracked;  ///< T_map_scan
  std::size_t first = 0;              ///< the number of that scan
};
/// @param imu     its samples, in order of time; may be empty
/// @param change  is applied to the points, 3 x 3; with one, the IMU is left out
/// Errors: those of the localizer.
[[nodiscard]] Result<Fit> fit_of(const Bundle& bundle, const Config& config,
                                 const PluginLoader& plugins,
                                 std::span<const io::StampedScan> scans,
                                 std::span<const ImuSample> imu,
                                 const std::optional<Eigen::Matrix3d>& change = std::nullopt);

/// Tries what users get wrong: mirrored axes, a sensor upside down, other axes, feet, centimetres
/// and millimetres. The note names the change with which the scans fit the map clearly better; none
/// if they do with no change.
/// @param as_they_are  the result of fit_of without a change
[[nodiscard]] Result<std::optional<Note>> try_changes(const Bundle& bundle, const Config& config,
                                                      const PluginLoader& plugins,
                                                      std::span<const io::StampedScan> scans,
                                                      const Fit& as_they_are);

}  // namespace vantage::checks
