// Makes what the test of recordings reads.
//   mcap_samples messages FOLDER          messages of all types, once for every compression
//   mcap_samples shift FOLDER X Y Z       map.pcd and reference.tum, moved by whole metres
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include "io/ros/message_writers.hpp"
#include "support/mcap.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/trajectory_io.hpp"

namespace fs = std::filesystem;

namespace vantage::test {
namespace {

using namespace io::ros;

/// The messages at 0.1 i s, which check_samples.mjs works out for itself.
Result<void> add_messages(int i, std::vector<McapMessage>& messages) {
  const Header header{.stamp = 0.1 * i, .frame = "map"};
  const auto add = [&](const char* topic, const char* type,
                       Result<std::string> bytes) -> Result<void> {
    VANTAGE_TRY(auto message, std::move(bytes));
    VANTAGE_TRY(auto schema, schema_of(type));
    messages.push_back({topic, std::move(schema), header.stamp, std::move(message)});
    return {};
  };
  PointCloud points;
  std::vector<float> seconds;
  for (int k = 0; k < 10'000 * (i % 3); ++k) {
    points.emplace_back(k, -0.5 * k, i);
    seconds.push_back(0.25F * static_cast<float>(k));
  }
  const std::vector<CloudField> more{{.name = "time", .values = seconds}};
  const Pose pose{.rotation = {0.5, 0.5, -0.5, 0.5}, .translation = {1.0 * i, 2.0, -3.0}};
  const std::vector<PoseMessage> transforms(static_cast<std::size_t>(i % 3),
                                            {.header = header, .child = "lidar", .pose = pose});
  const std::string text(static_cast<std::size_t>(i % 9), 'n');
  const std::vector<Diagnostic> diagnostics{{.level = Diagnostic::Level::warn,
                                             .name = "name",
                                             .message = text,
                                             .values = {{"key", text}, {"other", "value"}}}};
  VANTAGE_CHECK(add("/cloud", "sensor_msgs/PointCloud2", write_point_cloud2(header, points, more)));
  VANTAGE_CHECK(add("/pose", "geometry_msgs/PoseStamped", write_pose_stamped(header, pose)));
  VANTAGE_CHECK(add("/text", "std_msgs/String", write_string(text)));
  VANTAGE_CHECK(add("/tf", "tf2_msgs/TFMessage", write_transforms(transforms)));
  return add("/diagnostics", "diagnostic_msgs/DiagnosticArray",
             write_diagnostics(header, diagnostics));
}

Result<void> write_messages(const fs::path& folder) {
  std::vector<McapMessage> messages;
  for (int i = 0; i < 60; ++i) VANTAGE_CHECK(add_messages(i, messages));
  VANTAGE_CHECK(write_mcap(folder / "none.mcap", messages, McapCompression::none));
  VANTAGE_CHECK(write_mcap(folder / "lz4.mcap", messages, McapCompression::lz4));
  return write_mcap(folder / "zstd.mcap", messages, McapCompression::zstd);
}

Result<void> shift(const fs::path& folder, const Point& by) {
  VANTAGE_TRY(auto map, io::read_point_cloud(folder / "map.pcd"));
  for (Point& p : map.points) p += by;
  VANTAGE_CHECK(io::write_pcd(folder / "map.pcd", map.points, io::Precision::float64));
  VANTAGE_TRY(auto reference, io::read_trajectory(folder / "reference.tum"));
  for (auto& entry : reference) entry.pose.translation += by;
  return io::write_tum(folder / "reference.tum", reference);
}

Result<void> run(const std::vector<std::string>& arguments) {
  if (arguments.size() == 2 && arguments[0] == "messages") return write_messages(arguments[1]);
  if (arguments.size() == 5 && arguments[0] == "shift") {
    return shift(arguments[1],
                 {std::stod(arguments[2]), std::stod(arguments[3]), std::stod(arguments[4])});
  }
  return fail(ErrorCode::invalid_input, "see the first lines of samples.cpp");
}

}  // namespace
}  // namespace vantage::test

int main(int argc, char** argv) {
  const auto done = vantage::test::run({argv + 1, argv + argc});
  if (done) return EXIT_SUCCESS;
  std::cerr << done.error() << '\n';
  return EXIT_FAILURE;
}
