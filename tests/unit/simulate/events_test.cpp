#include "simulate/events.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "simulate/odometry.hpp"
#include "simulate/simulation.hpp"
#include "small_world.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/trajectory_io.hpp"

namespace vantage::simulation {
namespace {

using Eigen::Vector2d;
using vantage::test::read_text;
using vantage::test::TemporaryFolder;

/// A drive of 500 scans with three kidnaps and two holes.
WorldParams eventful_world() {
  WorldParams params = test::small_world();
  params.campus.size_x = params.campus.size_y = 120.0;
  params.campus.street_spacing = 40.0;
  params.drive.route = 1;
  params.drive.length = 500.0;
  params.drive.scan_every = 10;
  params.drive.speed = 10.0 / 10.0;
  params.drive.kidnaps = 3;
  params.map.holes = 2;
  params.map.hole_radius = 12.0;
  return params;
}

Vector2d place(const Drive& drive, std::size_t scan) {
  return drive.pose(drive.stamp(scan)).translation.head<2>();
}

std::vector<std::size_t> kidnapped_scans(const Drive& drive) {
  std::vector<std::size_t> scans;
  for (std::size_t k = 0; k < drive.scans(); ++k) {
    if (drive.is_kidnapped(k)) scans.push_back(k);
  }
  return scans;
}

TEST_CASE("kidnaps carry the sensor far away, evenly spread over the drive") {
  const WorldParams params = eventful_world();
  const World world = test::make_world(params);
  for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
    WorldParams seeded = params;
    seeded.seed = seed;
    const Drive drive = test::make_drive(world, seeded);
    REQUIRE(drive.scans() == 500);
    CHECK(kidnapped_scans(drive) == std::vector<std::size_t>{125, 250, 375});
    for (std::size_t k = 1; k < drive.scans(); ++k) {
      const Pose before = drive.pose(drive.stamp(k - 1)), now = drive.pose(drive.stamp(k));
      const double moved = (place(drive, k) - place(drive, k - 1)).norm();
      if (!drive.is_kidnapped(k)) {
        CHECK(moved < 1.0 + 1e-6);  // one second at 1 m/s
        continue;
      }
      CHECK(moved > 0.3 * 120.0 - 1.0);
      CHECK(rotation_between(before, now) > 40.0 * M_PI / 180.0);
      // Up to its moment the sensor is where it would have been.
      const Pose just_before = drive.pose(std::nextafter(drive.stamp(k), 0.0));
      CHECK((just_before.translation - drive.pose_driven_on(k).translation).norm() < 1e-6);
      CHECK((just_before.translation - before.translation).norm() < 1.0 + 0.1);
      CHECK(world.streets().distance_to_street(place(drive, k)) < params.campus.street_width / 2.0);
    }
  }
}

TEST_CASE("holes lie on the driven path, apart, and not where the sensor starts or lands") {
  const WorldParams params = eventful_world();
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  REQUIRE(drive.holes().size() == 2);
  const auto& holes = drive.holes();
  CHECK((holes[0].centre - holes[1].centre).norm() >= 24.0);
  auto starts = kidnapped_scans(drive);
  starts.push_back(0);
  for (std::size_t h = 0; h < 2; ++h) {
    CHECK(holes[h].radius == 12.0);
    for (const std::size_t start : starts) {
      CHECK((place(drive, start) - holes[h].centre).norm() > 12.0 + 20.0);
    }
    // Its centre is a scan in its half of the drive.
    bool is_on_path = false;
    for (std::size_t k = 250 * h; k < 250 * (h + 1); ++k) {
      is_on_path = is_on_path || (place(drive, k) - holes[h].centre).norm() < 1e-9;
    }
    CHECK(is_on_path);
  }
  std::size_t inside = 0;
  for (std::size_t k = 0; k < drive.scans(); ++k) {
    const bool expected = (place(drive, k) - holes[0].centre).norm() <= 12.0 ||
                          (place(drive, k) - holes[1].centre).norm() <= 12.0;
    CHECK(drive.is_in_hole(k) == expected);
    inside += expected ? 1 : 0;
  }
  CHECK(inside >= 40);
  CHECK(inside < 250);
}

TEST_CASE("events are the same again, and others with another seed") {
  const WorldParams params = eventful_world();
  const World world = test::make_world(params);
  const Drive a = test::make_drive(world, params), b = test::make_drive(world, params);
  WorldParams other = params;
  other.seed += 1;
  const Drive c = test::make_drive(world, other);
  CHECK(place(a, 125) == place(b, 125));
  CHECK(a.holes()[0].centre == b.holes()[0].centre);
  CHECK(place(a, 125) != place(c, 125));
}

TEST_CASE("the files of an eventful drive") {
  const TemporaryFolder scratch;
  WorldParams params = eventful_world();
  params.map.point_spacing = 0.8;
  params.lidar.azimuth_step = 5.0;
  params.campus.origin_x = 300.0;
  params.campus.origin_y = -700.0;
  params.odometry.rotation_noise = params.odometry.translation_noise = 0.0;
  params.drive.scan_every = 40;  // 125 scans
  const auto summary = simulate(params, scratch.path() / "a");
  REQUIRE_MESSAGE(summary, to_string(summary.error()));
  CHECK(summary->kidnaps == 3);
  CHECK(summary->holes == 2);
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);

