// The messages of each driver, written byte by byte, and when their points were measured.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/ros/bag_scans.hpp"
#include "io/ros/messages.hpp"
#include "ros_messages.hpp"
#include "support/bags/livox_messages.hpp"

namespace vantage::io::ros {
namespace {

using test::check_clear;
using test::encoding_of;
using test::kLayouts;
using test::kWhere;
using test::MemoryBag;
using test::MessageWriter;
using test::raw;
using Layout = MessageWriter::Layout;
using Seconds = std::vector<float>;

constexpr std::uint8_t kUint8 = 2, kUint16 = 4, kUint32 = 6, kFloat32 = 7, kFloat64 = 8;
constexpr std::uint32_t kStamp = 1'700'000'000;  // [s]

/// The layout of a driver's points, and the points.
struct DriverCloud {
  struct Field {
    std::string name;
    std::uint32_t offset = 0;
    std::uint8_t datatype = 0;
  };
  std::vector<Field> fields;
  std::uint32_t step = 0;
  std::vector<std::string> points;
  std::uint32_t seconds = kStamp, nanoseconds = 250'000'000;  // the header's stamp
  std::uint32_t height = 1;

  [[nodiscard]] std::string bytes(Layout layout = Layout::cdr_little) const {
    MessageWriter writer(layout);
    const auto width = static_cast<std::uint32_t>(points.size()) / height;
    writer.header(seconds, nanoseconds, "lidar").number(height).number(width);
    writer.number(static_cast<std::uint32_t>(fields.size()));
    for (const Field& field : fields) {
      writer.text(field.name).number(field.offset).number(field.datatype).number(1U);
    }
    std::string data;
    for (const std::string& point : points) {
      REQUIRE(point.size() == step);
      data += point;
    }
    writer.number(std::uint8_t{0}).number(step).number(width * step);
    writer.number(static_cast<std::uint32_t>(data.size())).append(data).number(std::uint8_t{1});
    return writer.bytes();
  }
};

std::string zeros(std::size_t count) { return std::string(count, '\0'); }
std::string xyz(float x) { return raw(x) + raw(2.0F) + raw(3.0F); }
std::string byte(std::uint8_t value) { return raw(value); }

Result<StampedScan> read_message(const std::string& type, Encoding encoding,
                                 const std::string& bytes, ScanOptions options = {}) {
  std::vector<Topic> topics{{"/lidar", type, encoding, "", 1}};
  auto scans = bag_scans(
      std::make_unique<MemoryBag>(topics, std::vector<MemoryBag::Message>{{0, 42, bytes}}),
      options);
  if (!scans) return fail(scans.error());
  VANTAGE_TRY(auto scan, (*scans)->next());
  REQUIRE(scan.has_value());
  return *std::move(scan);
}

StampedScan scan_of(const DriverCloud& cloud, const ScanOptions& options = {}) {
  auto scan = read_message("sensor_msgs/PointCloud2", Encoding::cdr, cloud.bytes(), options);
  REQUIRE_MESSAGE(scan, to_string(scan.error()));
  CHECK(scan->stamp == cloud.seconds + 1e-9 * cloud.nanoseconds);
  return *std::move(scan);
}

void check_seconds(const StampedScan& scan, const Seconds& expected, float tolerance = 1e-6F) {
  REQUIRE(scan.seconds.size() == expected.size());
  REQUIRE(scan.points.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    CAPTURE(i);
    CHECK(std::abs(scan.seconds[i] - expected[i]) <= tolerance);
  }
}

StampedScan stamped(const DriverCloud& cloud, StampedPoint point) {
  return scan_of(cloud, {.path = {}, .topic = {}, .stamped = point});
}

TEST_CASE("layouts: Ouster counts nanoseconds from the first measurement, and has no-returns") {
  DriverCloud cloud{.fields = {{"x", 0, kFloat32},
                               {"y", 4, kFloat32},
                               {"z", 8, kFloat32},
                               {"intensity", 16, kFloat32},
                               {"t", 20, kUint32},
                               {"reflectivity", 24, kUint16},
                               {"ring", 26, kUint16},
                               {"ambient", 28, kUint16},
                               {"range", 32, kUint32}},
                    .step = 48,
                    .points = {},
                    .height = 2};
  const auto add = [&](const std::string& place, std::uint32_t t) {
    cloud.points.push_back(place + zeros(4) + raw(17.0F) + raw(t) + zeros(24));
  };
  add(xyz(1), 0);
  add(zeros(12), 25'000'000);
  add(xyz(2), 50'000'000);
  add(xyz(3), 100'000'000);
  const StampedScan scan = scan_of(cloud);
  check_seconds(scan, {0.0F, 0.05F, 0.1F});
  CHECK(scan.no_returns == 1);
  CHECK(scan.dropped == 0);
  CHECK(scan.points == PointCloud{{1, 2, 3}, {2, 2, 3}, {3, 2, 3}});
}

TEST_CASE("layouts: Hesai has seconds since the epoch, as has Robosense in wider points") {
  const auto hesai = [](const std::vector<double>& times) {
    DriverCloud cloud{.fields = {{"x", 0, kFloat32},
                                 {"y", 4, kFloat32},
                                 {"z", 8, kFloat32},
                                 {"intensity", 12, kFloat32},
                                 {"ring", 16, kUint16},
                                 {"timestamp", 18, kFloat64}},
                      .step = 26,
                      .points = {}};
    for (const double time : times) {
      cloud.points.push_back(xyz(1) + raw(0.5F) + raw(std::uint16_t{3}) + raw(time));
    }
    return cloud;
  };
  const auto robosense = [](const std::vector<double>& times) {
    DriverCloud cloud{.fields = {{"x", 0, kFloat32},
                                 {"y", 4, kFloat32},
                                 {"z", 8, kFloat32},
                                 {"intensity", 12, kFloat32},
                                 {"ring", 16, kUint16},
                                 {"timestamp", 24, kFloat64}},
                      .step = 32,
                      .points = {}};
    for (const double time : times) {
      cloud.points.push_back(xyz(1) + raw(0.5F) + raw(std::uint16_t{3}) + zeros(6) + raw(time));
    }
    return cloud;
  };
  const double stamp = kStamp + 0.25;
  SUBCASE("the stamp is that of the first point") {
    check_seconds(scan_of(hesai({stamp, stamp + 0.05, stamp + 0.1})), {0.0F, 0.05F, 0.1F});
  }
  SUBCASE("or that of the last") {
    check_seconds(scan_of(robosense({stamp - 0.1, stamp - 0.05, stamp})), {-0.1F, -0.05F, 0.0F});
  }
  SUBCASE("of a clock of its own, only the user knows which point that is") {
    for (const DriverCloud& cloud :
         {hesai({7200.0, 7200.05, 7200.1}), robosense({7200.0, 7200.05, 7200.1})}) {
      check_seconds(scan_of(cloud), {0.0F, 0.05F, 0.1F});
      check_seconds(stamped(cloud, StampedPoint::first), {0.0F, 0.05F, 0.1F});
      check_seconds(stamped(cloud, StampedPoint::middle), {-0.05F, 0.0F, 0.05F});
      check_seconds(stamped(cloud, StampedPoint::last), {-0.1F, -0.05F, 0.0F});
    }
  }
  SUBCASE("points without a return need not have a time") {
    DriverCloud cloud = robosense({stamp, stamp + 0.1});
    cloud.points.push_back(zeros(32));
    const float nan = std::numeric_limits<float>::quiet_NaN();
    cloud.points.push_back(raw(nan) + raw(nan) + raw(nan) + zeros(20));
    const StampedScan scan = scan_of(cloud);
    check_seconds(scan, {0.0F, 0.1F});
    CHECK(scan.no_returns == 1);
    CHECK(scan.dropped == 1);
  }
}

TEST_CASE("layouts: Velodyne counts seconds from the stamp, which may be that of the last packet") {
  const auto velodyne = [](const std::vector<float>& times) {
    DriverCloud cloud{.fields = {{"x", 0, kFloat32},
                                 {"y", 4, kFloat32},
                                 {"z", 8, kFloat32},
                                 {"intensity", 12, kFloat32},
                                 {"ring", 16, kUint16},
                                 {"time", 18, kFloat32}},
                      .step = 22,
                      .points = {}};
    for (const float time : times) {
      cloud.points.push_back(xyz(1) + raw(9.0F) + raw(std::uint16_t{3}) + raw(time));
    }
    return cloud;
  };
  check_seconds(scan_of(velodyne({-0.1F, -0.05F, 0.0F})), {-0.1F, -0.05F, 0.0F});
  check_seconds(scan_of(velodyne({0.0F, 0.05F, 0.1F})), {0.0F, 0.05F, 0.1F});
  // A driver may count from the first point and stamp with the last one.
  check_seconds(stamped(velodyne({0.0F, 0.05F, 0.1F}), StampedPoint::last), {-0.1F, -0.05F, 0.0F});
}

TEST_CASE("layouts: Autoware's PointXYZIRCAEDT counts nanoseconds from the start of the scan") {
  DriverCloud cloud{.fields = {{"x", 0, kFloat32},
                               {"y", 4, kFloat32},
                               {"z", 8, kFloat32},
                               {"intensity", 12, kUint8},
                               {"return_type", 13, kUint8},
                               {"channel", 14, kUint16},
                               {"azimuth", 16, kFloat32},
                               {"elevation", 20, kFloat32},
                               {"distance", 24, kFloat32},
                               {"time_stamp", 28, kUint32}},
                    .step = 32,
                    .points = {}};
  for (const std::uint32_t time : {0U, 50'000'000U, 100'000'000U}) {
    cloud.points.push_back(xyz(1) + byte(9) + byte(1) + raw(std::uint16_t{5}) + raw(0.5F) +
                           raw(0.1F) + raw(3.7F) + raw(time));
  }
  check_seconds(scan_of(cloud), {0.0F, 0.05F, 0.1F});
}

DriverCloud livox_cloud(const std::vector<double>& nanoseconds) {
  DriverCloud cloud{.fields = {{"x", 0, kFloat32},
                               {"y", 4, kFloat32},
                               {"z", 8, kFloat32},
                               {"intensity", 12, kFloat32},
                               {"tag", 16, kUint8},
                               {"line", 17, kUint8},
                               {"timestamp", 18, kFloat64}},
                    .step = 26,
                    .points = {}};
  for (const double time : nanoseconds) {
    cloud.points.push_back(xyz(1) + raw(30.0F) + byte(0x10) + byte(2) + raw(time));
  }
  return cloud;
}

TEST_CASE("layouts: Livox' PointCloud2 has nanoseconds of any clock") {
  SUBCASE("since the epoch, in steps of 256 ns") {
    const double stamp = (kStamp + 0.25) * 1e9;
    check_seconds(scan_of(livox_cloud({stamp, stamp + 5e7, stamp + 1e8})), {0.0F, 0.05F, 0.1F});
  }
  SUBCASE("since the sensor was switched on") {
    for (const double hours : {0.0, 0.5, 2.0, 27.0, 30.0}) {
      const double uptime = std::floor(hours * 3600.0);
      DriverCloud cloud = livox_cloud({uptime * 1e9, uptime * 1e9 + 5e7, uptime * 1e9 + 1e8});
      CAPTURE(hours);
      // The header has the computer's time, or that of the sensor.
      check_seconds(scan_of(cloud), {0.0F, 0.05F, 0.1F});
      cloud.nanoseconds = 1;  // the stamp 0 would mean that there is none
      cloud.seconds = static_cast<std::uint32_t>(uptime);
      check_seconds(scan_of(cloud), {0.0F, 0.05F, 0.1F});
      // Packets that came in the wrong order.
      std::swap(cloud.points[0], cloud.points[1]);
      check_seconds(scan_of(cloud), {0.05F, 0.0F, 0.1F});
    }
  }
  SUBCASE("whose packet is stamped after the header") {
    DriverCloud cloud = livox_cloud({7200.2e9, 7200.25e9, 7200.3e9});
    cloud.seconds = 7200;
    check_seconds(scan_of(cloud), {-0.05F, 0.0F, 0.05F});
  }
  SUBCASE("all of one packet") {
    check_seconds(scan_of(livox_cloud({7.2e12, 7.2e12})), {0.0F, 0.0F});
    check_seconds(scan_of(livox_cloud({7.2e12, 7.2e12 + 256})), {0.0F, 0.0F});
  }
  SUBCASE("older drivers send none") {
    DriverCloud cloud = livox_cloud({1.0, 2.0});
    cloud.fields.pop_back();
    cloud.step = 18;
    for (std::string& point : cloud.points) point.resize(18);
    cloud.points.push_back(zeros(18));
    const StampedScan scan = scan_of(cloud);
    CHECK(scan.points.size() == 2);
    CHECK(scan.no_returns == 1);
    CHECK(scan.seconds.empty());
  }
}

using test::LivoxPoint;

std::string custom_message(const std::vector<LivoxPoint>& points, Layout layout) {
  return test::livox_message({.seconds = 7200, .points = points}, layout);
}

TEST_CASE("layouts: Livox' CustomMsg counts nanoseconds from the stamp") {
  const std::vector<LivoxPoint> points{
      {0, 1.0F}, {50'000'000, 2.0F}, {99'999'744, 0.0F}, {100'000'000, -4.0F}};
  for (const std::string type : {"livox_ros_driver/CustomMsg", "livox_ros_driver2/CustomMsg",
                                 "livox_interfaces/CustomMsg"}) {
    for (const Layout layout : kLayouts) {
      CAPTURE(type);
      const auto scan = read_message(type, encoding_of(layout), custom_message(points, layout));
      REQUIRE_MESSAGE(scan, to_string(scan.error()));
      CHECK(scan->stamp == 7200.5);
      CHECK(scan->points == PointCloud{{1, 2, 3}, {2, 4, 6}, {-4, -8, -12}});
      CHECK(scan->no_returns == 1);
      check_seconds(*scan, {0.0F, 0.05F, 0.1F});
    }
  }
  const std::string bytes = custom_message(points, Layout::ros1);
  const auto message = parse_livox(bytes, Encoding::ros1, kWhere);
  REQUIRE(message);
  CHECK(message->header.frame == "livox_frame");
  CHECK(message->fields.front() == "offset_time uint32");
  CHECK(message->width == 4);
  // The ROS 1 message has 19 bytes a point and no padding.
  CHECK(bytes.size() == 4 + 8 + 4 + 11 + 8 + 4 + 4 + 4 + 4 * 19);
  CHECK(custom_message(points, Layout::cdr_little).size() % 20 ==
        (4 + 8 + 4 + 12 + 8 + 4 + 4 + 4 + 3 * 20 + 19) % 20);
}

TEST_CASE("layouts: packets of Livox that come in the wrong order are before the stamp") {
  const std::vector<LivoxPoint> points{
      {0, 1.0F}, {static_cast<std::uint32_t>(-480'000), 2.0F}, {100'000'000, 3.0F}};
  for (const Layout layout : kLayouts) {
    const auto scan = read_message("livox_ros_driver2/CustomMsg", encoding_of(layout),
                                   custom_message(points, layout));
    REQUIRE_MESSAGE(scan, to_string(scan.error()));
    check_seconds(*scan, {0.0F, -0.00048F, 0.1F});
  }
}

TEST_CASE("layouts: a CustomMsg that is cut off or holds no point") {
  for (const Layout layout : kLayouts) {
    const std::string bytes = custom_message({{0, 1.0F}, {1, 2.0F}, {2, 3.0F}}, layout);
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      const std::string cut = bytes.substr(0, size);
      const auto message = parse_livox(cut, encoding_of(layout), kWhere);
      REQUIRE_FALSE(message);
      check_clear(message.error(), ErrorCode::corrupt_data, "run.bag", "byte");
    }
    const std::string none = custom_message({}, layout);
    const auto message = parse_livox(none, encoding_of(layout), kWhere);
    REQUIRE(message);
    CHECK(message->cloud.points.empty());
  }
}

TEST_CASE("layouts: points that a Livox tags as noise are kept unless the user says otherwise") {
  // The two lowest pairs of bits tell noise; the third is the return, or a further kind of noise.
  const std::vector<LivoxPoint> points{{0, 1.0F, 0x00}, {1, 2.0F, 0x10}, {2, 3.0F, 0x02},
                                       {3, 4.0F, 0x04}, {4, 5.0F, 0x30}, {5, 0.0F, 0x02}};
  const ScanOptions normal{.path = {}, .topic = {}, .tags = Tags::normal};
  const std::string type = "livox_ros_driver2/CustomMsg";
  const std::string bytes = custom_message(points, Layout::ros1);
  const auto all = read_message(type, Encoding::ros1, bytes);
  REQUIRE(all);
  CHECK(all->points.size() == 5);
  CHECK(all->noise == 0);
  const auto some = read_message(type, Encoding::ros1, bytes, normal);
  REQUIRE(some);
  CHECK(some->points == PointCloud{{1, 2, 3}, {2, 4, 6}, {5, 10, 15}});
  CHECK(some->no_returns == 1);
  CHECK(some->noise == 2);
  check_seconds(*some, {0.0F, 1e-9F, 4e-9F}, 1e-12F);

  DriverCloud cloud = livox_cloud({7.2e12, 7.2e12, 7.2e12});
  cloud.points[1][16] = 0x21;
  CHECK(scan_of(cloud).points.size() == 3);
  CHECK(scan_of(cloud, normal).points.size() == 2);
  CHECK(scan_of(cloud, normal).noise == 1);
  SUBCASE("which is an error where points have no tags") {
    cloud.fields[4].name = "ring";
    const auto scan = read_message("sensor_msgs/PointCloud2", Encoding::cdr, cloud.bytes(), normal);
    REQUIRE_FALSE(scan);
    check_clear(scan.error(), ErrorCode::invalid_input, "run.bag",
                "the points of /lidar have no field tag of uint8");
  }
}

}  // namespace
}  // namespace vantage::io::ros
