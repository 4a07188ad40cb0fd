#include "integrity_worlds.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "simulate/drive.hpp"
#include "simulate/lidar.hpp"
#include "simulate/map_sampler.hpp"
#include "simulate/odometry.hpp"
#include "simulate/world.hpp"

namespace vantage::benchmarks {

const char* to_string(Scenario scenario) noexcept {
  switch (scenario) {
    case Scenario::odometry: return "odometry";
    case Scenario::constant_velocity: return "constant_velocity";
    case Scenario::wrong_start: return "wrong_start";
    case Scenario::kidnap: return "kidnap";
    case Scenario::prior: return "prior";
    case Scenario::slip: return "slip";
    case Scenario::late_odometry: return "late_odometry";
    case Scenario::budget: return "budget";
    case Scenario::live: return "live";
  }
  return "";
}

const char* use_of_seed(std::uint64_t seed) noexcept {
  constexpr std::array<std::uint64_t, 6> kChose{301, 302, 303, 311, 606, 608};
  constexpr std::array<std::uint64_t, 11> kSeen{304, 305, 401, 402, 403, 601,
                                                604, 607, 609, 610, 612};
  if (std::ranges::find(kChose, seed) != kChose.end()) return "constants were chosen on it";
  if (std::ranges::find(kSeen, seed) != kSeen.end()) return "seen after the choice";
  return seed > 601 ? "not used for the verdict" : "seen by earlier versions";
}

Result<void> check_seed(std::uint64_t seed) {
  constexpr std::array<std::uint64_t, 8> kUsed{1, 7, 11, 21, 23, 32, 38, 50};
  if (std::ranges::find(kUsed, seed) != kUsed.end()) {
    return fail(ErrorCode::invalid_input,
                fmt::format("seed {} is that of a world of configs/simulate/; take another", seed));
  }
  return {};
}

Result<simulation::WorldParams> params_of(const NamedWorld& world, std::uint64_t seed, int kidnaps,
                                          const std::vector<std::string>& more) {
  VANTAGE_CHECK(check_seed(seed));
  std::vector<std::string> overrides = world.overrides;
  overrides.push_back(fmt::format("seed={}", seed));
  overrides.push_back(fmt::format("drive.kidnaps={}", kidnaps));
  overrides.insert(overrides.end(), more.begin(), more.end());
  return simulation::load_world(VANTAGE_SOURCE_DIR "/configs/simulate/integrity.toml", overrides);
}

Result<PointCloud> simulated_map(const simulation::WorldParams& params) {
  VANTAGE_TRY(const auto world, simulation::World::create(params));
  PointCloud map = simulation::sample_map(world, params.map, params.seed);
  for (Point& p : map) p = p.cast<float>().cast<double>();
  return map;
}

Result<SimulatedDrive> simulated_drive(const simulation::WorldParams& params,
                                       std::size_t most_scans, std::uint64_t noise_seed) {
  VANTAGE_TRY(const auto world, simulation::World::create(params, simulation::Day::drive));
  VANTAGE_TRY(const auto drive, simulation::Drive::create(world, params));
  SimulatedDrive result;
  result.reference = simulation::reference_of(world, drive);
  result.odometry = simulation::simulate_odometry(
      simulation::without_kidnaps(world, drive, result.reference), params.odometry, noise_seed);
  std::size_t scans = drive.scans();
  if (most_scans > 0) scans = std::min(scans, most_scans);
  result.reference.resize(scans);
  result.odometry.resize(scans);
  result.scans.resize(scans);
  result.seconds.resize(scans);
  const simulation::Lidar lidar(params.lidar, noise_seed);
  tbb::parallel_for(std::size_t{0}, scans, [&](std::size_t i) {
    simulation::Sweep sweep = lidar.sweep(world, drive, i);
    result.scans[i] = std::move(sweep.points);
    result.seconds[i] = std::move(sweep.seconds);
    for (Point& p : result.scans[i]) p = p.cast<float>().cast<double>();
  });
  for (std::size_t i = 0; i < scans; ++i) result.kidnapped.push_back(drive.is_kidnapped(i));
  return result;
}

}  // namespace vantage::benchmarks
