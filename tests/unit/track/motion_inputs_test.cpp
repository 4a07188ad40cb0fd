#include "vantage/track/motion_inputs.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <numbers>

using namespace vantage;

namespace {

ImuSample imu(double stamp, double rate) {
  return {stamp, Eigen::Vector3d(0, 0, rate), Eigen::Vector3d(0, 0, 9.8)};
}

double seconds_of(const std::vector<MotionInput>& pieces) {
  double sum = 0.0;
  for (const MotionInput& piece : pieces) sum += piece.seconds;
  return sum;
}

/// The turn about z that the gyroscope measured.
double turn_of(const std::vector<MotionInput>& pieces) {
  double sum = 0.0;
  for (const MotionInput& piece : pieces) {
    if (piece.rate) sum += piece.seconds * piece.rate->z();
  }
  return sum;
}

/// Whether odometry measured the motion up to a moment.
bool has_odometry(const MotionInputs& inputs, double stamp) {
  return inputs.between(stamp - 1e-3, stamp, stamp).back().odometry.has_value();
}

}  // namespace

TEST_CASE("pieces fill the time exactly, forwards and backwards, with or without samples") {
  MotionInputs inputs({});
  CHECK(seconds_of(inputs.between(1.0, 1.3, 1.0)) == doctest::Approx(0.3));
  for (int k = 0; k < 40; ++k) REQUIRE(inputs.add(imu(1.0 + 0.0071 * k, 0.1 * k)));
  const auto forwards = inputs.between(1.013, 1.2, 1.0), back = inputs.between(1.2, 1.013, 1.0);
  CHECK(seconds_of(forwards) == doctest::Approx(0.187));
  CHECK(seconds_of(back) == doctest::Approx(-0.187));
  CHECK(turn_of(forwards) == doctest::Approx(-turn_of(back)));
  // The rate grows linearly: by 0.1 in 7.1 ms.
  const auto rate = [](double t) { return (t - 1.0) / 0.0071 * 0.1; };
  CHECK(turn_of(forwards) == doctest::Approx(0.187 * 0.5 * (rate(1.013) + rate(1.2))));
}

TEST_CASE("samples may come late until a scan has used later ones; then they are counted") {
  MotionInputs inputs({});
  for (const double stamp : {0.00, 0.02, 0.01, 0.03}) REQUIRE(inputs.add(imu(stamp, stamp)));
  CHECK(inputs.dropped() == 0);
  CHECK(turn_of(inputs.between(0.0, 0.03, 0.0)) == doctest::Approx(0.5 * 0.03 * 0.03));
  REQUIRE(inputs.add(imu(0.01, 99.0)));  // twice
  CHECK(inputs.dropped() == 1);
  inputs.forget_before(0.02);
  REQUIRE(inputs.add(imu(0.015, 99.0)));
  CHECK(inputs.dropped() == 2);
  REQUIRE(inputs.add(imu(0.025, 0.025)));
  CHECK(inputs.dropped() == 2);
}

TEST_CASE("a gap of a gyroscope is a gap, and its last sample holds for a moment only") {
  MotionInputs inputs({});
  for (int k = 0; k <= 10; ++k) REQUIRE(inputs.add(imu(0.01 * k, 1.0)));
  for (int k = 0; k <= 10; ++k) REQUIRE(inputs.add(imu(1.0 + 0.01 * k, 1.0)));
  double known = 0.0;
  for (const MotionInput& piece : inputs.between(0.0, 1.5, 0.0)) {
    if (piece.rate) known += piece.seconds;
  }
  CHECK(known == doctest::Approx(0.3).epsilon(0.1));  // twice 0.1 s, and 0.1 s after the last
}

