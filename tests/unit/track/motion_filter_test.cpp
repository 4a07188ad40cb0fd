#include "vantage/track/motion_filter.hpp"

#include <doctest/doctest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <fstream>
#include <iterator>
#include <numbers>
#include <random>
#include <sstream>
#include <string>
#include <utility>

using namespace vantage;

namespace {

constexpr double kGravity = 9.80665;

MotionState some_state() {
  MotionState state;
  state.T_map_body = pose_from_xyz_rpy({3.0, -2.0, 1.0}, {0.2, -0.1, 1.3});
  state.velocity = {4.0, -0.5, 0.3};
  state.rate_bias = {0.1, -0.2, 0.4};
  state.force_bias = {0.05, -0.1, 0.2};
  return state;
}

/// A piece of time of every kind.
std::vector<MotionInput> inputs_of_every_kind() {
  const Eigen::Vector3d rate(0.5, -0.3, 1.2), force(1.0, -0.5, 9.5);
  return {{.seconds = 0.02},
          {.seconds = -0.015},
          {.seconds = 0.01, .rate = rate},
          {.seconds = 0.01, .rate = rate, .force = force},
          {.seconds = -0.01, .rate = rate, .force = force},
          {.seconds = 0.02, .coasts = true},
          {.seconds = -0.03, .coasts = true}};
}

/// How far a state is from another, in the filter's terms.
MotionVector error_of(const MotionState& state, const MotionState& from) {
  MotionVector error;
  error << difference(state.T_map_body, from.T_map_body), state.velocity - from.velocity,
      state.rate_bias - from.rate_bias, state.force_bias - from.force_bias;
  return error;
}

PoseMatrix sigma(double metres, double radians) {
  PoseVector variance;
  variance << Eigen::Vector3d::Constant(metres * metres),
      Eigen::Vector3d::Constant(radians * radians);
  return variance.asDiagonal();
}

bool is_positive(const MotionMatrix& covariance) {
  return Eigen::SelfAdjointEigenSolver<MotionMatrix>(covariance).eigenvalues().minCoeff() > -1e-9;
}

}  // namespace

TEST_CASE("every Jacobian is the derivative that finite differences give") {
  const MotionState state = some_state();
  for (const MotionInput& input : inputs_of_every_kind()) {
    CAPTURE(input.seconds);
    CAPTURE(input.rate.has_value());
    CAPTURE(input.force.has_value());
    CAPTURE(input.coasts);
    const MotionMatrix F = moved_jacobian(state, input);
    constexpr double kStep = 1e-5;
    for (Eigen::Index k = 0; k < 15; ++k) {
      MotionVector step = MotionVector::Zero();
      step[k] = kStep;
      const MotionVector column =
          error_of(moved(plus(state, step), input), moved(plus(state, -step), input)) /
          (2.0 * kStep);
      CAPTURE(k);
      CHECK((column - F.col(k)).norm() < 2e-6);
    }
  }
}

TEST_CASE("a constant twist drives a circle, forwards and back") {
  MotionState state;
  state.velocity = {2.0, 0.0, 0.0};
  state.rate_bias = {0.0, 0.0, -0.5};  // turns left; radius 4 m
  const MotionState half = moved(state, {.seconds = 2.0 * std::numbers::pi});
  CHECK((half.T_map_body.translation - Eigen::Vector3d(0, 8, 0)).norm() < 1e-9);
  const MotionState back = moved(half, {.seconds = -2.0 * std::numbers::pi});
  CHECK(back.T_map_body.translation.norm() < 1e-9);
  CHECK(rotation_between(back.T_map_body, Pose{}) < 1e-9);
}

