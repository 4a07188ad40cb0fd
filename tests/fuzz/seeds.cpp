#include "seeds.hpp"

#include <cstdint>
#include <fstream>
#include <iterator>
#include <span>
#include <stdexcept>

#include "io/autoware_tiles.hpp"
#include "io/ros/message_writers.hpp"
#include "place_index.hpp"
#include "support/bags/bags.hpp"
#include "support/bags/imu_messages.hpp"
#include "support/bags/livox_messages.hpp"
#include "support/bags/nav_sat_fix.hpp"
#include "support/captures/velodyne_captures.hpp"
#include "support/real_data.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/trajectory_io.hpp"

namespace vantage::test::seeds {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;  // [ns]

PointCloud cloud() { return {{1.0, -2.0, 0.5}, {3.25, 4.0, -1.0}, {100.0, 0.0, 2.0}}; }

std::vector<std::uint32_t> views() { return {1, 7, 12}; }

Pose pose() {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ())), {1.0, 2.0, 3.0}};
}

/// What a writer of files writes.
template <class Write>
std::string written(const std::string& name, const Write& write) {
  const TemporaryFolder folder;
  const auto path = folder.path() / name;
  if (const auto done = write(path); !done) throw std::runtime_error(to_string(done.error()));
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

io::ros::Header header(double stamp) { return {.stamp = stamp, .frame = "velodyne"}; }

std::string cdr_cloud(double stamp) {
  const std::vector<float> times{0.0F, 0.01F, 0.02F};
  const std::vector<io::ros::CloudField> fields{{"time", times}};
  return io::ros::write_point_cloud2(header(stamp), cloud(), fields).value();
}

/// sensor_msgs/PointCloud2 as ROS 1 lays it out: x, y, z and a ring.
std::string ros1_cloud(std::uint32_t stamp) {
  std::string bytes = little(std::uint32_t{1}) + little(stamp) + little(std::uint32_t{0}) +
                      sized("velodyne") + little(std::uint32_t{1}) + little(std::uint32_t{3}) +
                      little(std::uint32_t{4});
  std::uint32_t offset = 0;
  for (const char* name : {"x", "y", "z"}) {
    constexpr std::uint8_t kFloat32 = 7;
    bytes += sized(name) + little(offset) + little(kFloat32) + little(std::uint32_t{1});
    offset += 4;
  }
  constexpr std::uint8_t kUint16 = 4;
  bytes += sized("ring") + little(offset) + little(kUint16) + little(std::uint32_t{1});
  std::string points;
  for (const Point& point : cloud()) {
    for (const double value : point) points += little(static_cast<float>(value));
    points += little(std::uint32_t{5});
  }
  constexpr std::uint32_t kStep = 16;
  return bytes + std::string(1, '\0') + little(kStep) + little(3 * kStep) + sized(points) +
         std::string(1, '\1');
}

std::string fix_message(bool ros1, std::uint32_t stamp) {
  using Layout = MessageWriter::Layout;
  return test::nav_sat_fix({.seconds = stamp}, ros1 ? Layout::ros1 : Layout::cdr_little);
}

std::string imu_message(bool ros1, std::uint32_t stamp) {
  using Layout = MessageWriter::Layout;
  return test::imu_message({.seconds = stamp}, ros1 ? Layout::ros1 : Layout::cdr_little);
}

std::string livox_message(bool ros1, std::uint32_t stamp) {
  using Layout = MessageWriter::Layout;
  const std::vector<LivoxPoint> points{{}, {.offset = 50'000'000, .x = 2.0F, .tag = 2}, {}};
  return test::livox_message({.seconds = stamp, .points = points},
                             ros1 ? Layout::ros1 : Layout::cdr_little);
}

std::vector<TestMessage> messages(bool ros1) {
  std::vector<TestMessage> all;
  for (std::uint32_t i = 0; i < 5; ++i) {
    all.push_back({"/points", ros1 ? "sensor_msgs/PointCloud2" : "sensor_msgs/msg/PointCloud2",
                   kSecond * (i + 1), ros1 ? ros1_cloud(i + 1) : cdr_cloud(i + 1.0)});
    all.push_back({"/fix", ros1 ? "sensor_msgs/NavSatFix" : "sensor_msgs/msg/NavSatFix",
                   kSecond * (i + 1), fix_message(ros1, i + 1)});
    all.push_back({"/imu", ros1 ? "sensor_msgs/Imu" : "sensor_msgs/msg/Imu", kSecond * (i + 1),
                   imu_message(ros1, i + 1)});
    all.push_back({"/livox",
                   ros1 ? "livox_ros_driver2/CustomMsg" : "livox_ros_driver2/msg/CustomMsg",
                   kSecond * (i + 1), livox_message(ros1, i + 1)});
    if (ros1) continue;
    all.push_back({"/pose", "geometry_msgs/msg/PoseStamped", kSecond * (i + 1),
                   io::ros::write_pose_stamped(header(i + 1.0), pose()).value()});
  }
  return all;
}

/// A sensor that turns so fast that whole revolutions are in a few packets: small captures are
/// read hundreds of times as often as those of real sensors.
std::vector<CapturedFrame> fast_turns(std::uint8_t product, std::uint8_t mode) {
  constexpr std::size_t kPackets = 5;
  constexpr std::uint32_t kPair = 6000, kStep = 20;  // columns come in pairs [1/100 deg]
  constexpr std::uint32_t kPacketTime = 1327;        // [us]
  std::vector<CapturedFrame> frames;
  std::uint32_t columns = 0;
  for (std::uint32_t i = 0; i < kPackets; ++i) {
    VelodynePacket packet{.product = product, .mode = mode, .timestamp = i * kPacketTime};
    for (std::size_t block = 0; block < packet.azimuths.size(); ++block) {
      packet.azimuths[block] =
          static_cast<std::uint16_t>((columns / 2 * kPair + columns % 2 * kStep) % 36'000);
      if (mode != 0x39 || block % 2 == 1) ++columns;
    }
    frames.push_back(
        {.stamp = 3600.0 + i * kPacketTime * 1e-6, .bytes = ethernet(ipv4(udp(to_bytes(packet))))});
  }
  return frames;
}

}  // namespace

std::vector<std::string> pcd() {
  const std::vector<float> seconds{0.0F, 0.1F, 0.2F};
  const auto as_pcd = [](const auto&... options) {
    return written("a.pcd",
                   [&](const auto& path) { return io::write_pcd(path, cloud(), options...); });
  };
  return {as_pcd(io::Precision::float32, views()), as_pcd(io::Precision::float64),
          as_pcd(std::span<const float>(seconds)),
          "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z t\nSIZE 4 4 4 8\nTYPE F F F F\nCOUNT 1 1 1 1\n"
          "WIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n"
          "1 2 3 0.0\nnan 5 6 0.05\n"};
}

std::vector<std::string> ply() {
  const auto as_ply = [](const auto&... options) {
    return written("a.ply",
                   [&](const auto& path) { return io::write_ply(path, cloud(), options...); });
  };
  return {as_ply(io::Precision::float32, views()), as_ply(io::Precision::float64),
          "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 2\nproperty float x\n"
          "property float y\nproperty float z\nelement face 1\n"
          "property list uchar int vertex_indices\nend_header\n1 2 3\n4 5 6\n2 0 1\n"};
}

std::vector<std::string> las() {
  return {written("a.las", [](const auto& path) { return io::write_las(path, cloud(), views()); }),
          written("a.las", [](const auto& path) { return io::write_las(path, cloud()); })};
}

std::vector<std::string> rosbag1() {
  std::vector<std::string> bags;
  for (const char* compression : {"none", "bz2", "lz4"}) {
    for (const bool indexed : {true, false}) {
      bags.push_back(
          test::rosbag1(messages(true),
                        {.compression = compression, .indexed = indexed, .messages_in_chunk = 2}));
    }
  }
  return bags;
}

std::vector<std::string> rosbag2() {
  return {test::rosbag2(messages(false)),
          test::rosbag2(messages(false),
                        {.zstd = true, .timestamp_index = false, .serialization = "cdr"})};
}

std::vector<std::string> mcap() {
  std::vector<std::string> bags;
  for (const char* compression : {"", "lz4", "zstd"}) {
    for (const bool indexed : {true, false}) {
      bags.push_back(test::mcap(messages(false), {.compression = compression,
                                                  .chunked = true,
                                                  .indexed = indexed,
                                                  .encoding = "cdr",
                                                  .messages_in_chunk = 4}));
    }
  }
  return bags;
}

std::vector<std::string> point_cloud2() {
  return {std::string(1, '\0') + ros1_cloud(1), std::string(1, '\1') + cdr_cloud(1.0)};
}

std::vector<std::string> poses() {
  const auto stamped = io::ros::write_pose_stamped(header(1.0), pose()).value();
  const std::vector<io::ros::PoseMessage> transforms{
      {.header = header(1.0), .child = "lidar", .pose = pose(), .problem = {}},
      {.header = header(2.0), .child = "imu", .pose = pose(), .problem = {}}};
  const std::string covariance(36 * sizeof(double), '\0');
  return {std::string("\1\1", 2) + stamped,
          std::string("\1\2", 2) + stamped + std::string(4, '\0') + covariance,
          std::string("\1\4", 2) + io::ros::write_transforms(transforms).value()};
}

std::vector<std::string> nav_sat_fix() {
  return {std::string(1, '\0') + fix_message(true, 1),
          std::string(1, '\1') + fix_message(false, 1)};
}

std::vector<std::string> livox() {
  return {std::string(1, '\0') + livox_message(true, 1),
          std::string(1, '\1') + livox_message(false, 1)};
}

std::vector<std::string> imu() {
  return {std::string(1, '\0') + imu_message(true, 1),
          std::string(1, '\1') + imu_message(false, 1)};
}

std::vector<std::string> imu_csv() {
  return {"t,wx,wy,wz,ax,ay,az\n1.5,0.1,0.2,0.3,0,0,9.8\n1.51,0,nan,0,0,0,9.8\n",
          "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
          "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n"
          "1403636579758555392,-0.099,0.147,0.0279,8.1476,-0.375,-2.404\n"};
}

std::vector<std::string> velodyne() {
  std::vector<std::string> captures;
  constexpr std::uint8_t kVlp16 = 0x22, kHdl32 = 0x21, kStrongest = 0x37, kDual = 0x39;
  for (const auto& [product, mode] :
       {std::pair{kVlp16, kStrongest}, std::pair{kVlp16, kDual}, std::pair{kHdl32, kStrongest}}) {
    // A whole revolution and what it takes to begin and end it.
    const std::size_t packets = mode == kDual ? 320 : 200;
    const auto frames = captured(VelodyneSensor(product, mode, 35'000.0, 1000.0), packets);
    captures.push_back(mode == kDual ? pcapng(frames) : pcap(frames));
    captures.push_back(pcap(fast_turns(product, mode)));
    captures.push_back(pcapng(fast_turns(product, mode)));
  }
  return captures;
}

std::vector<std::string> trajectory() {
  const io::Trajectory poses{{0.1, pose()}, {0.2, pose()}};
  return {written("a.txt", [&](const auto& path) { return io::write_tum(path, poses); }),
          written("a.txt", [&](const auto& path) { return io::write_kitti(path, poses); }),
          "# frame and matrix\n0 1 0 0 1 0 1 0 2 0 0 1 3\n"};
}

std::vector<std::string> tiles() {
  return {io::to_yaml({.x_resolution = 20.0,
                       .y_resolution = 20.0,
                       .tiles = {{"a_0_0.pcd", 0, 0}, {"a_-20_40.pcd", -20, 40}}}),
          "x_resolution: 10\ny_resolution: 10\n\"b.pcd\":\n  - 10\n  - 20\n"};
}

std::vector<std::string> map_projector() {
  const std::string origin =
      "vertical_datum: WGS84\nmap_origin:\n  latitude: 35.6762\n  longitude: 139.6503\n";
  return {"projector_type: MGRS\nvertical_datum: WGS84\nmgrs_grid: 54SUE\n",
          "projector_type: LocalCartesianUTM\n" + origin,
          "projector_type: TransverseMercator\nscale_factor: 0.9996\n" + origin,
          "projector_type: LocalCartesian\n" + origin};
}

std::vector<std::string> places() {
  std::vector<std::string> indexes;
  for (const PointCloud& map : {cloud(), PointCloud{{0.0, 0.0, 0.0}, {400.0, 300.0, 30.0}}}) {
    const std::vector<std::byte> bytes = voxel_search::PlaceIndex::of(map).value().encode();
    indexes.emplace_back(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }
  return indexes;
}

}  // namespace vantage::test::seeds
