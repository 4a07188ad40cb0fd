#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string_view>

#include "simulate/params.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::simulation {

/// What was written.
struct Summary {
  std::uint64_t map_points = 0, scans = 0, scan_points = 0;
  std::uint64_t odometry_poses = 0, imu_samples = 0;
  Bounds3 map_bounds;                                ///< map frame [m]
  io::Precision precision = io::Precision::float32;  ///< of map.pcd
  double distance = 0.0;                             ///< driven [m]
  double seconds = 0.0;                              ///< from the first to the last stamp
  std::size_t kidnaps = 0, holes = 0;
  std::uint64_t triangles = 0;
};

/// @param stage  "sampling the map" or "scanning"; never called by two threads at once
using StageProgress =
    std::function<void(std::string_view stage, std::size_t done, std::size_t total)>;

/// What a simulation makes.
enum class Extent : std::uint8_t {
  map,    ///< the map only
  drive,  ///< and a drive through it
};

/// Makes the world, maps it, and drives through it as it is after `[changes]`. Writes into the
/// directory `out`:
/// - `map.pcd`: the wide-area map, map frame; float32 unless that would move a point by a
///   millimetre
///   or `map/000000.pcd`, ... with map.points_per_file, in the same order
/// - `scans/000000.pcd`, ...: sensor frame, float32; with motion distortion, each point is in the
///   frame of its own moment, which is in the field t: float32 [s] after the stamp
/// - `scans/times.txt`: one stamp [s] per line, that of the scan's first firing
/// - `reference.tum`: T_map_sensor at the stamps of the scans
/// - `odometry.tum`: T_odometry_sensor, drifting, at the same stamps or at those of
///   `odometry.rate`; at a kidnap, the motion of a sensor that drove on
/// - `imu.csv`, if `imu.rate` is given: `t,wx,wy,wz,ax,ay,az`: stamp on the IMU's clock [s], rates
///   [rad/s], and accelerations less gravity [m/s^2, or g] in the IMU's frame
/// - `events.csv`: one line per scan with its stamp, 1 for the first scan after a kidnap, and 1 for
///   a sensor above a hole of the map
/// - `world.toml`: all values that made it
/// The directory appears completely or not at all: see io::OutputFolder.
/// Files are the same for any number of threads.
/// @param overwrite  replace `out` if it is the result of an earlier simulation
/// Errors: `already_exists`; `io_failure`; those of World and of the writers.
[[nodiscard]] Result<Summary> simulate(const WorldParams& params, const std::filesystem::path& out,
                                       bool overwrite = false, Extent extent = Extent::drive,
                                       const StageProgress& progress = {});

}  // namespace vantage::simulation