TEST_CASE("an accelerometer at rest feels gravity and stays; in free fall it falls") {
  MotionState state;
  state.T_map_body = pose_from_xyz_rpy({0, 0, 0}, {0.4, -0.2, 1.0});
  const Eigen::Vector3d up =
      state.T_map_body.rotation.conjugate().toRotationMatrix() * Eigen::Vector3d(0, 0, kGravity);
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  const MotionState rest = moved(state, {.seconds = 0.5, .rate = zero, .force = up});
  CHECK(rest.T_map_body.translation.norm() < 1e-9);
  const MotionState falling = moved(state, {.seconds = 0.5, .rate = zero, .force = zero});
  CHECK(falling.T_map_body.translation.z() == doctest::Approx(-0.125 * kGravity));
}

TEST_CASE("noise is symmetric, positive, and that of the integrals") {
  for (const MotionInput& input : inputs_of_every_kind()) {
    const MotionMatrix Q = moved_noise(some_state(), input, {});
    CHECK((Q - Q.transpose()).norm() < 1e-12);
    CHECK(is_positive(Q));
  }
  // A second of white acceleration: sigma of the way is q / sqrt(3), in one step or in fifty.
  const MotionNoise noise{.acceleration = 0.6};
  MotionMatrix P = MotionMatrix::Zero();
  for (int k = 0; k < 50; ++k) {
    const MotionMatrix F = moved_jacobian({}, {.seconds = 0.02});
    P = F * P * F.transpose() + moved_noise({}, {.seconds = 0.02}, noise);
  }
  CHECK(std::sqrt(P(0, 0)) == doctest::Approx(0.6 / std::sqrt(3.0)).epsilon(0.001));
  CHECK(std::sqrt(moved_noise({}, {.seconds = 1.0}, noise)(0, 0)) ==
        doctest::Approx(0.6 / std::sqrt(3.0)));
}

TEST_CASE("the noise of a body that coasts is that of its time, in one step or in many") {
  MotionState state;
  state.T_map_body = some_state().T_map_body;
  const auto grown = [&](double seconds, int steps) {
    MotionMatrix P = MotionMatrix::Zero();
    for (int k = 0; k < steps; ++k) {
      const MotionInput input{.seconds = seconds / steps, .coasts = true};
      const MotionMatrix F = moved_jacobian(state, input);
      P = F * P * F.transpose() + moved_noise(state, input, {});
    }
    return P;
  };
  for (const double seconds : {1e-5, 0.02, 1.0, 10.0, 3600.0}) {
    CAPTURE(seconds);
    const MotionMatrix once = grown(seconds, 1), often = grown(seconds, 500);
    // A speed of variance 1 /s at rest: the way is a random walk.
    if (seconds > 100.0) CHECK(once(0, 0) == doctest::Approx(seconds).epsilon(0.01));
    for (Eigen::Index k = 0; k < 3; ++k) CHECK(often(k, k) == doctest::Approx(once(k, k)));
    for (Eigen::Index k = 6; k < 12; ++k) CHECK(often(k, k) == doctest::Approx(once(k, k)));
  }
}

/// Odometry that drives and turns evenly, as exact as it is taken for.
MotionInputs even_odometry(const Twist& twist, double interval, double until) {
  MotionInputs inputs({});
  for (int k = 0; k * interval <= until + 1e-9; ++k) {
    const double t = k * interval;
    const Pose pose = exponential({t * twist.linear, t * twist.angular});
    REQUIRE(inputs.add(OdometrySample{t, pose}));
  }
  return inputs;
}

TEST_CASE("what odometry tells does not depend on the pieces that its time is cut into") {
  const Twist twist{.linear = {8.0, 0.0, 0.0}, .angular = {0.0, 0.0, 0.3}};
  const MotionInputs inputs = even_odometry(twist, 0.1, 1.0);
  const auto after = [&](int pieces) {
    MotionFilter filter(0.0, Pose{}, sigma(0.01, 0.001), inputs);
    for (int k = 1; k <= pieces; ++k) filter.predict(1.0 * k / pieces, inputs, {});
    return filter;
  };
  const MotionFilter whole = after(1);
  CHECK(whole.state().velocity.x() == doctest::Approx(8.0).epsilon(0.002));
  CHECK(-whole.state().rate_bias.z() == doctest::Approx(0.3).epsilon(0.02));
  for (const int pieces : {7, 50, 100}) {
    CAPTURE(pieces);
    const MotionFilter parts = after(pieces);
    CHECK((parts.pose().translation - whole.pose().translation).norm() < 0.02);
    for (const Eigen::Index k : {0, 5, 6, 11}) {
      CAPTURE(k);
      CHECK(std::sqrt(parts.covariance()(k, k)) ==
            doctest::Approx(std::sqrt(whole.covariance()(k, k))).epsilon(0.03));
    }
  }
}

