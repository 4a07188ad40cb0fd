// LAS files made here byte by byte, and those of other programs. Expected numbers of the latter
// come from reading them with Python's struct module.

#include "io/las.hpp"

#include <cmath>
#include <limits>
#include <random>
#include <sstream>
#include <vector>

#include "files.hpp"
#include "las_files.hpp"

namespace vantage {
namespace {

using test::check_clear;
using test::las_file;
using test::LasFile;
using test::overwrite;
using test::real_data;

Result<io::LoadedCloud> load(std::string_view bytes) {
  const auto file = io::InputFile::of_memory(bytes, "memory.las");
  VANTAGE_TRY(const auto records, io::las_records(file));
  return io::load_records(file, records);
}

void refused(std::string_view bytes, const std::string& expected,
             ErrorCode code = ErrorCode::corrupt_data) {
  CAPTURE(expected);
  const auto cloud = load(bytes);
  REQUIRE_FALSE(cloud.has_value());
  check_clear(cloud.error(), code, "memory.las", expected);
}

TEST_CASE("LAS: every version and point format, scale and offset applied in double") {
  for (unsigned minor = 0; minor <= 4; ++minor) {
    for (unsigned format = 0; format <= 10; ++format) {
      for (const unsigned extra : {0u, 5u}) {
        CAPTURE(minor);
        CAPTURE(format);
        const auto cloud = load(las_file({.minor = minor, .format = format, .extra_bytes = extra}));
        REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
        REQUIRE(cloud->points.size() == 3);
        // 0.001 * 1 + 500000, ...: UTM coordinates keep their millimetres
        CHECK((cloud->points[0] - Point(500000.001, 4649999.998, 100.5)).norm() < 1e-9);
        CHECK((cloud->points[1] - Point(500004.0, 4650005.0, 160.0)).norm() < 1e-9);
        CHECK(cloud->points[2].x() == doctest::Approx(500000.0 + 2147483.647));
        CHECK(cloud->points[2].y() == doctest::Approx(4650000.0 - 2147483.648));
      }
    }
  }
}

TEST_CASE("LAS: the format is told by the content, in blocks, beside a longer header and records") {
  LasFile layout{.minor = 2, .format = 1, .header_padding = 13, .points_padding = 2};
  layout.vlrs = {{"LASF_Projection", 34735, std::string(100, 'x')}, {"other", 7, ""}};
  const auto cloud = test::read_as("map.bin", las_file(layout));
  REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
  CHECK(cloud->points.size() == 3);
  CHECK(cloud->times.values.empty());
  CHECK(load(las_file({.minor = 4, .points = {}}))->points.empty());

  std::vector<std::array<std::int32_t, 3>> many;  // more than a block of 1 MiB
  for (std::int32_t i = 0; i < 100'000; ++i) many.push_back({i, -i, 2 * i});
  const auto large = load(las_file({.points = many}));
  REQUIRE(large);
  REQUIRE(large->points.size() == many.size());
  for (std::size_t i = 0; i < many.size(); i += 997) {
    CHECK((large->points[i] - Point(500000 + 1e-3 * static_cast<double>(i),
                                    4650000 - 1e-3 * static_cast<double>(i),
                                    100 + 5e-1 * 2 * static_cast<double>(i)))
              .norm() < 1e-8);
  }
}

TEST_CASE("LAS: the counts of 1.4") {
  const std::string file = las_file({.minor = 4, .format = 6});
  REQUIRE(load(file)->points.size() == 3);
  const auto with = [&](std::uint32_t legacy, std::uint64_t count) {
    return overwrite(overwrite(file, 107, legacy), 247, count);
  };
  CHECK(load(with(0, 3))->points.size() == 3);
  CHECK(load(with(3, 0))->points.size() == 3);
  CHECK(load(with(0, 2))->points.size() == 2);
  CHECK(load(with(0, 0))->points.empty());
  refused(with(2, 3), "3 points according to byte 247 and 2 according to byte 107");
  refused(with(0, 4), "expected 4 points of 30 bytes from byte 375 on but there is room for 3");
  refused(with(0, std::numeric_limits<std::uint64_t>::max()), "there is room for 3");
  refused(with(0, std::uint64_t{1} << 63), "there is room for 3");
}

TEST_CASE("LAS: points that overflow are dropped and counted") {
  const auto cloud = load(overwrite(las_file({}), 131, 1e308));
  REQUIRE(cloud);
  CHECK(cloud->points.size() == 1);  // 4000 * 1e308 and 2^31 * 1e308 are infinite
  CHECK(cloud->dropped == 2);
}

TEST_CASE("LAS: headers that contradict themselves or the file") {
  const std::string file = las_file({});
  REQUIRE(load(file));
  refused(overwrite(file, 24, std::uint8_t{2}), "LAS version 2.2 at byte 24, expected 1.0 to 1.4");
  refused(overwrite(file, 25, std::uint8_t{5}), "LAS version 1.5 at byte 24");
  refused(overwrite(file, 94, std::uint16_t{226}), "the header's size at byte 94 is 226");
  refused(overwrite(file, 94, std::uint16_t{0}), "expected 227 or more in LAS 1.2");
  refused(overwrite(file, 96, std::uint32_t{226}), "the points begin at byte 226");
  refused(overwrite(file, 96, std::uint32_t{0xffffffff}), "the points begin at byte 4294967295");
  refused(overwrite(file, 96, static_cast<std::uint32_t>(file.size() + 1)), "the points begin");
  refused(overwrite(file, 104, std::uint8_t{11}), "point format 11 at byte 104, expected 0 to 10");
  refused(overwrite(file, 105, std::uint16_t{19}), "points of 19 bytes according to byte 105");
  refused(overwrite(file, 105, std::uint16_t{0}), "points of 0 bytes according to byte 105");
  refused(overwrite(file, 107, std::uint32_t{4}), "expected 4 points of 20 bytes from byte 227");
  refused(overwrite(file, 107, std::uint32_t{0xffffffff}), "there is room for 3");
  for (const std::size_t at : {131u, 139u, 147u}) {
    const std::string where = "at byte " + std::to_string(at);
    refused(overwrite(file, at, 0.0), where + " is 0");
    refused(overwrite(file, at, -0.0), where + " is 0");
    refused(overwrite(file, at, std::nan("")), where + " is nan");
    refused(overwrite(file, at, HUGE_VAL), where + " is inf");
    refused(overwrite(file, at + 24, std::nan("")), "the offset of");
  }
}

TEST_CASE("LAS: variable length records that do not fit before the points") {
  LasFile layout{.minor = 2};
  layout.vlrs = {{"a", 1, std::string(10, 'a')}, {"b", 2, std::string(20, 'b')}};
  const std::string file = las_file(layout);
  REQUIRE(load(file));
  refused(overwrite(file, 100, std::uint32_t{3}),
          "3 variable length records according to byte 100");
  refused(overwrite(file, 100, std::uint32_t{0xffffffff}), "expected 2 at most");
  refused(overwrite(file, 227 + 20, std::uint16_t{60000}),
          "record 1 of 2 (counted at byte 100) is at byte 227, and its 60000 bytes reach beyond");
  refused(overwrite(file, 227 + 20, std::uint16_t{40}),
          "record 2 of 2 (counted at byte 100) is at byte 321, too near to byte 365");
  CHECK(load(overwrite(file, 100, std::uint32_t{1})));  // what follows is skipped
}

TEST_CASE("LAS: compressed formats name a converter") {
  for (const unsigned bits : {0x80u, 0x40u, 0xc0u}) {
    refused(overwrite(las_file({.format = 3}), 104, static_cast<std::uint8_t>(bits | 3u)),
            "convert it: `pdal translate in.laz out.las` or `laszip", ErrorCode::unsupported);
  }
  LasFile layout{.minor = 4, .format = 6};
  layout.vlrs = {{"laszip encoded", 22204, std::string(46, '\0')}};
  refused(las_file(layout), "LAZ (compressed LAS) is not read", ErrorCode::unsupported);
  layout.vlrs.insert(layout.vlrs.begin(), {"copc", 1, std::string(160, '\0')});
  refused(las_file(layout), "`pdal translate in.copc.laz out.las`", ErrorCode::unsupported);
  const auto e57 = test::read_as("map.e57", "ASTM-E57" + std::string(40, '\0'));
  REQUIRE_FALSE(e57.has_value());
  check_clear(e57.error(), ErrorCode::unsupported, "map.e57", "`pdal translate in.e57 out.las`");
}

TEST_CASE("LAS: cut at every byte") {
  LasFile layout{.minor = 4, .format = 7};
  layout.vlrs = {{"a", 1, std::string(10, 'a')}};
  const std::string file = las_file(layout);
  REQUIRE(load(file)->points.size() == 3);
  for (std::size_t size = 0; size < file.size(); ++size) {
    const auto cloud = load(std::string_view(file).substr(0, size));
    REQUIRE_FALSE_MESSAGE(cloud.has_value(), size);
    check_clear(cloud.error(), ErrorCode::corrupt_data, "memory.las", "byte");
  }
}

TEST_CASE("LAS: any bytes in the header give points or an error") {
  LasFile layout{.minor = 4, .format = 6};
  layout.vlrs = {{"a", 1, std::string(10, 'a')}};
  const std::string file = las_file(layout);
  for (std::size_t at = 4; at < 375 + 54; ++at) {
    for (unsigned bit = 0; bit < 8; ++bit) {
      std::string flipped = file;
      flipped[at] = static_cast<char>(static_cast<unsigned char>(flipped[at]) ^ (1u << bit));
      const auto cloud = load(flipped);
      if (cloud) {
        CHECK(cloud->points.size() + cloud->dropped <= 4);
      } else {
        check_clear(cloud.error(), cloud.error().code, "memory.las", "");
      }
    }
  }
  std::mt19937 random(1);
  for (int round = 0; round < 20'000; ++round) {
    std::string noise = file;
    for (int i = 0; i < 6; ++i) noise[4 + random() % 371] = static_cast<char>(random() & 0xff);
    const auto cloud = load(noise);
    if (cloud) CHECK(cloud->points.size() <= noise.size());
  }
}

/// File, points; the first, the last and the sum of all points. From Python's struct module.
constexpr const char* kRecorded = R"(
1.2-with-color.las 1065 637012.24 849028.31 431.66 637342.85 853240.3200000001 423.92
  678721022.97 906580758.4899988 462314.20000000024
autzen_trim.las 110000 637177.98 849393.9500000001 411.19 636037.88 849336.9400000001 423.2
  70020104544.59975 93406036431.28035 47337127.72999868
perm_1.0_0.las 1 470692.44 4602888.9 16.0 470692.44 4602888.9 16.0
  470692.44 4602888.9 16.0
perm_1.1_0.las 1 470692.44 4602888.9 16.0 470692.44 4602888.9 16.0
  470692.44 4602888.9 16.0
perm_1.2_3.las 1 470692.44 4602888.9 16.0 470692.44 4602888.9 16.0
  470692.44 4602888.9 16.0
simple.las 1065 637012.24 849028.31 431.66 637342.85 853240.3200000001 423.92
  678721022.97 906580758.4899988 462314.20000000024
test1_4.las 1000 1694510.3869346841 1816497.966263977 5598.3596128149675
  1694291.6363326558 1816493.0662305846 5597.089652537912
  1694379477.6543586 1816495465.573155 5597520.532653073
)";

TEST_CASE("LAS: files of other programs") {
  const auto folder = real_data("formats/las");
  if (!folder) return;
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(*folder)) {
    count += entry.path().extension() == ".las" ? 1 : 0;
  }
  std::size_t read = 0, points = 0;
  std::string file;
  Point first, last, total;
  std::istringstream rows(kRecorded);
  for (; rows >> file >> points; ++read) {
    for (Point* point : {&first, &last, &total}) rows >> point->x() >> point->y() >> point->z();
    CAPTURE(file);
    const auto cloud = io::read_point_cloud(*folder / file, io::ReadTimes::yes);
    REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
    REQUIRE(cloud->points.size() == points);
    CHECK(cloud->dropped == 0);
    CHECK(cloud->times.values.empty());
    CHECK((cloud->points.front() - first).norm() < 1e-8);
    CHECK((cloud->points.back() - last).norm() < 1e-8);
    Point sum = Point::Zero();
    for (const Point& p : cloud->points) sum += p;
    CHECK((sum - total).norm() <= 1e-9 * total.norm());
  }
  CHECK(read == 7);
  CHECK(count == read + 1);  // and the one without points
  const auto empty = io::read_point_cloud(*folder / "no-points.las");
  REQUIRE_MESSAGE(empty, to_string(empty.error()));
  CHECK(empty->points.empty());
}

TEST_CASE("LAS: cut or flipped files of other programs give points or a clear error") {
  const auto folder = real_data("formats/las");
  if (!folder) return;
  for (const auto* name : {"1.2-with-color.las", "test1_4.las", "perm_1.0_0.las"}) {
    const std::string file = test::content_of(*folder / name);
    for (std::size_t size = 0; size < file.size(); size += 97) {
      REQUIRE_FALSE_MESSAGE(load(std::string_view(file).substr(0, size)).has_value(), size);
    }
    std::mt19937 random(7);
    for (int round = 0; round < 2000; ++round) {
      std::string flipped = file;
      flipped[random() % 700] ^= static_cast<char>(1u << random() % 8);
      const auto cloud = load(flipped);
      if (!cloud) check_clear(cloud.error(), cloud.error().code, "memory.las", "");
    }
  }
}

}  // namespace
}  // namespace vantage
