#include "simulate/pace.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "simulate/drive.hpp"
#include "simulate/imu.hpp"
#include "simulate/lidar.hpp"
#include "simulate/roughness.hpp"
#include "small_world.hpp"

namespace vantage::simulation {
namespace {

using Eigen::Vector3d;

using test::kRadians;
constexpr double kStep = 1e-3;  // [s]

TEST_CASE("without halts, the speed is constant") {
  DriveParams params;
  params.speed = 1.7;
  const Pace pace(params, 51.0);
  CHECK(pace.seconds() == doctest::Approx(30.0));
  CHECK_FALSE(pace.starts_still());
  for (const double t : {-1.0, 0.0, 0.1, 12.3, 30.0, 99.0}) {
    CHECK(pace.distance(t) == 1.7 * t);
    CHECK(pace.turned(t) == 0.0);
  }
}

TEST_CASE("stops cost what their ramps and their rest take, and no speed jumps") {
  DriveParams params;
  params.speed = 2.0;
  params.acceleration = 0.8;
  params.stops = 4;
  params.stop_time = 2.5;
  for (const double still_start : {0.0, 6.0}) {
    CAPTURE(still_start);
    params.still_start = still_start;
    const Pace pace(params, 200.0);
    const double expected = 200.0 / 2.0 + 4 * (2.5 + 2.0 / 0.8) +
                            (still_start > 0.0 ? still_start + 2.0 / 0.8 / 2.0 : 0.0);
    CHECK(pace.seconds() == doctest::Approx(expected));
    CHECK(pace.starts_still() == (still_start > 0.0));
    CHECK(pace.distance(pace.seconds()) == doctest::Approx(200.0));
    CHECK(pace.distance(pace.seconds() + 1.0) == doctest::Approx(202.0));
    double still = 0.0;
    std::vector<double> halts;
    for (double t = 0.0; t < pace.seconds(); t += kStep) {
      const double before = pace.distance(t) - pace.distance(t - kStep);
      const double after = pace.distance(t + kStep) - pace.distance(t);
      CHECK(after >= -1e-9);
      CHECK(after <= 2.0 * kStep + 1e-9);
      CHECK(std::abs(after - before) <= 0.8 * kStep * kStep + 1e-9);
      if (after > 1e-12) continue;
      still += kStep;
      if (halts.empty() || pace.distance(t) > halts.back() + 1.0) halts.push_back(pace.distance(t));
    }
    CHECK(still == doctest::Approx(4 * 2.5 + still_start).epsilon(0.01));
    if (still_start > 0.0) halts.erase(halts.begin());
    REQUIRE(halts.size() == 4);
    for (int i = 0; i < 4; ++i) {
      CHECK(halts[static_cast<std::size_t>(i)] == doctest::Approx(40.0 * (i + 1)).epsilon(1e-4));
    }
  }
}

TEST_CASE("between halts that are near, a drive does not reach its full speed") {
  DriveParams params;
  params.speed = 10.0;
  params.acceleration = 1.0;
  params.still_start = 1.0;
  params.stops = 9;
  params.stop_time = 1.0;
  const Pace pace(params, 40.0);  // halts 4 m apart: up to sqrt(a s) = 2 m/s and down again, 4 s
  double fastest = 0.0;
  for (double t = 0.0; t < 46.0; t += kStep) {
    fastest = std::max(fastest, (pace.distance(t + kStep) - pace.distance(t)) / kStep);
  }
  CHECK(fastest == doctest::Approx(2.0).epsilon(0.001));
  CHECK(pace.distance(1.0 + 4.0 + 0.5) == doctest::Approx(4.0));
  CHECK(pace.distance(1.0 + 9 * 5.0) == doctest::Approx(36.0));
  CHECK(pace.seconds() == doctest::Approx(1.0 + 9 * 5.0 + std::sqrt(2.0 * 4.0)));
}

TEST_CASE("turns on the spot go there and back, to both sides, at their rate") {
  DriveParams params;
  params.turns_in_place = 2;
  params.turn_rate = 60.0;
  const Pace pace(params, 60.0);
  // Each way takes 90 / 60 s and one ramp of 0.25 s; each halt costs the ramps of speed.
  CHECK(pace.seconds() == doctest::Approx(60.0 / 1.5 + 2 * (2 * (1.5 + 0.25) + 1.5 / 1.0)));
  double left = 0.0, right = 0.0, fastest = 0.0, growth = 0.0;
  for (double t = 0.0; t < pace.seconds(); t += kStep) {
    const double now = pace.turned(t);
    left = std::max(left, now);
    right = std::min(right, now);
    const double rate = (pace.turned(t + kStep) - now) / kStep;
    fastest = std::max(fastest, std::abs(rate));
    growth = std::max(growth, std::abs(rate - (now - pace.turned(t - kStep)) / kStep) / kStep);
    if (now == 0.0) continue;
    const double place = pace.distance(t);
    CHECK(std::min(std::abs(place - 15.0), std::abs(place - 45.0)) < 1e-9);
  }
  CHECK(left == doctest::Approx(90.0 * kRadians));
  CHECK(right == doctest::Approx(-90.0 * kRadians));
  CHECK(fastest == doctest::Approx(60.0 * kRadians));
  CHECK(growth < 1.01 * 60.0 * kRadians / 0.25);
  CHECK(pace.turned(pace.seconds()) == 0.0);
}

TEST_CASE("the default drive has exactly the poses of a constant speed on the route") {
  const WorldParams params = test::small_world();
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  for (std::size_t k = 0; k < drive.scans(); k += 7) {
    const double distance = 1.5 * drive.stamp(k);
    const Pose pose = drive.pose(drive.stamp(k));
    CHECK(pose.translation.head<2>() == drive.route().position(distance));
    CHECK(pose.translation.z() ==
          world.terrain().height(drive.route().position(distance)) + params.lidar.height);
    const Vector3d up = pose.rotation * Vector3d::UnitZ();
    CHECK((up - world.terrain().normal(drive.route().position(distance))).norm() < 1e-12);
  }
}

TEST_CASE("a drive stands still at its start, and turns on the spot") {
  WorldParams params = test::small_world();
  params.drive.length = 20.0;
  params.drive.still_start = 2.0;
  params.drive.turns_in_place = 1;
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  const Pose start = drive.pose(0.0);
  CHECK(drive.pose(-0.5).translation == start.translation);
  CHECK(drive.pose(2.0).translation == start.translation);
  CHECK((drive.pose(3.0).translation - start.translation).norm() ==
        doctest::Approx(0.5).epsilon(0.01));
  CHECK(drive.scans() == static_cast<std::size_t>(std::ceil(drive.pace().seconds() / 0.1 - 1e-9)));
  double most = 0.0;
  for (std::size_t k = 0; k < drive.scans(); ++k) {
    const double turned = drive.pace().turned(drive.stamp(k));
    if (turned == 0.0) continue;
    const Eigen::Vector2d forward = drive.route().direction(drive.distance(drive.stamp(k)));
    const Vector3d ahead = drive.pose(drive.stamp(k)).rotation * Vector3d::UnitX();
    const double angle =
        std::atan2(forward.x() * ahead.y() - forward.y() * ahead.x(), forward.dot(ahead.head<2>()));
    CHECK(angle == doctest::Approx(turned).epsilon(0.01));
    most = std::max(most, angle);
  }
  CHECK(most > 80.0 * kRadians);
}

TEST_CASE("rough ground moves the wheels by its amplitude, and the vehicle stands on them") {
  DriveParams params;
  params.roughness = 0.03;
  params.roughness_length = 1.5;
  const Roughness roughness(params, 4);
  double highest = 0.0, steepest = 0.0;
  for (double s = 0.0; s < 200.0; s += 0.05) {
    for (const std::size_t track : {std::size_t{0}, std::size_t{1}}) {
      highest = std::max(highest, std::abs(roughness.height(track, s)));
      steepest =
          std::max(steepest,
                   std::abs(roughness.height(track, s + 0.01) - roughness.height(track, s)) / 0.01);
    }
    // The plane of the vehicle passes the wheels as a plane can: the mean of opposite errors is 0.
    const Pose stand = roughness.stand(s);
    double sum = 0.0, front = 0.0, left = 0.0;
    for (const double x : {-0.6, 0.6}) {
      for (const double y : {-0.5, 0.5}) {
        const Vector3d up = stand.rotation * Vector3d::UnitZ();
        const double plane = stand.translation.z() - (up.x() * x + up.y() * y) / up.z();
        const double error = plane - roughness.height(y > 0.0 ? 0 : 1, s + x);
        sum += error;
        front += x > 0.0 ? error : -error;
        left += y > 0.0 ? error : -error;
      }
    }
    CHECK(std::abs(sum) < 1e-6);
    CHECK(std::abs(front) < 1e-3);
    CHECK(std::abs(left) < 1e-3);
  }
  CHECK(highest > 0.8 * 0.03);
  CHECK(highest <= 0.03);
  CHECK(steepest < 0.03 * 2.0 * std::numbers::pi / 1.5 * (1.0 + 1.0 / std::numbers::phi) / 2.0);
  CHECK(roughness.height(0, 3.0) != roughness.height(1, 3.0));
  CHECK(roughness.height(0, 3.0) != Roughness(params, 5).height(0, 3.0));
}

TEST_CASE("scans are taken from the pose that rough ground gives the sensor") {
  WorldParams params = test::small_world();
  params.campus.leaf_area_density = 0.0;
  params.lidar.range_noise = params.lidar.dropout = params.lidar.grazing_angle = 0.0;
  params.drive.roughness = 0.05;
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  params.drive.roughness = 0.0;
  const Drive smooth = test::make_drive(world, params);
  const double stamp = drive.stamp(30);
  const Pose pose = drive.pose(stamp);
  CHECK(rotation_between(pose, smooth.pose(stamp)) > 0.1 * kRadians);
  CHECK((pose.translation - smooth.pose(stamp).translation).norm() < 0.1);
  double worst = 0.0, worst_smooth = 0.0;
  for (const Point& p : Lidar(params.lidar, 1).scan(world, drive, 30)) {
    worst = std::max(worst, test::distance_to_surface(world, pose * p, 1.0));
    worst_smooth =
        std::max(worst_smooth, test::distance_to_surface(world, smooth.pose(stamp) * p, 1.0));
  }
  CHECK(worst < 1e-3);
  CHECK(worst_smooth > 0.01);
}

ImuParams exact_imu_at(double rate, double x) {
  ImuParams params;
  params.rate = rate;
  params.gyro_noise = params.accel_noise = 0.0;
  params.position.x() = x;
  return params;
}

TEST_CASE("an IMU of a drive that starts still measures a second of rest before the first scan") {
  WorldParams params = test::small_world();
  params.drive.length = 10.0;
  params.drive.still_start = 3.0;
  params.drive.start_time = 50.0;
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  const auto samples = simulate_imu(drive, exact_imu_at(200.0, 0.2), 1);
  CHECK(samples.front().stamp == doctest::Approx(49.0));
  CHECK(samples[200].stamp == 50.0);
  const Vector3d up = drive.pose(50.0).rotation.conjugate() * Vector3d::UnitZ();
  for (const ImuSample& sample : samples) {
    if (sample.stamp > 52.9) break;
    CHECK(sample.angular_velocity.norm() < 1e-12);
    CHECK((sample.specific_force - 9.80665 * up).norm() < 1e-9);
  }
}

TEST_CASE("while turning on the spot, an IMU measures the rate and the pull of its lever arm") {
  WorldParams params = test::bare_world();
  params.drive.length = 20.0;
  params.drive.turns_in_place = 1;
  params.drive.turn_rate = 90.0;
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  const double rate = 90.0 * kRadians;
  int turning = 0;
  for (const ImuSample& sample : simulate_imu(drive, exact_imu_at(200.0, 0.5), 1)) {
    // In the middle of a turn that is as fast as it gets.
    const double before = drive.pace().turned(sample.stamp - 0.05);
    const double after = drive.pace().turned(sample.stamp + 0.05);
    if (std::abs(after - before) < rate * 0.1 - 1e-9) continue;
    ++turning;
    const double side = after > before ? 1.0 : -1.0;
    CHECK((sample.angular_velocity - Vector3d(0.0, 0.0, side * rate)).norm() < 1e-9);
    CHECK(sample.specific_force.x() == doctest::Approx(-rate * rate * 0.5).epsilon(1e-3));
    CHECK(std::abs(sample.specific_force.y()) < 1e-6);
    CHECK(sample.specific_force.z() == doctest::Approx(9.80665));
  }
  CHECK(turning > 2 * 0.5 * 200.0);
}

TEST_CASE(
    "from rest, samples integrate to the poses of stops, turns on the spot and rough ground") {
  WorldParams params = test::small_world();
  params.drive.length = 9.0;
  params.drive.still_start = 1.0;
  params.drive.stops = 1;
  params.drive.stop_time = 0.5;
  params.drive.turns_in_place = 2;
  params.drive.roughness = 0.02;
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  const ImuParams imu = exact_imu_at(200.0, 0.3);
  const Pose T_sensor_imu = pose_from_xyz_rpy({0.3, 0.0, 0.0}, {0.0, 0.0, 0.0});
  const auto samples = simulate_imu(drive, imu, 1);
  constexpr double kInterval = 1.0 / 200.0;
  Pose pose = drive.pose(0.0) * T_sensor_imu;
  Vector3d velocity = Vector3d::Zero();
  double most = 0.0;
  for (std::size_t k = 200; k <= 200 + 10 * 200; ++k) {  // 10 s from the first scan on
    const Pose truth = drive.pose(samples[k].stamp) * T_sensor_imu;
    most = std::max(most, (pose.translation - truth.translation).norm());
    velocity +=
        kInterval * (pose.rotation * samples[k].specific_force - Vector3d(0.0, 0.0, 9.80665));
    pose.translation += kInterval * velocity;
    const Vector3d turn =
        kInterval / 2.0 * (samples[k].angular_velocity + samples[k + 1].angular_velocity);
    pose.rotation = (pose.rotation * rotation_from_vector(turn)).normalized();
  }
  MESSAGE("10 s from rest: at most " << 1000.0 * most << " mm off");
  CHECK(most < 1e-3);
}

TEST_CASE("a pace that is impossible is refused with the place of the error") {
  test::check_refused(
      "schema = 1\n[drive]\nspeed = 20\nstops = 3\n",
      "w.toml:4:9: error: the drive begins at full speed and needs 200.0 m to stop");
  test::check_refused("schema = 1\n[drive]\nstops = -1\n", "w.toml:3:9: error: ");
  test::check_refused("schema = 1\n[drive]\nturn_rate = 0\n", "w.toml:3:13: error: ");
  test::check_refused("schema = 1\n[drive]\nroughness = 1\n", "w.toml:3:13: error: ");
}

}  // namespace
}  // namespace vantage::simulation