TEST_CASE(
    "odometry only adds to what is known: scans tell a speed better than slow odometry does") {
  const MotionInputs nothing({});
  const Twist fast{.linear = {8.8, 0.0, 0.0}};  // 10 % too far
  for (const double interval : {0.05, 0.5, 1.0}) {
    CAPTURE(interval);
    const MotionInputs inputs = even_odometry(fast, interval, 4.0);
    const auto error_with = [&](const MotionInputs& some) {
      MotionFilter filter(0.0, Pose{}, sigma(0.003, 0.0005), some);
      double worst = 0.0;
      for (int k = 1; k <= 30; ++k) {
        const Pose truth = pose_from_xyz_rpy({0.8 * k, 0, 0}, {0, 0, 0});
        filter.predict(0.1 * k, some, {});
        if (k > 10) worst = std::max(worst, (filter.pose().translation - truth.translation).norm());
        filter.update(truth, sigma(0.003, 0.0005));
      }
      CHECK(is_positive(filter.covariance()));
      return worst;
    };
    CHECK(error_with(nothing) < 0.002);
    CHECK(error_with(inputs) < 0.03);  // 0.08 by odometry alone
  }
}

TEST_CASE(
    "odometry of wheels that slip, lock or begin anew does not count while scans know better") {
  const auto worst_with = [](double factor, double jump, double rate, bool imu) {
    MotionInputs inputs({});
    const auto samples = static_cast<int>(4.0 * rate);
    double x = 0.0;
    for (int k = 0; k <= samples; ++k) {
      const double t = k / rate;
      REQUIRE(inputs.add(OdometrySample{t, pose_from_xyz_rpy({x, 0, 0}, {0, 0, 0})}));
      x += 8.0 / rate * (k >= samples / 2 && k < 3 * samples / 4 ? factor : 1.0);
      if (k == samples / 2) x += jump;
    }
    for (int k = 0; imu && k <= 1600; ++k) {
      REQUIRE(inputs.add(ImuSample{0.0025 * k, {0, 0, 0}, {0, 0, kGravity}}));
    }
    MotionFilter filter(0.0, Pose{}, sigma(0.003, 0.0005), inputs);
    double worst = 0.0, doubted = 0.0;
    for (int k = 1; k <= 39; ++k) {
      const Pose truth = pose_from_xyz_rpy({0.8 * k, 0, 0}, {0, 0, 0});
      filter.predict(0.1 * k, inputs, {});
      doubted += filter.doubted();
      if (k > 10) worst = std::max(worst, (filter.pose().translation - truth.translation).norm());
      filter.update(truth, sigma(0.003, 0.0005));
    }
    CHECK(doubted <= 1.15);
    CHECK(is_positive(filter.covariance()));
    return std::pair(worst, doubted);
  };
  for (const double rate : {10.0, 20.0, 50.0, 200.0}) {
    for (const bool imu : {false, true}) {
      CAPTURE(rate);
      CAPTURE(imu);
      CHECK(worst_with(1.0, 0.0, rate, imu).first < 0.01);
      CHECK(worst_with(1.0, 0.0, rate, imu).second == 0.0);
      for (const double factor : {0.0, 0.5, 1.6, 2.4, 3.0, -1.0}) {
        CAPTURE(factor);
        CHECK(worst_with(factor, 0.0, rate, imu).first < 0.1);  // 0.3 and more if it counted
        CHECK(worst_with(factor, 0.0, rate, imu).second > 0.8);
      }
      for (const double jump : {-2.0, 1.0, 4.0}) {
        CAPTURE(jump);
        CHECK(worst_with(1.0, jump, rate, imu).first < 0.05);
      }
    }
  }
}

