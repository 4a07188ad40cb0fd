#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "integrity_runs.hpp"
#include "integrity_worlds.hpp"
#include "vantage/engine/localizer.hpp"
#include "vantage/result.hpp"

namespace vantage::benchmarks {

/// A drive as it is localized: the reference is in the map's frame, also if that is bent.
struct JudgedDrive {
  SimulatedDrive drive;
  /// Of each scan, the pose that is right; none if no pose is.
  std::vector<std::optional<Pose>> truth;
};

/// What scenarios need of the drive; those that need the same share one.
struct DriveNeeds {
  int kidnaps = 0;
  bool slips = false;
  /// Scans are so many times as far apart, and the drive as long; raw sweeps follow each other.
  int stretch = 1;

  bool operator==(const DriveNeeds&) const = default;
};
/// @param kidnaps  of drives with kidnaps
/// @param stretch  of drives with odometry; without it, scans stay near each other
[[nodiscard]] DriveNeeds needs_of(Scenario scenario, int kidnaps, int stretch);

/// Errors: those of params_of and of simulated_drive.
[[nodiscard]] Result<simulation::WorldParams> params_of(const NamedWorld& world, std::uint64_t seed,
                                                        const DriveNeeds& needs);
[[nodiscard]] Result<JudgedDrive> judged_drive(const NamedWorld& world,
                                               const simulation::WorldParams& params,
                                               std::size_t most_scans);

/// A run that is to be done.
struct Task {
  Scenario scenario;
  std::size_t part = 0;
  Pose start;
  std::size_t begin = 0, end = 0;  ///< scans
};
[[nodiscard]] std::vector<Task> tasks_of(const NamedWorld& world, Scenario scenario,
                                         const SimulatedDrive& drive,
                                         const simulation::WorldParams& params);

/// The parameters of the localizer in a scenario.
[[nodiscard]] LocalizerParams params_in(Scenario scenario, LocalizerParams params);

[[nodiscard]] Result<std::vector<JudgedScan>> localize(Localizer localizer, const Task& task,
                                                       const JudgedDrive& judged);

}  // namespace vantage::benchmarks