TEST_CASE("odometry gives the twist of the IMU, wherever both sit") {
  const Pose T_sensor_imu = pose_from_xyz_rpy({0.1, 0.2, -0.3}, {0.3, -0.2, 1.0});
  const Pose T_sensor_body = pose_from_xyz_rpy({-1.0, 0.0, -1.5}, {0.0, 0.05, 0.0});
  MotionInputs inputs({T_sensor_imu, T_sensor_body});
  const Pose step = pose_from_xyz_rpy({0.5, 0.02, 0.0}, {0.0, 0.01, 0.2});  // of the sensor
  Pose T_odom_sensor = pose_from_xyz_rpy({10, 20, 0}, {0, 0, 2});
  for (int k = 0; k < 3; ++k) {
    REQUIRE(inputs.add(OdometrySample{0.1 * k, T_odom_sensor * T_sensor_body}));
    T_odom_sensor = T_odom_sensor * step;
  }
  Pose T_now_later;
  for (const MotionInput& piece : inputs.between(0.05, 0.15, 0.0)) {
    REQUIRE(piece.odometry);
    T_now_later = T_now_later * exponential({piece.seconds * piece.odometry->linear,
                                             piece.seconds * piece.odometry->angular});
  }
  const Pose of_sensor = T_sensor_imu * T_now_later * T_sensor_imu.inverse();
  CHECK((of_sensor.translation - step.translation).norm() < 1e-9);
  CHECK(rotation_between(of_sensor, step) < 1e-9);
  CHECK(has_odometry(inputs, 0.2));
  CHECK_FALSE(has_odometry(inputs, 5.0));
}

TEST_CASE("between samples of odometry, the twist changes evenly") {
  MotionInputs inputs({});
  for (int k = 0; k <= 10; ++k) {  // accelerates at 2 m/s^2
    const double t = 0.1 * k;
    REQUIRE(inputs.add(OdometrySample{t, pose_from_xyz_rpy({t * t, 0, 0}, {0, 0, 0})}));
  }
  double way = 0.0, time = 0.05;
  for (const MotionInput& piece : inputs.between(0.05, 0.95, 0.0)) {
    REQUIRE(piece.odometry);
    time += piece.seconds;
    way += piece.seconds * piece.odometry->linear.x();
    CHECK(piece.odometry->linear.x() ==
          doctest::Approx(2.0 * (time - 0.5 * piece.seconds)).epsilon(1e-6));
  }
  CHECK(way == doctest::Approx(0.95 * 0.95 - 0.05 * 0.05));
}

TEST_CASE("a gap of odometry is a gap, at any rate; a jump is one, too") {
  const auto known_of = [](double interval, double gap, double jump) {
    MotionInputs inputs({});
    double stamp = 0.0, x = 0.0;
    for (int k = 0; k < 40; ++k) {
      if (k == 20) {
        stamp += gap;
        x += jump;
      }
      REQUIRE(inputs.add(OdometrySample{stamp, pose_from_xyz_rpy({x, 0, 0}, {0, 0, 0})}));
      stamp += interval;
      x += 2.0 * interval;
    }
    CHECK(has_odometry(inputs, stamp - 1.5 * interval));
    CHECK(has_odometry(inputs, 10.3 * interval));
    double known = 0.0;
    for (const MotionInput& piece : inputs.between(0.0, stamp, 0.0)) {
      if (!piece.odometry) continue;
      known += piece.seconds;
      CHECK(piece.odometry->linear.norm() == doctest::Approx(2.0));
      CHECK(piece.odometry_seconds == doctest::Approx(interval));
    }
    CHECK(has_odometry(inputs, 19.5 * interval + gap) == (gap == 0.0 && jump == 0.0));
    return known / interval;
  };
  for (const double interval : {0.005, 0.05, 0.1, 0.5, 1.0}) {
    CAPTURE(interval);
    CHECK(known_of(interval, 0.0, 0.0) == doctest::Approx(39.0).epsilon(0.001));
    CHECK(known_of(interval, 5.0, 0.0) == doctest::Approx(38.0).epsilon(0.001));
    CHECK(known_of(interval, 0.0, 300.0) == doctest::Approx(38.0).epsilon(0.001));
  }
}

TEST_CASE("a burst of odometry does not make its usual interval shorter") {
  const auto drive = [](double stamp) {
    return OdometrySample{stamp, pose_from_xyz_rpy({2.0 * stamp, 0, 0}, {0, 0, 0})};
  };
  for (const int burst : {0, 1, 9}) {  // two messages together, at first or later
    CAPTURE(burst);
    MotionInputs inputs({});
    for (int k = 0; k < 20; ++k) {
      REQUIRE(inputs.add(drive(0.5 * k)));
      if (k == burst) REQUIRE(inputs.add(drive(0.5 * k + 0.001)));
    }
    for (const double stamp : {1.25, 4.75, 9.25}) CHECK(has_odometry(inputs, stamp));
  }
}

