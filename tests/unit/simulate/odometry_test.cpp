#include "simulate/odometry.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

#include "simulate/simulation.hpp"
#include "small_world.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"

namespace vantage::simulation {
namespace {

OdometryParams exact_odometry() {
  OdometryParams params;
  params.translation_noise = params.rotation_noise = 0.0;
  return params;
}

/// The sum of the lengths of a trajectory's motions [m].
double way(const io::Trajectory& trajectory) {
  double sum = 0.0;
  for (std::size_t k = 1; k < trajectory.size(); ++k) {
    sum += (trajectory[k].pose.translation - trajectory[k - 1].pose.translation).norm();
  }
  return sum;
}

/// A straight way of this length, a pose every 0.1 m.
io::Trajectory straight(double length) {
  io::Trajectory truth;
  for (int k = 0; k <= std::lround(length / 0.1); ++k) {
    truth.push_back({0.1 * k, pose_from_xyz_rpy({0.1 * k, 0.0, 0.0}, {0.0, 0.0, 0.0})});
  }
  return truth;
}

TEST_CASE("odometry of its own rate reaches from the first scan to the end of the last sweep") {
  WorldParams params = test::small_world();
  params.drive.length = 30.0;
  params.drive.scan_every = 7;
  params.drive.start_time = 100.0;
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  params.odometry.rate = 50.0;
  const auto stamps = stamps_of_odometry(drive, params.odometry);
  REQUIRE(stamps.size() == static_cast<std::size_t>(7 * 5 * (drive.scans() - 1) + 5 + 1));
  CHECK(stamps.front() == drive.stamp(0));
  for (std::size_t k = 1; k < stamps.size(); ++k) {
    CHECK(stamps[k] - stamps[k - 1] == doctest::Approx(0.02));
  }
  CHECK(stamps.back() == doctest::Approx(drive.stamp(drive.scans() - 1) + 0.1));
  CHECK(stamps.back() == doctest::Approx(drive.end()));

  const auto truth = truth_at(world, drive, stamps);
  const auto odometry = simulate_odometry(truth, exact_odometry(), 1);
  REQUIRE(odometry.size() == stamps.size());
  for (std::size_t k = 0; k < stamps.size(); ++k) {
    const Pose expected = drive.pose(stamps[0]).inverse() * drive.pose(stamps[k]);
    CHECK(odometry[k].stamp == stamps[k]);
    CHECK((odometry[k].pose.translation - expected.translation).norm() < 1e-9);
    CHECK(rotation_between(odometry[k].pose, expected) < 1e-7);
  }
}

TEST_CASE("odometry without a rate reports at the stamps of the scans") {
  const WorldParams params = test::small_world();
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  const auto stamps = stamps_of_odometry(drive, params.odometry);
  REQUIRE(stamps.size() == drive.scans());
  for (std::size_t k = 0; k < stamps.size(); ++k) CHECK(stamps[k] == drive.stamp(k));
}

TEST_CASE("odometry of its own rate does not notice a kidnap between two of its poses") {
  WorldParams params = test::small_world();
  params.campus.size_x = params.campus.size_y = 120.0;
  params.drive.route = 1;
  params.drive.length = 200.0;
  params.drive.speed = 2.0;
  params.drive.kidnaps = 2;
  params.odometry.rate = 7.0;
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  const auto truth = truth_at(world, drive, stamps_of_odometry(drive, params.odometry));
  const auto felt = without_kidnaps(world, drive, truth);
  double longest = 0.0;
  int jumps = 0;
  for (std::size_t k = 1; k < felt.size(); ++k) {
    const double moved = (felt[k].pose.translation - felt[k - 1].pose.translation).norm();
    longest = std::max(longest, moved);
    CHECK(moved > 0.9 * 2.0 / 7.0);
    if ((truth[k].pose.translation - truth[k - 1].pose.translation).norm() > 10.0) ++jumps;
  }
  CHECK(jumps == 2);
  CHECK(longest < 1.1 * 2.0 / 7.0);
}

TEST_CASE("wheels slip on their share of the way") {
  OdometryParams params = exact_odometry();
  const io::Trajectory truth = straight(200.0);
  for (const double share : {0.0, 0.1, 0.5, 1.0}) {
    for (const double factor : {0.0, 0.5, 1.5}) {
      CAPTURE(share);
      CAPTURE(factor);
      params.slip = share;
      params.slip_factor = factor;
      const auto odometry = simulate_odometry(truth, params, 5);
      CHECK(way(odometry) == doctest::Approx(200.0 * (1.0 + share * (factor - 1.0))));
      for (std::size_t k = 1; k < odometry.size(); ++k) {
        const double step =
            (odometry[k].pose.translation - odometry[k - 1].pose.translation).norm();
        CHECK(step >= 0.1 * std::min(1.0, factor) - 1e-9);
        CHECK(step <= 0.1 * std::max(1.0, factor) + 1e-9);
      }
    }
  }
}

TEST_CASE("slip comes in one piece of every ten metres, the same at any rate of odometry") {
  OdometryParams params = exact_odometry();
  params.slip = 0.2;
  params.slip_factor = 2.0;
  const io::Trajectory truth = straight(100.0);
  io::Trajectory seldom;
  for (std::size_t k = 0; k < truth.size(); k += 5) seldom.push_back(truth[k]);
  const auto often = simulate_odometry(truth, params, 3);
  const auto rare = simulate_odometry(seldom, params, 3);
  for (std::size_t k = 0; k < rare.size(); ++k) {
    CHECK((rare[k].pose.translation - often[5 * k].pose.translation).norm() < 1e-9);
  }
  int begins = 0;
  bool was_slipping = false;
  for (std::size_t k = 1; k < often.size(); ++k) {
    const double step = (often[k].pose.translation - often[k - 1].pose.translation).norm();
    const bool slips = step > 0.1 + 1e-9;
    if (slips && !was_slipping) ++begins;
    was_slipping = slips;
  }
  CHECK(begins >= 9);  // two pieces may touch
  CHECK(begins <= 10);
  const auto other = simulate_odometry(truth, params, 4);
  CHECK((other[50].pose.translation - often[50].pose.translation).norm() +
            (other[150].pose.translation - often[150].pose.translation).norm() >
        1e-3);
}

TEST_CASE("odometry.tum has the poses of odometry.rate") {
  const vantage::test::TemporaryFolder scratch;
  WorldParams params = test::small_world();
  params.map.point_spacing = 1.0;
  params.lidar.azimuth_step = 5.0;
  params.drive.length = 6.0;
  params.odometry.rate = 20.0;
  const auto summary = simulate(params, scratch.path() / "a");
  REQUIRE_MESSAGE(summary, to_string(summary.error()));
  const auto odometry = io::read_trajectory(scratch.path() / "a/odometry.tum");
  REQUIRE(odometry);
  CHECK(odometry->size() == 40 * 2 + 1);  // 40 sweeps of 0.1 s
  CHECK(summary->odometry_poses == odometry->size());
  CHECK(io::read_trajectory(scratch.path() / "a/reference.tum")->size() == 40);
}

TEST_CASE("wrong odometry is refused with the place of the error") {
  test::check_refused("schema = 1\n[odometry]\nrate = 0\n", "w.toml:3:8: error: ");
  test::check_refused("schema = 1\n[odometry]\nslip = 1.5\n", "w.toml:3:8: error: ");
  test::check_refused("schema = 1\n[odometry]\nslip_factor = -1\n", "w.toml:3:15: error: ");
  test::check_refused("schema = 1\n[odometry]\nrate = 1000\n[drive]\nlength = 1e5\n",
                      "w.toml:3:8: error: odometry.rate would make more than");
}

}  // namespace
}  // namespace vantage::simulation
