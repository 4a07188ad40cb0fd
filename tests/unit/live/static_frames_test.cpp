#include "live/static_frames.hpp"

#include <doctest/doctest.h>

#include <string>

namespace vantage::live {
namespace {

io::ros::PoseMessage transform(const char* parent, const char* child, double x) {
  io::ros::PoseMessage message{
      .header = {.stamp = 0.0, .frame = parent}, .child = child, .pose = {}};
  message.pose.translation.x() = x;
  return message;
}

TEST_CASE("frames are found over several transforms, in either direction") {
  StaticFrames frames;
  REQUIRE(frames.add(transform("/base_link", "mast", 1.0)));
  REQUIRE(frames.add(transform("mast", "/lidar", 2.0)));
  REQUIRE(frames.add(transform("base_link", "imu", 10.0)));
  CHECK(frames.pose("base_link", "lidar").value()->translation.x() == 3.0);
  CHECK(frames.pose("lidar", "imu").value()->translation.x() == 7.0);
  CHECK(frames.pose("lidar", "/lidar").value()->translation.x() == 0.0);
  CHECK_FALSE(frames.pose("lidar", "camera").value());

  REQUIRE(frames.add(transform("mast", "lidar", 5.0)));  // latched again
  CHECK(frames.pose("base_link", "lidar").value()->translation.x() == 6.0);
}

TEST_CASE("a static frame that has a parent in /tf, too, is named") {
  StaticFrames frames;
  REQUIRE(frames.add(transform("base_link", "mast", 1.0)));
  REQUIRE(frames.add(transform("mast", "lidar", 2.0)));
  constexpr std::int64_t kSecond = 1'000'000'000;
  frames.add_moving(transform("odom", "base_link", 0.0), kSecond);
  CHECK_FALSE(frames.second_parent("base_link", "lidar", kSecond));
  frames.add_moving(transform("/arm", "/mast", 0.0), kSecond);
  CHECK(frames.second_parent("base_link", "lidar", 2 * kSecond) ==
        "the frame 'mast' has the parent 'base_link' in /tf_static, and 'arm' in /tf");
  CHECK_FALSE(frames.second_parent("base_link", "camera", 2 * kSecond));

  // A node that ended publishes no longer; one that is there does.
  CHECK(frames.second_parent("base_link", "lidar", 11 * kSecond));
  CHECK_FALSE(frames.second_parent("base_link", "lidar", 11 * kSecond + 1));
  frames.add_moving(transform("arm", "mast", 0.0), 12 * kSecond);
  CHECK(frames.second_parent("base_link", "lidar", 12 * kSecond));
}

TEST_CASE("frames that moved once make room for those that move now") {
  StaticFrames frames;
  REQUIRE(frames.add(transform("base_link", "lidar", 1.0)));
  for (int i = 0; i < 10'000; ++i) {
    frames.add_moving(transform("map", ("person_" + std::to_string(i)).c_str(), 0.0), 0);
  }
  constexpr std::int64_t kLater = 11'000'000'000;
  frames.add_moving(transform("arm", "lidar", 0.0), 1);
  CHECK_FALSE(frames.second_parent("base_link", "lidar", 1));
  frames.add_moving(transform("arm", "lidar", 0.0), kLater);
  CHECK(frames.second_parent("base_link", "lidar", kLater));
}

TEST_CASE("a frame with two parents and an invalid transform are errors") {
  StaticFrames frames;
  REQUIRE(frames.add(transform("a", "c", 1.0)));
  REQUIRE(frames.add(transform("b", "c", 1.0)));
  CHECK_FALSE(frames.pose("a", "d/x").value_or(std::nullopt));
  auto broken = transform("a", "e", 1.0);
  broken.problem = "its rotation is not of unit length";
  CHECK_FALSE(frames.add(broken));
}

}  // namespace
}  // namespace vantage::live
