// Captures as scans. Expected numbers of recorded files come from reading them with Python's struct
// module.

#include <algorithm>
#include <cmath>
#include <ctime>
#include <iostream>
#include <numbers>
#include <variant>
#include <vector>

#include "files.hpp"
#include "io/velodyne/capture.hpp"
#include "io/velodyne/datagram.hpp"
#include "support/captures/velodyne_captures.hpp"

namespace vantage {
namespace {

using io::InputFile;
using io::ScanSource;
using io::StampedScan;
using io::velodyne::Datagram;
using io::velodyne::NoDatagram;
using io::velodyne::udp_datagram;
using namespace test;

using Opened = Result<std::unique_ptr<ScanSource>>;

Opened open(std::string_view bytes, const std::string& sensor = "") {
  return io::open_velodyne_capture(InputFile::of_memory(bytes, "a.pcap"), sensor);
}

struct Read {
  std::vector<StampedScan> scans;
  std::optional<Error> error;
};
Read read_all(ScanSource& source) {
  Read read;
  while (true) {
    auto scan = source.next();
    if (!scan) {
      read.error = scan.error();
      const auto after = source.next();
      CHECK(after.has_value());
      CHECK_FALSE(after->has_value());
      return read;
    }
    if (!*scan) return read;
    read.scans.push_back(**std::move(scan));
  }
}
Read read_all(std::string_view bytes, const std::string& sensor = "") {
  const auto source = open(bytes, sensor);
  REQUIRE_MESSAGE(source, to_string(source.error()));
  return read_all(**source);
}

void check_not_opened(std::string_view bytes, ErrorCode code, const std::string& expected,
                      const std::string& sensor = "") {
  const auto source = open(bytes, sensor);
  REQUIRE_FALSE(source.has_value());
  check_clear(source.error(), code, "a.pcap", expected);
}

/// 0.34 s of a VLP-16 from 300 deg on: three whole turns.
std::vector<CapturedFrame> three_turns(double clock_offset = 0.0) {
  return captured(VelodyneSensor(0x22, 0x37, 30'000.0, 1000.0), 256, clock_offset);
}

TEST_CASE("pcap: files are told by their magic numbers") {
  for (const char* magic : {"\xD4\xC3\xB2\xA1", "\xA1\xB2\xC3\xD4", "\x4D\x3C\xB2\xA1",
                            "\xA1\xB2\x3C\x4D", "\x0A\x0D\x0D\x0A"}) {
    CHECK(io::looks_like_pcap(std::string(magic) + "abc"));
    CHECK_FALSE(io::looks_like_pcap(std::string(magic).substr(0, 3)));
  }
  CHECK_FALSE(io::looks_like_pcap(""));
  CHECK_FALSE(io::looks_like_pcap("# .PCD v0.7"));
}

TEST_CASE("pcap: datagrams in frames of every link type") {
  const std::string ip = test::ipv4(test::udp("hello", 2368, 2369));
  const auto check = [](int link, const std::string& frame, const std::string& source) {
    CAPTURE(link);
    const auto parsed = udp_datagram(link, frame);
    REQUIRE(std::holds_alternative<Datagram>(parsed));
    const auto& datagram = std::get<Datagram>(parsed);
    CHECK(datagram.payload == "hello");
    CHECK(to_string(datagram.source) == source);
    CHECK(datagram.destination_port == 2369);
    // A frame cut anywhere gives none, or the whole one where only padding is lost.
    for (std::size_t size = 0; size < frame.size(); ++size) {
      CHECK_FALSE(std::holds_alternative<Datagram>(udp_datagram(link, frame.substr(0, size))));
    }
    CHECK(std::holds_alternative<Datagram>(udp_datagram(link, frame + std::string(20, '\0'))));
  };
  const std::string v4 = "192.168.1.201:2368";
  check(1, test::ethernet(ip), v4);
  check(1, test::ethernet(ip, 0x0800, {0x8100}), v4);
  check(1, test::ethernet(ip, 0x0800, {0x88A8, 0x8100}), v4);
  check(12, ip, v4);
  check(228, ip, v4);
  check(0, std::string("\x02\x00\x00\x00", 4) + ip, v4);
  check(108, std::string("\x00\x00\x00\x02", 4) + ip, v4);
  check(113, std::string(14, '\x01') + std::string("\x08\x00", 2) + ip, v4);
  check(276, std::string("\x08\x00", 2) + std::string(18, '\x01') + ip, v4);
  const std::string ip6 = test::ipv6(test::udp("hello", 5, 2369));
  check(1, test::ethernet(ip6, 0x86DD), "[fe80::1]:5");
  check(229, ip6, "[fe80::1]:5");
  // Header options.
  std::string options = ip;
  options[0] = 0x46;
  options[3] = static_cast<char>(options[3] + 4);
  options.insert(20, 4, '\x01');
  check(12, options, v4);
}

TEST_CASE("pcap: frames without a whole datagram say why") {
  const auto reason = [](const std::string& frame) {
    const auto parsed = udp_datagram(1, frame);
    REQUIRE(std::holds_alternative<NoDatagram>(parsed));
    return std::get<NoDatagram>(parsed);
  };
  const std::string udp = test::udp("hello");
  CHECK(reason(test::ethernet(test::ipv4(udp, {1, 2, 3, 4}, 0x2000))) == NoDatagram::fragment);
  CHECK(reason(test::ethernet(test::ipv4(udp, {1, 2, 3, 4}, 0x0003))) == NoDatagram::fragment);
  CHECK(std::holds_alternative<Datagram>(
      udp_datagram(1, test::ethernet(test::ipv4(udp, {1, 2, 3, 4}, 0x4000)))));  // do not fragment
  CHECK(reason(test::ethernet(test::ipv4(udp, {1, 2, 3, 4}, 0, 6))) == NoDatagram::other);
  CHECK(reason(test::ethernet(test::ipv6(udp, 44), 0x86DD)) == NoDatagram::fragment);
  CHECK(reason(test::ethernet(test::ipv6(udp, 6), 0x86DD)) == NoDatagram::other);
  CHECK(reason(test::ethernet("who has 10.0.0.1?", 0x0806)) == NoDatagram::other);
  CHECK(reason(test::ethernet("")) == NoDatagram::other);
  CHECK(reason(test::ethernet(test::ipv4(udp).substr(0, 30))) == NoDatagram::cut);
  std::string lie = udp;
  lie[4] = '\x7F';  // a length of 32 kB
  CHECK(reason(test::ethernet(test::ipv4(lie))) == NoDatagram::cut);
  lie[4] = 0;
  lie[5] = 7;  // less than its own header
  CHECK(reason(test::ethernet(test::ipv4(lie))) == NoDatagram::other);
  std::string header = test::ipv4(udp);
  header[0] = 0x44;
  CHECK(reason(test::ethernet(header)) == NoDatagram::other);
}

TEST_CASE("pcap: whole revolutions are scans, the others are counted") {
  for (const bool is_pcapng : {false, true}) {
    CAPTURE(is_pcapng);
    const auto frames = three_turns();
    const std::string bytes = is_pcapng ? test::pcapng(frames) : test::pcap(frames);
    const auto source = open(bytes);
    REQUIRE_MESSAGE(source, to_string(source.error()));
    CHECK((*source)->describe().format ==
          (is_pcapng ? "pcapng (VLP-16, strongest return)" : "pcap (VLP-16, strongest return)"));
    CHECK((*source)->describe().topic == "192.168.1.201:2368");
    CHECK((*source)->describe().frame.empty());
    CHECK((*source)->describe().fields.size() == 4);
    CHECK((*source)->describe().stamp_rule.find("within a minute of the time of receipt") !=
          std::string::npos);
    const Read read = read_all(**source);
    CHECK_FALSE(read.error);
    REQUIRE(read.scans.size() == 3);
    CHECK((*source)->skipped().incomplete == 2);
    CHECK((*source)->skipped().total() == 2);
    for (std::size_t i = 0; i < 3; ++i) {
      const StampedScan& scan = read.scans[i];
      CHECK(std::abs(scan.stamp - (1000.0 + 1.0 / 60.0 + 0.1 * static_cast<double>(i))) < 1.2e-4);
      // 904.2 blocks of 32 returns.
      CHECK(std::abs(static_cast<double>(scan.points.size()) / 32.0 - 904.2) < 1.0);
      CHECK(scan.seconds.size() == scan.points.size());
      CHECK(scan.dropped == 0);
      CHECK(scan.name.starts_with("a.pcap at byte "));
    }
  }
}

TEST_CASE("pcap: seek goes to the first revolution at or after a stamp, as often as one likes") {
  const std::string bytes = test::pcap(three_turns(-500.0));  // not synchronised
  const auto source = open(bytes);
  REQUIRE_MESSAGE(source, to_string(source.error()));
  CHECK((*source)->describe().stamp_rule.find("not synchronised") != std::string::npos);
  const Read all = read_all(**source);
  REQUIRE(all.scans.size() == 3);
  CHECK(std::abs(all.scans[0].stamp - (500.0 + 1.0 / 60.0)) < 1.2e-4);
  const std::pair<double, std::size_t> stamps[] = {{all.scans[1].stamp, 1},
                                                   {all.scans[1].stamp + 1e-4, 2},
                                                   {-1e300, 0},
                                                   {all.scans[2].stamp + 1e-4, 3},
                                                   {all.scans[0].stamp, 0}};
  for (const auto& [stamp, first] : stamps) {
    CAPTURE(stamp);
    REQUIRE((*source)->seek(stamp).has_value());
    const Read some = read_all(**source);
    CHECK_FALSE(some.error);
    REQUIRE(some.scans.size() == 3 - first);
    for (std::size_t i = 0; i < some.scans.size(); ++i) {
      CHECK(some.scans[i].stamp == all.scans[first + i].stamp);
      CHECK(some.scans[i].points == all.scans[first + i].points);
    }
    CHECK((*source)->skipped().incomplete == (stamp < 0 ? 2 : 1));
  }
}

TEST_CASE("pcap: of several sensors one is chosen by its address") {
  auto frames = three_turns();
  const auto others =
      captured(VelodyneSensor(0x21, 0x37, 0.0, 1000.0), 660, 0.0, {192, 168, 1, 202});
  frames.insert(frames.end(), others.begin(), others.end());
  std::stable_sort(frames.begin(), frames.end(),
                   [](const auto& a, const auto& b) { return a.stamp < b.stamp; });
  const std::string bytes = test::pcap(frames);
  check_not_opened(bytes, ErrorCode::invalid_input,
                   "choose one as the topic: 192.168.1.201:2368, 192.168.1.202:2368");
  check_not_opened(bytes, ErrorCode::invalid_input,
                   "no data packets come from '192.168.1.203:2368', found 192.168.1.201:2368, "
                   "192.168.1.202:2368",
                   "192.168.1.203:2368");
  CHECK(read_all(bytes, "192.168.1.201:2368").scans.size() == 3);
  const auto hdl = open(bytes, "192.168.1.202:2368");
  REQUIRE_MESSAGE(hdl, to_string(hdl.error()));
  CHECK((*hdl)->describe().format == "pcap (HDL-32E, strongest return)");
  const Read read = read_all(**hdl);
  CHECK(read.scans.size() == 2);
  CHECK((*hdl)->skipped().incomplete == 2);

  // A second one that shows up late.
  auto late = captured(VelodyneSensor(0x22, 0x37, 0.0, 1000.0), 1100);
  late.push_back(others.front());
  const std::string late_bytes = test::pcap(late);
  const Read first = read_all(late_bytes);
  CHECK(first.scans.size() == 13);
  REQUIRE(first.error);
  check_clear(*first.error, ErrorCode::invalid_input, "a.pcap",
              "is of a second sensor, choose one as the topic: 192.168.1.201:2368, "
              "192.168.1.202:2368");
  CHECK_FALSE(read_all(late_bytes, "192.168.1.201:2368").error);

  // Of hundreds the message lists a few.
  std::vector<CapturedFrame> many;
  for (std::size_t i = 0; i < 300; ++i) {
    const auto one =
        captured(VelodyneSensor(0x22, 0x37, 0.0, 1000.0), 1, 0.0,
                 {10, 0, static_cast<std::uint8_t>(i / 200), static_cast<std::uint8_t>(i % 200)});
    many.push_back(one.front());
  }
  check_not_opened(test::pcap(many), ErrorCode::invalid_input, "10.0.0.7:2368, ...");
}

TEST_CASE("pcap: other packets are skipped; alone they are an error that says what there is") {
  const std::string data = test::to_bytes(test::VelodynePacket{});
  std::vector<CapturedFrame> others{
      {1.0, test::ethernet(test::ipv4(test::udp(std::string(512, 'G'), 8308, 8308)))},
      {1.0, test::ethernet(test::ipv4(test::udp(std::string(512, 'G'), 8308, 8308)))},
      {1.0, test::ethernet(test::ipv4(test::udp(std::string(1206, 'x'))))},
      {1.0, test::ethernet(test::ipv4(test::udp(data).substr(0, 800), {1, 2, 3, 4}, 0x2000))},
      {1.0, test::ethernet(test::ipv4(test::udp(data))), 96},
      {1.0, test::ethernet("who has 10.0.0.1?", 0x0806)}};
  check_not_opened(test::pcap(others), ErrorCode::corrupt_data,
                   "no data packets of a Velodyne sensor (UDP, 1206 bytes), found 2 position (GPS) "
                   "packets, 1 other UDP datagrams, 1 fragments of IP packets, 1 frames that were "
                   "captured in part, 1 frames without UDP");
  check_not_opened(test::pcap({}), ErrorCode::corrupt_data, "found no packets at all");
  auto frames = three_turns();
  for (std::size_t i = 0; i < frames.size(); i += 5) {
    frames.insert(frames.begin() + static_cast<std::ptrdiff_t>(i), others[i % others.size()]);
  }
  CHECK(read_all(test::pcap(frames)).scans.size() == 3);
}

TEST_CASE("pcap: a capture without a whole revolution is an error") {
  const std::string bytes = test::pcap(captured(VelodyneSensor(0x22, 0x37, 100.0, 10.0), 100));
  const Read read = read_all(bytes);
  CHECK(read.scans.empty());
  REQUIRE(read.error);
  check_clear(
      *read.error, ErrorCode::corrupt_data, "a.pcap",
      "holds no whole revolution of the sensor, from azimuth 0 to azimuth 0, in 100 packets "
      "(0.13 s)");
}

TEST_CASE("pcap: revolutions without points and ones that are not later are counted") {
  auto frames = three_turns();
  auto again = three_turns();
  frames.insert(frames.end(), again.begin(), again.end());
  const std::string bytes = test::pcap(frames);
  const auto source = open(bytes);
  REQUIRE_MESSAGE(source, to_string(source.error()));
  CHECK(read_all(**source).scans.size() == 3);
  CHECK((*source)->skipped().not_later == 3);
  CHECK((*source)->skipped().incomplete == 4);

  std::vector<CapturedFrame> blind;
  VelodyneSensor sensor(0x22, 0x37, 30'000.0, 1000.0);
  for (int i = 0; i < 256; ++i) {
    auto packet = sensor.next();
    packet.distance = [](std::size_t, std::size_t) { return std::uint16_t{0}; };
    blind.push_back({1000.0, test::ethernet(test::ipv4(test::udp(to_bytes(packet))))});
  }
  const std::string blind_bytes = test::pcap(blind);
  const auto empty = open(blind_bytes);
  REQUIRE_MESSAGE(empty, to_string(empty.error()));
  const Read read = read_all(**empty);
  CHECK_FALSE(read.error);
  REQUIRE(read.scans.size() == 3);
  CHECK(read.scans.front().points.empty());
}

TEST_CASE("pcap: files of other kinds and link types are refused") {
  check_not_opened("", ErrorCode::corrupt_data, "at byte 0 of 0");
  check_not_opened("\xD4\xC3", ErrorCode::corrupt_data, "truncated");
  check_not_opened("# .PCD v0.7 - Point Cloud Data file format\n", ErrorCode::corrupt_data,
                   "unknown file format");
  check_not_opened(test::pcap(three_turns(), 105), ErrorCode::unsupported, "link type 105");
  auto frames = three_turns();
  frames[0].bytes[14 + 20 + 8 + 1205] = 0x28;
  check_not_opened(test::pcap(frames), ErrorCode::unsupported,
                   "the packet at byte 24 is of a VLP-32C (product 0x28)");
}

TEST_CASE("pcap: a capture cut short gives what came before, then an error with the byte") {
  const auto frames = three_turns();
  const std::string whole = test::pcap(frames);
  const std::size_t record = 16 + frames[0].bytes.size();
  std::size_t ends = 0;
  for (std::size_t size = 0; size < whole.size(); size += 1009) {
    CAPTURE(size);
    const auto source = open(std::string_view(whole).substr(0, size));
    if (size < 24 + record) {
      REQUIRE_FALSE(source.has_value());
      REQUIRE(source.error().code == ErrorCode::corrupt_data);
      continue;
    }
    REQUIRE(source.has_value());
    const Read read = read_all(**source);
    REQUIRE(read.scans.size() <= 3);
    // The turn that begins at packet 12 ends at packet 88, and so on.
    if (size > 24 + 90 * record) REQUIRE(read.scans.size() >= 1);
    if ((size - 24) % record == 0) {
      ++ends;
      continue;
    }
    REQUIRE(read.error);
    const std::string line = to_string(*read.error);
    CAPTURE(line);
    REQUIRE(read.error->code == ErrorCode::corrupt_data);
    REQUIRE(line.find("at byte " + std::to_string(size)) != std::string::npos);
    REQUIRE(line.size() < 400);
  }
  CHECK(ends < 10);
}

TEST_CASE("pcap: any byte changed: read or refused, with a line") {
  for (const bool is_pcapng : {false, true}) {
    const auto frames = captured(VelodyneSensor(0x22, 0x39, 35'900.0, 1000.0), 160);
    const std::string whole = is_pcapng ? test::pcapng(frames) : test::pcap(frames);
    std::uint32_t random = 7;
    std::size_t refused = 0, runs = 0;
    for (std::size_t at = 0; at < whole.size(); at += at < 120 ? 1 : 4013) {
      for (const int flip : {1, 128, 255}) {
        std::string bytes = whole;
        bytes[at] = static_cast<char>(bytes[at] ^ flip);
        random = random * 1'664'525U + 1'013'904'223U;
        if (at >= 120) bytes[random / 3 % bytes.size()] = static_cast<char>(random >> 24U);
        const auto source = open(bytes);
        ++runs;
        std::optional<Error> error;
        if (source) {
          error = read_all(**source).error;
        } else {
          error = source.error();
        }
        if (!error) continue;
        ++refused;
        const std::string line = to_string(*error);
        REQUIRE(line.find('\n') == std::string::npos);
        REQUIRE(line.size() < 400);
      }
    }
    CHECK(refused > 100);
    CHECK(refused < runs);
  }
}

TEST_CASE("pcap: absurd sizes in a record or block are refused") {
  const std::string whole = test::pcap(three_turns());
  for (const std::uint32_t size : {0xFFFFFFFFU, 0x7FFFFFFFU, 0x10000000U, 300'000U}) {
    std::string bytes = whole;
    bytes.replace(24 + 8, 4, test::raw(size));
    const auto source = open(bytes);
    REQUIRE_FALSE(source.has_value());
    CHECK(source.error().code == ErrorCode::corrupt_data);
    std::string next = test::pcapng(three_turns());
    next.replace(48 + 4, 4, test::raw(size));
    const auto block = open(next);
    REQUIRE_FALSE(block.has_value());
    CHECK(block.error().code == ErrorCode::corrupt_data);
  }
}

// ---- recorded ----

struct Expected {
  double stamp;
  std::uint64_t offset;
  std::size_t points;
  double sum, longest;  // of the ranges [m]
};

void check_capture(const std::filesystem::path& path, const std::string& format,
                   const std::string& topic, const std::vector<Expected>& expected,
                   const std::vector<double>& angles) {
  auto file = InputFile::open(path, "a capture");
  REQUIRE(file.has_value());
  const auto source = io::open_velodyne_capture(*std::move(file), "");
  REQUIRE_MESSAGE(source, to_string(source.error()));
  CHECK((*source)->describe().format == format);
  CHECK((*source)->describe().topic == topic);
  const Read read = read_all(**source);
  CHECK_FALSE(read.error);
  CHECK((*source)->skipped().incomplete == 2);
  REQUIRE(read.scans.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    CAPTURE(i);
    const StampedScan& scan = read.scans[i];
    CHECK(std::abs(scan.stamp - expected[i].stamp) < 1e-6);
    CHECK(scan.name == path.string() + " at byte " + std::to_string(expected[i].offset));
    CHECK(scan.points.size() == expected[i].points);
    double sum = 0.0, longest = 0.0;
    for (const Point& p : scan.points) {
      sum += p.norm();
      longest = std::max(longest, p.norm());
      const double degrees = std::atan2(p.z(), std::hypot(p.x(), p.y())) * 180.0 / std::numbers::pi;
      REQUIRE(std::any_of(angles.begin(), angles.end(),
                          [&](double angle) { return std::abs(angle - degrees) < 0.0071; }));
    }
    CHECK(sum == doctest::Approx(expected[i].sum).epsilon(1e-8));
    CHECK(longest == doctest::Approx(expected[i].longest).epsilon(1e-7));
    CHECK(std::is_sorted(scan.seconds.begin(), scan.seconds.end()));
    CHECK(scan.seconds.back() < 0.1108F);
  }
}

TEST_CASE("recorded: captures of an HDL-32E and a VLP-16 with GPS") {
  const auto folder = test::real_data("formats/pcap");
  if (!folder) return;
  std::vector<double> hdl32, vlp16;
  for (int i = 0; i < 32; ++i) hdl32.push_back(-92.0 / 3 + 4.0 / 3 * i);
  for (int i = 0; i < 16; ++i) vlp16.push_back(-15.0 + 2.0 * i);
  check_capture(*folder / "velodyne_hdl32.pcap", "pcap (HDL-32E, strongest return)",
                "192.168.17.162:443",
                {{1319768035.416442, 96'088, 57'734, 488354.042, 81.286},
                 {1319768035.527080, 348'888, 57'882, 487888.550, 80.136}},
                hdl32);
  check_capture(*folder / "velodyne_vlp16_gps.pcap", "pcap (VLP-16, strongest return)",
                "10.0.0.100:2368",
                {{1453364282.407725, 69'494, 18'561, 24048.462, 2.834},
                 {1453364282.507922, 173'538, 18'554, 24040.500, 2.838},
                 {1453364282.608117, 276'318, 18'482, 23983.212, 2.834}},
                vlp16);
}

TEST_CASE("recorded: an empty capture is refused") {
  const auto path = test::real_data("formats/malformed/empty_pcap.pcap");
  if (!path) return;
  auto file = InputFile::open(*path, "a capture");
  REQUIRE(file.has_value());
  const auto source = io::open_velodyne_capture(*std::move(file), "");
  REQUIRE_FALSE(source.has_value());
  check_clear(source.error(), ErrorCode::corrupt_data, "empty_pcap.pcap", "no packets at all");
}

TEST_CASE("pcap: reading is far faster than the sensor") {
  const std::string bytes =
      test::pcap(captured(VelodyneSensor(0x22, 0x37, 0.0, 1000.0), 7540));  // 10 s
  const std::clock_t start = std::clock();  // of this process: others may use the machine
  const auto source = open(bytes);
  REQUIRE_MESSAGE(source, to_string(source.error()));
  std::size_t scans = 0;
  while (*(*source)->next()) ++scans;
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  CHECK(scans == 99);
  std::cout << "Velodyne: " << 10.0 / seconds << " times real time (VLP-16, 10 Hz)\n";
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  CHECK(seconds < 5.0);
#else
  CHECK(seconds < 0.5);  // 20 times real time; it takes a tenth of that
#endif
}

}  // namespace
}  // namespace vantage
