#pragma once

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

namespace vantage::benchmarks {

enum class Scenario : std::uint8_t {
  odometry,           ///< from the right start, with odometry
  constant_velocity,  ///< from the right start, without odometry
  wrong_start,        ///< from starts that are far off, with odometry
  kidnap,             ///< from the right start, with odometry, carried away on the way
  prior,              ///< as odometry, with a biased absolute prior that jumps for a while
};
inline constexpr std::array kScenarios{Scenario::odometry, Scenario::constant_velocity,
                                       Scenario::wrong_start, Scenario::kidnap, Scenario::prior};
[[nodiscard]] const char* to_string(Scenario scenario) noexcept;

/// A row of the benchmark's table: a world, and what differs between its map and its drive.
struct NamedWorld {
  std::string name;
  std::vector<std::string> overrides;  ///< of configs/simulate/integrity.toml
  bool ambiguous = false;              ///< it has places that look alike to the sensor
  std::vector<Scenario> scenarios{kScenarios.begin(), kScenarios.end()};
  int wrong_starts = 5;  ///< a drive
  /// The map holds everything twice: the second copy is moved by this [m].
  Point second_copy = Point::Zero();
};
[[nodiscard]] std::span<const NamedWorld> all_worlds();

/// Errors: `invalid_input` for a seed of configs/simulate/, whose worlds the engine was made with.
[[nodiscard]] Result<void> check_seed(std::uint64_t seed);

/// Errors: those of load_world and of check_seed.
[[nodiscard]] Result<simulation::WorldParams> params_of(const NamedWorld& world, std::uint64_t seed,
                                                        int kidnaps);

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
