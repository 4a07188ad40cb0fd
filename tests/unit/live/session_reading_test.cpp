// What a session reads from messages.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

#include "io/ros/message_writers.hpp"
#include "live/session.hpp"
#include "robot.hpp"
#include "support/bags/nav_sat_fix.hpp"
#include "vantage/io/pose_priors.hpp"

namespace vantage::live {
namespace {

using io::ros::Header;
using namespace test_world;

TEST_CASE("messages that cannot be used are told once, and nothing ends") {
  Robot robot(Robot::with_mount());
  for (const Input input : {Input::points, Input::imu, Input::odometry, Input::initial_pose,
                            Input::prior, Input::static_transforms}) {
    for (const std::string& bytes : {std::string(), std::string("xx"), std::string(100, '\xff')}) {
      robot.session.take({.input = input, .arrival = 0, .message = bytes});
    }
  }
  CHECK(robot.told.size() == 6);
  CHECK(robot.notices.counts().at("points_unusable") == 3);
  robot.imu(kStart, std::numeric_limits<double>::quiet_NaN());
  CHECK(robot.notices.counts().at("imu_unusable") == 4);
  robot.scan(kStart);
  CHECK(robot.localize());
}

TEST_CASE("frames that another node publishes as well are told") {
  Robot robot;
  const auto give = [&](Input input, const char* parent, const char* child) {
    const io::ros::PoseMessage one{
        .header = {.stamp = kStart, .frame = parent}, .child = child, .pose = {}};
    robot.give(input, kStart, io::ros::write_transforms(std::array{one}));
  };
  give(Input::static_transforms, "base_link", "lidar");
  give(Input::transforms, "map",
       "odom");  // nobody's business: without odometry, /tf gets base_link
  robot.scan(kStart);
  REQUIRE(robot.localize());
  CHECK(robot.told.empty());
  give(Input::transforms, "odom", "/base_link");
  CHECK(robot.was_told(
      "another node publishes 'base_link' under 'odom' in /tf, and this one under 'map'"));
  give(Input::transforms, "arm", "lidar");
  robot.scan(kStart + 0.1);
  REQUIRE(robot.localize());
  CHECK(robot.was_told(
      "the frame 'lidar' has the parent 'base_link' in /tf_static, and 'arm' in /tf"));

  // Once the other node has ended, nothing is wrong any more.
  for (const double after : {10.0, 10.2, 60.0}) {
    robot.scan(kStart + after);
    REQUIRE(robot.localize());
  }
  CHECK(robot.notices.count_of("lidar_with_two_parents") == 2);
}

TEST_CASE("an invalid transform does not hide those that follow it in its message") {
  Robot robot;
  io::ros::PoseMessage wheel{
      .header = {.stamp = 0.0, .frame = "base_link"}, .child = "wheel", .pose = {}};
  wheel.pose.rotation.coeffs().setZero();
  const io::ros::PoseMessage mount{
      .header = {.stamp = 0.0, .frame = "base_link"}, .child = "lidar", .pose = test::at_x(0.5)};
  for (int i = 0; i < 2; ++i) {
    robot.give(Input::static_transforms, kStart,
               io::ros::write_transforms(std::array{wheel, mount}));
  }
  CHECK(robot.told.size() == 1);
  CHECK(
      robot.was_told("the transform from 'base_link' to 'wheel' of /tf_static is left out: the "
                     "quaternion"));
  CHECK(robot.notices.count_of("static_transforms_invalid") == 2);
  robot.scan(kStart);
  const auto found = robot.localize();
  REQUIRE(found);
  CHECK(found->T_base_sensor.translation.x() == 0.5);
}

/// East, north and up at 48 N, 11 E.
io::MapProjection on_earth() {
  auto projection = io::MapProjection::parse(
      "projector_type: LocalCartesian\nvertical_datum: WGS84\n"
      "map_origin: {latitude: 48.0, longitude: 11.0, altitude: 0.0}\n",
      "map_projector_info.yaml");
  REQUIRE_MESSAGE(projection, to_string(projection.error()));
  return *std::move(projection);
}

TEST_CASE("a fix is a place of the antenna, without a heading") {
  Robot robot(Robot::with_mount(), test::at_x(5.0), on_earth());
  const io::ros::PoseMessage antenna{.header = {.stamp = 0.0, .frame = "base_link"},
                                     .child = "gnss",
                                     .pose = pose_from_xyz_rpy({0.3, 0.4, 1.5}, {0, 0, 0})};
  robot.give(Input::static_transforms, kStart, io::ros::write_transforms(std::array{antenna}));
  // Of the scan half a second later, and of a clock that is a year ahead.
  test::TestFix fix{.seconds = static_cast<std::uint32_t>(kStart),
                    .latitude = 48.0001,
                    .longitude = 11.0,
                    .altitude = 2.5};
  const auto give = [&](const test::TestFix& one) {
    robot.give(Input::fix, kStart, test::nav_sat_fix(one, test::MessageWriter::Layout::cdr_little));
  };
  robot.scan(kStart);
  REQUIRE(robot.localize());
  give(fix);
  robot.scan(kStart + 0.5);
  auto found = robot.localize();
  REQUIRE(found);
  REQUIRE(found->prior);
  const PosePrior& prior = *found->prior;
  CHECK(prior.T_map_sensor.translation.x() == doctest::Approx(0.0));
  CHECK(prior.T_map_sensor.translation.y() == doctest::Approx(11.12).epsilon(1e-3));
  // The antenna is 1.5 m above the base and half a metre beside it, and the LiDAR is 1 m above it.
  // The robot's heading is unknown, so the half metre adds to the deviations.
  CHECK(prior.T_map_sensor.translation.z() == doctest::Approx(2.5 - 1.5 + 1.0).epsilon(1e-3));
  CHECK(prior.sigma_translation.x() == doctest::Approx(std::sqrt(4.0 + 0.25)));
  CHECK(prior.sigma_translation.y() == doctest::Approx(std::sqrt(9.0 + 0.25)));
  CHECK(prior.sigma_translation.z() == doctest::Approx(4.0));
  CHECK(std::isinf(prior.sigma_heading));

  SUBCASE("none is used twice") {
    robot.scan(kStart + 1.0);
    CHECK_FALSE(robot.localize()->prior);
  }
  SUBCASE("a fix that cannot be used is told once") {
    fix.status = -1;
    for (int i = 0; i < 3; ++i) give(fix);
    CHECK(robot.was_told("has no fix"));
    fix.status = 0;
    fix.latitude = std::nan("");
    give(fix);
    CHECK(robot.was_told("a fix is left out"));
    fix.latitude = 48.0;
    fix.seconds += 365 * 86400;
    give(fix);
    CHECK(robot.was_told("later than the last scan"));
    fix.seconds -= 365 * 86400 - 1;
    fix.frame = "mast";
    fix.covariance_type = 0;
    give(fix);
    CHECK(robot.was_told("'mast', the antenna's frame"));
    CHECK(robot.told.size() == 4);
    robot.scan(kStart + 1.5);
    found = robot.localize();
    REQUIRE(found->prior);
    CHECK(found->prior->sigma_translation.x() == doctest::Approx(io::PriorSigmas{}.horizontal));
  }
}

/// Flips bits, cuts, or fills in numbers that are too large.
std::string damaged(std::string message, std::mt19937& random) {
  for (std::size_t hits = 1 + random() % 3; hits > 0 && !message.empty(); --hits) {
    const std::size_t at = random() % message.size();
    switch (random() % 4) {
      case 0: message[at] = static_cast<char>(message[at] ^ (1 << random() % 8)); break;
      case 1: message.resize(at); break;
      case 2: message.insert(at, random() % 9, '\xff'); break;
      default:
        std::fill_n(message.begin() + static_cast<std::ptrdiff_t>(at),
                    std::min<std::size_t>(message.size() - at, 1 + random() % 8),
                    random() % 2 == 0 ? '\x7f' : '\xff');
    }
  }
  return message;
}

TEST_CASE("a session survives damaged messages, and localizes afterwards") {
  // VANTAGE_MESSAGES=10000000 runs for a minute or two.
  const char* const wanted = std::getenv("VANTAGE_MESSAGES");
  const std::uint64_t count = wanted == nullptr ? 20'000 : std::stoull(wanted);
  LiveParams params = Robot::with_mount();
  params.topics.imu = "/imu";
  params.topics.odometry = "/odom";
  params.topics.prior = "/gnss";
  Robot robot(params, test::at_x(5.0), on_earth());
  robot.world.stand_at(test::at_x(5.0));
  io::ros::PoseCovariance covariance = io::ros::PoseCovariance::Identity();
  const io::ros::PoseMessage mount{
      .header = {.stamp = 0.0, .frame = "base_link"}, .child = "lidar", .pose = test::at_x(0.5)};
  std::mt19937 random(1);
  const auto message_at = [&](Input input, double stamp) -> std::string {
    const Header header{.stamp = stamp, .frame = "map"};
    switch (input) {
      case Input::points:
        return io::ros::write_point_cloud2({.stamp = stamp, .frame = "lidar"}, robot.world.scan)
            .value();
      case Input::imu: return io::ros::write_imu(header, {0, 0, 0}, {0, 0, 9.81}).value();
      case Input::odometry:
        return io::ros::write_odometry(header, "base_link", test::at_x(1.0)).value();
      case Input::initial_pose:
      case Input::prior:
        return io::ros::write_pose_with_covariance(header, test::at_x(5.0), covariance).value();
      case Input::fix:
        return test::nav_sat_fix(
            {.seconds = static_cast<std::uint32_t>(stamp), .latitude = 48.0, .longitude = 11.00007},
            test::MessageWriter::Layout::cdr_little);
      case Input::align:
        return io::ros::write_pose_with_covariance(header, test::at_x(5.0), covariance).value();
      case Input::trigger: return set_bool(random() % 4 != 0);
      case Input::followed_pose:
      case Input::static_transforms:
      case Input::transforms: break;
    }
    return io::ros::write_transforms(std::array{mount}).value();
  };
  std::uint64_t localized = 0, requests = 0, answers = 0;
  double stamp = kStart;
  for (std::uint64_t i = 0; i < count; ++i) {
    // Poses by hand and scans search: fewer of them.
    constexpr std::array kInputs{
        Input::points, Input::imu,   Input::odometry,          Input::initial_pose, Input::prior,
        Input::fix,    Input::align, Input::static_transforms, Input::transforms,   Input::trigger};
    const Input input = kInputs[random() % kInputs.size()];
    const bool is_costly =
        input == Input::points || input == Input::initial_pose || input == Input::align;
    if (is_costly && random() % 20 != 0) continue;
    stamp += 0.001;
    const bool is_request = input == Input::align || input == Input::trigger;
    robot.session.take({.input = input,
                        .arrival = ns(stamp),
                        .message = damaged(message_at(input, stamp), random),
                        .request = is_request ? std::optional(dds::RequestId{}) : std::nullopt});
    requests += is_request ? 1 : 0;
    answers += robot.session.take_answers(ns(stamp)).size();
    if (robot.session.is_ready(ns(stamp + 10.0)) && robot.session.localize()) ++localized;
  }
  MESSAGE(count << " messages, " << localized << " scans of them localized");
  CHECK(localized > count / 1000);
  answers += robot.session.take_answers(ns(stamp + 10.0)).size();
  CHECK(requests > count / 10);
  CHECK(answers == requests);
  // Each kind once; poses, clocks and requests each time.
  CHECK(robot.told.size() < 100 + 2 * (localized + requests));
  robot.session.take({.input = Input::trigger,
                      .arrival = ns(stamp),
                      .message = set_bool(true),
                      .request = dds::RequestId{}});
  // A clock of its own, and a pose by hand.
  for (int i = 0; i < 30; ++i) {
    const double then = kStart - 1e6 + 0.1 * i;
    if (i == 1) {
      robot.session.take({.input = Input::initial_pose,
                          .arrival = ns(then),
                          .message = message_at(Input::initial_pose, then)});
    }
    robot.session.take(
        {.input = Input::points, .arrival = ns(then), .message = message_at(Input::points, then)});
    REQUIRE(robot.session.is_ready(ns(then + 1.0)));
    const auto found = robot.session.localize();
    REQUIRE(found);
    REQUIRE(*found);
    if (i == 29) {
      CHECK((*found)->report.has_pose);
      CHECK((*found)->report.T_map_scan.translation.x() == doctest::Approx(5.0).epsilon(1e-2));
    }
  }
}

}  // namespace
}  // namespace vantage::live