TEST_CASE("after a silence, odometry counts at once: nothing was known any more") {
  MotionInputs inputs({});
  for (int k = 0; k <= 20; ++k) {  // it drives on after 12 s
    REQUIRE(
        inputs.add(OdometrySample{14.0 + 0.05 * k, pose_from_xyz_rpy({0.4 * k, 0, 0}, {0, 0, 0})}));
  }
  MotionFilter filter(0.0, Pose{}, sigma(0.003, 0.0005), MotionInputs({}));
  for (int k = 1; k <= 20; ++k) {
    filter.predict(0.1 * k, MotionInputs({}), {});
    filter.update(pose_from_xyz_rpy({0.8 * k, 0, 0}, {0, 0, 0}), sigma(0.003, 0.0005));
  }
  filter.predict(14.4, inputs, {});
  CHECK(filter.doubted() == 0.0);
  CHECK(filter.state().velocity.x() == doctest::Approx(8.0).epsilon(0.05));
}

TEST_CASE("without scans, odometry counts again soon after a doubt") {
  MotionInputs inputs({});
  // It takes 8 m/s for 2 m/s; then no scan says so any more.
  for (int k = 0; k <= 200; ++k) {
    REQUIRE(inputs.add(OdometrySample{0.05 * k, pose_from_xyz_rpy({0.1 * k, 0, 0}, {0, 0, 0})}));
  }
  MotionFilter filter(0.0, Pose{}, sigma(0.003, 0.0005), MotionInputs({}));
  for (int k = 1; k <= 20; ++k) {
    filter.predict(0.1 * k, MotionInputs({}), {});
    filter.update(pose_from_xyz_rpy({0.8 * k, 0, 0}, {0, 0, 0}), sigma(0.003, 0.0005));
  }
  filter.predict(2.2, inputs, {});
  CHECK(filter.doubted() == doctest::Approx(0.2));
  CHECK(filter.state().velocity.x() == doctest::Approx(8.0).epsilon(0.05));
  filter.predict(9.0, inputs, {});
  CHECK(filter.doubted() > 0.2);
  CHECK(filter.doubted() < 3.0);
  CHECK(filter.state().velocity.x() == doctest::Approx(2.0).epsilon(0.1));
}

TEST_CASE("at the start, odometry counts at any speed: none is known") {
  for (const double speed : {0.0, 8.0, 40.0, 80.0}) {
    CAPTURE(speed);
    const MotionInputs inputs = even_odometry({.linear = {speed, 0.0, 0.0}}, 0.05, 0.3);
    MotionFilter filter(0.0, Pose{}, sigma(0.01, 0.001), inputs);
    filter.predict(0.2, inputs, {});
    CHECK(filter.doubted() == 0.0);
    CHECK(filter.state().velocity.x() == doctest::Approx(speed).epsilon(0.05));
  }
}

TEST_CASE("odometry at once tells the speed of a sensor of which nothing is known") {
  const Twist twist{.linear = {8.0, 0.0, 0.0}, .angular = {0.0, 0.0, 0.3}};
  const MotionInputs inputs = even_odometry(twist, 0.05, 0.2);
  MotionFilter filter(0.0, Pose{}, sigma(0.01, 0.001), inputs);
  filter.predict(0.1, inputs, {});
  CHECK(filter.state().velocity.x() == doctest::Approx(8.0).epsilon(0.02));
  CHECK((filter.pose().translation -
         exponential({0.1 * twist.linear, 0.1 * twist.angular}).translation)
            .norm() < 0.05);
}