  SUBCASE("events.csv says what happens at which scan") {
    std::string expected = "stamp,kidnapped,in_hole\n";
    for (std::size_t k = 0; k < drive.scans(); ++k) {
      const std::string stamp = std::to_string(4 * k);
      expected += stamp + (k == 31 || k == 62 || k == 93 ? ",1" : ",0") +
                  (drive.is_in_hole(k) ? ",1\n" : ",0\n");
    }
    CHECK(read_text(scratch.path() / "a/events.csv") == expected);
    CHECK(expected.find(",1\n") != std::string::npos);
  }
  SUBCASE("the map has no point in a hole and all others") {
    params.map.holes = 0;
    REQUIRE(simulate(params, scratch.path() / "whole"));
    PointCloud whole = io::read_point_cloud(scratch.path() / "whole/map.pcd")->points;
    const std::size_t size = whole.size();
    const auto is_in_hole = [&](const Point& p) {
      return std::any_of(drive.holes().begin(), drive.holes().end(), [&](const Hole& hole) {
        return (p.head<2>() - Vector2d(300.0, -700.0) - hole.centre).norm() <= 12.0;
      });
    };
    std::erase_if(whole, is_in_hole);
    CHECK(whole.size() + 500 < size);
    const PointCloud map = io::read_point_cloud(scratch.path() / "a/map.pcd")->points;
    CHECK(map.size() > whole.size() - 5);  // points on the edge, rounded to float32
    CHECK(map.size() < whole.size() + 5);
    CHECK(std::count_if(map.begin(), map.end(), is_in_hole) < 5);
  }
  SUBCASE("odometry does not notice") {
    const auto reference = io::read_trajectory(scratch.path() / "a/reference.tum");
    const auto odometry = io::read_trajectory(scratch.path() / "a/odometry.tum");
    REQUIRE(reference);
    REQUIRE(odometry);
    REQUIRE(reference->size() == 125);
    for (std::size_t k = 1; k < 125; ++k) {
      const Pose before = (*reference)[k - 1].pose;
      Pose now = (*reference)[k].pose;
      if (drive.is_kidnapped(k)) {
        CHECK((now.translation - before.translation).norm() > 30.0);
        now = drive.pose_driven_on(k);
        now.translation += world.map_origin();
      }
      const Pose moved = before.inverse() * now;
      const Pose felt = (*odometry)[k - 1].pose.inverse() * (*odometry)[k].pose;
      CHECK(felt.translation.norm() < 4.0 + 0.1);  // up and down the ground
      CHECK((felt.translation - moved.translation).norm() < 1e-5);
      CHECK(rotation_between(felt, moved) < 1e-5);
      CHECK((*reference)[k].stamp - (*reference)[k - 1].stamp == doctest::Approx(4.0));
    }
  }
}

TEST_CASE("events that do not fit are refused with the place of the error") {
  struct Case {
    const char* text;
    const char* message;
  };
  const Case cases[] = {
      {"schema = 1\n[map]\nholes = 40\n", "w.toml:3:9: error: map.holes = 40 of map.hole_radius"},
      {"schema = 1\n[map]\nhole_radius = 300\nholes = 1\n", "w.toml:4:9: error: map.holes = 1"},
      {"schema = 1\n[drive]\nlength = 3\nscan_every = 10\nkidnaps = 1\n",
       "w.toml:5:11: error: drive.kidnaps = 1 leaves less than two scans"},
      {"schema = 1\n[drive]\nkidnaps = -1\n", "w.toml:3:11: error: "},
      {"schema = 1\n[map]\nholes = 1.5\n", "w.toml:3:9: error: "},
      {"schema = 1\n[map]\nhole_radius = 0\n", "w.toml:3:15: error: "},
  };
  for (const Case& c : cases) test::check_refused(c.text, c.message);
}

}  // namespace
}  // namespace vantage::simulation
