#include "live/session.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

#include "io/ros/message_writers.hpp"
#include "robot.hpp"
#include "support/bags/nav_sat_fix.hpp"
#include "vantage/io/pose_priors.hpp"

namespace vantage::live {
namespace {

using io::ros::Header;
using namespace test_world;

TEST_CASE("scans are localized from the pose that was kept") {
  Robot robot(Robot::with_mount());
  for (int i = 0; i < 5; ++i) {
    robot.scan(kStart + 0.1 * i);
    REQUIRE(robot.session.is_ready(ns(kStart + 0.1 * i)));
    const auto found = robot.localize();
    REQUIRE(found);
    CHECK(found->report.T_map_scan.translation.x() == doctest::Approx(5.0 + 0.1 * i).epsilon(1e-3));
    CHECK(found->T_base_sensor.translation.z() == 1.0);
    CHECK_FALSE(robot.session.is_ready(ns(kStart + 1e3)));
  }
  CHECK(robot.told.empty());
}

TEST_CASE("a scan that waits is dropped for the next one, and told once") {
  LiveParams params = Robot::with_mount();
  params.topics.imu = "/imu";
  Robot robot(params);
  robot.imu(kStart + 0.21);  // none of the scans waits for a sample
  robot.scan(kStart);
  robot.scan(kStart + 0.1);
  robot.scan(kStart + 0.2);
  CHECK(robot.was_told("come faster than they are localized"));
  CHECK(robot.told.size() == 1);
  CHECK(robot.notices.counts().at("scans_dropped") == 2);
  CHECK(robot.localize()->report.stamp == kStart + 0.2);
}

/// A map on a disk that is not there yet.
class OnDisk final : public MapReader {
 public:
  OnDisk(std::shared_ptr<test::Memory> memory, ErrorCode error, const std::atomic<bool>& is_away)
      : inner_(std::move(memory)), error_(error), is_away_(is_away) {}
  [[nodiscard]] Result<MapIndex> index() const noexcept override { return inner_.index(); }
  [[nodiscard]] Result<std::unique_ptr<const RegionDirectory>> directory() const noexcept override {
    return inner_.directory();
  }
  [[nodiscard]] Result<RegionMap> get(RegionId region) const noexcept override {
    if (is_away_) return fail(error_, "cannot be read");
    return inner_.get(region);
  }

