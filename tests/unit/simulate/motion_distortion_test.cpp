#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <numbers>
#include <vector>

#include "io/scan_sequence.hpp"
#include "simulate/lidar.hpp"
#include "simulate/simulation.hpp"
#include "small_world.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "vantage/track/sweep_motion.hpp"

namespace vantage::simulation {
namespace {

using vantage::test::TemporaryFolder;

/// At 8 m/s through the corners of a loop, with noise.
WorldParams fast_drive() {
  WorldParams params = test::small_world();
  params.campus.leaf_area_density = 0.0;  // distance_to_surface knows no leaves
  params.map.point_spacing = 1.0;
  params.lidar.motion_distortion = true;
  params.lidar.range_noise = 0.02;
  params.drive.speed = 8.0;
  params.drive.turn_radius = 5.0;
  params.drive.length = 60.0;
  params.drive.scan_every = 5;
  return params;
}

struct Errors {
  double rms, percentile_99;
};

Errors errors_of(const World& world, const Pose& T_campus_sensor, const PointCloud& points) {
  std::vector<double> errors;
  double squares = 0.0;
  for (const Point& p : points) {
    errors.push_back(test::distance_to_surface(world, T_campus_sensor * p, 3.0));
    squares += errors.back() * errors.back();
  }
  std::sort(errors.begin(), errors.end());
  return {std::sqrt(squares / static_cast<double>(errors.size())),
          errors[errors.size() * 99 / 100]};
}

TEST_CASE("point times and the true motion undo motion distortion, all the way through files") {
  const TemporaryFolder scratch;
  const WorldParams params = fast_drive();
  REQUIRE(simulate(params, scratch.path() / "out"));
  const auto scans = io::ScanSequence::open(scratch.path() / "out/scans", 10.0);
  REQUIRE_MESSAGE(scans, to_string(scans.error()));
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  REQUIRE(scans->size() == drive.scans());

  Errors worst_raw{}, worst_undistorted{};
  double fastest_turn = 0.0;
  for (std::size_t k = 0; k < scans->size(); ++k) {
    const auto scan = scans->read(k);
    REQUIRE_MESSAGE(scan, to_string(scan.error()));
    REQUIRE(scan->seconds.size() == scan->points.size());
    const auto [first, last] = std::minmax_element(scan->seconds.begin(), scan->seconds.end());
    CHECK(*first >= 0.0F);
    CHECK(*last < 0.1F);
    CHECK(*last - *first > 0.09F);
    CHECK(std::is_sorted(scan->seconds.begin(), scan->seconds.end()));

    MotionInputs odometry({});
    for (double t = scan->stamp; t < scan->stamp + 0.105; t += 0.01) {
      REQUIRE(odometry.add(OdometrySample{t, drive.pose(t)}));
    }
    const SweepTime time{scan->stamp, scan->stamp + 0.1};
    const Pose now = drive.pose(time.middle());
    const Pose step = drive.pose(time.first).inverse() * drive.pose(time.last);
    fastest_turn = std::max(fastest_turn, rotation_between(Pose{}, step) / 0.1);
    const Twist twist = logarithm(step);
    const MotionState state{
        .T_map_body = now, .velocity = twist.linear / 0.1, .rate_bias = -twist.angular / 0.1};
    const SweepMotion motion(state, odometry, time, time.first);
    PointCloud undistorted;
    for (std::size_t i = 0; i < scan->points.size(); ++i) {
      const double stamp = scan->stamp + static_cast<double>(scan->seconds[i]);
      undistorted.push_back(motion.seen_from_middle(scan->points[i], stamp));
    }
    const Errors raw = errors_of(world, now, scan->points);
    const Errors without = errors_of(world, now, undistorted);
    worst_raw.rms = std::max(worst_raw.rms, raw.rms);
    worst_raw.percentile_99 = std::max(worst_raw.percentile_99, raw.percentile_99);
    worst_undistorted.rms = std::max(worst_undistorted.rms, without.rms);
    worst_undistorted.percentile_99 =
        std::max(worst_undistorted.percentile_99, without.percentile_99);
  }
  MESSAGE("worst scan, rms and 99 %: " << worst_raw.rms << ", " << worst_raw.percentile_99
                                       << " m as measured, " << worst_undistorted.rms << ", "
                                       << worst_undistorted.percentile_99 << " m undistorted");
  CHECK(fastest_turn > 60.0 * std::numbers::pi / 180.0);
  CHECK(worst_raw.rms > 0.15);
  CHECK(worst_raw.percentile_99 > 0.5);
  CHECK(worst_undistorted.rms < 1.5 * params.lidar.range_noise);
  CHECK(worst_undistorted.percentile_99 < 0.08);
}

TEST_CASE("each point has the moment of its firing") {
  WorldParams params = fast_drive();
  params.lidar.range_noise = 0.0;
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  const Sweep sweep = Lidar(params.lidar, params.seed).sweep(world, drive, 3);
  REQUIRE(sweep.points.size() > 5000);
  REQUIRE(sweep.seconds.size() == sweep.points.size());
  for (std::size_t i = 0; i < sweep.points.size(); ++i) {
    const Point& p = sweep.points[i];
    const double clockwise_from_back =
        std::fmod(3.0 * std::numbers::pi - std::atan2(p.y(), p.x()), 2.0 * std::numbers::pi);
    const double turned = clockwise_from_back / (2.0 * std::numbers::pi);
    const double difference = std::remainder(turned * 0.1 - sweep.seconds[i], 0.1);
    CHECK(std::abs(difference) < 1e-6);
  }
}

TEST_CASE("scans have motion distortion unless a world says otherwise, whatever the model") {
  for (const char* text : {"schema = 1\n", "schema = 1\n[lidar]\nmodel = \"mid360\"\n"}) {
    const auto table = parse_toml(text, "w.toml");
    REQUIRE(table);
    CHECK(parse_world(*table)->lidar.motion_distortion);
  }
}

TEST_CASE("without motion distortion scans have no times, and their files no field for them") {
  const TemporaryFolder scratch;
  WorldParams params = fast_drive();
  params.lidar.motion_distortion = false;
  params.drive.length = 4.0;
  REQUIRE(simulate(params, scratch.path() / "out"));
  const auto scan = io::ScanSequence::open(scratch.path() / "out/scans", 10.0)->read(0);
  REQUIRE(scan);
  CHECK(scan->points.size() > 5000);
  CHECK(scan->seconds.empty());
  CHECK(vantage::test::read_text(scratch.path() / "out/scans/000000.pcd").find("FIELDS x y z\n") !=
        std::string::npos);
}

}  // namespace
}  // namespace vantage::simulation
