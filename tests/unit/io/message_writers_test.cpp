// The expected bytes were laid out with Python's struct, member by member.
#include "io/ros/message_writers.hpp"

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "files.hpp"

namespace vantage {
namespace {

using namespace io::ros;

std::string hex(const Result<std::string>& message) {
  REQUIRE_MESSAGE(message, to_string(message.error()));
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const char c : *message) {
    const auto byte = static_cast<unsigned char>(c);
    text += kDigits[byte >> 4U];
    text += kDigits[byte & 15U];
  }
  return text;
}

const Pose kPose{.rotation = {0.5, 0.5, -0.5, 0.5}, .translation = {1.0, 2.0, -3.0}};

TEST_CASE("message writers: std_msgs/String") {
  CHECK(hex(write_string("A_1")) == "0001000004000000415f3100");
  CHECK(hex(write_string("")) == "000100000100000000");
}

TEST_CASE("message writers: geometry_msgs/PoseStamped, the quaternion as x, y, z, w") {
  CHECK(hex(write_pose_stamped({.stamp = 1.5, .frame = "map"}, kPose)) ==
        "00010000010000000065cd1d040000006d617000000000000000f03f0000000000000040000000000000"
        "08c0000000000000e03f000000000000e0bf000000000000e03f000000000000e03f");
}

TEST_CASE("message writers: PoseWithCovarianceStamped, the covariance row by row") {
  PoseCovariance covariance = PoseCovariance::Zero();
  covariance(0, 1) = 1.0;
  covariance(5, 5) = 2.0;
  const std::string pose = hex(write_pose_stamped({.stamp = 1.5, .frame = "map"}, kPose));
  const std::string zero(16, '0');
  std::string expected = pose + zero + "000000000000f03f";
  for (int k = 0; k < 33; ++k) expected += zero;
  CHECK(hex(write_pose_with_covariance({.stamp = 1.5, .frame = "map"}, kPose, covariance)) ==
        expected + "0000000000000040");
}

TEST_CASE("message writers: tf2_msgs/TFMessage, also an empty one") {
  const std::vector<PoseMessage> transforms{
      {.header = {.stamp = 1.5, .frame = "map"}, .child = "lidar", .pose = kPose, .problem = {}}};
  CHECK(hex(write_transforms(transforms)) ==
        "0001000001000000010000000065cd1d040000006d617000060000006c69646172000000000000000000"
        "f03f000000000000004000000000000008c0000000000000e03f000000000000e0bf000000000000e03f"
        "000000000000e03f");
  CHECK(hex(write_transforms({})) == "0001000000000000");
}

TEST_CASE("message writers: sensor_msgs/PointCloud2 with a field more") {
  const PointCloud points{{1, 2, 3}, {-1, -2, -3}};
  const std::vector<float> seconds{0.25F, 0.5F};
  const std::vector<CloudField> more{{.name = "time", .values = seconds}};
  CHECK(hex(write_point_cloud2({.stamp = 1.5, .frame = "lidar"}, points, more)) ==
        "00010000010000000065cd1d060000006c69646172000000010000000200000004000000020000007800"
        "00000000000007000000010000000200000079000000040000000700000001000000020000007a000000"
        "0800000007000000010000000500000074696d65000000000c0000000700000001000000000000001000"
        "000020000000200000000000803f00000040000040400000803e000080bf000000c0000040c00000003f"
        "01");
}

TEST_CASE("message writers: a coordinate beyond float32 is NaN in a cloud that is not dense") {
  const auto plain = write_point_cloud2({.stamp = 0.0, .frame = ""}, PointCloud{{1, 2, 3}});
  const auto huge = write_point_cloud2({.stamp = 0.0, .frame = ""}, PointCloud{{1, -1e300, 3}});
  REQUIRE(plain);
  REQUIRE(huge);
  REQUIRE(huge->size() == plain->size());
  CHECK(plain->back() == 1);
  CHECK(huge->back() == 0);
  float y = 0.0F;
  std::memcpy(&y, huge->data() + huge->size() - 9, sizeof y);
  CHECK(std::isnan(y));
}

TEST_CASE("message writers: coordinates are float64 where float32 would move them") {
  const PointCloud near{{1.0 / 3.0, -32767.999, 100.1}}, utm{{10.0, 0.0, 0.0}, {1, 5300000.2, 3}};
  CHECK(coordinates_for(PointsView{}) == Coordinates::float32);
  CHECK(coordinates_for(near) == Coordinates::float32);
  CHECK(coordinates_for(PointCloud{{-32768.001, 0, 0}}) == Coordinates::float32);  // by 0.9999 mm
  CHECK(coordinates_for(PointCloud{{0, -32768.0015, 0}}) == Coordinates::float64);
  CHECK(coordinates_for(PointCloud{{0, 0, 5300000.5}}) == Coordinates::float32);  // not at all
  CHECK(coordinates_for(PointCloud{{1e300, 0, 0}}) == Coordinates::float32);
  CHECK(coordinates_for(utm) == Coordinates::float64);

  const std::vector<float> seconds{0.25F, 0.5F};
  const std::vector<CloudField> more{{.name = "time", .values = seconds}};
  const auto message =
      write_point_cloud2({.stamp = 1.5, .frame = "map"}, utm, more, Coordinates::float64);
  REQUIRE(message);
  const auto read = parse_point_cloud2(*message, Encoding::cdr, {});
  REQUIRE_MESSAGE(read, to_string(read.error()));
  CHECK(read->cloud.points == utm);
  CHECK(read->fields ==
        std::vector<std::string>{"x float64", "y float64", "z float64", "time float32"});
}

TEST_CASE("message writers: diagnostic_msgs/DiagnosticArray") {
  const std::vector<Diagnostic> diagnostics{
      {.level = Diagnostic::Level::error, .name = "n", .message = "lost", .values = {{"k", "vv"}}}};
  CHECK(hex(write_diagnostics({.stamp = 1.5, .frame = ""}, diagnostics)) ==
        "00010000010000000065cd1d01000000000000000100000002000000020000006e000000050000006c6f"
        "737400000000010000000000000001000000020000006b00000003000000767600");
}

TEST_CASE("message writers: stamps that are no time, fields of another length") {
  const Header never{.stamp = std::nan(""), .frame = "map"};
  const auto refused = [](const Result<std::string>& message, const std::string& expected) {
    REQUIRE_FALSE(message);
    CHECK(message.error().code == ErrorCode::invalid_input);
    CHECK(message.error().message.find(expected) != std::string::npos);
  };
  const std::vector<PoseMessage> transforms{
      {.header = never, .child = "lidar", .pose = kPose, .problem = {}}};
  refused(write_pose_stamped(never, kPose), "is no ROS time");
  refused(write_transforms(transforms), "is no ROS time");
  refused(write_point_cloud2(never, {}), "is no ROS time");
  refused(write_diagnostics(never, {}), "is no ROS time");
  const std::vector<float> seconds{0.25F};
  const std::vector<CloudField> more{{.name = "time", .values = seconds}};
  refused(write_point_cloud2({}, PointCloud{{1, 2, 3}, {4, 5, 6}}, more),
          "field 'time' has 1 values for 2 points");
}

}  // namespace
}  // namespace vantage
