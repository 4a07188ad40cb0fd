#include "vantage/io/point_times.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <lzf.h>

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "files.hpp"
#include "io/scan_sequence.hpp"
#include "vantage/io/scan_source.hpp"

namespace vantage::io {
namespace {

using test::check_clear;
using test::put;
using test::raw;
using test::reversed;
using test::TemporaryFolder;

/// A PCD header of x y z (float32) and one more field.
std::string pcd_header(const std::string& field, int size, char type, std::size_t points,
                       const std::string& data) {
  return fmt::format(
      "VERSION 0.7\nFIELDS x y z {0}\nSIZE 4 4 4 {1}\nTYPE F F F {2}\nCOUNT 1 1 1 1\nWIDTH {3}\n"
      "HEIGHT 1\nPOINTS {3}\nDATA {4}\n",
      field, size, type, points, data);
}

template <class T>
constexpr char kType = std::is_floating_point_v<T> ? 'F' : (std::is_signed_v<T> ? 'I' : 'U');

template <class T>
std::string pcd(const std::string& field, const std::vector<T>& times) {
  std::string content = pcd_header(field, sizeof(T), kType<T>, times.size(), "binary");
  for (const T time : times) content += raw(1.0F) + raw(2.0F) + raw(3.0F) + raw(time);
  return content;
}

/// As a scan of that stamp.
Result<StampedScan> read_scan(const std::string& suffix, const std::string& content,
                              const std::string& stamp = "0") {
  const TemporaryFolder folder;
  put(folder.path() / "times.txt", stamp + "\n");
  put(folder.path() / ("scan" + suffix), content);
  auto scans = ScanSequence::open(folder.path(), 10.0);
  REQUIRE_MESSAGE(scans, to_string(scans.error()));
  return scans->read(0);
}

std::vector<float> seconds_of(const std::string& suffix, const std::string& content,
                              const std::string& stamp = "0") {
  const auto scan = read_scan(suffix, content, stamp);
  REQUIRE_MESSAGE(scan, to_string(scan.error()));
  if (!scan->seconds.empty()) CHECK(scan->seconds.size() == scan->points.size());
  return scan->seconds;
}

template <class T>
std::vector<float> seconds_of(const std::string& field, const std::vector<T>& times,
                              const std::string& stamp = "0") {
  CAPTURE(field);
  return seconds_of(".pcd", pcd(field, times), stamp);
}

using Seconds = std::vector<float>;

void check_near(const Seconds& found, const Seconds& expected, float tolerance = 1e-6F) {
  REQUIRE(found.size() == expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    CHECK(std::abs(found[i] - expected[i]) <= tolerance);
  }
}

TEST_CASE("point times come from the fields that recorders write") {
  const Seconds expected{0.0F, 0.05F, 0.1F};
  for (const char* name :
       {"t", "time", "timestamp", "time_stamp", "offset_time", "time_offset", "relative_time",
        "rel_time", "T", "Time", "TIMESTAMP", "scalar_Time", "scalar_timestamp"}) {
    CHECK(seconds_of<float>(name, {0.0F, 0.05F, 0.1F}) == expected);
  }
  for (const char* name : {"intensity", "ring", "times", "stamp", "tt", "_", "_ns", "t_fs"}) {
    CHECK(seconds_of<float>(name, {0.0F, 0.05F, 0.1F}).empty());
  }
  SUBCASE("the unit is told by the type") {
    CHECK(seconds_of<double>("t", {0.0, 0.05, 0.1}) == expected);
    CHECK(seconds_of<std::uint32_t>("t", {0, 50'000'000, 100'000'000}) == expected);
    CHECK(seconds_of<std::int32_t>("t", {-50'000'000, 0, 50'000'000}) ==
          Seconds{-0.05F, 0.0F, 0.05F});
    CHECK(seconds_of<std::uint64_t>("t", {0, 50'000'000, 100'000'000}) == expected);
    CHECK(seconds_of<std::int64_t>("t", {0, 50'000'000, 100'000'000}) == expected);
    CHECK(seconds_of<std::uint16_t>("t", {0, 50'000}) == Seconds{0.0F, 0.05F});
  }
  SUBCASE("or by the name") {
    CHECK(seconds_of<std::int32_t>("time_offset_ns", {0, 50'000'000, 100'000'000}) == expected);
    CHECK(seconds_of<std::uint32_t>("t_us", {0, 50'000, 100'000}) == expected);
    CHECK(seconds_of<float>("t_us", {0.0F, 50'000.0F, 100'000.0F}) == expected);
    CHECK(seconds_of<std::uint8_t>("scalar_time_ms", {0, 50, 100}) == expected);
    CHECK(seconds_of<double>("timestamp_s", {0.0, 0.05, 0.1}) == expected);
  }
  SUBCASE("of two fields the one that counts from the stamp is taken") {
    const std::string content =
        "FIELDS timestamp x y z offset_time\nSIZE 8 4 4 4 4\nTYPE F F F F U\nWIDTH 2\nDATA ascii\n"
        "1e9 1 2 3 0\n1e9 4 5 6 50000000\n";
    CHECK(seconds_of(".pcd", content) == Seconds{0.0F, 0.05F});
  }
}

TEST_CASE("absolute point times become times after the stamp") {
  SUBCASE("nanoseconds since the epoch") {
    constexpr std::uint64_t kStamp = 1'700'000'000'250'000'000;
    check_near(
        seconds_of<std::uint64_t>("t", {kStamp, kStamp + 100'000'000}, "1700000000.250000000"),
        {0.0F, 0.1F});
    check_near(seconds_of<double>("timestamp", {1.70000000025e18, 1.70000000035e18},
                                  "1700000000.250000000"),
               {0.0F, 0.1F});
  }
  SUBCASE("seconds since the epoch, before and after the stamp") {
    check_near(seconds_of<double>("timestamp", {1700000000.15, 1700000000.35}, "1700000000.25"),
               {-0.1F, 0.1F});
  }
  SUBCASE("of a clock that has just started") {
    check_near(seconds_of<double>("timestamp", {5.0, 5.1}, "5.0"), {0.0F, 0.1F});
    check_near(seconds_of<double>("timestamp", {0.0, 0.1}, "5.0"), {0.0F, 0.1F});
    check_near(seconds_of<double>("timestamp", {0.0, 0.1}, "0.1"), {0.0F, 0.1F});
    check_near(seconds_of<float>("timestamp", {5.0F, 5.5F}, "5.0"), {5.0F, 5.5F});
  }
  SUBCASE("in the unit in which they are near the stamp, if the name has none") {
    check_near(seconds_of<std::uint64_t>("timestamp", {7'200'250'000, 7'200'350'000}, "7200.25"),
               {0.0F, 0.1F});
    check_near(seconds_of<double>("timestamp", {7200250.0, 7200350.0}, "7200.25"), {0.0F, 0.1F});
    check_near(seconds_of<double>("timestamp", {7.20025e12, 7.20035e12}, "7200.25"), {0.0F, 0.1F});
    // Not so if all times are near zero in every unit.
    check_near(seconds_of<std::uint64_t>("t", {0, 100'000'000}, "95.0"), {0.0F, 0.1F});
    check_near(seconds_of<double>("t", {0.0, 0.1}, "3.0"), {0.0F, 0.1F});
  }
  SUBCASE("in nanoseconds also if they would end near the stamp in another unit") {
    check_near(seconds_of<double>("t", {0.0, 2.5e7, 5e7, 7.5e7, 1e8}, "95.0"),
               {0.0F, 0.025F, 0.05F, 0.075F, 0.1F});
  }
  SUBCASE("of a clock of nanoseconds that nothing synchronizes") {
    for (const double uptime : {0.0, 3.6e12, 9.9e13, 1.1e14}) {
      check_near(seconds_of<double>("timestamp", {uptime + 1e8, uptime}, "33.0"), {0.1F, 0.0F});
    }
  }
  SUBCASE("of a clock of 32 bits that starts again within the scan") {
    check_near(seconds_of<std::uint32_t>("t", {4'294'967'295U, 0, 99'999'999}, "33.0"),
               {-1e-9F, 0.0F, 0.099999999F}, 1e-10F);
    check_near(seconds_of<std::uint32_t>("timestamp_us", {4'294'967'295U, 0, 99'999}, "33.0"),
               {-1e-6F, 0.0F, 0.099999F}, 1e-8F);
    check_near(seconds_of<std::int32_t>("t", {-1'000'000'000, 0, 1'100'000'000}, "33.0"),
               {-1.0F, 0.0F, 1.1F});
  }
  SUBCASE("of a clock of 32 bits that does not start again, in a sweep of 3 s") {
    std::vector<std::uint32_t> times;
    Seconds expected;
    for (std::uint32_t k = 0; k <= 30; ++k) {
      times.push_back(k * 100'000'000U);
      expected.push_back(0.1F * static_cast<float>(k));
    }
    check_near(seconds_of<std::uint32_t>("t", times), expected);
  }
  SUBCASE("of another clock count from the earliest point") {
    check_near(seconds_of<double>("timestamp", {1700000000.3, 1700000000.2}, "33.0"), {0.1F, 0.0F});
    check_near(seconds_of<std::uint32_t>("timestamp_us", {3'000'000'000, 3'000'100'000}, "33.0"),
               {0.0F, 0.1F});
  }
}

TEST_CASE("floating point of a whole sweep is in the unit in which it lasts as long as sweeps do") {
  const auto sweep = [](auto zero, double length) {
    std::vector<decltype(zero)> times;
    for (int i = 0; i <= 1000; ++i) {
      times.push_back(zero + static_cast<decltype(zero)>(0.001 * i * length));
    }
    return times;
  };
  const auto length_of = [](const Seconds& times) { return times.back() - times.front(); };
  for (const double seconds : {0.05, 0.1, 0.2, 1.0}) {
    CAPTURE(seconds);
    for (const double units : {1.0, 1e3, 1e6, 1e9}) {
      CAPTURE(units);
      const double length = seconds * units;
      for (const char* stamp : {"0.1", "33.0", "1700000000.25"}) {
        CAPTURE(stamp);
        CHECK(length_of(seconds_of("t", sweep(0.0F, length), stamp)) == doctest::Approx(seconds));
        CHECK(length_of(seconds_of("time", sweep(0.0, length), stamp)) == doctest::Approx(seconds));
      }
      // Of another clock.
      CHECK(length_of(seconds_of("time", sweep(7e4 * units, length), "33.0")) ==
            doctest::Approx(seconds).epsilon(1e-3));
    }
  }
  // A stray time may be what makes a sweep long.
  std::vector<float> stray = sweep(0.0F, 0.1);
  stray.back() = 100.0F;
  const auto refused = read_scan(".pcd", pcd("t", stray));
  REQUIRE_FALSE(refused);
  check_clear(refused.error(), ErrorCode::corrupt_data, "scan.pcd", "spans 100 s");
}

TEST_CASE("the user can say which point has the stamp, whatever the times count from") {
  const auto seconds = [](const std::vector<double>& values, std::optional<StampedPoint> point) {
    const PointTimes times{values, *time_format("timestamp", true, 8), "timestamp"};
    return seconds_after(1700000000.0, times, "scan.pcd", point).value();
  };
  for (const double zero : {0.0, -0.1, 5000.0, 1700000000.0, 1699999999.9}) {
    CAPTURE(zero);
    const std::vector<double> values{zero + 0.025, zero, zero + 0.1};
    check_near(seconds(values, StampedPoint::first), {0.025F, 0.0F, 0.1F});
    check_near(seconds(values, StampedPoint::middle), {-0.025F, -0.05F, 0.05F});
    check_near(seconds(values, StampedPoint::last), {-0.075F, -0.1F, 0.0F});
    const auto first = static_cast<float>(zero > 1e6 ? zero - 1700000000.0 : zero > 0 ? 0.0 : zero);
    check_near(seconds(values, std::nullopt), {first + 0.025F, first, first + 0.1F});
  }
  const TemporaryFolder folder;
  put(folder.path() / "7.pcd", pcd<float>("t", {0.0F, 0.1F}));
  const auto scans =
      open_scans({.path = folder.path(), .topic = {}, .stamped = StampedPoint::last});
  REQUIRE(scans);
  check_near((*scans)->next().value()->seconds, {-0.1F, 0.0F});
  const auto refused = open_scans({.path = folder.path(), .topic = {}, .tags = Tags::normal});
  REQUIRE_FALSE(refused);
  check_clear(refused.error(), ErrorCode::invalid_input, folder.path(), "of messages only");
}

TEST_CASE("a scan in a file has no point where the sensor is") {
  std::string content = pcd_header("t", 4, 'F', 3, "binary");
  for (const float x : {1.0F, 0.0F, 2.0F}) {
    content += raw(x) + raw(0.0F) + raw(0.0F) + raw(x > 0.0F ? 0.1F * x : 1e9F);
  }
  const auto scan = read_scan(".pcd", content);
  REQUIRE_MESSAGE(scan, to_string(scan.error()));
  CHECK(scan->points == PointCloud{{1, 0, 0}, {2, 0, 0}});
  CHECK(scan->no_returns == 1);
  CHECK(scan->dropped == 0);
  check_near(scan->seconds, {0.1F, 0.2F});
}

TEST_CASE("every format has point times") {
  const Seconds expected{0.0F, 0.0625F};
  SUBCASE("PCD ascii, without the point that is dropped") {
    const std::string rows = "1 2 3 0\nnan 2 3 0.03\n4 5 6 0.0625\n";
    const auto scan = read_scan(".pcd", pcd_header("t", 4, 'F', 3, "ascii") + rows);
    REQUIRE(scan);
    CHECK(scan->dropped == 1);
    CHECK(scan->points == PointCloud{{1, 2, 3}, {4, 5, 6}});
    CHECK(scan->seconds == expected);
  }
  SUBCASE("PCD binary, without the point that is dropped, whatever its time") {
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    std::string content = pcd_header("t", 4, 'F', 3, "binary");
    content += raw(1.0F) + raw(2.0F) + raw(3.0F) + raw(0.0F);
    content += raw(1.0F) + raw(kNan) + raw(3.0F) + raw(kNan);
    content += raw(4.0F) + raw(5.0F) + raw(6.0F) + raw(0.0625F);
    const auto scan = read_scan(".pcd", content);
    REQUIRE(scan);
    CHECK(scan->points == PointCloud{{1, 2, 3}, {4, 5, 6}});
    CHECK(scan->seconds == expected);
  }
  SUBCASE("PCD binary_compressed") {
    std::string columns;
    for (const float x : {1.0F, 4.0F, 2.0F, 5.0F, 3.0F, 6.0F}) columns += raw(x);
    for (const std::uint32_t t : {0U, 62'500'000U}) columns += raw(t);
    std::string packed(1000, '\0');
    const unsigned size = lzf_compress(columns.data(), static_cast<unsigned>(columns.size()),
                                       packed.data(), static_cast<unsigned>(packed.size()));
    REQUIRE(size > 0);
    packed.resize(size);
    const std::string content = pcd_header("t", 4, 'U', 2, "binary_compressed") +
                                raw(static_cast<std::uint32_t>(size)) +
                                raw(static_cast<std::uint32_t>(columns.size())) + packed;
    const auto scan = read_scan(".pcd", content);
    REQUIRE_MESSAGE(scan, to_string(scan.error()));
    CHECK(scan->points == PointCloud{{1, 2, 3}, {4, 5, 6}});
    CHECK(scan->seconds == expected);
  }
  const auto ply = [](const std::string& format, const std::string& extra) {
    return "ply\nformat " + format +
           " 1.0\nelement vertex 2\nproperty double t\nproperty float x\nproperty float y\n"
           "property float z\n" +
           extra + "end_header\n";
  };
  const std::string list = "property list uchar int extra\n";
  SUBCASE("PLY ascii") {
    CHECK(seconds_of(".ply", ply("ascii", "") + "0 1 2 3\n0.0625 4 5 6\n") == expected);
    CHECK(seconds_of(".ply", ply("ascii", list) + "0 1 2 3 1 7\n0.0625 4 5 6 0\n") == expected);
  }
  SUBCASE("PLY binary of either byte order") {
    const auto rows = [](auto bytes, const std::string& extra) {
      std::string content;
      content += bytes(0.0) + bytes(1.0F) + bytes(2.0F) + bytes(3.0F) + extra;
      content += bytes(0.0625) + bytes(4.0F) + bytes(5.0F) + bytes(6.0F) + extra;
      return content;
    };
    const auto little = [](auto x) { return raw(x); };
    const auto big = [](auto x) { return reversed(x); };
    const std::string none(1, '\0');  // a list without values
    CHECK(seconds_of(".ply", ply("binary_little_endian", "") + rows(little, "")) == expected);
    CHECK(seconds_of(".ply", ply("binary_big_endian", "") + rows(big, "")) == expected);
    CHECK(seconds_of(".ply", ply("binary_little_endian", list) + rows(little, none)) == expected);
  }
  SUBCASE("KITTI has none") {
    CHECK(seconds_of(".bin", raw(1.0F) + raw(2.0F) + raw(3.0F) + raw(0.5F)).empty());
  }
  SUBCASE("a scan without points has no times") {
    CHECK(seconds_of(".pcd", pcd_header("t", 4, 'F', 0, "binary")).empty());
  }
}

TEST_CASE("point times that make no sense are refused") {
  const auto refused = [](const std::string& suffix, const std::string& content,
                          const std::string& expected) {
    const auto scan = read_scan(suffix, content);
    REQUIRE_FALSE(scan);
    check_clear(scan.error(), ErrorCode::corrupt_data, "scan" + suffix, expected);
  };
  refused(".pcd", pcd<float>("t", {0.0F, std::numeric_limits<float>::quiet_NaN()}),
          "field 't' holds the time nan");
  refused(".pcd", pcd<float>("time", {0.0F, -std::numeric_limits<float>::infinity()}),
          "field 'time' holds the time -inf");
  refused(".pcd", pcd<float>("time", {0.0F, 10.5F}), "spans 10.5 s");
  refused(".pcd", pcd<float>("time", {0.0F, 1e8F}), "expected a sweep of at most 10 s");
  refused(".pcd", pcd<double>("time", {0.0, 1e11}), "expected a sweep of at most 10 s");
  refused(".pcd", pcd<double>("time", {0.0, 100.0}), "spans 100 s");
  refused(".pcd", pcd<double>("time", {-1e300, 1e300}), "expected a sweep of at most 10 s");
  // A point without a time among seconds since the epoch: its sweep lasts from 1970 on. As
  // nanoseconds it would last 1.7 s.
  const std::vector<double> one_without{0.0, 1700000000.2, 1700000000.25, 1700000000.3,
                                        1700000000.35};
  for (const char* stamp : {"1700000000.2", "1700000000.35"}) {
    const auto scan = read_scan(".pcd", pcd("timestamp", one_without), stamp);
    REQUIRE_FALSE(scan);
    check_clear(scan.error(), ErrorCode::corrupt_data, "scan.pcd",
                "expected a sweep of at most 10 s (read in units of 1/1 s");
  }
  // The same in milliseconds of a clock that started two hours ago.
  const auto milliseconds = read_scan(
      ".pcd", pcd<double>("timestamp", {0.0, 7200250.0, 7200300.0, 7200350.0}), "7200.25");
  REQUIRE_FALSE(milliseconds);
  check_clear(milliseconds.error(), ErrorCode::corrupt_data, "scan.pcd", "units of 1/1000 s");
  std::vector<std::uint32_t> microseconds;  // a tenth of a second of a small sensor
  for (std::uint32_t i = 0; i < 10'000; ++i) microseconds.push_back(10 * i);
  refused(".pcd", pcd("t", microseconds), "more than any sensor");
  CHECK(seconds_of("t_us", microseconds).back() == doctest::Approx(0.09999));
  CHECK(seconds_of("t", std::vector<double>(10'000, 0.0)) == Seconds(10'000, 0.0F));

  refused(".pcd",
          "FIELDS x y z t\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 2\nWIDTH 1\nDATA ascii\n"
          "1 2 3 0 0\n",
          "field t has 2 values, expected 1");
  refused(".pcd", pcd_header("t", 2, 'F', 0, "binary"), "field t of type F has size 2");
  refused(".pcd", pcd_header("t", 4, 'F', 1, "ascii") + "1 2 3 soon\n", "expected a number for t");
  refused(".ply",
          "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
          "property float z\nproperty list uchar float t\nend_header\n1 2 3 1 0\n",
          "property t of element 'vertex' is a list");
}

TEST_CASE("a map is read without its times, sensible or not") {
  const TemporaryFolder folder;
  const auto file = put(folder.path() / "map.pcd", pcd<double>("GpsTime", {0.0, 1e9}));
  const auto other = put(folder.path() / "map2.pcd", pcd<double>("time", {0.0, 1e9}));
  for (const auto& path : {file, other}) {
    const auto map = read_point_cloud(path);
    REQUIRE(map);
    CHECK(map->points.size() == 2);
    CHECK(map->times.values.empty());
  }
  const auto with_times = read_point_cloud(other, ReadTimes::yes);
  REQUIRE(with_times);
  CHECK(with_times->times.values == std::vector<double>{0.0, 1e9});
  CHECK(with_times->times.field == "time");
}

TEST_CASE("scans with times survive writing and reading") {
  const TemporaryFolder folder;
  const auto file = folder.path() / "scan.pcd";
  PointCloud points;
  Seconds seconds;
  for (int i = 0; i < 9001; ++i) {  // more than are written at once
    points.emplace_back(0.25 * i, -0.5 * i, 3.0);
    seconds.push_back(static_cast<float>(i) * 1e-5F);
  }
  REQUIRE(write_pcd(file, points, seconds));
  CHECK(test::content_of(file).find("FIELDS x y z t\nSIZE 4 4 4 4\nTYPE F F F F\n") !=
        std::string::npos);
  const auto scans = ScanSequence::open(file, 10.0);
  REQUIRE(scans);
  const auto scan = scans->read(0);
  REQUIRE_MESSAGE(scan, to_string(scan.error()));
  CHECK((scan->points == points));
  CHECK((scan->seconds == seconds));

  SUBCASE("and what cannot be written leaves the file alone") {
    const auto check = [&](const Result<void>& written, const std::string& expected) {
      REQUIRE_FALSE(written);
      check_clear(written.error(), ErrorCode::invalid_input, "scan.pcd", expected);
      CHECK((ScanSequence::open(file, 10.0)->read(0)->seconds == seconds));
    };
    check(write_pcd(file, points, Seconds{}), "0 times for 9001 points");
    Seconds wrong = seconds;
    wrong[7] = std::numeric_limits<float>::infinity();
    check(write_pcd(file, points, wrong), "point 7 of 9001 was measured after inf s");
    points[8].x() = std::numeric_limits<double>::quiet_NaN();
    check(write_pcd(file, points, seconds), "point 8 of 9001");
  }
}

}  // namespace
}  // namespace vantage::io
