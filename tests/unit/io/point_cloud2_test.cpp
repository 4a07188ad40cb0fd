#include <doctest/doctest.h>
#include <fmt/format.h>

#include <chrono>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "io/ros/messages.hpp"
#include "ros_messages.hpp"

namespace vantage::io::ros {
namespace {

using test::check_clear;
using test::encoding_of;
using test::kLayouts;
using test::kWhere;
using test::MessageWriter;
using test::raw;
using test::reversed;
using Layout = MessageWriter::Layout;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

enum Datatype : std::uint8_t {
  kInt8 = 1,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kFloat32,
  kFloat64
};

struct Field {
  std::string name;
  std::uint32_t offset = 0;
  std::uint8_t datatype = kFloat32;
  std::uint32_t count = 1;
};

/// A message of two points (1, 2, 3) and (4, 5, 6) in float32, unless something is changed.
struct Cloud {
  std::uint32_t height = 1, width = 2;
  std::vector<Field> fields{{"x", 0}, {"y", 4}, {"z", 8}};
  std::uint8_t is_big_endian = 0;
  std::uint32_t point_step = 12, row_step = 24;
  std::string data = raw(1.0F) + raw(2.0F) + raw(3.0F) + raw(4.0F) + raw(5.0F) + raw(6.0F);
  std::string frame = "velodyne";

