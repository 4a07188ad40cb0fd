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
namespace {

/// A level campus with a straight street of 120 m, which the drive takes as its second one.
std::vector<std::string> long_street(const std::string& layout) {
  return {"campus.layout=" + layout,     "campus.size_x=80.0",       "campus.size_y=240.0",
          "campus.street_spacing=120.0", "campus.street_jitter=0.0", "campus.ground_relief=0.0",
          "drive.length=130.0",          "drive.scan_every=6"};
}

}  // namespace

const char* to_string(Scenario scenario) noexcept {
  switch (scenario) {
    case Scenario::odometry: return "odometry";
    case Scenario::constant_velocity: return "constant_velocity";
    case Scenario::wrong_start: return "wrong_start";
    case Scenario::kidnap: return "kidnap";
    case Scenario::prior: return "prior";
  }
  return "";
}

std::span<const NamedWorld> all_worlds() {
  static const std::vector<NamedWorld> worlds{
      {.name = "plain", .overrides = {}},
      {.name = "half_covered",
       .overrides = {"lidar.covered_from=-180.0", "lidar.covered_to=0.0",
                     "lidar.disturbed_from=0.2"}},
      {.name = "cars_moved", .overrides = {"changes.moved_cars=1.0"}},
      {.name = "building_gone", .overrides = {"changes.buildings_gone=3"}},
      {.name = "building_new", .overrides = {"changes.buildings_new=2", "changes.fences_new=4"}},
      {.name = "leaves", .overrides = {"changes.leaves_gone=1.0"}},
      {.name = "clutter", .overrides = {"lidar.clutter=0.15"}},
      {.name = "rows", .overrides = long_street("rows"), .ambiguous = true},
      {.name = "tunnel", .overrides = long_street("tunnel"), .ambiguous = true},
      {.name = "square",
       .overrides = {"campus.layout=square", "campus.size_x=150.0", "campus.size_y=150.0",
                     "campus.street_spacing=50.0", "campus.ground_relief=0.0",
                     "lidar.max_range=35.0", "drive.route=2", "drive.length=130.0",
                     "drive.scan_every=6"},
       .ambiguous = true},
      {.name = "kidnaps", .overrides = {"drive.length=90.0"}, .scenarios = {Scenario::kidnap}},
      {.name = "wrong_starts",
       .overrides = {},
       .scenarios = {Scenario::wrong_start},
       .wrong_starts = 12},
      {.name = "sweeps", .overrides = {"lidar.motion_distortion=true", "drive.scan_every=1"}},
      {.name = "large",
       .overrides = {"campus.size_x=500.0", "campus.size_y=500.0", "drive.length=120.0"},
       .wrong_starts = 2},
      {.name = "slopes",
       .overrides = {"campus.ground_relief=15.0", "lidar.roll=6.0", "lidar.pitch=-8.0"}},
      {.name = "doubled", .overrides = {}, .ambiguous = true, .second_copy = {0.5, 0.5, 0.0}},
  };
  return worlds;
}

Result<void> check_seed(std::uint64_t seed) {
  constexpr std::array<std::uint64_t, 8> kUsed{1, 7, 11, 21, 23, 32, 38, 50};
  if (std::ranges::find(kUsed, seed) != kUsed.end()) {
    return fail(ErrorCode::invalid_input,
                fmt::format("seed {} is that of a world of configs/simulate/; take another", seed));
  }
  return {};
}

Result<simulation::WorldParams> params_of(const NamedWorld& world, std::uint64_t seed,
                                          int kidnaps) {
  VANTAGE_CHECK(check_seed(seed));
  std::vector<std::string> overrides = world.overrides;
  overrides.push_back(fmt::format("seed={}", seed));
  overrides.push_back(fmt::format("drive.kidnaps={}", kidnaps));
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