TEST_CASE("with an IMU, odometry corrects the speed that accelerations lead to") {
  MotionInputs inputs({});
  const Eigen::Vector3d bias(0.3, 0.0, 0.0);  // of the accelerometer
  for (int k = 0; k <= 1000; ++k) {
    REQUIRE(inputs.add(ImuSample{0.005 * k, {0, 0, 0}, Eigen::Vector3d(0, 0, kGravity) + bias}));
  }
  const auto speed_with = [](const MotionInputs& some) {
    MotionFilter filter(0.0, Pose{}, sigma(0.01, 0.001), some);
    filter.predict(5.0, some, {});
    return filter.state().velocity.norm();
  };
  CHECK(speed_with(inputs) > 1.0);
  for (int k = 0; k <= 50; ++k) REQUIRE(inputs.add(OdometrySample{0.1 * k, Pose{}}));  // it stands
  CHECK(speed_with(inputs) < 0.1);
}

TEST_CASE("the start covariance is the same for every mounting of the IMU") {
  const MotionNoise noise;
  for (const Eigen::Vector3d& rpy : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(-1.5708, 0, -1.5708),
                                     Eigen::Vector3d(3.1416, 0, 0.7)}) {
    const MotionInputs inputs({.T_sensor_imu = pose_from_xyz_rpy({0, 0, 0}, rpy)});
    const Pose start = pose_from_xyz_rpy({5, 6, 0}, {0, 0, 0.8});
    MotionFilter filter(0.0, start, sigma(0.1, 0.01), inputs);
    filter.predict(0.1, inputs, noise);
    const PoseMatrix P = filter.pose_covariance();
    CHECK(std::sqrt(P(0, 0)) == doctest::Approx(0.81).epsilon(0.02));  // 8 m/s for 0.1 s
    CHECK(std::sqrt(P(1, 1)) == doctest::Approx(0.81).epsilon(0.02));
    CHECK(std::sqrt(P(2, 2)) == doctest::Approx(0.14).epsilon(0.05));
  }
}

TEST_CASE("flat ground means the map's axes, for every mounting of the IMU") {
  const MotionNoise noise{.upright = 0.1};
  const Pose start = pose_from_xyz_rpy({5, 6, 0}, {0, 0, 0.8});
  const auto added = [&](const Eigen::Vector3d& rpy) {
    const MotionInputs inputs({.T_sensor_imu = pose_from_xyz_rpy({0, 0, 0}, rpy)});
    MotionFilter filter(0.0, start, sigma(0.1, 0.01), inputs);
    filter.predict(0.5, inputs, noise);
    return filter.pose_covariance();
  };
  const PoseMatrix level = added({0, 0, 0});
  for (const Eigen::Vector3d& rpy : {Eigen::Vector3d(0, 1.5708, 0), Eigen::Vector3d(-1.5708, 0, 1),
                                     Eigen::Vector3d(3.1416, 0, 0.7)}) {
    CHECK((added(rpy) - level).norm() < 1e-6 * level.norm());
  }
}

TEST_CASE("a steady turn before the start is no bias that is beyond doubt") {
  MotionInputs inputs({});
  for (int k = 0; k <= 200; ++k) {
    REQUIRE(inputs.add(ImuSample{0.005 * k, {0.0, 0.0, 0.15}, {0.0, 0.0, kGravity}}));
  }
  const MotionFilter filter(1.0, {}, sigma(0.1, 0.01), inputs);
  CHECK(std::sqrt(filter.covariance()(11, 11)) == doctest::Approx(0.15).epsilon(0.01));
}

