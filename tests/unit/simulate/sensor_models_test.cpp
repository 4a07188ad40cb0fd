#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "simulate/imu.hpp"
#include "simulate/lidar.hpp"
#include "simulate/simulation.hpp"
#include "small_world.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "vantage/io/trajectory_io.hpp"

namespace vantage::simulation {
namespace {

using Eigen::Vector3d;
using test::kRadians;

double elevation_of(const Vector3d& direction) {
  return std::asin(direction.z() / direction.norm()) / kRadians;
}
double azimuth_of(const Vector3d& direction) {
  return std::atan2(direction.y(), direction.x()) / kRadians;
}

WorldParams parsed(const std::string& text) {
  const auto table = parse_toml(text, "w.toml");
  REQUIRE(table);
  const auto world = parse_world(*table);
  REQUIRE_MESSAGE(world, to_string(world.error()));
  return *world;
}

WorldParams without_noise(SensorModel model) {
  WorldParams params = test::small_world();
  params.campus.leaf_area_density = 0.0;  // distance_to_surface knows no leaves
  params.lidar = lidar_of(model);
  params.lidar.motion_distortion = false;
  params.lidar.range_noise = params.lidar.angle_noise = params.lidar.dropout = 0.0;
  params.lidar.grazing_angle = 0.0;
  return params;
}

TEST_CASE("an HDL-64 has two blocks of 32 rings") {
  const LidarParams params = lidar_of(SensorModel::hdl64);
  REQUIRE(params.validate());
  CHECK(params.firings() == 2083);
  const Lidar lidar(params, 1);
  std::vector<double> elevations;
  for (int ring = 0; ring < 64; ++ring)
    elevations.push_back(elevation_of(lidar.direction(5, ring)));
  CHECK(elevations.front() == doctest::Approx(-24.8));
  CHECK(elevations.back() == doctest::Approx(2.0));
  for (std::size_t ring = 1; ring < 64; ++ring) {
    const double spacing = elevations[ring] - elevations[ring - 1];
    if (ring < 32) CHECK(spacing == doctest::Approx(0.5).epsilon(0.05));
    if (ring > 32) CHECK(spacing == doctest::Approx(1.0 / 3.0));
  }
  CHECK(elevations[32] - elevations[31] == doctest::Approx(1.0 / 3.0));
}

TEST_CASE("a MID-360 fires 200,000 times a second in a rosette that fills its field of view") {
  const LidarParams params = lidar_of(SensorModel::mid360);
  REQUIRE(params.validate());
  REQUIRE(params.firings() * params.rings * params.rate == doctest::Approx(200'000.0));
  CHECK(params.turns * params.rate == doctest::Approx(180.0).epsilon(0.02));
  const Lidar lidar(params, 1);
  double lowest = 90.0, highest = -90.0, turned = 0.0;
  std::set<std::pair<int, int>> seen;  // cells of 1 degree
  std::size_t seen_in_one = 0;
  for (std::size_t sweep = 0; sweep < 10; ++sweep) {
    for (int firing = 0; firing < params.firings(); ++firing) {
      const Vector3d first = lidar.direction(firing, 0, sweep);
      const Vector3d next = firing + 1 < params.firings() ? lidar.direction(firing + 1, 0, sweep)
                                                          : lidar.direction(0, 0, sweep + 1);
      turned -= std::remainder(azimuth_of(next) - azimuth_of(first), 360.0);
      // From one sweep to the next, the pattern goes on without a jump.
      CHECK(std::abs(elevation_of(next) - elevation_of(first)) < 0.05);
      CHECK(std::abs(std::remainder(azimuth_of(next) - azimuth_of(first), 360.0)) < 1.4);
      for (int ring = 0; ring < 4; ++ring) {
        const Vector3d direction = lidar.direction(firing, ring, sweep);
        CHECK(elevation_of(direction) == doctest::Approx(elevation_of(first) + 2.7 * ring));
        CHECK(std::abs(std::remainder(azimuth_of(direction) - azimuth_of(first), 360.0)) < 1e-9);
        lowest = std::min(lowest, elevation_of(direction));
        highest = std::max(highest, elevation_of(direction));
        seen.emplace(static_cast<int>(std::floor(azimuth_of(direction))),
                     static_cast<int>(std::floor(elevation_of(direction))));
      }
    }
    if (sweep == 0) seen_in_one = seen.size();
  }
  CHECK(lowest == doctest::Approx(-7.2).epsilon(0.01));
  CHECK(lowest >= -7.2 - 1e-9);
  CHECK(highest == doctest::Approx(52.2).epsilon(0.01));
  CHECK(highest <= 52.2 + 1e-9);
  CHECK(turned / 360.0 == doctest::Approx(10.0 * params.turns));
  const double cells = 360.0 * 59.4;
  CHECK(static_cast<double>(seen_in_one) < 0.7 * cells);
  CHECK(static_cast<double>(seen.size()) > 0.97 * cells);
}

TEST_CASE("no sweep of a MID-360 repeats another") {
  const Lidar lidar(lidar_of(SensorModel::mid360), 1);
  double nearest = 180.0;
  for (std::size_t a = 0; a < 300; ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      const double cosine = lidar.direction(0, 0, a).dot(lidar.direction(0, 0, b));
      nearest = std::min(nearest, std::acos(std::min(1.0, cosine)) / kRadians);
    }
  }
  CHECK(nearest > 0.05);
}

TEST_CASE("the points of every model lie on surfaces, from the pose of their moment") {
  for (const SensorModel model : {SensorModel::vlp16, SensorModel::hdl64, SensorModel::mid360}) {
    for (const bool distorted : {false, true}) {
      for (const double roll : {0.0, 180.0}) {
        CAPTURE(static_cast<int>(model));
        CAPTURE(distorted);
        CAPTURE(roll);
        WorldParams params = without_noise(model);
        params.lidar.motion_distortion = distorted;
        params.lidar.azimuth_step *= 5.0;
        params.lidar.roll = roll;
        params.lidar.pitch = 5.0;
        params.lidar.yaw = 30.0;
        params.drive.speed = 6.0;
        const World world = test::make_world(params);
        const Drive drive = test::make_drive(world, params);
        const std::size_t index = drive.scans() / 8;
        const Sweep sweep = Lidar(params.lidar, 1).sweep(world, drive, index);
        REQUIRE(sweep.points.size() > 500);
        REQUIRE(sweep.seconds.size() == (distorted ? sweep.points.size() : 0));
        double worst = 0.0;
        for (std::size_t i = 0; i < sweep.points.size(); ++i) {
          const double after = distorted ? sweep.seconds[i] : 0.0;
          const Pose pose = drive.pose(drive.stamp(index) + after);
          worst = std::max(worst, test::distance_to_surface(world, pose * sweep.points[i], 1.0));
        }
        CHECK(worst < 1e-3);
      }
    }
  }
}

TEST_CASE("a sensor upside down stands on its head where the body is, and its IMU with it") {
  WorldParams params = test::small_world();
  params.drive.still_start = 1.0;
  const World world = test::make_world(params);
  const Drive body = test::make_drive(world, params);
  params.lidar.roll = 180.0;
  const Drive sensor = test::make_drive(world, params);
  for (double t = 0.0; t < 20.0; t += 0.7) {
    const Pose a = body.pose(t), b = sensor.pose(t);
    CHECK(b.translation == a.translation);
    CHECK((b.rotation * Vector3d::UnitX() - a.rotation * Vector3d::UnitX()).norm() < 1e-9);
    CHECK((b.rotation * Vector3d::UnitZ() + a.rotation * Vector3d::UnitZ()).norm() < 1e-9);
  }
  params.imu.rate = 100.0;
  params.imu.gyro_noise = params.imu.accel_noise = 0.0;
  const ImuSample still = simulate_imu(sensor, params.imu, 1).front();
  CHECK(still.specific_force.norm() == doctest::Approx(9.80665));
  CHECK(still.specific_force.z() < -9.5);
}

TEST_CASE("reference.tum has the poses of the sensor, not of the body") {
  const vantage::test::TemporaryFolder scratch;
  WorldParams params = test::small_world();
  params.map.point_spacing = 1.0;
  params.lidar.azimuth_step = 5.0;
  params.lidar.roll = 180.0;
  params.drive.length = 3.0;
  REQUIRE(simulate(params, scratch.path() / "a"));
  const auto reference = io::read_trajectory(scratch.path() / "a/reference.tum");
  REQUIRE(reference);
  for (const auto& [stamp, pose] : *reference)
    CHECK((pose.rotation * Vector3d::UnitZ()).z() < -0.9);
}

TEST_CASE("far surfaces return less and less often beyond the sure range") {
  WorldParams params = without_noise(SensorModel::vlp16);
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  const PointCloud all = Lidar(params.lidar, 1).scan(world, drive, 0);
  params.lidar.sure_range = 10.0;
  params.lidar.max_range = 30.0;
  double expected = 0.0, near_before = 0.0, near = 0.0, far = 0.0;
  for (const Point& p : all) {
    if (p.norm() <= 10.0) ++near_before;
    if (p.norm() > 10.0 && p.norm() < 30.0) expected += (30.0 - p.norm()) / 20.0;
  }
  for (const Point& p : Lidar(params.lidar, 1).scan(world, drive, 0)) {
    ++(p.norm() <= 10.0 ? near : far);
  }
  CHECK(near == near_before);
  REQUIRE(expected > 1000.0);
  CHECK(far == doctest::Approx(expected).epsilon(0.05));
}

TEST_CASE("directions are reported with their noise") {
  WorldParams params = without_noise(SensorModel::vlp16);
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  const PointCloud exact = Lidar(params.lidar, 1).scan(world, drive, 0);
  params.lidar.angle_noise = 0.15;
  const PointCloud noisy = Lidar(params.lidar, 1).scan(world, drive, 0);
  REQUIRE(noisy.size() == exact.size());
  double azimuths = 0.0, elevations = 0.0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    CHECK(noisy[i].norm() == doctest::Approx(exact[i].norm()).epsilon(1e-9));
    azimuths += std::pow(std::remainder(azimuth_of(noisy[i]) - azimuth_of(exact[i]), 360.0), 2);
    elevations += std::pow(elevation_of(noisy[i]) - elevation_of(exact[i]), 2);
  }
  const auto n = static_cast<double>(exact.size());
  CHECK(std::sqrt(azimuths / n) == doctest::Approx(0.15).epsilon(0.03));
  CHECK(std::sqrt(elevations / n) == doctest::Approx(0.15).epsilon(0.03));
}

TEST_CASE("a model gives the values that a world file leaves out, and no others") {
  const WorldParams plain = parsed("schema = 1\n"), vlp = parsed("schema = 1\n[lidar]\n");
  CHECK(to_world_file(plain) == to_world_file(vlp));
  CHECK(plain.lidar.rings == 16);
  const WorldParams mid =
      parsed("schema = 1\n[lidar]\nmax_range = 50\nmodel = \"mid360\"\nroll = 180\n");
  CHECK(mid.lidar.model == SensorModel::mid360);
  CHECK(mid.lidar.max_range == 50.0);
  CHECK(mid.lidar.roll == 180.0);
  CHECK(mid.lidar.rings == 4);
  CHECK(mid.lidar.min_range == 0.1);
  CHECK(mid.lidar.firings() == 5000);
  for (const char* model : {"vlp16", "hdl64", "mid360"}) {
    const WorldParams once =
        parsed("schema = 1\n[lidar]\nmodel = \"" + std::string(model) + "\"\n");
    const WorldParams again = parsed(to_world_file(once));
    CHECK(to_world_file(again) == to_world_file(once));
    CHECK(again.lidar.turns == once.lidar.turns);
    CHECK(again.lidar.rings == once.lidar.rings);
  }
}

TEST_CASE("wrong sensors are refused with the place of the error") {
  test::check_refused("schema = 1\n[lidar]\nmodel = \"os1\"\n", "w.toml:3:9: error: ");
  test::check_refused("schema = 1\n[lidar]\nupper_rings = 16\n",
                      "w.toml:3:15: error: upper_rings must be below rings");
  test::check_refused("schema = 1\n[lidar]\nupper_rings = 8\n", "upper_spacing must be above 0");
  test::check_refused("schema = 1\n[lidar]\nsweeps = 1\nring_spacing = 2.0\n",
                      "w.toml:4:16: error: rings that go up and down need more room");
  test::check_refused("schema = 1\n[lidar]\nroll = 200\n", "w.toml:3:8: error: ");
}

}  // namespace
}  // namespace vantage::simulation
