#include "simulate/imu.hpp"

#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "simulate/simulation.hpp"
#include "small_world.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"

namespace vantage::simulation {
namespace {

using Eigen::Vector3d;
using vantage::test::read_text;

using test::kRadians;

ImuParams exact_imu(double rate = 200.0) {
  ImuParams params;
  params.rate = rate;
  params.gyro_noise = params.accel_noise = 0.0;
  return params;
}

Pose mount_of(const ImuParams& params) {
  return pose_from_xyz_rpy(params.position,
                           kRadians * Vector3d(params.roll, params.pitch, params.yaw));
}

/// Integrates samples from the pose and velocity at one of them; returns T_campus_imu at another.
Pose integrated(std::span<const ImuSample> samples, double interval, Pose pose,
                Vector3d velocity_before, std::size_t from, std::size_t to) {
  Vector3d velocity = velocity_before;  // in the middle between two samples
  const auto turn = [&](const ImuSample& sample) {
    pose.rotation =
        (pose.rotation * rotation_from_vector(sample.angular_velocity * (interval / 2.0)))
            .normalized();
  };
  for (std::size_t k = from; k < to; ++k) {
    velocity +=
        interval * (pose.rotation * samples[k].specific_force - Vector3d(0.0, 0.0, 9.80665));
    turn(samples[k]);
    pose.translation += interval * velocity;
    turn(samples[k + 1]);
  }
  return pose;
}

TEST_CASE("integrating the samples without noise gives the poses again, to a millimetre in 10 s") {
  for (const double speed : {1.5, 4.0}) {
    for (const double rate : {100.0, 200.0, 400.0}) {
      CAPTURE(speed);
      CAPTURE(rate);
      WorldParams params = test::small_world();
      params.drive.speed = speed;
      params.drive.length = 1.5 * 64.0;
      const World world = test::make_world(params);
      const Drive drive = test::make_drive(world, params);
      params.imu = exact_imu(rate);
      params.imu.position = {0.3, -0.2, -0.4};
      params.imu.roll = 180.0, params.imu.pitch = 10.0, params.imu.yaw = -70.0;
      const auto samples = simulate_imu(drive, params.imu, 1);
      const Pose T_sensor_imu = mount_of(params.imu);
      const double interval = 1.0 / rate;
      const auto at = [&](std::size_t k, double after = 0.0) {
        return drive.pose(static_cast<double>(k) * interval + after) * T_sensor_imu;
      };
      const auto ten_seconds = static_cast<std::size_t>(10.0 * rate);
      double turned = 0.0;
      int starts = 0;
      for (std::size_t from = ten_seconds / 10; from + ten_seconds < samples.size();
           from += ten_seconds / 5) {
        // The mean velocity around the start, of displacements over 20 ms.
        const std::size_t start = from;
        const double steps = std::round(0.02 * rate);
        Vector3d velocity = Vector3d::Zero();
        for (double i = 0.0; i < steps; ++i) {
          velocity += (at(start, i * interval).translation -
                       at(start, (i - steps) * interval).translation) /
                      (0.02 * steps);
        }
        ++starts;
        const Pose reached =
            integrated(samples, interval, at(start), velocity, start, start + ten_seconds);
        const Pose truth = at(start + ten_seconds);
        CHECK((reached.translation - truth.translation).norm() < 1e-3);
        CHECK(rotation_between(reached, truth) < 1e-4);
        turned = std::max(turned, rotation_between(at(start), truth));
      }
      CHECK(starts > 5);
      if (speed > 2.0) CHECK(turned > 80.0 * kRadians);  // through a corner
    }
  }
}

TEST_CASE("on a level straight, an IMU measures gravity along the axis that points up") {
  const WorldParams params = test::bare_world();
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  struct Case {
    double roll, pitch, yaw;
    Vector3d up;
  };
  const Case cases[] = {{0.0, 0.0, 0.0, {0, 0, 1}},
                        {180.0, 0.0, 0.0, {0, 0, -1}},
                        {90.0, 0.0, 0.0, {0, 1, 0}},
                        {0.0, 90.0, 0.0, {-1, 0, 0}},
                        {180.0, 0.0, 123.0, {0, 0, -1}}};
  for (const Case& c : cases) {
    ImuParams imu = exact_imu();
    imu.roll = c.roll, imu.pitch = c.pitch, imu.yaw = c.yaw;
    imu.position.x() = 0.5;
    for (const ImuSample& sample : simulate_imu(drive, imu, 1)) {
      if (sample.stamp > 3.0) break;
      CHECK(sample.angular_velocity.norm() < 1e-6);
      CHECK((sample.specific_force - 9.80665 * c.up).norm() < 1e-4);
    }
  }
}

TEST_CASE("around a level loop, rates add up to a turn and accelerations point to its middle") {
  WorldParams params = test::bare_world();
  params.drive.speed = 3.0;
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  const auto middle = simulate_imu(drive, exact_imu(), 1);
  ImuParams ahead_of_it = exact_imu();
  ahead_of_it.position.x() = 0.8;
  const auto ahead = simulate_imu(drive, ahead_of_it, 1);
  double turned = 0.0, to_the_left = 0.0, centripetal = 0.0, expected = 0.0;
  const auto lap =
      static_cast<std::size_t>(std::lround(200.0 * drive.route().length() / params.drive.speed));
  REQUIRE(lap < middle.size() + 20);
  for (std::size_t k = 0; k < std::min(lap, middle.size()); ++k) {
    const double rate = middle[k].angular_velocity.z();
    CHECK(middle[k].angular_velocity.head<2>().norm() < 1e-9);
    CHECK((ahead[k].angular_velocity - middle[k].angular_velocity).norm() < 1e-9);
    turned += rate / 200.0;
    to_the_left += middle[k].specific_force.y() / 200.0;
    centripetal += (ahead[k].specific_force.x() - middle[k].specific_force.x()) / 200.0;
    expected -= rate * rate * 0.8 / 200.0;
  }
  CHECK(std::abs(turned) == doctest::Approx(2.0 * std::numbers::pi).epsilon(0.001));
  CHECK(to_the_left == doctest::Approx(params.drive.speed * turned).epsilon(0.001));
  CHECK(expected < -1.0);
  CHECK(centripetal == doctest::Approx(expected).epsilon(0.01));
}

struct Statistics {
  Vector3d mean, deviation;
};

template <class Get>
Statistics statistics_of(const std::vector<ImuSample>& noisy, const std::vector<ImuSample>& exact,
                         Get get) {
  Vector3d sum = Vector3d::Zero(), squares = Vector3d::Zero();
  for (std::size_t k = 0; k < exact.size(); ++k) {
    const Vector3d error = get(noisy[k]) - get(exact[k]);
    sum += error;
    squares += error.cwiseProduct(error);
  }
  const auto n = static_cast<double>(exact.size());
  const Vector3d mean = sum / n;
  return {mean, (squares / n - mean.cwiseProduct(mean)).cwiseMax(0.0).cwiseSqrt()};
}

TEST_CASE("noise has its density, and biases are constant") {
  const WorldParams params = test::bare_world();
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  const auto rates = [](const ImuSample& s) { return s.angular_velocity; };
  const auto forces = [](const ImuSample& s) { return s.specific_force; };
  for (const double rate : {50.0, 400.0}) {
    CAPTURE(rate);
    const auto exact = simulate_imu(drive, exact_imu(rate), 9);
    REQUIRE(exact.size() > 2000);
    ImuParams noisy = exact_imu(rate);
    noisy.gyro_noise = 1e-3;
    noisy.accel_noise = 2e-2;
    noisy.gyro_bias = {1.0, -2.0, 3.0};
    noisy.accel_bias = {0.1, 0.2, -0.3};
    const auto samples = simulate_imu(drive, noisy, 9);
    const auto gyro = statistics_of(samples, exact, rates);
    const auto accel = statistics_of(samples, exact, forces);
    for (int axis = 0; axis < 3; ++axis) {
      CHECK(gyro.deviation[axis] == doctest::Approx(1e-3 * std::sqrt(rate)).epsilon(0.05));
      CHECK(accel.deviation[axis] == doctest::Approx(2e-2 * std::sqrt(rate)).epsilon(0.05));
    }
    CHECK((gyro.mean - kRadians * Vector3d(1.0, -2.0, 3.0)).norm() < 2e-3);
    CHECK((accel.mean - Vector3d(0.1, 0.2, -0.3)).norm() < 4e-2);
  }
  SUBCASE("a norm has a direction of the seed") {
    ImuParams biased = exact_imu(50.0);
    biased.gyro_bias = {3.0};
    biased.accel_bias = {0.2};
    const auto bias = [&](std::uint64_t seed) {
      return statistics_of(simulate_imu(drive, biased, seed),
                           simulate_imu(drive, exact_imu(50.0), seed), rates)
          .mean;
    };
    CHECK(bias(1).norm() == doctest::Approx(3.0 * kRadians));
    CHECK(bias(1) == bias(1));
    CHECK((bias(1) - bias(2)).norm() > 0.1 * kRadians);
    const auto accel = statistics_of(simulate_imu(drive, biased, 1),
                                     simulate_imu(drive, exact_imu(50.0), 1), forces);
    CHECK(accel.mean.norm() == doctest::Approx(0.2));
    CHECK(accel.deviation.norm() < 1e-6);
    CHECK(bias(1).normalized().dot(accel.mean.normalized()) < 0.999);
  }
}

TEST_CASE("samples begin with the first scan and end after the last sweep, on their own clock") {
  WorldParams params = test::small_world();
  params.drive.length = 10.0;
  params.drive.start_time = 1'700'000'000.0;
  params.imu = exact_imu(100.0);
  params.imu.clock_offset = -0.25;
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  const auto samples = simulate_imu(drive, params.imu, 1);
  CHECK(samples.front().stamp == doctest::Approx(drive.stamp(0) - 0.25).epsilon(1e-15));
  CHECK(samples.back().stamp + 0.25 >= drive.end());
  CHECK(samples.back().stamp + 0.25 < drive.end() + 0.02);
  params.drive.start_time = 0.0;
  const auto early = simulate_imu(test::make_drive(world, params), params.imu, 1);
  REQUIRE(early.size() == samples.size());
  for (std::size_t k = 0; k < samples.size(); ++k) {
    CHECK(samples[k].angular_velocity == early[k].angular_velocity);
    CHECK(samples[k].specific_force == early[k].specific_force);
  }
}

TEST_CASE("an IMU feels no kidnap") {
  WorldParams params = test::small_world();
  params.campus.size_x = params.campus.size_y = 120.0;
  params.drive.route = 1;
  params.drive.length = 150.0;
  params.drive.kidnaps = 3;
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  REQUIRE(drive.kidnaps().size() == 3);
  for (const ImuSample& sample : simulate_imu(drive, exact_imu(), 1)) {
    CHECK(sample.angular_velocity.norm() < 2.0);
    CHECK((sample.specific_force - Vector3d(0.0, 0.0, kGravity)).norm() < 8.0);
  }
}

TEST_CASE("imu.csv") {
  const vantage::test::TemporaryFolder scratch;
  WorldParams params = test::bare_world();
  params.map.point_spacing = 1.0;
  params.lidar.azimuth_step = 5.0;
  params.drive.length = 3.0;
  SUBCASE("is not written without a rate") {
    const auto summary = simulate(params, scratch.path() / "a");
    REQUIRE(summary);
    CHECK(summary->imu_samples == 0);
    CHECK_FALSE(std::filesystem::exists(scratch.path() / "a/imu.csv"));
  }
  SUBCASE("has a header, and the unit that was asked for") {
    params.imu = exact_imu(100.0);
    const auto summary = simulate(params, scratch.path() / "a");
    REQUIRE_MESSAGE(summary, to_string(summary.error()));
    params.imu.unit = AccelerationUnit::g;
    REQUIRE(simulate(params, scratch.path() / "b"));
    for (const auto& [name, gravity] : {std::pair{"a", 9.80665}, std::pair{"b", 1.0}}) {
      std::istringstream file(read_text(scratch.path() / name / "imu.csv"));
      std::string line;
      std::getline(file, line);
      CHECK(line == "t,wx,wy,wz,ax,ay,az");
      std::uint64_t samples = 0;
      while (std::getline(file, line)) {
        std::replace(line.begin(), line.end(), ',', ' ');
        std::istringstream numbers(line);
        std::vector<double> row;
        for (double x = 0.0; numbers >> x;) row.push_back(x);
        REQUIRE(row.size() == 7);
        CHECK(row[0] == doctest::Approx(0.01 * static_cast<double>(samples)));
        CHECK(row[6] == doctest::Approx(gravity).epsilon(1e-5));
        ++samples;
      }
      CHECK(samples == summary->imu_samples);
      CHECK(samples == 202);  // 2 s and one after the end
    }
  }
  SUBCASE("is the same from its own world.toml") {
    params.imu.rate = 100.0;
    params.imu.gyro_bias = {3.0};
    REQUIRE(simulate(params, scratch.path() / "a"));
    const auto reread = load_world(scratch.path() / "a/world.toml");
    REQUIRE_MESSAGE(reread, to_string(reread.error()));
    REQUIRE(simulate(*reread, scratch.path() / "b"));
    CHECK(read_text(scratch.path() / "a/imu.csv") == read_text(scratch.path() / "b/imu.csv"));
  }
}

TEST_CASE("a drive with everything is the same with one thread, from its own world.toml") {
  const vantage::test::TemporaryFolder scratch;
  WorldParams params = test::small_world();
  params.map.point_spacing = 1.0;
  params.lidar = lidar_of(SensorModel::mid360);
  params.lidar.motion_distortion = true;
  params.lidar.azimuth_step *= 5.0;
  params.lidar.roll = 180.0;
  params.drive.length = 10.0;
  params.drive.still_start = 0.5;
  params.drive.stops = 1;
  params.drive.turns_in_place = 1;
  params.drive.roughness = 0.01;
  params.odometry.rate = 50.0;
  params.odometry.slip = 0.2;
  params.imu.rate = 200.0;
  params.imu.gyro_bias = {3.0};
  REQUIRE(simulate(params, scratch.path() / "a"));
  const auto reread = load_world(scratch.path() / "a/world.toml");
  REQUIRE_MESSAGE(reread, to_string(reread.error()));
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  REQUIRE(simulate(*reread, scratch.path() / "b"));
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(scratch.path() / "a")) {
    if (!entry.is_regular_file()) continue;
    ++files;
    const auto name = std::filesystem::relative(entry.path(), scratch.path() / "a");
    CHECK_MESSAGE((read_text(entry.path()) == read_text(scratch.path() / "b" / name)),
                  name.string());
  }
  CHECK(files > 100);
}

TEST_CASE("a wrong IMU is refused with the place of the error") {
  test::check_refused("schema = 1\n[imu]\ngyro_bias = [1.0, 2.0]\n",
                      "w.toml:3:13: error: gyro_bias must have three numbers");
  test::check_refused("schema = 1\n[imu]\naccel_bias = []\n",
                      "w.toml:3:14: error: accel_bias must have three numbers");
  test::check_refused("schema = 1\n[imu]\nposition = [0.1, 0.2]\n", "w.toml:3:12: error: ");
  test::check_refused("schema = 1\n[imu]\nunit = \"mg\"\n", "w.toml:3:8: error: ");
  test::check_refused("schema = 1\n[imu]\nrate = 0\n", "w.toml:3:8: error: ");
  test::check_refused("schema = 1\n[imu]\nrate = 2000\n[drive]\nlength = 5e4\n",
                      "w.toml:3:8: error: imu.rate would make more than");
}

}  // namespace
}  // namespace vantage::simulation
