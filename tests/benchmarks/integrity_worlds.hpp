#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "simulate/params.hpp"
#include "vantage/engine/prepared_scan.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"
#include "world_maps.hpp"

namespace vantage::benchmarks {

enum class Scenario : std::uint8_t {
  odometry,           ///< from the right start, with odometry
  constant_velocity,  ///< from the right start, without odometry
  wrong_start,        ///< from starts that are far off, with odometry
  kidnap,             ///< from the right start, with odometry, carried away on the way
  prior,              ///< as odometry, with a biased absolute prior that jumps for a while
  slip,               ///< as odometry, whose wheels spin on a fifth of the way
  late_odometry,      ///< as odometry, whose clock is 50 ms late
  budget,             ///< as kidnap, and a scan waits for a search for 20 ms
  live,               ///< as budget, in real time
};
/// Those that give the same results on every machine.
inline constexpr std::array kRepeatable{Scenario::odometry,      Scenario::constant_velocity,
                                        Scenario::wrong_start,   Scenario::kidnap,
                                        Scenario::prior,         Scenario::slip,
                                        Scenario::late_odometry, Scenario::budget};
[[nodiscard]] const char* to_string(Scenario scenario) noexcept;

/// A row of the benchmark's table: a world, and what differs between its map and its drive.
struct NamedWorld {
  std::string name;
  std::vector<std::string> overrides;  ///< of configs/simulate/integrity.toml
  /// `uncertain` is a right answer here: places look alike, or the map does not show them.
  bool ambiguous = false;
  std::vector<Scenario> scenarios{Scenario::odometry, Scenario::constant_velocity,
                                  Scenario::wrong_start, Scenario::kidnap, Scenario::prior};
  int wrong_starts = 5;     ///< a drive
  bool only_whole = false;  ///< the site is so large that its region maps take too long to make
  MapDifference map = {};
  /// The localizer gets `axes * p` for every point p of a scan.
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();

  /// Whether a pose can be right: not in the map of another place, and not with mirrored scans.
  [[nodiscard]] bool has_truth() const noexcept {
    return !map.of_another_place && axes.determinant() > 0.0;
  }
};
[[nodiscard]] std::span<const NamedWorld> all_worlds();

/// What is known of the worlds of a seed: whether constants of the verdict were chosen on them.
[[nodiscard]] const char* use_of_seed(std::uint64_t seed) noexcept;

/// Errors: `invalid_input` for a seed of configs/simulate/, whose worlds the engine was made with.
[[nodiscard]] Result<void> check_seed(std::uint64_t seed);

/// @param more  overrides
/// Errors: those of load_world and of check_seed.
[[nodiscard]] Result<simulation::WorldParams> params_of(const NamedWorld& world, std::uint64_t seed,
                                                        int kidnaps,
                                                        const std::vector<std::string>& more = {});

/// @return  what map.pcd would hold, map frame [m]
[[nodiscard]] Result<PointCloud> simulated_map(const simulation::WorldParams& params);

/// A drive with its scans, in memory.
struct SimulatedDrive {
  std::vector<PointCloud> scans;            ///< sensor frame [m]
  std::vector<std::vector<float>> seconds;  ///< of the points after the stamp; empty if all at once
  std::vector<bool> kidnapped;              ///< whether each scan is the first after a kidnap
  io::Trajectory reference, odometry;

  [[nodiscard]] Scan scan(std::size_t i) const {
    return {.stamp = reference[i].stamp, .points = scans[i], .seconds = seconds[i]};
  }
};
/// @param most_scans  fewer if the drive is shorter; 0: all
/// @param noise_seed  of scans and odometry; the world and its route do not depend on it
[[nodiscard]] Result<SimulatedDrive> simulated_drive(const simulation::WorldParams& params,
                                                     std::size_t most_scans,
                                                     std::uint64_t noise_seed);

}  // namespace vantage::benchmarks