  [[nodiscard]] std::string bytes(Layout layout) const {
    MessageWriter writer(layout);
    writer.header(1'700'000'000, 250'000'000, frame).number(height).number(width);
    writer.number(static_cast<std::uint32_t>(fields.size()));
    for (const Field& field : fields) {
      writer.text(field.name).number(field.offset).number(field.datatype).number(field.count);
    }
    writer.number(is_big_endian).number(point_step).number(row_step);
    writer.number(static_cast<std::uint32_t>(data.size())).append(data).number(std::uint8_t{1});
    return writer.bytes();
  }
};

CloudMessage parse(const Cloud& cloud, Layout layout = Layout::cdr_little) {
  const std::string bytes = cloud.bytes(layout);
  auto message = parse_point_cloud2(bytes, encoding_of(layout), kWhere);
  REQUIRE_MESSAGE(message, to_string(message.error()));
  return *std::move(message);
}

void check_refused(const Cloud& cloud, const std::string& expected) {
  for (const Layout layout : kLayouts) {
    const auto message = parse_point_cloud2(cloud.bytes(layout), encoding_of(layout), kWhere);
    REQUIRE_FALSE(message);
    check_clear(message.error(), ErrorCode::corrupt_data, "run.bag", expected);
  }
}

const PointCloud kTwo{{1, 2, 3}, {4, 5, 6}};

TEST_CASE("PointCloud2: points, stamp, frame and fields, in every encoding") {
  // Names and frames of every length put the members after them at every alignment.
  for (const Layout layout : kLayouts) {
    for (std::size_t length = 0; length < 9; ++length) {
      CAPTURE(length);
      Cloud cloud;
      cloud.frame = std::string(length, 'f');
      cloud.fields.push_back({std::string(length, 'n'), 0, kUint8, 3});
      const CloudMessage message = parse(cloud, layout);
      CHECK(message.header.stamp == 1700000000.25);
      CHECK(message.header.frame == cloud.frame);
      CHECK(message.width == 2);
      CHECK(message.height == 1);
      CHECK(message.cloud.points == kTwo);
      CHECK(message.cloud.dropped == 0);
      CHECK(message.cloud.times.values.empty());
      CHECK(message.fields == std::vector<std::string>{"x float32", "y float32", "z float32",
                                                       cloud.fields[3].name + " uint8[3]"});
    }
  }
}

TEST_CASE("PointCloud2: stamps of ROS 1 reach 2106, those of ROS 2 are signed") {
  for (const Layout layout : kLayouts) {
    MessageWriter writer(layout);
    writer.header(0xFFFF'FFFF, 500'000'000, "late");
    const auto header = parse_header(writer.bytes(), encoding_of(writer.layout()), kWhere);
    REQUIRE(header);
    CHECK(header->stamp == (layout == Layout::ros1 ? 4294967295.5 : -0.5));
  }
  CHECK(seconds_from(1'700'000'000'250'000'000) == 1700000000.25);
  CHECK(seconds_from(-250'000'000) == -0.25);
  CHECK(seconds_from(std::numeric_limits<std::int64_t>::min()) == doctest::Approx(-9.223372e9));
}

TEST_CASE("PointCloud2: coordinates of any type, order and byte order, with gaps") {
  Cloud cloud;
  const auto check = [&] {
    for (const Layout layout : kLayouts) CHECK(parse(cloud, layout).cloud.points == kTwo);
  };
  SUBCASE("float64, int16 and uint8, out of order") {
    cloud.fields = {{"z", 2, kFloat64}, {"ring", 12, kUint16}, {"x", 11, kUint8}, {"y", 0, kInt16}};
    cloud.point_step = 20;
    cloud.row_step = 40;
    cloud.data = raw(std::int16_t{2}) + raw(3.0) + "_" + "\1" + std::string(8, '_') +
                 raw(std::int16_t{5}) + raw(6.0) + "_" + "\4" + std::string(8, '_');
    check();
  }
  SUBCASE("int8, int32, uint32") {
    cloud.fields = {{"x", 0, kInt8}, {"y", 1, kInt32}, {"z", 5, kUint32}};
    cloud.point_step = 9;
    cloud.row_step = 18;
    cloud.data = "\1" + raw(std::int32_t{2}) + raw(3U) + "\4" + raw(std::int32_t{5}) + raw(6U);
    check();
  }
  SUBCASE("upper case") {
    cloud.fields = {{"Z", 8}, {"X", 0}, {"Y", 4}};
    check();
  }
  SUBCASE("big endian, whatever the encoding of the message") {
    cloud.is_big_endian = 1;
    cloud.fields = {{"x", 0}, {"y", 4, kUint16}, {"z", 6, kFloat64}};
    cloud.point_step = 14;
    cloud.row_step = 28;
    cloud.data = reversed(1.0F) + reversed(std::uint16_t{2}) + reversed(3.0) + reversed(4.0F) +
                 reversed(std::uint16_t{5}) + reversed(6.0);
    check();
  }
  SUBCASE("a count of 0, as old versions of PCL wrote it") {
    for (Field& field : cloud.fields) field.count = 0;
    check();
  }
  SUBCASE("a row_step of 0 where there is one row only") {
    cloud.row_step = 0;
    check();
  }
  SUBCASE("more bytes than the points need") {
    cloud.data += "padding";
    check();
  }
  SUBCASE("rows of their own, and what lies between them") {
    cloud.height = 2;
    cloud.width = 1;
    cloud.row_step = 17;
    cloud.data.insert(12, "12345");
    check();
    cloud.data += "12345";  // the last row may be filled up, too
    check();
  }
  SUBCASE("rows without anything between them") {
    cloud.height = 2;
    cloud.width = 1;
    cloud.row_step = 12;
    check();
  }
  SUBCASE("a row_step of 0 or of all rows, where the data hold the points and nothing else") {
    cloud.height = 2;
    cloud.width = 1;
    for (const std::uint32_t row_step : {0U, 24U}) {
      cloud.row_step = row_step;
      check();
    }
  }
  SUBCASE("unknown types of fields that are not needed") {
    cloud.fields.insert(cloud.fields.begin(), {"label", 999, 0, 1});
    cloud.fields.push_back({"t", 0, 9, 1});
    check();
    CHECK(parse(cloud).fields == std::vector<std::string>{"label (unknown type 0)", "x float32",
                                                          "y float32", "z float32",
                                                          "t (unknown type 9)"});
  }
}

TEST_CASE("PointCloud2: points that are not finite are dropped and counted, with their times") {
  Cloud cloud;
  cloud.width = 2;
  cloud.height = 2;
  cloud.fields = {{"x", 0}, {"y", 4}, {"z", 8}, {"t", 12, kUint32}};
  cloud.point_step = 16;
  cloud.row_step = 40;
  const auto point = [](float x, float y, float z, std::uint32_t t) {
    return raw(x) + raw(y) + raw(z) + raw(t);
  };
  const std::string gap(8, '\xff');
  cloud.data = point(kNan, 0, 0, 1) + point(1, 2, 3, 2) + gap + point(4, 5, 6, 3) +
               point(0, 0, std::numeric_limits<float>::infinity(), 4) + gap;
  for (const Layout layout : kLayouts) {
    const CloudMessage message = parse(cloud, layout);
    CHECK(message.cloud.points == kTwo);
    CHECK(message.cloud.dropped == 2);
    CHECK(message.cloud.times.values == std::vector<double>{2, 3});
    CHECK(message.cloud.times.field == "t");
    CHECK(message.cloud.times.format.per_second == 1e9);
  }
}

TEST_CASE("PointCloud2: the times of drivers") {
  struct Case {
    std::string name;
    std::uint8_t datatype;
    std::string first, second;
    double per_second;
    bool is_wide;
  };
  const std::vector<Case> cases{
      {"time", kFloat32, raw(0.25F), raw(0.5F), 1.0, false},
      {"t", kUint32, raw(250'000'000U), raw(500'000'000U), 1e9, false},
      {"timestamp", kFloat64, raw(0.25), raw(0.5), 1.0, true},
      {"offset_time", kUint32, raw(250'000'000U), raw(500'000'000U), 1e9, false},
      {"time_stamp", kUint16, raw(std::uint16_t{25}), raw(std::uint16_t{50}), 1e6, false},
  };
  for (const Case& c : cases) {
    CAPTURE(c.name);
    Cloud cloud;
    cloud.fields.push_back({c.name, 12, c.datatype});
    cloud.point_step = 12 + static_cast<std::uint32_t>(c.first.size());
    cloud.row_step = 2 * cloud.point_step;
    cloud.data.insert(12, c.first);
    cloud.data += c.second;
    const PointTimes times = parse(cloud).cloud.times;
    REQUIRE(times.values.size() == 2);
    CHECK(times.values[1] == 2 * times.values[0]);
    CHECK(times.values[0] > 0);
    CHECK(times.format.per_second == c.per_second);
    CHECK(times.format.is_wide == c.is_wide);
  }
  SUBCASE("of two the one that counts from the stamp") {
    Cloud cloud;
    cloud.fields.push_back({"timestamp", 0});
    cloud.fields.push_back({"time", 8});
    const PointTimes times = parse(cloud).cloud.times;
    CHECK(times.field == "time");
    CHECK(times.values == std::vector<double>{3, 6});
  }
}

TEST_CASE("PointCloud2: a cloud without points needs no fields") {
  for (const auto& [height, width] :
       std::vector<std::pair<std::uint32_t, std::uint32_t>>{{0, 0}, {1, 0}, {0, 0xFFFF'FFFF}}) {
    Cloud cloud;
    cloud.height = height;
    cloud.width = width;
    cloud.fields.clear();
    cloud.data.clear();
    for (const Layout layout : kLayouts) CHECK(parse(cloud, layout).cloud.points.empty());
  }
}

TEST_CASE("PointCloud2: what contradicts itself is refused") {
  Cloud cloud;
  const std::uint32_t most = std::numeric_limits<std::uint32_t>::max();
  SUBCASE("no z") {
    cloud.fields.pop_back();
    check_refused(cloud, "no field z or Z among the 2 fields");
  }
  SUBCASE("two y") {
    cloud.fields.push_back({"y", 4});
    check_refused(cloud, "two fields are named y");
  }
  SUBCASE("an unknown type") {
    cloud.fields[0].datatype = 0;
    check_refused(cloud, "field x has the datatype 0");
    cloud.fields[0].datatype = 255;
    check_refused(cloud, "field x has the datatype 255, expected 1 (INT8) to 8 (FLOAT64)");
  }
  SUBCASE("several values") {
    cloud.fields[2].count = 2;
    check_refused(cloud, "field z has 2 values, expected 1");
  }
  SUBCASE("several times") {
    cloud.fields.push_back({"time", 0, kUint32, 2});
    check_refused(cloud, "field time has 2 values, expected 1");
  }
  SUBCASE("fields beyond the point") {
    cloud.point_step = 11;
    check_refused(cloud, "field z ends at byte 12 of a point, but point_step is 11");
    cloud.point_step = 0;
    check_refused(cloud, "point_step is 0");
    cloud.point_step = 12;
    cloud.fields[1].offset = most;
    check_refused(cloud, "field y ends at byte 4294967299");
    cloud.fields[1].offset = 4;
    cloud.fields.push_back({"t", 9, kUint32});
    check_refused(cloud, "field t ends at byte 13");
  }
  SUBCASE("rows shorter than their points") {
    cloud.height = 2;
    cloud.width = 1;
    cloud.row_step = 11;
    check_refused(cloud, "row_step is 11, expected at least width * point_step = 1 * 12 = 12");
  }
  SUBCASE("fewer data than points") {
    cloud.data.pop_back();
    check_refused(cloud, "there are 23 bytes of data");
    cloud.width = most;
    check_refused(cloud, "expected 1 rows of 4294967295 points of 12 bytes");
    cloud.height = most;
    cloud.width = 1;
    cloud.row_step = most;
    check_refused(cloud, "a row every 4294967295 bytes");
    cloud.width = most;
    cloud.point_step = most;
    check_refused(cloud, "row_step is 4294967295");
  }
  SUBCASE("a row_step of 0 or of all rows, where there are more data than points") {
    cloud.height = 2;
    cloud.width = 1;
    cloud.data += "1";
    cloud.row_step = 0;
    check_refused(cloud, "row_step is 0, expected at least width * point_step = 1 * 12 = 12");
    cloud.row_step = 24;
    check_refused(cloud, "there are 25 bytes of data");
  }
  SUBCASE("as many bytes as points that wrap around 2^64") {
    cloud.width = 1U << 31;
    cloud.height = 1U << 31;
    cloud.point_step = 12;  // 2^62 points of 12 bytes: 0 modulo 2^64
    cloud.row_step = 0;
    cloud.data.clear();
    check_refused(cloud, "row_step is 0");
  }
  SUBCASE("rows that wrap around 2^32 or 2^64") {
    cloud.width = 1U << 31;
    cloud.point_step = 1U << 31;
    cloud.height = 4;
    check_refused(cloud, "row_step is 24");
    cloud.height = 1;
    check_refused(cloud, "there are 24 bytes of data");
  }
}

TEST_CASE("PointCloud2: counts and lengths are not believed") {
  for (const Layout layout : kLayouts) {
    const auto refused = [&](const MessageWriter& writer, const std::string& expected) {
      const auto message = parse_point_cloud2(writer.bytes(), encoding_of(writer.layout()), kWhere);
      REQUIRE_FALSE(message);
      check_clear(message.error(), ErrorCode::corrupt_data, "run.bag", expected);
    };
    MessageWriter fields(layout);
    fields.header(1, 2, "f").number(1U).number(1U).number(0xFFFF'FFFFU).append("0123456789abcdef");
    refused(fields, "4294967295 fields, but only 16 bytes follow");

    MessageWriter data(layout);
    data.header(1, 2, "f").number(1U).number(1U).number(0U).number(std::uint8_t{0});
    data.number(12U).number(12U).number(0xFFFF'FFFFU).append("0123456789abcdef");
    refused(data, "4294967295 bytes of data, but only 16 bytes follow");

    MessageWriter frame(layout);
    if (layout == Layout::ros1) frame.number(0U);
    frame.time(1, 2).number(0xFFFF'FFFFU).append("frame");
    refused(frame, "expected 4294967295 bytes of header.frame_id");
  }
}

TEST_CASE("CDR: headers and strings that are none are refused, an empty string without zero not") {
  std::string bytes = Cloud().bytes(Layout::cdr_little);
  const auto refused = [&](const std::string& expected) {
    const auto message = parse_point_cloud2(bytes, Encoding::cdr, kWhere);
    REQUIRE_FALSE(message);
    check_clear(message.error(), ErrorCode::corrupt_data, "run.bag", expected);
  };
  SUBCASE("another encapsulation") {
    bytes[1] = 3;
    refused("the message starts with 0x0003, expected plain CDR");
    bytes[1] = 7;
    refused("0x0007");
    bytes[0] = '\xff';
    refused("0xff07");
  }
  SUBCASE("the options of the encapsulation say nothing about the layout") {
    bytes[3] = 3;
    CHECK(parse_point_cloud2(bytes, Encoding::cdr, kWhere));
  }
  SUBCASE("a string that does not end") {
    const std::size_t end = bytes.find("velodyne") + 8;
    bytes[end] = '!';
    refused(fmt::format("byte {} ends header.frame_id with 0x21, expected a zero", end));
  }
  SUBCASE("a string of length 0") {
    MessageWriter writer(Layout::cdr_little);
    writer.time(5, 0).number(0U);
    const auto header = parse_header(writer.bytes(), Encoding::cdr, kWhere);
    REQUIRE(header);
    CHECK(header->frame.empty());
  }
}

TEST_CASE("PointCloud2: a message cut at any byte is refused, flipped bits do no harm") {
  Cloud cloud;
  cloud.fields.push_back({"time", 8});
  for (const Layout layout : kLayouts) {
    const std::string whole = cloud.bytes(layout);
    for (std::size_t size = 0; size < whole.size(); ++size) {
      CAPTURE(size);
      // A copy of that size, so that a sanitizer sees what is read behind it.
      const std::string part = whole.substr(0, size);
      const auto message = parse_point_cloud2(part, encoding_of(layout), kWhere);
      REQUIRE_FALSE(message);
      check_clear(message.error(), ErrorCode::corrupt_data, "run.bag", "byte");
    }
    std::size_t refused = 0;
    for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
      std::string flipped = whole;
      flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ (1 << bit % 8));
      const auto message = parse_point_cloud2(flipped, encoding_of(layout), kWhere);
      if (!message) {
        ++refused;
        check_clear(message.error(), ErrorCode::corrupt_data, "run.bag", "");
        continue;
      }
      CHECK(message->cloud.points.size() + message->cloud.dropped <= 2);
      CHECK(message->cloud.times.values.size() <= message->cloud.points.size());
    }
    CHECK(refused > whole.size());
  }
}

TEST_CASE("VelodyneScan: packets and their stamps") {
  for (const Layout layout : kLayouts) {
    MessageWriter writer(layout);
    writer.header(100, 5, "velo").number(3U);
    for (std::uint32_t i = 0; i < 3; ++i) {
      // 1206 is no multiple of 4: in CDR two bytes go before the next stamp.
      writer.time(100 + i, 500'000'000).append(std::string(1206, static_cast<char>('a' + i)));
    }
    const auto scan = parse_velodyne_scan(writer.bytes(), encoding_of(writer.layout()), kWhere);
    REQUIRE_MESSAGE(scan, to_string(scan.error()));
    CHECK(scan->header.stamp == 100.000000005);
    CHECK(scan->header.frame == "velo");
    REQUIRE(scan->packets.size() == 3);
    for (std::size_t i = 0; i < 3; ++i) {
      CHECK(scan->packets[i].stamp == 100.5 + static_cast<double>(i));
      CHECK(scan->packets[i].data == std::string(1206, static_cast<char>('a' + i)));
    }
    for (std::size_t size = 0; size < writer.bytes().size(); size += size < 40 ? 1 : 7) {
      const std::string part = writer.bytes().substr(0, size);
      const auto cut = parse_velodyne_scan(part, encoding_of(writer.layout()), kWhere);
      REQUIRE_FALSE(cut);
      check_clear(cut.error(), ErrorCode::corrupt_data, "run.bag", "byte");
    }
    MessageWriter absurd(layout);
    absurd.header(1, 2, "velo").number(0xFFFF'FFFFU).append(std::string(3000, 'x'));
    const auto refused = parse_velodyne_scan(absurd.bytes(), encoding_of(absurd.layout()), kWhere);
    REQUIRE_FALSE(refused);
    check_clear(refused.error(), ErrorCode::corrupt_data, "run.bag",
                "4294967295 packets, but only 3000 bytes follow");
  }
}

TEST_CASE("VelodyneScan: a recorded bag") {
  const auto path = test::real_data("formats/rosbag2/nebula_vlp16");
  if (!path) return;
  // From Python's struct.
  struct Expected {
    std::size_t packets = 0;
    double first = 0.0, last = 0.0;  // [s]
  };
  const std::vector<Expected> expected{
      {151, 1673400471.737763166, 1673400471.837293386},
      {151, 1673400471.837960720, 1673400471.937488794},
      {151, 1673400471.938157320, 1673400472.037683248},
      {150, 1673400472.038354158, 1673400472.137216567},
  };
  auto bag = open_bag(*path);
  REQUIRE_MESSAGE(bag, to_string(bag.error()));
  for (const Expected& scan : expected) {
    const auto message = (*bag)->next();
    REQUIRE(message);
    REQUIRE(*message);
    const auto found = parse_velodyne_scan((*message)->bytes, Encoding::cdr, kWhere);
    REQUIRE_MESSAGE(found, to_string(found.error()));
    CHECK(found->header.frame == "velodyne");
    CHECK(found->header.stamp == scan.first);
    REQUIRE(found->packets.size() == scan.packets);
    CHECK(found->packets.front().stamp == scan.first);
    CHECK(found->packets.back().stamp == doctest::Approx(scan.last).epsilon(1e-15));
    for (const VelodynePacket& packet : found->packets) {
      for (std::size_t block = 0; block < 12; ++block) {
        CHECK(packet.data.substr(100 * block, 2) == "\xff\xee");  // how a block of data begins
      }
    }
  }
}

}  // namespace
}  // namespace vantage::io::ros
