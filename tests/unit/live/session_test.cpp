#include "live/session.hpp"

#include <doctest/doctest.h>

#include <array>
#include <atomic>

#include "io/ros/message_writers.hpp"
#include "robot.hpp"

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

TEST_CASE("a pose that is given is used by the first scan that can be looked for with it") {
  std::atomic<bool> is_away = false;
  test::PostWorld world;
  world.stand_at(test::at_x(5.0));
  auto bundle = Bundle::of(test::in_process<OnDisk, const MapReader>(
                               world.memory, ErrorCode::io_failure, is_away),
                           "disk")
                    .value();
  auto localizer = Localizer::open(std::move(bundle),
                                   test::in_process<test::TruthMatcher, ScanMatcher>(world.truth),
                                   test::plugin<Relocalizer>("voxel_search"), {});
  REQUIRE_MESSAGE(localizer, to_string(localizer.error()));
  Notices notices([](const std::string&) {});
  Session session(*std::move(localizer), Robot::with_mount(), std::nullopt, notices);
  const auto localize = [&](double stamp, const PointCloud& points) {
    const auto cloud = io::ros::write_point_cloud2({.stamp = stamp, .frame = "lidar"}, points);
    session.take({.input = Input::points, .arrival = ns(stamp), .message = *cloud});
    return session.localize();
  };
  const auto given = io::ros::write_pose_with_covariance(
      {.stamp = kStart, .frame = "map"}, test::at_x(5.0), io::ros::PoseCovariance::Zero());
  session.take({.input = Input::initial_pose, .arrival = ns(kStart), .message = *given});

  is_away = true;
  const auto in_vain = localize(kStart, world.scan);
  REQUIRE(in_vain);
  CHECK((*in_vain)->report.reason.find("the search failed: ") != std::string::npos);
  is_away = false;
  const auto empty = localize(kStart + 0.1, {});
  REQUIRE(empty);
  CHECK_FALSE((*empty)->report.has_pose);
  const auto found = localize(kStart + 0.2, world.scan);
  REQUIRE(found);
  REQUIRE((*found)->prior);
  CHECK((*found)->prior->T_map_sensor.translation.x() == 5.0);
  CHECK((*found)->report.has_pose);
  const auto next = localize(kStart + 0.3, world.scan);
  REQUIRE(next);
  CHECK_FALSE((*next)->prior);
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
  CHECK(robot.session.idle(ns(kStart), {"a publisher sleeps"})->message ==
        "waits for a pose on /initialpose; no scan has come on /points yet; a publisher sleeps");
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
  CHECK_FALSE(robot.session.idle(ns(kStart + 7.1), {"a publisher sleeps"}));
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

}  // namespace
}  // namespace vantage::live