TEST_CASE("a sample far ahead of those after it is dropped, and counted") {
  MotionInputs inputs({});
  for (int k = 0; k < 10; ++k) REQUIRE(inputs.add(imu(0.01 * k, 1.0)));
  REQUIRE(inputs.add(imu(1000.0, 1.0)));
  for (int k = 10; k < 100; ++k) REQUIRE(inputs.add(imu(0.01 * k, 1.0)));
  CHECK(inputs.dropped() == 1);
  CHECK(turn_of(inputs.between(0.5, 0.6, 0.5)) == doctest::Approx(0.1));
}

TEST_CASE("a sample far behind drops no others, but a clock that was set back drops all") {
  MotionInputs inputs({});
  for (int k = 0; k < 100; ++k) {
    REQUIRE(inputs.add(imu(1000.0 + 0.01 * k, 1.0)));
    if (k % 40 == 30) REQUIRE(inputs.add(imu(0.0, 5.0)));
    if (k == 70) REQUIRE(inputs.add(imu(0.0, 5.0)));  // the same again: no clock that runs
  }
  CHECK(inputs.dropped() == 3);
  CHECK(turn_of(inputs.between(1000.1, 1000.9, 1000.0)) == doctest::Approx(0.8));
  for (int k = 0; k < 100; ++k) REQUIRE(inputs.add(imu(1.0 + 0.01 * k, 2.0)));
  CHECK(inputs.dropped() == 104);
  CHECK(turn_of(inputs.between(1.1, 1.9, 1.0)) == doctest::Approx(1.6));
}

TEST_CASE("a sample far ahead does not drop those before it") {
  MotionInputs inputs({});
  for (int k = 0; k < 10; ++k) REQUIRE(inputs.add(imu(0.01 * k, 1.0)));
  REQUIRE(inputs.add(imu(1000.0, 1.0)));
  CHECK(turn_of(inputs.between(0.0, 0.09, 0.0)) == doctest::Approx(0.09));
  CHECK(inputs.dropped() == 0);
}

TEST_CASE("samples that are no numbers are errors, and leave nothing behind") {
  MotionInputs inputs({});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(inputs.add(imu(nan, 0.0)).error().code == ErrorCode::invalid_input);
  CHECK(inputs.add(imu(0.0, nan)).error().code == ErrorCode::invalid_input);
  Pose bad;
  bad.rotation.w() = 2.0;
  CHECK(inputs.add(OdometrySample{0.0, bad}).error().code == ErrorCode::invalid_input);
  CHECK_FALSE(inputs.has_imu());
}

TEST_CASE("a rest gives the bias and the way up; a motion gives no rest") {
  const Pose T_sensor_imu = pose_from_xyz_rpy({0, 0, 0}, {std::numbers::pi, 0, 0});
  MotionInputs inputs({.T_sensor_imu = T_sensor_imu});
  for (int k = 0; k <= 200; ++k) {
    REQUIRE(
        inputs.add(ImuSample{0.005 * k, {0.01, 0.0, 0.05 + 0.001 * (k % 3)}, {0.0, 0.0, -9.8}}));
  }
  const auto rest = inputs.rest(1.0);
  REQUIRE(rest);
  CHECK(rest->rate.z() == doctest::Approx(0.051).epsilon(0.01));
  CHECK_FALSE(inputs.rest(0.3));  // too short
  const auto up = inputs.up(1.0);
  REQUIRE(up);
  CHECK((*up - Eigen::Vector3d(0, 0, 1)).norm() < 1e-9);  // the IMU hangs upside down
  for (int k = 1; k <= 100; ++k) REQUIRE(inputs.add(imu(1.0 + 0.005 * k, 1.0)));
  CHECK_FALSE(inputs.rest(1.5));
}

TEST_CASE("memory does not grow, with scans or without") {
  MotionInputs inputs({});
  for (int k = 0; k < 200'000; ++k) REQUIRE(inputs.add(imu(0.005 * k, 0.0)));
  CHECK(inputs.samples() < 20'000);
  inputs.forget_before(1000.0);
  CHECK(inputs.samples() < 500);
}
