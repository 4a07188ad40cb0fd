#include "integrity_worlds.hpp"

#include <doctest/doctest.h>

#include <filesystem>
#include <set>
#include <string>

#include "simulate/drive.hpp"
#include "simulate/world.hpp"

namespace vantage::benchmarks {
namespace {

TEST_CASE("every world of bench integrity can be made, on both days, with kidnaps") {
  std::set<std::string> names;
  for (const NamedWorld& named : all_worlds()) {
    CAPTURE(named.name);
    CHECK(names.insert(named.name).second);
    CHECK_FALSE(named.scenarios.empty());
    const auto params = params_of(named, 101, 2);
    REQUIRE_MESSAGE(params, to_string(params.error()));
    const auto world = simulation::World::create(*params, simulation::Day::drive);
    REQUIRE_MESSAGE(world, to_string(world.error()));
    const auto drive = simulation::Drive::create(*world, *params);
    REQUIRE_MESSAGE(drive, to_string(drive.error()));
    CHECK(drive->scans() >= 100);
  }
}

TEST_CASE("the seeds of the shipped worlds are refused") {
  for (const auto& file :
       std::filesystem::directory_iterator(VANTAGE_SOURCE_DIR "/configs/simulate")) {
    CAPTURE(file.path().string());
    const auto shipped = simulation::load_world(file.path());
    REQUIRE_MESSAGE(shipped, to_string(shipped.error()));
    const auto refused = params_of(all_worlds().front(), shipped->seed, 0);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == ErrorCode::invalid_input);
  }
}

TEST_CASE("a simulated drive has what a localizer needs") {
  const auto params = params_of(all_worlds().front(), 101, 2);
  REQUIRE(params);
  const auto drive = simulated_drive(*params, 40, params->seed);
  REQUIRE_MESSAGE(drive, to_string(drive.error()));
  CHECK(drive->scans.size() == 40);
  CHECK(drive->reference.size() == 40);
  CHECK(drive->odometry.size() == 40);
  REQUIRE(drive->kidnapped.size() == 40);
  for (std::size_t i = 0; i < 40; ++i) {
    CHECK(drive->scans[i].size() > 1000);
    CHECK(drive->odometry[i].stamp == drive->reference[i].stamp);
    if (i == 0) continue;
    // Odometry does not feel a kidnap.
    const double moved =
        (drive->reference[i].pose.translation - drive->reference[i - 1].pose.translation).norm();
    const double felt =
        (drive->odometry[i].pose.translation - drive->odometry[i - 1].pose.translation).norm();
    CHECK(felt == doctest::Approx(0.6).epsilon(0.1));
    CHECK((moved > 20.0) == drive->kidnapped[i]);
  }
}

}  // namespace
}  // namespace vantage::benchmarks
