#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "io/ros/message_writers.hpp"
#include "live/session.hpp"
#include "robot.hpp"

namespace vantage::live {
namespace {

using namespace test_world;

TEST_CASE("a scan waits for IMU and odometry, but not for ever") {
  LiveParams params = Robot::with_mount();
  params.topics.imu = "/imu";
  params.topics.odometry = "/odom";
  params.motion_wait = 0.05;
  Robot robot(params);
  robot.scan(kStart - 6.0);
  CHECK_FALSE(robot.session.is_ready(ns(kStart - 6.0)));  // neither has spoken yet
  CHECK(robot.session.is_ready(ns(kStart - 5.9)));
  CHECK(robot.localize());
  CHECK(robot.was_told("localized without them"));
  robot.scan(kStart);
  CHECK(robot.session.is_ready(ns(kStart)));  // nor will they
  CHECK(robot.localize());

  robot.imu(kStart + 0.02);
  robot.odometry(kStart + 0.02);
  robot.scan(kStart + 0.1);
  CHECK_FALSE(robot.session.is_ready(ns(kStart + 0.12)));
  robot.imu(kStart + 0.11);
  CHECK_FALSE(robot.session.is_ready(ns(kStart + 0.12)));
  robot.odometry(kStart + 0.11);
  CHECK(robot.session.is_ready(ns(kStart + 0.12)));
  const auto found = robot.localize();
  REQUIRE(found);
  REQUIRE(found->T_odom_base);
  CHECK(found->T_odom_base->translation.x() == doctest::Approx(0.1));

  robot.scan(kStart + 0.2);
  CHECK_FALSE(robot.session.is_ready(ns(kStart + 0.24)));
  CHECK(robot.session.is_ready(ns(kStart + 0.26)));
  CHECK(robot.localize());

  robot.scan(kStart + 1.5);  // the samples have been silent for more than a second
  CHECK(robot.session.is_ready(ns(kStart + 1.5)));
}

/// Odometry of a robot that stands at the origin.
void stands(Robot& robot, double stamp) {
  robot.give(Input::odometry, stamp,
             io::ros::write_odometry({.stamp = stamp, .frame = "odom"}, "base_link", Pose{}));
}
void scan_at_rest(Robot& robot, double stamp) {
  robot.world.stand_at(test::at_x(5.0));
  robot.give(Input::points, stamp,
             io::ros::write_point_cloud2({.stamp = stamp, .frame = "lidar"}, robot.world.scan));
}

TEST_CASE("odometry that comes after the next scan is waited for, and no scan is lost") {
  LiveParams params = Robot::with_mount();
  params.topics.odometry = "/odom";
  params.motion_wait = 0.2;
  Robot robot(params);
  std::vector<double> stamps;
  for (int step = 0; step < 830; ++step) {
    const double time = kStart + 0.01 * step;
    stands(robot, time - 0.13);
    if (step % 10 == 0 && step < 800) scan_at_rest(robot, time);
    if (!robot.session.is_ready(ns(time))) continue;
    const auto found = robot.localize();
    REQUIRE(found);
    CHECK(found->T_odom_base);
    stamps.push_back(found->report.stamp);
  }
  CHECK(stamps.size() == 80);
  CHECK(std::ranges::is_sorted(stamps));
  CHECK(robot.told.empty());
}

TEST_CASE("not many scans wait for their samples, and none over a jump of the clock") {
  LiveParams params = Robot::with_mount();
  params.topics.odometry = "/odom";
  const auto dropped_of = [&](int scans, double wait) {
    params.motion_wait = wait;
    Robot robot(params);
    for (int i = 0; i < scans; ++i) scan_at_rest(robot, kStart + 0.1 * i);
    const auto dropped = robot.notices.count_of("scans_dropped");
    CHECK(robot.localize()->report.stamp ==
          doctest::Approx(kStart + 0.1 * static_cast<double>(dropped)).epsilon(1e-12));
    return dropped;
  };
  CHECK(dropped_of(10, 0.25) == 6);  // the second of four would have waited longer
  CHECK(dropped_of(20, 4.0) == 4);   // 16 wait

  Robot robot(params);
  for (const double after : {0.0, 0.1, 3600.0}) scan_at_rest(robot, kStart + after);
  CHECK(robot.localize()->report.stamp == kStart + 3600.0);
  CHECK_FALSE(robot.session.has_scan());
}

TEST_CASE("a scan waits as long if the clock of the computer is set") {
  for (const double step : {-3600.0, 3600.0}) {
    LiveParams params = Robot::with_mount();
    params.topics.imu = "/imu";
    Robot robot(params);
    robot.imu(kStart - 0.01);
    const auto scan =
        io::ros::write_point_cloud2({.stamp = kStart, .frame = "lidar"}, robot.world.scan);
    robot.session.take({.input = Input::points,
                        .arrival = ns(kStart),
                        .time = ns(kStart + step),
                        .message = *scan});
    CHECK_FALSE(robot.session.is_ready(ns(kStart + 0.05)));
    CHECK(robot.session.is_ready(ns(kStart + 0.11)));
  }
}

TEST_CASE(
    "the session reports once, and counts, a silent IMU or odometry, or one of another clock") {
  for (const bool is_silent : {true, false}) {
    CAPTURE(is_silent);
    LiveParams params = Robot::with_mount();
    params.topics.imu = "/imu";
    params.topics.odometry = "/odom";
    Robot robot(params);
    for (int i = 0; i < 8; ++i) {
      const double stamp = kStart + i;
      if (!is_silent) {
        robot.imu(stamp - 3600.0);
        stands(robot, stamp - 3600.0);
      }
      scan_at_rest(robot, stamp);
      REQUIRE(robot.localize());
    }
    CHECK(robot.notices.count_of("scans_without_odometry") == 2);  // after the first five seconds
    CHECK(robot.notices.count_of("scans_without_imu") == 2);
    CHECK(std::ranges::count_if(robot.told, [](const std::string& line) {
            return line.find("/odom") != std::string::npos;
          }) == 1);
    CHECK(robot.was_told("no sample of /imu"));
  }
}

TEST_CASE("odometry counts at a scan only if its samples reach to the scan's stamp") {
  LiveParams params = Robot::with_mount();
  params.topics.odometry = "/odom";
  params.motion_wait = 0.0;
  Robot robot(params);
  const auto x_at = [&](double after) -> std::optional<double> {
    robot.scan(kStart + after);
    const auto found = robot.localize();
    REQUIRE(found);
    CHECK(found->report.tracking == Tracking::tracked);
    if (!found->T_odom_base) return std::nullopt;
    return found->T_odom_base->translation.x();
  };
  robot.odometry(kStart);
  CHECK(x_at(0.0) == doctest::Approx(0.0));
  CHECK_FALSE(x_at(0.02));  // one sample tells no motion
  robot.odometry(kStart + 0.05);
  CHECK(x_at(0.03) == doctest::Approx(0.03));
  CHECK(x_at(0.09) == doctest::Approx(0.09));  // the motion goes on for a moment
  CHECK_FALSE(x_at(0.12));
  CHECK_FALSE(x_at(0.4));
  robot.odometry(kStart + 0.6);  // more than half a second later
  CHECK_FALSE(x_at(0.5));
  robot.odometry(kStart + 0.7);
  CHECK(x_at(0.68) == doctest::Approx(0.68));
}

TEST_CASE("between scans, the IMU says how the robot moves") {
  LiveParams params = Robot::with_mount();
  params.topics.imu = "/imu";
  Robot robot(params);
  CHECK_FALSE(robot.session.moved());
  for (int scan = 0; scan < 30; ++scan) {
    for (int i = 1; i <= 10; ++i) robot.imu(kStart + 0.1 * scan + 0.01 * (i - 10));
    robot.scan(kStart + 0.1 * scan);
    REQUIRE(robot.localize());
  }
  const double last = kStart + 2.9;
  for (int i = 1; i <= 10; ++i) {
    robot.imu(last + 0.01 * i);
    const auto moved = robot.session.moved();
    REQUIRE(moved);
    CHECK(double(moved->stamp) == last + 0.01 * i);
    CHECK(moved->motion.T_map_sensor.translation.x() ==
          doctest::Approx(5.0 + 2.9 + 0.01 * i).epsilon(2e-3));
    CHECK(moved->motion.twist.linear.x() == doctest::Approx(1.0).epsilon(0.05));
    CHECK(moved->motion.covariance(0, 0) > 0.0);
    CHECK_FALSE(robot.session.moved());  // told already
  }
  robot.imu(last + 1.5);
  CHECK_FALSE(robot.session.moved());  // scans have been silent for too long
}

TEST_CASE("without an IMU, the motion is told for the end of each sweep") {
  for (const double sweep : {0.0, 0.1}) {
    CAPTURE(sweep);
    Robot robot(Robot::with_mount());
    robot.world.stand_at(test::at_x(5.0));
    const std::size_t count = robot.world.scan.size();
    std::vector<float> seconds(count);
    for (std::size_t i = 0; i < count; ++i) {
      seconds[i] = static_cast<float>(sweep * static_cast<double>(i) / static_cast<double>(count));
    }
    seconds.back() = static_cast<float>(sweep);
    const std::vector<io::ros::CloudField> times{{.name = "time", .values = seconds}};
    for (int i = 0; i < 5; ++i) {
      const double stamp = kStart + 0.1 * i;
      robot.give(
          Input::points, stamp,
          io::ros::write_point_cloud2({.stamp = stamp, .frame = "lidar"}, robot.world.scan, times));
      REQUIRE(robot.localize()->report.tracking == Tracking::tracked);
      const auto moved = robot.session.moved();
      REQUIRE(moved);
      CHECK(std::abs(double(moved->stamp) - (stamp + sweep)) < 1e-6);
      CHECK(moved->motion.stamp == double(moved->stamp));
      CHECK(moved->motion.T_map_sensor.translation.x() == doctest::Approx(5.0).epsilon(1e-3));
      CHECK_FALSE(robot.session.moved());  // told already
    }
  }
}

TEST_CASE("samples count after the clock went back") {
  LiveParams params = Robot::with_mount();
  params.topics.imu = "/imu";
  Robot robot(params);
  for (const double begin : {kStart, kStart - 3600.0}) {
    std::uint64_t dropped = 0;
    for (int i = 0; i < 30; ++i) {
      robot.imu(begin + 0.1 * i);
      robot.imu(begin + 0.1 * i + 0.05);
      robot.world.stand_at(test::at_x(5.0));
      robot.give(Input::points, kStart,
                 io::ros::write_point_cloud2({.stamp = begin + 0.1 * i, .frame = "lidar"},
                                             robot.world.scan));
      const auto found = robot.localize();
      REQUIRE(found);
      dropped = found->report.dropped_samples;
    }
    CHECK(dropped == 0);
  }
}

TEST_CASE("one sample with a stamp of the future does not hide those that follow") {
  LiveParams params = Robot::with_mount();
  params.topics.imu = "/imu";
  params.topics.odometry = "/odom";
  Robot robot(params);
  robot.scan(kStart);
  REQUIRE(robot.localize());
  robot.imu(kStart + 1e6);
  robot.odometry(kStart + 1e6);
  CHECK(robot.was_told("later than the last scan"));
  robot.odometry(kStart + 0.05);
  robot.imu(kStart + 0.2);
  robot.odometry(kStart + 0.2);
  robot.scan(kStart + 0.1);
  CHECK(robot.session.is_ready(ns(kStart + 0.1)));
  CHECK(robot.localize()->T_odom_base);
}

TEST_CASE("an IMU in g is noticed, and read as such if the configuration says so") {
  LiveParams params = Robot::with_mount();
  params.topics.imu = "/imu";
  Robot robot(params);
  robot.imu(kStart, 1.0);
  CHECK(robot.was_told("see [live] imu_unit"));
  params.imu_unit = ForceUnit::g;
  Robot other(params);
  other.imu(kStart, 1.0);
  CHECK(other.told.empty());
}

}  // namespace
}  // namespace vantage::live
