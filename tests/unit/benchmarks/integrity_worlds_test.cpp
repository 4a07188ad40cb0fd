#include "integrity_scenarios.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <string>

#include "integrity_worlds.hpp"
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

TEST_CASE("a seed on which constants were chosen is not called unseen") {
  const std::string chose = use_of_seed(301), seen = use_of_seed(401), unseen = use_of_seed(700);
  CHECK(chose == "constants were chosen on it");
  CHECK(chose == use_of_seed(303));
  CHECK(chose == use_of_seed(311));
  CHECK(seen == use_of_seed(601));
  CHECK(unseen == "not used for the verdict");
  CHECK(std::set<std::string>{chose, seen, unseen, use_of_seed(212)}.size() == 4);
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

const NamedWorld& world_of(const std::string& name) {
  return *std::ranges::find(all_worlds(), name, &NamedWorld::name);
}

TEST_CASE("scans several times as far apart make a drive of as many scans so many times as long") {
  const auto near = params_of(world_of("plain"), 101, DriveNeeds{});
  const auto far = params_of(world_of("plain"), 101, DriveNeeds{.stretch = 4});
  REQUIRE(near);
  REQUIRE(far);
  CHECK(*far->drive.length == 4.0 * *near->drive.length);
  CHECK(far->drive.scan_every == 4 * near->drive.scan_every);
  const auto sweeps = params_of(world_of("sweeps"), 101, DriveNeeds{.stretch = 4});
  REQUIRE(sweeps);
  CHECK(sweeps->drive.scan_every == 1);
  CHECK(needs_of(Scenario::constant_velocity, 2, 4) == DriveNeeds{});
  CHECK(needs_of(Scenario::kidnap, 2, 4) == DriveNeeds{.kidnaps = 2, .stretch = 4});
}

TEST_CASE("what a scenario changes of the localizer") {
  const LocalizerParams usual;
  for (const Scenario scenario : kRepeatable) {
    const LocalizerParams params = params_in(scenario, usual);
    CHECK_FALSE(params.live);
    CHECK(params.search_budget.has_value() == (scenario == Scenario::budget));
  }
  CHECK(params_in(Scenario::live, usual).live);
  CHECK(params_in(Scenario::live, usual).search_budget == 20.0);
}

TEST_CASE("the truth of a drive whose scans have other axes") {
  for (const NamedWorld& world : all_worlds()) {
    CAPTURE(world.name);
    const bool is_known = world.name != "other_place" && world.name != "mirrored" &&
                          world.name != "xy_swapped" && world.name != "yz_swapped";
    CHECK(world.has_truth() == is_known);
  }
  const auto params = params_of(world_of("plain"), 101, 0);
  REQUIRE(params);
  const auto plain = judged_drive(world_of("plain"), *params, 3);
  const auto down = judged_drive(world_of("z_down"), *params, 3);
  const auto mirrored = judged_drive(world_of("mirrored"), *params, 3);
  REQUIRE(plain);
  REQUIRE(down);
  REQUIRE(mirrored);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK_FALSE(mirrored->truth[i].has_value());
    CHECK(mirrored->drive.scans[i][0].y() == -plain->drive.scans[i][0].y());
    REQUIRE(plain->truth[i].has_value());
    REQUIRE(down->truth[i].has_value());
    // Its points are where they were.
    for (const std::size_t k : {0, 100, 1000}) {
      const Point expected = *plain->truth[i] * plain->drive.scans[i][k];
      const Point got = *down->truth[i] * down->drive.scans[i][k];
      CHECK((expected - got).norm() < 1e-9);
    }
  }
}

TEST_CASE("a bent map shows at the bent pose what the sensor sees") {
  const auto params = params_of(world_of("bent"), 101, 0);
  REQUIRE(params);
  constexpr double kBend = 1.5;
  double farthest = 0.0, most_turned = 0.0;
  for (const double x : {-100.0, -40.0, 0.0, 70.0}) {
    for (const double y : {-90.0, 10.0, 100.0}) {
      const Pose pose{.rotation = rotation_from_vector({0.0, 0.0, 0.7}),
                      .translation = {x, y, 1.0}};
      const Pose there = bent(pose, kBend, params->campus);
      farthest = std::max(farthest, (there.translation - pose.translation).norm());
      most_turned = std::max(most_turned, rotation_between(there, pose));
      for (const Point& seen : {Point(10.0, 0.0, 0.0), Point(0.0, 10.0, 0.0)}) {
        const Pose point{.translation = pose * seen};
        // 10 m away, the strain of the bend is all that differs.
        const double off = (bent(point, kBend, params->campus).translation - there * seen).norm();
        CHECK(off < 0.15);
      }
    }
  }
  CHECK(farthest > 1.0);
  CHECK(farthest < 2.2);
  CHECK(most_turned > 0.01);
  CHECK(bent(Pose{}, 0.0, params->campus).translation.norm() == 0.0);
}

TEST_CASE("maps that differ from their world") {
  auto params = params_of(world_of("plain"), 101, 0);
  REQUIRE(params);
  params->map.point_spacing = 1.0;
  const auto make = [&](const MapDifference& difference) {
    auto map = map_of(*params, difference);
    REQUIRE_MESSAGE(map, to_string(map.error()));
    return *std::move(map);
  };
  const PointCloud whole = make({});
  CHECK((whole == simulated_map(*params).value()));
  const PointCloud doubled = make({.second_copy = {0.5, 0.0, 0.0}});
  REQUIRE(doubled.size() == 2 * whole.size());
  CHECK((doubled.back() - whole.back()).isApprox(Point(0.5, 0.0, 0.0), 1e-9));
  const PointCloud half = make({.only_half = true});
  CHECK(half.size() < whole.size());
  CHECK(std::ranges::all_of(half, [](const Point& p) { return p.x() <= 0.0; }));
  CHECK((make({.of_another_place = true}) != whole));
  std::set<std::string> keys;
  for (const NamedWorld& world : all_worlds()) keys.insert(world.map.key());
  CHECK(keys.size() == 9);
}

TEST_CASE("a map that a sensor made lies on the world's surfaces") {
  auto params = params_of(world_of("plain"), 101, 0);
  REQUIRE(params);
  const auto surveyed = map_of(*params, {.surveyed_by = simulation::SensorModel::mid360});
  REQUIRE_MESSAGE(surveyed, to_string(surveyed.error()));
  const auto world = simulation::World::create(*params);
  REQUIRE(world);
  CHECK(surveyed->size() > 50'000);
  // Its ground is that of the terrain, where there is nothing else.
  std::size_t near_ground = 0, below = 0;
  for (const Point& p : *surveyed) {
    const double above = p.z() - world->terrain().height(p.x(), p.y());
    near_ground += std::abs(above) < 0.1 ? 1 : 0;
    below += above < -0.5 ? 1 : 0;
  }
  CHECK(10 * near_ground > surveyed->size());
  CHECK(100 * below < surveyed->size());
}

}  // namespace
}  // namespace vantage::benchmarks