 private:
  test::MemoryReader inner_;
  ErrorCode error_;
  const std::atomic<bool>& is_away_;
};

TEST_CASE(
    "the session reports a last pose whose map cannot be read, and keeps it after an I/O error") {
  for (const ErrorCode code : {ErrorCode::io_failure, ErrorCode::corrupt_data}) {
    const bool is_kept = code == ErrorCode::io_failure;
    std::atomic<bool> is_away = true;
    const test::PostWorld world;
    auto bundle =
        Bundle::of(test::in_process<OnDisk, const MapReader>(world.memory, code, is_away), "disk")
            .value();
    auto localizer = Localizer::open(std::move(bundle),
                                     test::in_process<test::TruthMatcher, ScanMatcher>(world.truth),
                                     test::plugin<Relocalizer>("voxel_search"), {});
    REQUIRE_MESSAGE(localizer, to_string(localizer.error()));
    std::vector<std::string> told;
    Notices notices([&](const std::string& text) { told.push_back(text); });
    Session session(*std::move(localizer), Robot::with_mount(), test::at_x(5.0), notices);
    REQUIRE(told.size() == 1);
    CHECK(told[0].find("cannot be read") != std::string::npos);
    CHECK(told[0].find(is_kept ? "is kept" : "is forgotten") != std::string::npos);

    is_away = false;
    for (const double stamp : {kStart, kStart - 3600.0}) {  // the second begins anew
      const auto cloud =
          io::ros::write_point_cloud2({.stamp = stamp, .frame = "lidar"}, world.scan);
      session.take({.input = Input::points, .arrival = ns(stamp), .message = *cloud});
    }
    CHECK((told.back().find("from the last pose") != std::string::npos) == is_kept);
  }
}

TEST_CASE("stamps that go back: a little is left out, more is another clock") {
  Robot robot(Robot::with_mount());
  for (int i = 0; i < 3; ++i) {
    robot.scan(kStart + 0.1 * i);
    REQUIRE(robot.localize());
  }
  robot.scan(kStart + 0.1);
  CHECK_FALSE(robot.session.is_ready(ns(kStart + 9)));
  CHECK(robot.was_told("no later than the one before"));

  // An hour back: begins anew, where the sensor was last.
  const double hour = 3600.0;
  robot.world.stand_at(test::at_x(5.3));
  for (int i = 0; i < 3; ++i) {
    robot.give(Input::points, kStart,
               io::ros::write_point_cloud2({.stamp = kStart - hour + 0.1 * i, .frame = "lidar"},
                                           robot.world.scan));
    const auto found = robot.localize();
    REQUIRE(found);
    CHECK(found->report.has_pose);
    CHECK(found->report.T_map_scan.translation.x() == doctest::Approx(5.3).epsilon(1e-3));
  }
  CHECK(robot.was_told("went back by"));
}

TEST_CASE("stamps that jump ahead are another clock, too") {
  Robot robot(Robot::with_mount());
  robot.scan(kStart);
  REQUIRE(robot.localize());
  robot.scan(kStart + 59.0);
  REQUIRE(robot.localize());
  CHECK(robot.told.empty());
  robot.scan(kStart + 3659.0);
  CHECK(robot.was_told("jumped ahead by 3600.000 s: begins anew"));
  REQUIRE(robot.localize());
}

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

TEST_CASE("scans without a mount are left out, until /tf_static tells it") {
  Robot robot;
  robot.scan(kStart);
  CHECK_FALSE(robot.localize());
  CHECK(robot.was_told("no transform leads from 'base_link' to it"));
  io::ros::PoseMessage mount{
      .header = {.stamp = 0.0, .frame = "base_link"}, .child = "lidar", .pose = test::at_x(0.5)};
  robot.give(Input::static_transforms, kStart, io::ros::write_transforms(std::array{mount}));
  robot.scan(kStart + 0.1);
  const auto found = robot.localize();
  REQUIRE(found);
  CHECK(found->T_base_sensor.translation.x() == 0.5);
  robot.scan(kStart + 0.2, "base_link");
  CHECK(robot.localize()->T_base_sensor.translation.x() == 0.0);
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

TEST_CASE("a session that waits for a pose begins with it, at any height") {
  LiveParams params = Robot::with_mount();
  params.start = Start::wait;
  Robot robot(params, std::nullopt);
  robot.scan(kStart);
  CHECK_FALSE(robot.localize());
  CHECK(robot.was_told("no pose has come on /initialpose"));
  const Header header{.stamp = kStart, .frame = "map"};
  io::ros::PoseCovariance covariance = io::ros::PoseCovariance::Zero();
  covariance(0, 0) = covariance(1, 1) = 0.25;
  covariance(5, 5) = 0.07;
  Pose pose = test::at_x(5.4);
  pose.translation.z() = -7.0;  // a screen has no height
  robot.give(
      Input::initial_pose, kStart,
      io::ros::write_pose_with_covariance({.stamp = kStart, .frame = "odom"}, pose, covariance));
  CHECK(robot.was_told("is given in the frame 'odom', expected 'map'"));
  robot.give(Input::initial_pose, kStart,
             io::ros::write_pose_with_covariance(header, pose, covariance));
  robot.scan(kStart + 0.1);
  const auto found = robot.localize();
  REQUIRE(found);
  CHECK(found->report.has_pose);
  CHECK(found->report.T_map_scan.translation.x() == doctest::Approx(5.1).epsilon(1e-2));
  CHECK(found->report.T_map_scan.translation.z() == doctest::Approx(0.0).epsilon(1e-2));
}

TEST_CASE("a pose that is given between two drives of different times is not lost") {
  LiveParams params = Robot::with_mount();
  params.start = Start::wait;
  Robot robot(params, std::nullopt);
  robot.scan(kStart);
  CHECK_FALSE(robot.localize());
  robot.give(Input::initial_pose, kStart + 1.0,
             io::ros::write_pose_with_covariance({.stamp = kStart, .frame = "map"}, test::at_x(5.0),
                                                 io::ros::PoseCovariance::Zero()));
  robot.world.stand_at(test::at_x(5.0));
  robot.give(
      Input::points, kStart + 2.0,
      io::ros::write_point_cloud2({.stamp = kStart - 3600.0, .frame = "lidar"}, robot.world.scan));
  CHECK(robot.was_told("went back by"));
  const auto found = robot.localize();
  REQUIRE(found);
  CHECK(found->report.T_map_scan.translation.x() == doctest::Approx(5.0).epsilon(1e-2));
}

TEST_CASE("a session says why it localizes nothing") {
  using Level = io::ros::Diagnostic::Level;
  LiveParams params;
  params.start = Start::wait;
  Robot robot(params, std::nullopt);
  const auto check = [&](double time, Level level, const std::string& message) {
    const auto idle = robot.session.idle(ns(time));
    REQUIRE(idle);
    CHECK(idle->level == level);
    CHECK(idle->message == message);
  };
  const auto check_busy = [&](double time) { CHECK_FALSE(robot.session.idle(ns(time))); };
  check(kStart, Level::stale, "waits for a pose on /initialpose; no scan has come on /points yet");
  robot.scan(kStart);
  CHECK_FALSE(robot.localize());
  check(kStart + 1.0, Level::error,
        "waits for a pose on /initialpose; scans are in the frame 'lidar', and no transform leads "
        "from 'base_link' to it: they are left out; publish /tf_static or give [live.frames] "
        "T_base_sensor");
  robot.scan(kStart + 0.1, "base_link");
  CHECK_FALSE(robot.localize());
  check(kStart + 1.0, Level::warn, "waits for a pose on /initialpose");
  robot.give(Input::initial_pose, kStart + 1.0,
             io::ros::write_pose_with_covariance({.stamp = kStart, .frame = "map"}, test::at_x(5.0),
                                                 io::ros::PoseCovariance::Zero()));
  robot.scan(kStart + 1.0, "base_link");
  CHECK(robot.localize());
  check_busy(kStart + 3.0);
  check(kStart + 7.0, Level::stale, "no scan has come on /points for 6 s");
  robot.give(Input::points, kStart + 7.0, "broken");
  CHECK(robot.session.idle(ns(kStart + 7.0))->level == Level::error);
  robot.scan(kStart + 7.1, "base_link");
  CHECK(robot.localize());
  check_busy(kStart + 7.1);
}

TEST_CASE("a prior is the pose between two of its source") {
  LiveParams params = Robot::with_mount();
  params.topics.prior = "/ekf";
  Robot robot(params);
  const io::ros::PoseCovariance covariance = io::ros::PoseCovariance::Identity();
  const auto give = [&](double stamp, double x) {
    robot.give(Input::prior, stamp,
               io::ros::write_pose_with_covariance({.stamp = stamp, .frame = "map"}, test::at_x(x),
                                                   covariance));
  };
  const auto prior_x = [&](double stamp) {
    robot.scan(stamp);
    const auto found = robot.localize();
    REQUIRE(found);
    REQUIRE(found->prior);
    return found->prior->T_map_sensor.translation.x();
  };
  give(kStart - 0.02, 4.0);
  give(kStart + 0.03, 6.0);
  give(kStart + 0.04, 9.0);
  CHECK(prior_x(kStart) == doctest::Approx(4.8));
  CHECK(prior_x(kStart + 0.1) == doctest::Approx(9.0));  // none is behind it
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
