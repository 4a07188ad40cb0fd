#include "vantage/track/sweep_motion.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace vantage;

namespace {

const Point kSeen(12.0, -7.0, 2.0);  // map frame [m]

MotionState driving() {
  MotionState state;
  state.T_map_body = pose_from_xyz_rpy({1.0, 2.0, 0.5}, {0.05, -0.02, 0.8});
  state.velocity = {8.0, 0.3, 0.0};
  state.rate_bias = {0.0, 0.1, -1.5};  // turns left with 1.5 rad/s
  return state;
}

}  // namespace

TEST_CASE("each point comes to where the sensor at the middle of the sweep would see it") {
  const MotionInputs inputs({});
  const SweepTime time{10.0, 10.1};
  const MotionState middle = driving();
  const SweepMotion motion(middle, inputs, time, 10.05);
  for (double stamp = 10.0; stamp <= 10.1; stamp += 0.0037) {
    const Pose T_map_sensor = moved(middle, {.seconds = stamp - 10.05}).T_map_body;
    const Point seen = motion.seen_from_middle(T_map_sensor.inverse() * kSeen, stamp);
    CHECK((seen - middle.T_map_body.inverse() * kSeen).norm() < 2e-4);
  }
}

TEST_CASE("a correction by another motion is the same as that motion at once") {
  const MotionInputs inputs({});
  const SweepTime time{0.0, 0.1};
  MotionState other = driving();
  other.velocity.x() = 7.0;
  other.rate_bias.z() = -1.2;
  const SweepMotion first(driving(), inputs, time, 0.05), second(other, inputs, time, 0.05);
  for (const double stamp : {0.0, 0.013, 0.05, 0.08, 0.1}) {
    const Point once = first.seen_from_middle(kSeen, stamp);
    CHECK((first.corrected(once, stamp, second) - second.seen_from_middle(kSeen, stamp)).norm() <
          5e-4);
  }
  CHECK(first.apart(first, 20.0) == 0.0);
  // 1 m/s and 0.3 rad/s for 0.05 s, 20 m away.
  CHECK(first.apart(second, 20.0) == doctest::Approx(0.05 * 1.0 + 0.05 * 0.3 * 20.0).epsilon(0.1));
}

TEST_CASE("without motion or without time, points stay where they are") {
  const MotionInputs inputs({});
  const SweepMotion standing({}, inputs, {0.0, 0.1}, 0.05);
  CHECK(standing.seen_from_middle(kSeen, 0.02) == kSeen);
  const SweepMotion instant(driving(), inputs, {3.0, 3.0}, 3.0);
  CHECK((instant.seen_from_middle(kSeen, 3.0) - kSeen).norm() < 1e-12);
}

TEST_CASE(
    "inside a sweep, odometry shapes the turn, and the state says how fast it is in the mean") {
  MotionInputs inputs({});
  // Turns during the second half only, and takes a turn of 1 rad/s for one of 1.5.
  for (int k = -1; k <= 11; ++k) {
    const double turn = 0.015 * std::max(0, k - 5);
    REQUIRE(inputs.add(OdometrySample{0.01 * k, pose_from_xyz_rpy({0, 0, 0}, {0, 0, turn})}));
  }
  MotionState state;
  state.rate_bias = {0, 0, -0.5};
  const SweepMotion motion(state, inputs, {0.0, 0.1}, 0.0);
  const auto turned = [&](double stamp) {
    const Point seen = motion.seen_from_middle(kSeen, stamp);
    return std::atan2(seen.y(), seen.x()) - std::atan2(kSeen.y(), kSeen.x());
  };
  // The mean of odometry is 0.75 rad/s.
  CHECK(turned(0.1) == doctest::Approx(0.05 * (1.5 - 0.25)).epsilon(0.05));
  CHECK(turned(0.0) == doctest::Approx(0.05 * 0.25).epsilon(0.2));
}

TEST_CASE("inside a sweep, the gyroscope shapes the motion") {
  MotionInputs inputs({});
  // Stands, and turns during the second half only.
  for (int k = 0; k <= 20; ++k) {
    REQUIRE(inputs.add(ImuSample{0.005 * k, {0, 0, k > 10 ? 2.0 : 0.0}, {0, 0, 9.80665}}));
  }
  const SweepMotion motion({}, inputs, {0.0, 0.1}, 0.0);
  CHECK((motion.seen_from_middle(kSeen, 0.01) - kSeen).norm() < 1e-9);
  const double turned = 2.0 * 0.05 - 2.0 * 0.0025;
  const Point expected = rotation_from_vector({0, 0, turned}).toRotationMatrix() * kSeen;
  CHECK((motion.seen_from_middle(kSeen, 0.1) - expected).norm() < 1e-3);
}
