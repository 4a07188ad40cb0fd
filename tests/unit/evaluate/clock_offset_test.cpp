#include "vantage/evaluation/clock_offset.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "vantage/track/rotation.hpp"

using namespace vantage;

namespace {

constexpr double kOffset = -1234.5678;  // of the IMU [s]

/// The rate of turn about z at a moment [rad/s]: three waves that never repeat.
double turning(double t) {
  return 0.3 * std::sin(0.7 * t) + 0.2 * std::sin(1.9 * t + 1.0) + 0.1 * std::sin(4.3 * t);
}
double turned(double t) {
  return -0.3 / 0.7 * std::cos(0.7 * t) - 0.2 / 1.9 * std::cos(1.9 * t + 1.0) -
         0.1 / 4.3 * std::cos(4.3 * t);
}

/// 30 s of poses at 10 Hz, each off by about 0.05 degrees.
io::Trajectory poses() {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.001);
  io::Trajectory poses;
  for (int k = 0; k < 300; ++k) {
    const double t = 100.0 + 0.1 * k;
    poses.push_back({t, pose_from_xyz_rpy({t, 0, 0}, {noise(random), noise(random), turned(t)})});
  }
  return poses;
}

/// An IMU that lies on its side, with a bias; it runs from before the poses to after them.
io::ImuRecording imu() {
  io::ImuRecording imu;
  imu.source = "imu.csv";
  for (int k = 0; k < 10'000; ++k) {
    const double t = 90.0 + 0.005 * k;
    imu.samples.push_back({.stamp = t - kOffset,
                           .angular_velocity = {0.01, -turning(t), -0.02},
                           .specific_force = {0, 9.8, 0}});
  }
  return imu;
}

}  // namespace

TEST_CASE("the clock of an IMU is found by the turns that it measured") {
  const auto found = clock_offset_of(poses(), imu());
  REQUIRE_MESSAGE(found, to_string(found.error()));
  CHECK(std::abs(found->seconds - kOffset) < 0.003);
  CHECK(found->correlation > 0.95);
}

TEST_CASE("samples with stray stamps, and gaps, change nothing") {
  io::ImuRecording recorded = imu();
  for (ImuSample& sample : recorded.samples) sample.stamp += 1.7e9;
  const auto expected = clock_offset_of(poses(), recorded);
  REQUIRE_MESSAGE(expected, to_string(expected.error()));
  CHECK(std::abs(expected->seconds - kOffset + 1.7e9) < 0.003);

  ImuSample stray = recorded.samples.front();
  stray.stamp = 0.0;
  recorded.samples.insert(recorded.samples.begin(), stray);
  stray.stamp = 1e18;
  recorded.samples.push_back(stray);
  const auto found = clock_offset_of(poses(), recorded);
  REQUIRE_MESSAGE(found, to_string(found.error()));
  CHECK(found->seconds == expected->seconds);
  CHECK(found->correlation == expected->correlation);

  // Nothing was recorded for 2 s, and there is an older recording.
  auto& samples = recorded.samples;
  samples.erase(samples.begin() + 4000, samples.begin() + 4400);
  for (int k = 0; k < 1000; ++k) samples[static_cast<std::size_t>(k)].stamp -= 1e9;
  std::ranges::sort(samples, {}, &ImuSample::stamp);
  const auto parted = clock_offset_of(poses(), recorded);
  REQUIRE_MESSAGE(parted, to_string(parted.error()));
  CHECK(std::abs(parted->seconds - expected->seconds) < 0.003);
}

TEST_CASE("a sensor that does not turn, and an IMU of another drive, are refused with numbers") {
  const auto message = [](const io::Trajectory& poses, const io::ImuRecording& imu) {
    const auto found = clock_offset_of(poses, imu);
    REQUIRE_FALSE(found);
    CHECK(found.error().code == ErrorCode::invalid_input);
    return to_string(found.error());
  };
  io::Trajectory straight;
  for (int k = 0; k < 300; ++k) straight.push_back({0.1 * k, Pose()});
  CHECK(message(straight, imu()).find("changes by 0.000 rad/s") != std::string::npos);

  io::ImuRecording other = imu();
  for (ImuSample& sample : other.samples)
    sample.angular_velocity.y() = std::sin(37.0 * sample.stamp * sample.stamp);
  CHECK(message(poses(), other).find("resemble those of the poses by 0.") != std::string::npos);

  // Laps that are all alike: any of them may be the one.
  io::ImuRecording laps = imu();
  io::Trajectory lap;
  for (ImuSample& sample : laps.samples) {
    sample.angular_velocity = {0.0, 0.0, 0.5 * std::sin(sample.stamp)};
  }
  for (int k = 0; k < 200; ++k) {
    lap.push_back({0.1 * k, pose_from_xyz_rpy({0, 0, 0}, {0, 0, -0.5 * std::cos(0.1 * k)})});
  }
  CHECK(message(lap, laps).find("give the offset") != std::string::npos);

  io::ImuRecording brief = imu();
  brief.samples.resize(1000);  // 5 s
  CHECK(message(poses(), brief).find("cover 5.0 s") != std::string::npos);
  CHECK(message({}, imu()).find("0 tracked scans") != std::string::npos);
}