TEST_CASE("scans alone reveal the speed and the turn of a sensor that was taken to stand") {
  const MotionInputs inputs({});
  const Pose step = exponential({.linear = {1.2, 0.0, 0.0}, .angular = {0.0, 0.0, 0.05}});
  Pose truth;
  MotionFilter filter(0.0, truth, sigma(1.0, 0.1), inputs);
  filter.update(truth, sigma(0.003, 0.0005));
  for (int k = 1; k < 5; ++k) {
    truth = truth * step;
    filter.predict(0.1 * k, inputs, {});
    if (k >= 3) CHECK((filter.pose().translation - truth.translation).norm() < 0.02);
    filter.update(truth, sigma(0.003, 0.0005));
  }
  CHECK(filter.state().velocity.x() == doctest::Approx(12.0).epsilon(0.01));
  CHECK(-filter.state().rate_bias.z() == doctest::Approx(0.5).epsilon(0.02));
}

TEST_CASE("a motion that changes more than the noise allows is believed, and its speed is new") {
  const MotionInputs inputs({});
  Pose truth;
  MotionFilter filter(0.0, truth, sigma(1.0, 0.1), inputs);
  for (int k = 1; k < 20; ++k) {  // at rest
    filter.predict(0.1 * k, inputs, {});
    filter.update(truth, sigma(0.003, 0.0005));
  }
  filter.predict(2.0, inputs, {});
  truth.translation.x() += 1.0;  // 10 m/s at once
  filter.update(truth, sigma(0.003, 0.0005));
  CHECK((filter.pose().translation - truth.translation).norm() < 0.02);
  CHECK(filter.state().velocity.x() > 5.0);
}

TEST_CASE("poses in and out are those of the sensor, wherever the IMU sits") {
  const Pose T_sensor_imu = pose_from_xyz_rpy({0.5, -0.3, 0.2}, {std::numbers::pi, 0.1, 0.7});
  const MotionInputs inputs({.T_sensor_imu = T_sensor_imu});
  const Pose start = pose_from_xyz_rpy({3, 4, 1}, {0.1, -0.2, 2.0});
  PoseMatrix P = sigma(0.2, 0.05);
  P(0, 4) = P(4, 0) = 0.003;
  MotionFilter filter(0.0, start, P, inputs);
  CHECK((filter.pose().translation - start.translation).norm() < 1e-12);
  CHECK((filter.pose_covariance() - P).norm() < 1e-12);
  const Pose seen = pose_from_xyz_rpy({3.1, 4.2, 1.0}, {0.1, -0.2, 2.05});
  filter.update(seen, sigma(1e-5, 1e-6));
  CHECK((filter.pose().translation - seen.translation).norm() < 2e-3);  // of second order
  CHECK(rotation_between(filter.pose(), seen) < 1e-5);
  CHECK(is_positive(filter.covariance()));
}

TEST_CASE("a sensor that nothing measures slows down, and the filter says that it does not know") {
  const MotionInputs inputs({});
  MotionFilter filter(0.0, Pose{}, sigma(0.01, 0.001), inputs);
  for (int k = 1; k < 5; ++k) {
    filter.predict(0.1 * k, inputs, {});
    filter.update(pose_from_xyz_rpy({0.15 * k, 0, 0}, {0, 0, 0}), sigma(0.003, 0.0005));
  }
  MotionFilter an_hour_later = filter;
  an_hour_later.predict(3600.0, inputs, {});
  const double way = (an_hour_later.pose().translation - filter.pose().translation).norm();
  CHECK(way > 10.0);
  CHECK(way < 20.0);  // not 5.4 km
  CHECK(std::sqrt(an_hour_later.pose_covariance()(0, 0)) > 10.0);
  CHECK(is_positive(an_hour_later.covariance()));
}

