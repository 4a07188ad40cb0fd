// Velodyne packets and revolutions. Expected numbers of recorded files come from reading them with
// Python's struct module; a cloud that another decoder (Nebula) made is the reference of positions.

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <map>
#include <numbers>
#include <vector>

#include "files.hpp"
#include "io/ros/message_reader.hpp"
#include "io/ros/messages.hpp"
#include "io/velodyne/packet_scans.hpp"
#include "io/velodyne/spins.hpp"
#include "support/captures/velodyne_captures.hpp"
#include "vantage/io/scan_source.hpp"

namespace vantage {
namespace {

using io::velodyne::Packet;
using io::velodyne::Spin;
using io::velodyne::SpinAssembler;
using test::check_clear;
using test::VelodynePacket;
using test::VelodyneSensor;

constexpr double kDegree = std::numbers::pi / 180.0;

double elevation(const Point& p) { return std::atan2(p.z(), std::hypot(p.x(), p.y())) / kDegree; }
/// Clockwise from x [deg].
double azimuth(const Point& p) {
  const double angle = std::atan2(-p.y(), p.x()) / kDegree;
  return angle < 0.0 ? angle + 360.0 : angle;
}

/// All revolutions, complete or not.
std::vector<Spin> spins_of(const std::vector<std::pair<double, VelodynePacket>>& packets,
                           double from = -std::numeric_limits<double>::infinity()) {
  SpinAssembler assembler("file", from);
  std::vector<Spin> spins;
  const auto take = [&] {
    while (auto spin = assembler.take()) spins.push_back(*std::move(spin));
  };
  for (const auto& [stamp, packet] : packets) {
    const std::string bytes = to_bytes(packet);
    const auto added = assembler.add({.stamp = stamp, .data = bytes, .offset = spins.size()});
    REQUIRE_MESSAGE(added, to_string(added.error()));
    take();
  }
  assembler.finish();
  take();
  return spins;
}

std::vector<std::pair<double, VelodynePacket>> sent(VelodyneSensor& sensor, std::size_t packets,
                                                    double clock_offset = 0.0) {
  std::vector<std::pair<double, VelodynePacket>> all;
  for (std::size_t i = 0; i < packets; ++i) {
    const double stamp = sensor.seconds() + clock_offset;
    all.emplace_back(stamp, sensor.next());
  }
  return all;
}

std::vector<bool> complete(const std::vector<Spin>& spins) {
  std::vector<bool> flags;
  for (const Spin& spin : spins) flags.push_back(spin.complete);
  return flags;
}

void check_refused(const std::string& bytes, ErrorCode code, const std::string& expected) {
  SpinAssembler assembler("file.pcap");
  const auto added = assembler.add({.stamp = 1.0, .data = bytes, .offset = 4711});
  REQUIRE_FALSE(added.has_value());
  check_clear(added.error(), code, "file.pcap", expected);
  CHECK(added.error().message.find("byte 4711") != std::string::npos);
}

TEST_CASE("Velodyne: one packet of a VLP-16, every channel by hand") {
  VelodynePacket packet;
  packet.azimuths.fill(9000);
  packet.azimuths[0] = 8960;
  for (std::size_t i = 1; i < 12; ++i) {
    packet.azimuths[i] = static_cast<std::uint16_t>(8960 + 40 * i);
  }
  // A return from channel k of block k % 12 alone, k + 1 m away.
  packet.distance = [](std::size_t block, std::size_t channel) {
    return static_cast<std::uint16_t>(channel % 12 == block ? 500 * (channel + 1) : 0);
  };
  const auto spins = spins_of({{3600.0, packet}});
  REQUIRE(spins.size() == 1);
  const Spin& spin = spins.front();
  CHECK_FALSE(spin.complete);
  CHECK(spin.stamp == 3600.0);
  REQUIRE(spin.points.size() == 32);
  const std::array<double, 16> angles{-15, 1, -13, 3, -11, 5, -9, 7, -7, 9, -5, 11, -3, 13, -1, 15};
  std::vector<bool> seen(32);
  for (std::size_t i = 0; i < 32; ++i) {
    const auto k = static_cast<std::size_t>(std::lround(spin.points[i].norm())) - 1;
    CAPTURE(k);
    REQUIRE(k < 32);
    seen[k] = true;
    CHECK(spin.points[i].norm() == doctest::Approx(static_cast<double>(k + 1)).epsilon(1e-7));
    CHECK(elevation(spin.points[i]) == doctest::Approx(angles[k % 16]).epsilon(1e-7));
    CHECK(spin.rings[i] == (angles[k % 16] + 15) / 2);
    const double delay = static_cast<double>(k / 16) * 55.296 + static_cast<double>(k % 16) * 2.304;
    CHECK(azimuth(spin.points[i]) ==
          doctest::Approx(89.6 + 0.4 * (static_cast<double>(k % 12) + delay / 110.592))
              .epsilon(1e-7));
    CHECK(spin.seconds[i] ==
          doctest::Approx((static_cast<double>(k % 12) * 110.592 + delay) * 1e-6).epsilon(1e-5));
  }
  CHECK(std::count(seen.begin(), seen.end(), true) == 32);
}

TEST_CASE("Velodyne: one packet of an HDL-32E: angles, times and the timestamp's place") {
  VelodynePacket packet;
  packet.product = 0x21;
  packet.timestamp = 1'000'000;
  for (std::size_t i = 0; i < 12; ++i) {
    packet.azimuths[i] = static_cast<std::uint16_t>(18'000 + 16 * i);
  }
  const auto spins = spins_of({{3601.0, packet}});
  REQUIRE(spins.size() == 1);
  const Spin& spin = spins.front();
  REQUIRE(spin.points.size() == 12 * 32);
  CHECK(spin.stamp == doctest::Approx(3601.0 - 542.592e-6).epsilon(1e-12));
  CHECK(spin.seconds.back() == doctest::Approx(542.592e-6));  // when the timestamp was written
  std::vector<double> angles;
  for (std::size_t k = 0; k < 32; ++k) {
    const double degrees = elevation(spin.points[k]);
    const double step = k % 2 == 0 ? -92.0 / 3 + 2.0 / 3 * static_cast<double>(k)
                                   : -28.0 / 3 + 2.0 / 3 * static_cast<double>(k - 1);
    CHECK(std::abs(degrees - step) < 0.0071);  // the manual rounds to 1/100 deg
    CHECK(spin.points[k].norm() == doctest::Approx(1.0));
    CHECK(spin.rings[k] == (k % 2 == 0 ? k / 2 : 16 + k / 2));
    angles.push_back(degrees);
    CHECK(azimuth(spin.points[k + 32 * 11]) ==
          doctest::Approx(180.0 + 0.16 * (11.0 + 1.152 * static_cast<double>(k) / 46.08)));
  }
  CHECK(angles[0] == doctest::Approx(-30.67));
  CHECK(angles[15] == doctest::Approx(0.0));
  CHECK(angles[31] == doctest::Approx(10.67));
}

TEST_CASE("Velodyne: forward is x, left is y") {
  VelodynePacket packet;
  packet.azimuths.fill(0);
  CHECK(spins_of({{0.0, packet}})[0].points[0].isApprox(
      Point(std::cos(15 * kDegree), 0, -std::sin(15 * kDegree))));
  packet.azimuths.fill(9000);  // clockwise: to the right
  CHECK(spins_of({{0.0, packet}})[0].points[0].isApprox(
      Point(0, -std::cos(15 * kDegree), -std::sin(15 * kDegree))));
}

TEST_CASE("Velodyne: of two returns that are equal one is kept, of a missing one the other") {
  VelodynePacket packet;
  packet.mode = 0x39;
  for (std::size_t i = 0; i < 12; ++i) {
    packet.azimuths[i] = static_cast<std::uint16_t>(100 + i / 2 * 40);
  }
  packet.distance = [](std::size_t block, std::size_t channel) {
    const bool second = block % 2 == 1;
    switch (channel) {
      case 0: return std::uint16_t{1000};  // equal
      case 1: return static_cast<std::uint16_t>(second ? 500 : 1500);
      case 2: return static_cast<std::uint16_t>(second ? 2000 : 0);
      case 3: return static_cast<std::uint16_t>(second ? 0 : 2500);
      default: return std::uint16_t{0};
    }
  };
  const auto spins = spins_of({{10.0, packet}});
  REQUIRE(spins.size() == 1);
  REQUIRE(spins[0].points.size() == 6 * 5);
  const double ranges[] = {2, 3, 1, 4, 5};
  for (std::size_t i = 0; i < spins[0].points.size(); ++i) {
    CHECK(spins[0].points[i].norm() == doctest::Approx(ranges[i % 5]));
  }
  // Six columns of 110.592 us, interpolated over both blocks.
  CHECK(spins[0].seconds[29] == doctest::Approx((5 * 110.592 + 3 * 2.304) * 1e-6));
  CHECK(azimuth(spins[0].points[29]) ==
        doctest::Approx(1.0 + 0.4 * (5 + 3 * 2.304 / 110.592)).epsilon(1e-7));
}

TEST_CASE("Velodyne: revolutions are cut at azimuth 0, also inside a packet") {
  for (const auto product : {std::uint8_t{0x21}, std::uint8_t{0x22}}) {
    for (const auto mode : {std::uint8_t{0x37}, std::uint8_t{0x38}, std::uint8_t{0x39}}) {
      CAPTURE(int{product});
      CAPTURE(int{mode});
      VelodyneSensor sensor(product, mode, 30'000.0, 7200.5);
      // 0.34 s at 10 Hz from 300 deg on: the rest of a turn, three whole ones, and a bit.
      const std::size_t dual = mode == 0x39 ? 2 : 1;
      const double packet_time = (product == 0x21 ? 552.96e-6 : 1327.104e-6);
      const auto count = static_cast<std::size_t>(0.34 / packet_time) * dual;
      const auto spins = spins_of(sent(sensor, count));
      CHECK(complete(spins) == std::vector<bool>{false, true, true, true, false});
      for (std::size_t i = 1; i < spins.size(); ++i) {
        CHECK(std::abs(spins[i].stamp - (7200.5 + 1.0 / 60.0 + 0.1 * static_cast<double>(i - 1))) <
              1.5e-4);
        CHECK(azimuth(spins[i].points.front()) < 0.5);
        if (i < 4) CHECK(std::abs(std::remainder(azimuth(spins[i].points.back()), 360.0)) < 0.6);
        CHECK(spins[i].seconds.front() >= 0.0F);
        CHECK(spins[i].seconds.back() < 0.1002F);
        if (i < 4) CHECK(spins[i].seconds.back() > 0.0995F);
        CHECK(std::is_sorted(spins[i].seconds.begin(), spins[i].seconds.end()));
        CHECK(spins[i].points.size() == spins[i].seconds.size());
        CHECK(spins[i].points.size() == spins[i].rings.size());
      }
    }
  }
}

TEST_CASE("Velodyne: lost packets are missing points, not missing revolutions") {
  VelodyneSensor sensor(0x22, 0x37, 35'000.0, 100.0);
  auto packets = sent(sensor, 100);
  SUBCASE("a few") { sensor.skip(5); }
  SUBCASE("more than half a turn, over azimuth 0") { sensor.skip(60); }
  const auto more = sent(sensor, 200);
  packets.insert(packets.end(), more.begin(), more.end());
  const auto spins = spins_of(packets);
  CHECK(complete(spins).front() == false);
  CHECK(complete(spins).back() == false);
  REQUIRE(spins.size() >= 5);
  for (std::size_t i = 1; i + 1 < spins.size(); ++i) {
    CHECK(spins[i].complete);
    CHECK(spins[i + 1].stamp - spins[i].stamp == doctest::Approx(0.1).epsilon(0.7));
  }
}

TEST_CASE("Velodyne: more than a revolution missing ends one and begins another, both incomplete") {
  VelodyneSensor sensor(0x22, 0x37, 0.0, 100.0);
  auto packets = sent(sensor, 100);  // 1.33 turns
  sensor.skip(215);
  const auto more = sent(sensor, 120);  // from 4.2 to 5.8 turns
  packets.insert(packets.end(), more.begin(), more.end());
  CHECK(complete(spins_of(packets)) == std::vector<bool>{false, false, false, false});
}

TEST_CASE("Velodyne: a packet that comes late does not cut twice") {
  VelodyneSensor sensor(0x22, 0x37, 30'000.0, 100.0);
  auto packets = sent(sensor, 180);
  const auto straight = spins_of(packets);
  // Those around the first passage of azimuth 0 (12.6 packets on).
  for (std::size_t i = 10; i < 15; ++i) {
    CAPTURE(i);
    auto swapped = packets;
    std::swap(swapped[i].second, swapped[i + 1].second);
    const auto spins = spins_of(swapped);
    CHECK(complete(spins) == complete(straight));
    std::size_t points = 0, expected = 0;
    for (const Spin& spin : spins) points += spin.points.size();
    for (const Spin& spin : straight) expected += spin.points.size();
    CHECK(points == expected);
  }
}

TEST_CASE("Velodyne: a sensor that stands still or turns backwards ends in bounded revolutions") {
  std::vector<std::pair<double, VelodynePacket>> packets;
  VelodynePacket packet;
  bool still = false;
  SUBCASE("still") { still = true; }
  SUBCASE("backwards") { still = false; }
  for (std::size_t i = 0; i < 4000; ++i) {
    packet.timestamp += 1327;
    for (std::size_t k = 0; k < 12; ++k) {
      packet.azimuths[k] =
          still ? std::uint16_t{100}
                : static_cast<std::uint16_t>((36'000 * 10'000 - 40 * (12 * i + k)) % 36'000);
    }
    packets.emplace_back(1e9 + static_cast<double>(i) * 1.327e-3, packet);
  }
  const auto spins = spins_of(packets);
  CHECK(spins.size() > 2);
  for (const Spin& spin : spins) {
    CHECK_FALSE(spin.complete);
    CHECK(spin.points.size() <= 16'384 * 32);
  }
}

TEST_CASE("Velodyne: the clock") {
  const auto stamps = [](double start, double clock_offset) {
    VelodyneSensor sensor(0x22, 0x37, 35'900.0, start);
    std::vector<double> all;
    for (const Spin& spin : spins_of(sent(sensor, 300, clock_offset))) all.push_back(spin.stamp);
    return all;
  };
  const double hours = 400'000 * 3600.0;
  SUBCASE("synchronised: the hour of the receipt, whichever side of it") {
    for (const double offset : {-30.0, -0.2, 0.0, 0.002, 45.0}) {
      for (const double past : {0.1, 1800.0, 3599.9}) {
        CAPTURE(offset);
        CAPTURE(past);
        const auto all = stamps(hours + past, offset);
        REQUIRE(all.size() == 5);
        CHECK(std::abs(all[0] - (hours + past)) < 2e-6);
        // Over the hour too: the clock does not fall back.
        CHECK(std::abs(all[4] - (hours + past + 0.1 / 360.0 + 0.3)) < 1.5e-4);
      }
    }
  }
  SUBCASE("not synchronised: the receipt of the first packet and the sensor's clock from there") {
    for (const double offset : {-1000.0, 61.0, 1700.0}) {
      const auto all = stamps(hours + 3599.9, offset);
      REQUIRE(all.size() == 5);
      CHECK(std::abs(all[0] - (hours + 3599.9 + offset)) < 2e-6);
      CHECK(std::abs(all[4] - (hours + 3599.9 + offset + 0.1 / 360.0 + 0.3)) < 1.5e-4);
    }
  }
  SUBCASE("a pause of hours, and clocks that part") {
    VelodyneSensor sensor(0x22, 0x37, 35'900.0, hours + 100.0);
    auto packets = sent(sensor, 100);
    sensor.skip(10'000'000);  // 3.7 h
    const double after = sensor.seconds();
    auto more = sent(sensor, 100);
    packets.insert(packets.end(), more.begin(), more.end());
    auto spins = spins_of(packets);
    CHECK(std::abs(spins.back().stamp - after) < 0.14);
    // The sensor's clock is set back by 100 s: the receipt tells the time.
    for (auto& [stamp, packet] : more) packet.timestamp -= 100'000'000;
    std::copy(more.begin(), more.end(), packets.begin() + 100);
    spins = spins_of(packets);
    CHECK(std::abs(spins.back().stamp - after) < 0.14);
  }
  SUBCASE("absurd receipts and timestamps") {
    std::vector<std::pair<double, VelodynePacket>> packets;
    VelodynePacket packet;
    for (int i = 0; i < 20'000; ++i) {
      packet.timestamp = 0xFFFFFFFFU - static_cast<std::uint32_t>(i) * 1'000'003U;
      packets.emplace_back((i % 3 == 0 ? 1e300 : 1e18) * (i % 2 == 0 ? -1.0 : 1.0) + i * 3e9,
                           packet);
    }
    for (const Spin& spin : spins_of(packets)) CHECK(std::isfinite(spin.stamp));
    for (std::size_t i = 0; i < packets.size(); ++i) {
      packets[i].first = static_cast<double>(i) * 3e9;  // centuries, each of them sound
      packets[i].second.timestamp = 0;
    }
    for (const Spin& spin : spins_of(packets)) CHECK(std::isfinite(spin.stamp));
  }
}

TEST_CASE("Velodyne: what is stamped before the beginning is not decoded") {
  VelodyneSensor sensor(0x22, 0x37, 35'900.0, 100.0);
  const auto packets = sent(sensor, 400);
  const auto all = spins_of(packets);
  REQUIRE(all.size() == 7);
  const auto some = spins_of(packets, all[3].stamp);
  REQUIRE(some.size() == 4);
  for (std::size_t i = 0; i < some.size(); ++i) {
    CHECK(some[i].stamp == all[i + 3].stamp);
    CHECK(some[i].points == all[i + 3].points);
    CHECK(some[i].complete == all[i + 3].complete);
  }
}

TEST_CASE("Velodyne: packets that cannot be read are refused with the reason") {
  const std::string good = to_bytes(VelodynePacket{});
  const auto with = [&](std::size_t at, std::uint8_t byte) {
    std::string bytes = good;
    bytes[at] = static_cast<char>(byte);
    return bytes;
  };
  check_refused(good.substr(1), ErrorCode::corrupt_data, "has 1205 bytes, expected 1206");
  check_refused("", ErrorCode::corrupt_data, "has 0 bytes, expected 1206");
  check_refused(with(1205, 0x28), ErrorCode::unsupported, "a VLP-32C (product 0x28)");
  check_refused(with(1205, 0x24), ErrorCode::unsupported, "a Puck Hi-Res");
  check_refused(with(1205, 0xA1), ErrorCode::unsupported, "a VLS-128");
  check_refused(with(1205, 0x99), ErrorCode::unsupported, "an unknown product 0x99");
  // Two banks of lasers; its last byte may be anything.
  for (const auto last : {std::uint8_t{0x00}, std::uint8_t{0x22}, std::uint8_t{0x24}}) {
    std::string banks = with(1205, last);
    banks[101] = static_cast<char>(0xDD);
    check_refused(banks, ErrorCode::unsupported, "an HDL-64E");
    banks[201] = static_cast<char>(0xCC);
    check_refused(banks, ErrorCode::unsupported, "a VLS-128");
  }
  check_refused(with(1204, 0x3A), ErrorCode::unsupported, "return mode 0x3A");
  check_refused(with(300, 0xFE), ErrorCode::corrupt_data, "block 3 of the packet");
  check_refused(with(503, 0x8D), ErrorCode::corrupt_data, "block 5 of the packet");
  std::string full = with(3, 0x8C);  // 36000 is 0
  full[2] = static_cast<char>(0xA0);
  SpinAssembler assembler("file");
  CHECK(assembler.add({.stamp = 0.0, .data = full, .offset = 0}).has_value());
}

TEST_CASE("Velodyne: any bit flipped, any byte random: refused or read, never more than a turn") {
  std::uint32_t random = 1;
  const auto next = [&random] { return random = random * 1'664'525U + 1'013'904'223U; };
  SpinAssembler assembler("file");
  VelodyneSensor sensor(0x22, 0x39, 0.0, 50.0);
  std::size_t refused = 0, spins = 0;
  for (std::size_t i = 0; i < 1206 * 8; ++i) {
    std::string bytes = to_bytes(sensor.next());
    bytes[i / 8] = static_cast<char>(bytes[i / 8] ^ (1 << (i % 8)));
    if (i % 16 == 0) {
      for (std::size_t k = 0; k < 20; ++k)
        bytes[next() / 7 % 1206] = static_cast<char>(next() >> 24U);
    }
    if (!assembler.add({.stamp = sensor.seconds(), .data = bytes, .offset = i})) ++refused;
    while (const auto spin = assembler.take()) {
      ++spins;
      REQUIRE(all_finite(spin->points));
      REQUIRE(spin->points.size() <= 16'384 * 64);
    }
  }
  CHECK(refused > 300);
  CHECK(refused < 1300);
  CHECK(spins > 20);
}

// ---- the reference ----

struct Recorded {
  double stamp;
  std::string bytes;
};

std::vector<Recorded> packets_of_bag(const std::filesystem::path& path) {
  const auto bag = io::ros::open_bag(path);
  REQUIRE_MESSAGE(bag, to_string(bag.error()));
  std::vector<Recorded> packets;
  for (;;) {
    const auto message = (*bag)->next();
    REQUIRE_MESSAGE(message, to_string(message.error()));
    if (!*message) return packets;
    const auto scan =
        io::ros::parse_velodyne_scan((*message)->bytes, io::ros::Encoding::cdr, {path, 0, 0});
    REQUIRE_MESSAGE(scan, to_string(scan.error()));
    for (const auto& packet : scan->packets) {
      packets.push_back({packet.stamp, std::string(packet.data)});
    }
  }
}

/// The last scan that open_scans gives.
io::StampedScan last_scan(const std::filesystem::path& path) {
  const auto scans = io::open_scans({.path = path, .topic = {}});
  REQUIRE_MESSAGE(scans, to_string(scans.error()));
  io::StampedScan last;
  for (;;) {
    auto scan = (*scans)->next();
    REQUIRE_MESSAGE(scan, to_string(scan.error()));
    if (!*scan) return last;
    last = **std::move(scan);
  }
}

struct ReferencePoint {
  Point point;
  std::uint16_t ring;
  long distance;      // [2 mm]
  std::size_t block;  // in its packet
  double in_packet;   // [s] its firing after the packet's first
};

/// x, y, z, intensity, return_type, channel, azimuth, elevation, distance, time_stamp: 32 bytes.
/// Their time_stamp counts from the packet's, as if each of its 12 blocks took 110.592 us.
std::vector<ReferencePoint> reference_points(const std::filesystem::path& path) {
  const std::string content = test::content_of(path);
  const std::size_t data = content.find("DATA binary\n") + 12;
  std::vector<ReferencePoint> points;
  for (std::size_t i = 0; i < 14'831; ++i) {
    const char* const bytes = content.data() + data + i * 32;
    const auto real = [&](std::size_t at) {
      float value = 0;
      std::memcpy(&value, bytes + at, 4);
      return static_cast<double>(value);
    };
    ReferencePoint point{.point = {real(0), real(4), real(8)},
                         .ring = 0,
                         .distance = std::lround(real(24) / 0.002),
                         .block = 0,
                         .in_packet = 0};
    std::memcpy(&point.ring, bytes + 14, 2);
    std::uint32_t time = 0;
    std::memcpy(&time, bytes + 28, 4);
    const double micros = time * 1e-3;
    const auto sequence = static_cast<std::size_t>((micros + 0.5) / 55.296);
    point.block = sequence / 2;
    point.in_packet = (micros - static_cast<double>(point.block) * 110.592 +
                       static_cast<double>(point.block / 2) * 110.592) *
                      1e-6;
    points.push_back(point);
  }
  return points;
}

TEST_CASE("recorded: a VLP-16's dual returns agree with Nebula's cloud") {
  const auto bag = test::real_data("formats/rosbag2/nebula_vlp16");
  const auto pcd = test::real_data("formats/pcd/nebula_vlp16_1673400472138016708.pcd");
  if (!bag || !pcd) return;
  const auto packets = packets_of_bag(*bag);
  REQUIRE(packets.size() == 603);
  SpinAssembler assembler("bag");
  for (const Recorded& packet : packets) {
    REQUIRE(assembler.add({.stamp = packet.stamp, .data = packet.bytes, .offset = 0}).has_value());
  }
  assembler.finish();
  std::vector<Spin> spins;
  while (auto spin = assembler.take()) spins.push_back(*std::move(spin));
  REQUIRE(complete(spins) == std::vector<bool>{false, true, true, true, false});
  CHECK_FALSE(assembler.clock().synchronised());

  // The cloud is the third revolution, from packet 452 (the last of the third message) on, less its
  // last degree, which Nebula's scan phase left for the next cloud, and ranges below 0.5 m.
  const Spin& spin = spins[3];
  const io::StampedScan scan = last_scan(*bag);  // what follows holds of it, too
  CHECK(scan.stamp == spin.stamp);
  CHECK(scan.points == spin.points);
  CHECK(scan.seconds == spin.seconds);
  CHECK(std::abs(spin.stamp - packets[452].stamp) < 1e-3);
  const auto reference = reference_points(*pcd);
  std::multimap<std::pair<int, long>, std::size_t> ours;
  for (std::size_t i = 0; i < spin.points.size(); ++i) {
    const long distance = std::lround(spin.points[i].norm() / 0.002);
    if (distance >= 250) ours.emplace(std::pair{int{spin.rings[i]}, distance}, i);
  }
  CHECK(ours.size() == 14'831 + 48);

  std::size_t packet = 0, interpolated = 0, within = 0;
  double worst = 0.0, sum = 0.0, worst_other = 0.0;
  std::size_t last_block = 0;
  for (const ReferencePoint& expected : reference) {
    if (expected.block < last_block) ++packet;
    last_block = expected.block;
    const auto [first, last] = ours.equal_range({expected.ring, expected.distance});
    const auto find = [&, first = first, last = last] {
      const double seconds = static_cast<double>(packet) * 663.552e-6 + expected.in_packet;
      return std::find_if(first, last, [&](const auto& entry) {
        return std::abs(static_cast<double>(spin.seconds[entry.second]) - seconds) < 20e-6;
      });
    };
    auto found = find();
    if (found == last) {  // where few blocks have returns, two packets look like one
      ++packet;
      found = find();
    }
    CAPTURE(packet);
    CAPTURE(expected.block);
    REQUIRE(found != last);  // same laser, same range, same firing
    const Point& point = spin.points[found->second];
    ours.erase(found);
    const double distance = (point - expected.point).norm();
    within += distance < 0.005 ? 1 : 0;
    if (expected.block % 2 == 0 && expected.block < 10) {
      ++interpolated;
      worst = std::max(worst, distance);
      sum += distance;
      continue;
    }
    // Nebula gives the second block of a pair the azimuth of the next pair, and does not
    // interpolate in the last pair of a packet. A pair turns by 0.40 deg, give or take 0.02.
    const double column = static_cast<double>(expected.block / 2) * 110.592e-6;
    const double turned = 0.3984 * (expected.in_packet - column) / 110.592e-6;
    const double deviation = expected.block < 10 ? 0.3984 - turned : -turned;
    const auto clockwise = Eigen::AngleAxisd(-deviation * kDegree, Point::UnitZ());
    worst_other = std::max(worst_other, (clockwise * point - expected.point).norm());
  }
  CHECK(packet == 150);
  CHECK(interpolated == 12'175);
  CHECK(worst < 0.0013);  // Nebula rounds to 1/100 deg, which is 1.3 mm in the 14.6 m of this room
  CHECK(within > 13'600);
  CHECK(worst_other < 0.005);
  std::cout << "Velodyne: " << reference.size() << " points matched, " << within
            << " within 5 mm; the " << interpolated << " that Nebula interpolates differ by "
            << worst * 1e3 << " mm at most, " << sum / static_cast<double>(interpolated) * 1e3
            << " mm in the mean; the others, turned back, by " << worst_other * 1e3
            << " mm at most\n";
  // What is left is the last degree.
  CHECK(ours.size() == 48);
  for (const auto& [key, i] : ours)
    CHECK(std::abs(std::remainder(azimuth(spin.points[i]), 360.0)) < 1.0);
}

}  // namespace
}  // namespace vantage
