#include "support/bags/cloud_bags.hpp"

namespace vantage::test {
namespace {

constexpr std::uint8_t kUint16 = 4, kFloat32 = 7;

struct Field {
  const char* name;
  std::uint32_t offset;
  std::uint8_t datatype;
};

std::vector<Field> fields_of(PointLayout layout) {
  std::vector<Field> fields{{"x", 0, kFloat32}, {"y", 4, kFloat32}, {"z", 8, kFloat32}};
  if (layout == PointLayout::packed) {
    fields.push_back({"intensity", 12, kFloat32});
  } else {
    fields.push_back({"intensity", 16, kFloat32});
    fields.push_back({"ring", 20, kUint16});
  }
  return fields;
}

std::string points_of(const FloatScan& scan, PointLayout layout) {
  std::string bytes;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    for (const float coordinate : scan.points[i]) bytes += little(coordinate);
    if (layout == PointLayout::padded) bytes += std::string(4, '\xAA');
    bytes += little(0.25F);
    if (layout == PointLayout::padded) {
      bytes += little(static_cast<std::uint16_t>(i % 64)) + std::string(10, '\xAA');
    }
  }
  return bytes;
}

std::vector<TestMessage> messages_of(const std::vector<FloatScan>& scans, bool is_ros1,
                                     PointLayout point) {
  const auto layout = is_ros1 ? MessageWriter::Layout::ros1 : MessageWriter::Layout::cdr_little;
  const std::string type = is_ros1 ? "sensor_msgs/PointCloud2" : "sensor_msgs/msg/PointCloud2";
  std::vector<TestMessage> messages;
  for (const FloatScan& scan : scans) {
    messages.push_back({"/points", type, scan.stamp, point_cloud2(scan, layout, point)});
  }
  return messages;
}

template <const auto& compression>
std::string write_rosbag1(const std::vector<FloatScan>& scans, PointLayout layout) {
  return rosbag1(messages_of(scans, true, layout), {.compression = compression});
}
std::string write_rosbag2(const std::vector<FloatScan>& scans, PointLayout layout) {
  return rosbag2(messages_of(scans, false, layout));
}
template <const auto& compression>
std::string write_mcap(const std::vector<FloatScan>& scans, PointLayout layout) {
  return mcap(messages_of(scans, false, layout), {.compression = compression});
}

constexpr char kNothing[] = "", kNone[] = "none", kBz2[] = "bz2", kLz4[] = "lz4", kZstd[] = "zstd";

}  // namespace

std::string point_cloud2(const FloatScan& scan, MessageWriter::Layout message, PointLayout point) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  MessageWriter writer(message);
  writer.header(static_cast<std::uint32_t>(scan.stamp / kSecond),
                static_cast<std::uint32_t>(scan.stamp % kSecond), "velodyne");
  const auto points = static_cast<std::uint32_t>(scan.points.size());
  writer.number(std::uint32_t{1}).number(points);
  const std::vector<Field> fields = fields_of(point);
  writer.number(static_cast<std::uint32_t>(fields.size()));
  for (const Field& field : fields) {
    writer.text(field.name).number(field.offset).number(field.datatype).number(std::uint32_t{1});
  }
  const std::uint32_t step = point == PointLayout::packed ? 16 : 32;
  writer.number(std::uint8_t{0}).number(step).number(step * points).number(step * points);
  writer.append(points_of(scan, point)).number(std::uint8_t{1});
  return writer.bytes();
}

std::vector<CloudBag> cloud_bags() {
  return {{"rosbag1", "rosbag1 2.0 (none)", write_rosbag1<kNone>},
          {"rosbag1_bz2", "rosbag1 2.0 (bz2)", write_rosbag1<kBz2>},
          {"rosbag1_lz4", "rosbag1 2.0 (lz4)", write_rosbag1<kLz4>},
          {"rosbag2", "rosbag2 (SQLite)", write_rosbag2},
          {"mcap", "MCAP (none)", write_mcap<kNothing>},
          {"mcap_lz4", "MCAP (lz4)", write_mcap<kLz4>},
          {"mcap_zstd", "MCAP (zstd)", write_mcap<kZstd>}};
}

}  // namespace vantage::test