TEST_CASE("an IMU carries the pose through a turn, and its bias is found") {
  MotionInputs inputs({});
  const Eigen::Vector3d bias(0.02, -0.03, 0.05);  // 3 deg/s
  const double speed = 1.5;
  const auto rate_at = [](double t) { return t < 2.0 ? 0.0 : 1.2 * std::sin(3.0 * t); };
  const auto truth_at = [&](double t) {
    MotionState state;
    state.velocity = {speed, 0, 0};
    constexpr double kStep = 1e-3;
    for (double at = 0.0; at < t - 1e-9; at += kStep) {
      state.rate_bias = {0, 0, -rate_at(at + 0.5 * kStep)};
      state = moved(state, {.seconds = kStep});
    }
    return state.T_map_body;
  };
  MotionFilter filter(0.0, Pose{}, sigma(0.1, 0.02), inputs);
  double imu = 0.0, worst = 0.0;
  for (int scan = 1; scan <= 60; ++scan) {
    const double now = 0.1 * scan;
    for (; imu <= now + 0.005; imu += 0.005) {
      const double w = rate_at(imu);
      // On a circle, the specific force points inwards, and up.
      REQUIRE(inputs.add(ImuSample{imu, Eigen::Vector3d(0, 0, w) + bias,
                                   Eigen::Vector3d(0, speed * w, kGravity)}));
    }
    const Pose truth = truth_at(now);
    filter.predict(now, inputs, {});
    if (scan > 40) worst = std::max(worst, rotation_between(filter.pose(), truth));
    filter.update(truth, sigma(0.003, 0.0005));
    inputs.forget_before(now);
  }
  CHECK(worst < 0.001);
  CHECK((filter.state().rate_bias - bias).norm() < 0.005);
  CHECK(is_positive(filter.covariance()));
}

TEST_CASE("docs/localization.md has the constants that are used") {
  std::ifstream file(VANTAGE_SOURCE_DIR "/docs/localization.md");
  const std::string docs(std::istreambuf_iterator<char>(file), {});
  const MotionNoise noise;
  std::size_t rows = 0;
  for (const auto& [name, value] : {std::pair("acceleration", noise.acceleration),
                                    {"turning", noise.turning},
                                    {"upright", noise.upright},
                                    {"force", noise.force},
                                    {"rate", noise.rate},
                                    {"force_bias", noise.force_bias},
                                    {"rate_bias", noise.rate_bias},
                                    {"odometry_metres", noise.odometry_metres},
                                    {"odometry_radians", noise.odometry_radians},
                                    {"odometry_turning", noise.odometry_turning}}) {
    std::ostringstream row;
    row << "| `" << name << "` | " << value << " | ";
    CHECK_MESSAGE(docs.find(row.str()) != std::string::npos, "there is no line " << row.str());
    ++rows;
  }
  CHECK(rows == sizeof(MotionNoise) / sizeof(double));
}

TEST_CASE("two poses near the filter's own moment tell the twist, whatever error they share") {
  const MotionInputs nothing{MotionMounts{}};
  MotionFilter filter(10.0, pose_from_xyz_rpy({5, 0, 1}, {0, 0, 0.4}), PoseMatrix::Identity(),
                      nothing);
  const Eigen::Vector3d velocity(12.0, 0.0, 0.2);
  const double rate = 0.8;
  const auto truth = [&](double t) {
    return pose_from_xyz_rpy({5, 0, 1}, {0, 0, 0.4}) *
           exponential({(t - 10.0) * velocity, (t - 10.0) * Eigen::Vector3d(0, 0, rate)});
  };
  const PoseMatrix R = 1e-6 * PoseMatrix::Identity();
  const Eigen::Vector3d common(0.3, -0.2, 0.1);
  const auto seen = [&](double t) {
    Pose pose = truth(t);
    pose.translation += common;
    return MotionFilter::Seen{t, pose, R};
  };
  const Pose before = filter.pose();
  for (int k = 0; k < 3; ++k) filter.update_motion(seen(9.975), seen(10.025), nothing);
  CHECK((filter.state().velocity - velocity).norm() < 0.05);
  CHECK((filter.state().rate_bias - Eigen::Vector3d(0, 0, -rate)).norm() < 0.05);
  CHECK((filter.pose().translation - before.translation).norm() < 0.01);
  // sqrt(2) mm over 0.05 s
  CHECK(std::sqrt(filter.covariance()(6, 6)) < 0.04);
  CHECK(std::sqrt(filter.covariance()(0, 0)) > 0.9);
}
