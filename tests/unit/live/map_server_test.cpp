#include "live/map_server.hpp"

#include <doctest/doctest.h>

#include "io/ros/message_writers.hpp"
#include "live/publisher.hpp"
#include "support/post_world.hpp"

namespace vantage::live {
namespace {

TEST_CASE("a map follows the pose of another localizer") {
  const test::PostWorld world;  // strips of 10 m along x
  std::vector<std::string> told;
  Notices notices([&](const std::string& text) { told.push_back(text); });
  MapServer server(test::bundle_in(world.memory).value(), {}, 1.0, notices);
  const auto at = [&](double x, const char* frame = "map") {
    auto message = io::ros::write_pose_with_covariance(
        {.stamp = 7.0, .frame = frame}, test::at_x(x), io::ros::PoseCovariance::Zero());
    REQUIRE(message);
    auto taken =
        server.take({.input = Input::followed_pose, .arrival = 0, .message = *std::move(message)});
    REQUIRE_MESSAGE(taken, to_string(taken.error()));
    return *std::move(taken);
  };
  CHECK_FALSE(at(5.0, "odom"));
  CHECK(told.back().find("frame 'odom', expected 'map'") != std::string::npos);
  CHECK_FALSE(server.region());

  const auto map = at(5.0);
  REQUIRE(map);
  const auto cloud = io::ros::parse_point_cloud2(*map, io::ros::Encoding::cdr, {});
  REQUIRE(cloud);
  CHECK(cloud->header.frame == "map");
  CHECK(cloud->cloud.points.size() == world.posts_of_map.size());

  CHECK_FALSE(at(9.9));
  CHECK_FALSE(at(10.9));  // not yet a metre outside
  CHECK(at(11.1));
  CHECK(server.region() == RegionId{1});
  CHECK_FALSE(at(9.1));
  CHECK(at(8.9));
  CHECK(at(25.0));
  CHECK_FALSE(at(1000.0));
  CHECK(told.back().find("is in no region") != std::string::npos);
  CHECK(server.region() == RegionId{2});

  CHECK_FALSE(
      server.take({.input = Input::followed_pose, .arrival = 0, .message = std::string(7, '\0')}));
}

TEST_CASE("a map server listens to poses and publishes a map, nothing else") {
  LiveParams params;
  params.topics.followed_pose = "/pcl_pose";
  const auto inputs = input_topics(params.topics);
  REQUIRE(inputs.size() == 2);
  CHECK(inputs[0].topic.name == "/initialpose");
  CHECK(inputs[1].topic.name == "/pcl_pose");
  const auto outputs = output_topics(params);
  REQUIRE(outputs.size() == 1);
  CHECK(outputs[0].topic.name == "/map");
  CHECK(outputs[0].topic.qos.transient_local);
}

}  // namespace
}  // namespace vantage::live
