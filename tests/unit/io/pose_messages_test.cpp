#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "io/ros/messages.hpp"
#include "ros_messages.hpp"

namespace vantage::io::ros {
namespace {

using namespace test;
using Numbers = std::array<double, 7>;

// A turn about z whose sine and cosine are exact enough: (0, 0, 0.6, 0.8).
constexpr Numbers kNumbers{1.5, -2.5, 3.25, 0.0, 0.0, 0.6, 0.8};

MessageWriter& transform(MessageWriter& writer, std::uint32_t seconds, const std::string& parent,
                         const std::string& child, const Numbers& numbers) {
  return writer.header(seconds, 500'000'000, parent).text(child).numbers(numbers);
}

/// One message of each type that holds one pose or, of transforms, two.
std::string message_of(const std::string& type, MessageWriter::Layout layout,
                       const Numbers& numbers) {
  MessageWriter writer(layout);
  const std::array<double, 36> covariance{};
  const std::array<double, 6> twist{};
  if (type == "tf2_msgs/TFMessage" || type == "tf/tfMessage") {
    writer.number(std::uint32_t{2});
    transform(writer, 100, "map", "odom", numbers);
    transform(writer, 101, "odom", "base", numbers);
  } else if (type == "geometry_msgs/TransformStamped") {
    transform(writer, 100, "map", "odom", numbers);
  } else if (type == "nav_msgs/Odometry") {
    transform(writer, 100, "map", "odom", numbers).numbers(covariance);
    writer.numbers(twist).numbers(covariance);
  } else {
    writer.header(100, 500'000'000, "map").numbers(numbers);
    if (type == "geometry_msgs/PoseWithCovarianceStamped") writer.numbers(covariance);
  }
  return writer.bytes();
}

TEST_CASE("poses of every message and encoding") {
  for (const std::string type : kPoseTypes) {
    for (const auto layout : kLayouts) {
      CAPTURE(type);
      CHECK(has_poses(type));
      const bool is_array = type.starts_with("tf");
      const bool has_child = type.find("Pose") == std::string::npos;
      const auto poses =
          parse_poses(message_of(type, layout, kNumbers), type, encoding_of(layout), kWhere);
      REQUIRE_MESSAGE(poses, to_string(poses.error()));
      REQUIRE(poses->size() == (is_array ? 2 : 1));
      CHECK(poses->front().header.stamp == 100.5);
      CHECK(poses->front().header.frame == "map");
      CHECK(poses->front().child == (has_child ? "odom" : ""));
      CHECK(poses->back().header.stamp == (is_array ? 101.5 : 100.5));
      CHECK(poses->back().child == (is_array ? "base" : has_child ? "odom" : ""));
      for (const PoseMessage& pose : *poses) {
        CHECK(pose.pose.translation == Eigen::Vector3d(1.5, -2.5, 3.25));
        CHECK(pose.pose.rotation.x() == 0.0);
        CHECK(pose.pose.rotation.z() == 0.6);
        CHECK(pose.pose.rotation.w() == 0.8);
        CHECK(pose.problem.empty());
      }
    }
  }
  CHECK_FALSE(has_poses("sensor_msgs/PointCloud2"));
  const auto other = parse_poses("", "sensor_msgs/Imu", Encoding::ros1, kWhere);
  REQUIRE_FALSE(other);
  check_clear(other.error(), ErrorCode::invalid_input, "run.bag", "'sensor_msgs/Imu'");
}

TEST_CASE("a quaternion close to unit length is normalized") {
  Numbers numbers = kNumbers;
  for (std::size_t i = 3; i < 7; ++i) numbers[i] *= 1.0009;
  const auto layout = MessageWriter::Layout::cdr_little;
  const std::string type = "geometry_msgs/PoseStamped";
  const auto poses = parse_poses(message_of(type, layout, numbers), type, Encoding::cdr, kWhere);
  REQUIRE(poses);
  CHECK(poses->front().pose.rotation.norm() == doctest::Approx(1.0).epsilon(1e-12));
  CHECK(poses->front().pose.rotation.z() == doctest::Approx(0.6).epsilon(1e-12));
}

TEST_CASE("numbers and rotations that are none are refused") {
  for (const std::string type : kPoseTypes) {
    for (const auto layout : kLayouts) {
      CAPTURE(type);
      const auto refused = [&](const Numbers& numbers, const std::string& expected) {
        const auto poses =
            parse_poses(message_of(type, layout, numbers), type, encoding_of(layout), kWhere);
        if (type.starts_with("tf")) {  // says what is wrong with each
          REQUIRE(poses);
          for (const PoseMessage& pose : *poses) {
            CHECK(pose.problem.find(expected) != std::string::npos);
            CHECK(pose.pose.translation == Eigen::Vector3d::Zero());
          }
          return;
        }
        REQUIRE_FALSE(poses);
        check_clear(poses.error(), ErrorCode::corrupt_data, "run.bag", expected);
      };
      for (std::size_t i = 0; i < 7; ++i) {
        for (const double wrong : {std::nan(""), std::numeric_limits<double>::infinity()}) {
          Numbers numbers = kNumbers;
          numbers[i] = wrong;
          refused(numbers, "number " + std::to_string(i + 1) + " of 7");
        }
      }
      Numbers numbers = kNumbers;
      numbers[6] = 0.81;
      refused(numbers, "has length 1.008");
      refused({1, 2, 3, 0, 0, 0, 0}, "has length 0, expected 1 to within 0.001");
      refused({1, 2, 3, 1e300, 0, 0, 0}, "has length inf");
    }
  }
}

TEST_CASE("messages with poses: cut at any byte refused, flipped bits do no harm") {
  for (const std::string type : kPoseTypes) {
    for (const auto layout : kLayouts) {
      CAPTURE(type);
      const std::string whole = message_of(type, layout, kNumbers);
      for (std::size_t size = 0; size < whole.size(); ++size) {
        const std::string part = whole.substr(0, size);
        const auto poses = parse_poses(part, type, encoding_of(layout), kWhere);
        REQUIRE_FALSE(poses);
        check_clear(poses.error(), ErrorCode::corrupt_data, "run.bag", "byte");
      }
      for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
        std::string flipped = whole;
        flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ (1 << bit % 8));
        const auto poses = parse_poses(flipped, type, encoding_of(layout), kWhere);
        if (!poses) {
          check_clear(poses.error(), ErrorCode::corrupt_data, "run.bag", "");
          continue;
        }
        CHECK(poses->size() <= 2);
        for (const PoseMessage& pose : *poses) CHECK(is_valid(pose.pose));
      }
    }
  }
}

TEST_CASE("the number of transforms is not believed") {
  for (const auto layout : kLayouts) {
    MessageWriter writer(layout);
    writer.number(std::uint32_t{0xFFFF'FFFF});
    transform(writer, 1, "map", "odom", kNumbers);
    const auto poses =
        parse_poses(writer.bytes(), "tf2_msgs/TFMessage", encoding_of(writer.layout()), kWhere);
    REQUIRE_FALSE(poses);
    check_clear(poses.error(), ErrorCode::corrupt_data, "run.bag", "4294967295 transforms, but");
    const auto none = parse_poses(MessageWriter(layout).number(std::uint32_t{0}).bytes(),
                                  "tf2_msgs/TFMessage", encoding_of(writer.layout()), kWhere);
    REQUIRE(none);
    CHECK(none->empty());
  }
}

}  // namespace
}  // namespace vantage::io::ros
