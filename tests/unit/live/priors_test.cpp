#include "live/priors.hpp"

#include <doctest/doctest.h>

#include "io/ros/message_writers.hpp"
#include "robot.hpp"

namespace vantage::live {
namespace {

using namespace test_world;

io::ros::PoseMessage prior_at(double stamp) {
  return {.header = {.stamp = stamp, .frame = "map"},
          .child = {},
          .pose = {},
          .variances = io::ros::PoseVariances{.translation = {1.0, 1.0, 1.0}, .heading = 1.0}};
}

TEST_CASE("priors are kept for 10 s before the last scan, whatever their order") {
  Notices notices([](const std::string&) {});
  Priors priors({}, {}, notices);
  priors.add(prior_at(20.0));
  priors.add(prior_at(1.0));
  CHECK(priors.at(1.0, {}));
  CHECK(priors.at(11.0, {}) == std::nullopt);
  CHECK(priors.at(1.0, {}));
  CHECK(priors.at(11.1, {}) == std::nullopt);
  CHECK(priors.at(1.0, {}) == std::nullopt);
  CHECK(priors.at(20.0, {}));
}

TEST_CASE("priors whose stamps do not advance are bounded in number") {
  Notices notices([](const std::string&) {});
  Priors priors({}, {}, notices);
  priors.add(prior_at(1.0));
  for (int i = 1; i < 5000; ++i) priors.add(prior_at(2.0));
  CHECK(priors.at(1.0, {}));
  priors.add(prior_at(2.0));
  CHECK(priors.at(1.0, {}) == std::nullopt);
  CHECK(priors.at(2.0, {}));
}

TEST_CASE("a prior whose stamp is long before the last scan is left out and reported once") {
  LiveParams params = Robot::with_mount();
  params.topics.prior = "/ekf";
  Robot robot(params);
  robot.scan(kStart);
  REQUIRE(robot.localize());
  const auto give = [&](double stamp) {
    robot.give(
        Input::prior, kStart,
        io::ros::write_pose_with_covariance({.stamp = stamp, .frame = "map"}, test::at_x(5.0),
                                            io::ros::PoseCovariance::Identity()));
  };
  give(kStart - 9.9);
  CHECK(robot.told.empty());
  for (int i = 0; i < 10; ++i) give(0.0);
  CHECK(
      robot.was_told("a message of the topic 'prior' is stamped 1700000000.0 s earlier than the "
                     "last scan"));
  CHECK(robot.told.size() == 1);
  CHECK(robot.notices.count_of("prior_behind") == 10);
  robot.scan(kStart + 0.1);
  CHECK_FALSE(robot.localize()->prior);
}

}  // namespace
}  // namespace vantage::live
