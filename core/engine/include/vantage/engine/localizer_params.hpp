#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/params.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// What is known of a sensor's tilt before it is found, unless an IMU tells where up is.
enum class Gravity : std::uint8_t {
  sensor_z,  ///< the sensor's z axis points up, to a few degrees
  unknown,   ///< nothing: the relocalizer has to find it out
};
constexpr auto enum_names(Gravity) {
  return std::array{std::pair{std::string_view("sensor_z"), Gravity::sensor_z},
                    std::pair{std::string_view("unknown"), Gravity::unknown}};
}

/// How a sensor moves.
enum class MotionModel : std::uint8_t {
  free,    ///< in any direction
  planar,  ///< on wheels: its height and tilt change slowly
};
constexpr auto enum_names(MotionModel) {
  return std::array{std::pair{std::string_view("free"), MotionModel::free},
                    std::pair{std::string_view("planar"), MotionModel::planar}};
}

/// [localizer]: how scans are prepared, when regions are switched, and how a lost scan is
/// recognized and the sensor found again.
struct LocalizerParams {
  double scan_voxel_size = 0.5;
  double scan_min_range = 0.0;
  std::optional<double> scan_max_range;
  double switch_margin = 0.0;
  double alert_limit = 0.5;
  double alert_limit_deg = 3.0;
  double max_risk = 0.01;
  std::optional<double> min_coverage, min_nvtl, max_correction;
  std::optional<double> recovery_radius;
  double search_first_radius = 10.0;
  std::uint32_t search_pause = 4;
  std::optional<double> search_budget;
  bool live = false;
  Gravity gravity = Gravity::sensor_z;
  std::uint32_t max_hypotheses = 6;
  bool prefetch = true;
  double prefetch_time = 3.0;
  double prefetch_distance = 5.0;
  double map_memory = 40.0;
  double covariance_scale = 0.003;
  bool undistort = true;
  MotionModel motion = MotionModel::free;
  std::vector<double> T_sensor_imu{0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  std::vector<double> T_sensor_body{0.0, 0.0, 0.0, 0.0, 0.0, 0.0};

  static constexpr auto schema() {
    return std::tuple{
        optional("scan_voxel_size", &LocalizerParams::scan_voxel_size, "m",
                 "scans are thinned to one centroid per voxel of this size; 0 keeps every point",
                 non_negative),
        optional("scan_min_range", &LocalizerParams::scan_min_range, "m",
                 "scan points nearer to the sensor than this are dropped", non_negative),
        optional("scan_max_range", &LocalizerParams::scan_max_range, "m",
                 "scan points farther from the sensor than this are dropped; unlimited if left out",
                 positive),
        optional("switch_margin", &LocalizerParams::switch_margin, "m",
                 "the localizer switches regions only this far beyond the border; 0 switches at "
                 "the border",
                 non_negative, Source{"Eq. 11", "Yagi et al. 2026, Sec. 2.4"}),
        optional("alert_limit", &LocalizerParams::alert_limit, "m",
                 "the integrity risk is the probability that the pose is off by more than this",
                 positive),
        optional("alert_limit_deg", &LocalizerParams::alert_limit_deg, "deg",
                 "or turned by more than this", positive),
        optional("max_risk", &LocalizerParams::max_risk, "",
                 "a scan is tracked if its integrity risk is at most this", between(0, 1)),
        optional("min_coverage", &LocalizerParams::min_coverage, "",
                 "a scan is not tracked if the share of its points that have a map voxel is below "
                 "this; no such limit if left out",
                 between(0, 1)),
        optional("min_nvtl", &LocalizerParams::min_nvtl, "",
                 "a scan is not tracked if its nearest-voxel likelihood is below this; no such "
                 "limit if left out",
                 non_negative),
        optional("max_correction", &LocalizerParams::max_correction, "m",
                 "a scan is not tracked if matching moves it farther than this from its predicted "
                 "pose; no such limit if left out",
                 positive),
        optional("recovery_radius", &LocalizerParams::recovery_radius, "m",
                 "radius of the search for a lost sensor around its last pose; 0: no search; "
                 "unlimited if left out",
                 non_negative),
        optional("search_first_radius", &LocalizerParams::search_first_radius, "m",
                 "radius of the search at the first scan that needs one; it doubles at each "
                 "further one, up to recovery_radius",
                 positive),
        optional(
            "search_pause", &LocalizerParams::search_pause, "",
            "once the radius has reached its maximum, the search runs only at every n-th such scan",
            at_least(1)),
        optional(
            "search_budget", &LocalizerParams::search_budget, "ms",
            "longest time that a scan waits for a search; if the search takes longer, a later "
            "scan gets its result. Left out: no limit, or 20 ms if live. Unless live, the "
            "time is counted in work, so that a recording gives the same result on any machine",
            non_negative),
        optional("live", &LocalizerParams::live, "",
                 "scans come as they are made: searches run in the background, so results depend "
                 "on timing"),
        optional(
            "gravity", &LocalizerParams::gravity, "",
            "sensor_z: a search takes the sensor's z axis for up, to a few degrees, and a pose at "
            "which the sensor lies on its side is hardly believed; unknown: a search has to find "
            "out where up is; an IMU overrides both"),
        optional("max_hypotheses", &LocalizerParams::max_hypotheses, "",
                 "this many poses are followed while it is uncertain which of them is right",
                 at_least(1)),
        optional("prefetch", &LocalizerParams::prefetch, "",
                 "region maps are loaded in the background before they are needed"),
        optional("prefetch_time", &LocalizerParams::prefetch_time, "s",
                 "regions that the sensor will reach within this time are loaded", non_negative),
        optional("prefetch_distance", &LocalizerParams::prefetch_distance, "m",
                 "regions this near to the sensor's predicted path are loaded", non_negative),
        optional(
            "map_memory", &LocalizerParams::map_memory, "MiB",
            "limit on the memory of region maps: those that are kept, those of rival poses, and "
            "those on their way with their points, and of the index that poses are searched in; "
            "the map in use is always kept",
            positive),
        optional("covariance_scale", &LocalizerParams::covariance_scale, "",
                 "the covariance of an alignment of N points is this factor times N + 700 times "
                 "the inverse Hessian of the minimized cost",
                 positive),
        optional("undistort", &LocalizerParams::undistort, "",
                 "points that have times are moved to where the sensor would have seen them at the "
                 "middle of the sweep"),
        optional("motion", &LocalizerParams::motion, "",
                 "planar: on wheels, so that height and tilt change slowly"),
        optional("T_sensor_imu", &LocalizerParams::T_sensor_imu, "m, rad",
                 "pose of the IMU in the LiDAR's frame: x, y, z, roll, pitch, yaw"),
        optional("T_sensor_body", &LocalizerParams::T_sensor_body, "m, rad",
                 "pose of the frame whose motion the odometry measures in the LiDAR's frame: x, y, "
                 "z, roll, pitch, yaw"),
    };
  }
  /// Mounts have six numbers.
  [[nodiscard]] VANTAGE_API Result<void> validate() const;
};

}  // namespace vantage
