#include <lzf.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "files.hpp"

namespace vantage {
namespace {

using namespace test;

std::string header(const std::string& fields, const std::string& sizes, const std::string& types,
                   const std::string& counts, std::size_t points, const std::string& data) {
  return "# .PCD v0.7\nVERSION 0.7\nFIELDS " + fields + "\nSIZE " + sizes + "\nTYPE " + types +
         "\nCOUNT " + counts + "\nWIDTH " + std::to_string(points) +
         "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + std::to_string(points) + "\nDATA " +
         data + "\n";
}

std::string xyz_header(std::size_t points, const std::string& data) {
  return header("x y z", "4 4 4", "F F F", "1 1 1", points, data);
}

PointCloud random_cloud(std::size_t size, double scale) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> coordinate(-scale, scale);
  PointCloud cloud(size);
  for (Point& p : cloud) p = {coordinate(random), coordinate(random), coordinate(random)};
  return cloud;
}

// What PCL writes: sizes, then all values of a field after another, compressed.
std::string compressed(const std::string& by_field) {
  std::vector<char> packed(by_field.size() + by_field.size() / 16 + 64);
  const unsigned size = lzf_compress(by_field.data(), static_cast<unsigned>(by_field.size()),
                                     packed.data(), static_cast<unsigned>(packed.size()));
  REQUIRE(size > 0);
  return raw(static_cast<std::uint32_t>(size)) + raw(static_cast<std::uint32_t>(by_field.size())) +
         std::string(packed.data(), size);
}

TEST_CASE("PCD: float64 round trip is exact") {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "cloud.pcd";
  PointCloud cloud = random_cloud(10'000, 5e6);
  cloud.push_back(
      {std::numeric_limits<double>::max(), std::numeric_limits<double>::denorm_min(), -0.0});
  REQUIRE(io::write_pcd(path, cloud, io::Precision::float64).has_value());
  const auto back = io::read_point_cloud(path);
  REQUIRE_MESSAGE(back, to_string(back.error()));
  CHECK(back->points == cloud);
  CHECK(back->dropped == 0);
}

TEST_CASE("PCD: float32 round trip is the nearest float") {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "cloud.pcd";
  const PointCloud cloud = random_cloud(10'000, 100.0);
  REQUIRE(io::write_pcd(path, cloud, io::Precision::float32).has_value());
  const auto back = io::read_point_cloud(path);
  REQUIRE_MESSAGE(back, to_string(back.error()));
  REQUIRE(back->points.size() == cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    CHECK(back->points[i] == cloud[i].cast<float>().cast<double>());
  }
}

TEST_CASE("PCD: an empty cloud is written and read") {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "cloud.pcd";
  REQUIRE(io::write_pcd(path, {}, io::Precision::float32).has_value());
  const auto back = io::read_point_cloud(path);
  REQUIRE_MESSAGE(back, to_string(back.error()));
  CHECK(back->points.empty());
}

TEST_CASE("PCD: points that are not finite in the precision are not written") {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "cloud.pcd";
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const Point& bad : {Point(0, nan, 0), Point(0, 0, -infinity), Point(1e39, 0, 0)}) {
    const PointCloud cloud{{1, 2, 3}, bad};
    const auto written = io::write_pcd(path, cloud, io::Precision::float32);
    REQUIRE_FALSE(written.has_value());
    check_clear(written.error(), ErrorCode::invalid_input, "cloud.pcd", "point 1 of 2");
    CHECK(std::filesystem::is_empty(folder.path()));
  }
  const PointCloud large{{1e39, 0, 0}};
  CHECK(io::write_pcd(path, large, io::Precision::float64).has_value());
}

TEST_CASE("PCD: ascii, with comments, blank lines, signs, exponents and Windows line ends") {
  const auto cloud =
      read_as("a.pcd", xyz_header(3, "ascii") + "1 -2.5 +3e1\r\n\n# note\n 4\t5  6 \n7 8 9");
  REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
  CHECK(cloud->points == PointCloud{{1, -2.5, 30}, {4, 5, 6}, {7, 8, 9}});
}

TEST_CASE("PCD: ascii keeps the precision of the text") {
  const auto cloud = read_as("a.pcd", xyz_header(1, "ascii") + "637012.2400000001 851028.31 0.1\n");
  REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
  CHECK(cloud->points.front() == Point(637012.2400000001, 851028.31, 0.1));
}

TEST_CASE("PCD: NaN and infinite points are dropped and counted") {
  const auto ascii =
      read_as("a.pcd", xyz_header(5, "ascii") + "nan 0 0\n1 2 3\n0 inf 0\n0 0 -Inf\nNaN NaN NaN\n");
  REQUIRE_MESSAGE(ascii, to_string(ascii.error()));
  CHECK(ascii->points == PointCloud{{1, 2, 3}});
  CHECK(ascii->dropped == 4);

  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  const std::string points = raw(1.F) + raw(nan) + raw(1.F) + raw(1.F) + raw(2.F) + raw(3.F) +
                             raw(infinity) + raw(0.F) + raw(0.F) + raw(4.F) + raw(5.F) + raw(6.F);
  const auto binary = read_as("b.pcd", xyz_header(4, "binary") + points);
  REQUIRE_MESSAGE(binary, to_string(binary.error()));
  CHECK(binary->points == PointCloud{{1, 2, 3}, {4, 5, 6}});
  CHECK(binary->dropped == 2);
}

TEST_CASE("PCD: any field order, size and type; fields of several values; padding fields") {
  const std::string fields =
      header("rgb Z _ Y hist X", "4 8 1 2 4 4", "U F U I F U", "1 1 3 1 5 1", 2, "");
  const std::string points = [] {
    std::string bytes;
    for (const int i : {0, 1}) {
      bytes += raw(std::uint32_t{0xffffffff}) + raw(0.1 + i) + "abc" +
               raw(static_cast<std::int16_t>(-300 - i));
      for (int k = 0; k < 5; ++k) bytes += raw(1e30F);
      bytes += raw(static_cast<std::uint32_t>(4'000'000'000U + static_cast<unsigned>(i)));
    }
    return bytes;
  }();
  const PointCloud expected{{4e9, -300, 0.1}, {4e9 + 1, -301, 1.1}};

  SUBCASE("binary") {
    std::string content = fields;
    content.replace(content.find("DATA "), 6, "DATA binary\n");
    const auto cloud = read_as("a.pcd", content + points);
    REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
    CHECK(cloud->points == expected);
  }
  SUBCASE("binary with bytes after the last point") {
    std::string content = fields;
    content.replace(content.find("DATA "), 6, "DATA binary\n");
    const auto cloud = read_as("a.pcd", content + points + std::string(4096, '\0'));
    REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
    CHECK(cloud->points == expected);
  }
  SUBCASE("ascii") {
    std::string content = fields;
    content.replace(content.find("DATA "), 6, "DATA ascii\n");
    const auto cloud = read_as("a.pcd", content +
                                            "9 0.1 a b c -300 1 1 1 1 1 4000000000\n"
                                            "9 1.1 a b c -301 nan 1 1 1 1 4000000001\n");
    REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
    CHECK(cloud->points == expected);
  }
  SUBCASE("binary_compressed") {
    std::string content = fields;
    content.replace(content.find("DATA "), 6, "DATA binary_compressed\n");
    const std::size_t size = points.size() / 2;
    std::string by_field;
    std::size_t offset = 0;
    for (const std::size_t bytes : {4, 8, 3, 2, 20, 4}) {
      by_field += points.substr(offset, bytes) + points.substr(size + offset, bytes);
      offset += bytes;
    }
    REQUIRE(offset == size);
    const auto cloud = read_as("a.pcd", content + compressed(by_field) + "padding");
    REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
    CHECK(cloud->points == expected);
  }
}

TEST_CASE("PCD: every integer type of a coordinate") {
  const auto read_with = [](const std::string& type, const std::string& size,
                            const std::string& value) {
    const auto cloud =
        read_as("a.pcd", header("x y z", size + " 4 4", type + " F F", "1 1 1", 1, "binary") +
                             value + raw(1.F) + raw(2.F));
    REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
    return cloud->points.at(0).x();
  };
  CHECK(read_with("I", "1", raw(std::int8_t{-100})) == -100.0);
  CHECK(read_with("U", "1", raw(std::uint8_t{200})) == 200.0);
  CHECK(read_with("I", "2", raw(std::int16_t{-30000})) == -30000.0);
  CHECK(read_with("U", "2", raw(std::uint16_t{60000})) == 60000.0);
  CHECK(read_with("I", "4", raw(std::int32_t{-2000000000})) == -2000000000.0);
  CHECK(read_with("U", "4", raw(std::uint32_t{4000000000})) == 4000000000.0);
  CHECK(read_with("I", "8", raw(std::int64_t{-9000000000})) == -9000000000.0);
  CHECK(read_with("U", "8", raw(std::uint64_t{18000000000})) == 18000000000.0);
  CHECK(read_with("F", "8", raw(0.1)) == 0.1);
  CHECK(read_with("F", "4", raw(0.1F)) == static_cast<double>(0.1F));
}

TEST_CASE("PCD: lines that other programs leave out") {
  const std::string fields = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n";
  for (const std::string counts : {"WIDTH 2\n", "WIDTH 2\nHEIGHT 1\n", "WIDTH 1\nHEIGHT 2\n",
                                   "POINTS 2\n", "COUNT 1 1 1\nWIDTH 2\nPOINTS 2\n"}) {
    CAPTURE(counts);
    const auto cloud = read_as("a.pcd", fields + counts + "DATA ascii\n1 2 3\n4 5 6\n");
    REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
    CHECK(cloud->points == PointCloud{{1, 2, 3}, {4, 5, 6}});
  }
}

TEST_CASE("PCD: the viewpoint is not applied") {
  std::string content = xyz_header(1, "ascii") + "1 2 3\n";
  content.replace(content.find("0 0 0 1 0 0 0"), 13, "9 9 9 0 1 0 0");
  const auto cloud = read_as("a.pcd", content);
  REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
  CHECK(cloud->points == PointCloud{{1, 2, 3}});
}

TEST_CASE("PCD: the content tells the format, not the suffix") {
  CHECK(read_as("cloud.bin", xyz_header(1, "ascii") + "1 2 3\n").has_value());
  CHECK(read_as("cloud", "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nDATA ascii\n1 2 3\n")
            .has_value());
  CHECK(read_as("cloud.ply", xyz_header(1, "ascii") + "1 2 3\n").has_value());
}

TEST_CASE("PCD: headers that contradict themselves are refused") {
  const std::string good = xyz_header(1, "ascii") + "1 2 3\n";
  const auto with = [&](const std::string& line, const std::string& instead) {
    std::string content = good;
    const auto at = content.find("\n" + line);
    REQUIRE(at != std::string::npos);
    content.replace(at + 1, content.find('\n', at + 1) - at - 1, instead);
    return content;
  };
  REQUIRE(read_as("a.pcd", good).has_value());
  check_refused("a.pcd", with("WIDTH", "WIDTH -1"), "a.pcd:7: error: WIDTH");
  check_refused("a.pcd", with("WIDTH", "WIDTH many"), "found 'many'");
  check_refused("a.pcd", with("WIDTH", "WIDTH"), "found ''");
  check_refused("a.pcd", with("WIDTH", "WIDTH 1 1"), "WIDTH must be one whole number");
  check_refused("a.pcd", with("WIDTH", "WIDTH 1.5"), "WIDTH");
  check_refused("a.pcd", with("WIDTH", "WIDTH 99999999999999999999999"), "WIDTH");
  check_refused("a.pcd", with("WIDTH", "WIDTH 2"), "POINTS is 1, expected WIDTH * HEIGHT = 2 * 1");
  check_refused("a.pcd", with("HEIGHT", "HEIGHT 0"), "POINTS is 1");
  check_refused("a.pcd", with("HEIGHT", "HEIGHT x"), "HEIGHT");
  check_refused("a.pcd", with("POINTS", "POINTS -5"), "found '-5'");
  check_refused("a.pcd", with("SIZE", "SIZE 4 0 4"), "size of field 'y'");
  check_refused("a.pcd", with("SIZE", "SIZE 4 -4 4"), "size of field 'y'");
  check_refused("a.pcd", with("SIZE", "SIZE 4 3 4"), "1, 2, 4 or 8, found '3'");
  check_refused("a.pcd", with("SIZE", "SIZE 4 2 4"), "field y of type F has size 2");
  check_refused("a.pcd", with("SIZE", "SIZE 4 4"), "SIZE has 2 values");
  check_refused("a.pcd", with("SIZE", "SIZE four 4 4"), "found 'four'");
  check_refused("a.pcd", with("SIZE", "# SIZE"), "no SIZE line");
  check_refused("a.pcd", with("TYPE", "TYPE F Q F"), "I, U or F, found 'Q'");
  check_refused("a.pcd", with("TYPE", "TYPE F F F F"), "TYPE has 4 values");
  check_refused("a.pcd", with("TYPE", "# TYPE"), "no TYPE line");
  check_refused("a.pcd", with("COUNT", "COUNT 1 0 1"), "count of field 'y'");
  check_refused("a.pcd", with("COUNT", "COUNT 1 -1 1"), "count of field 'y'");
  check_refused("a.pcd", with("COUNT", "COUNT 1 2 1"), "field y has 2 values, expected 1");
  check_refused("a.pcd", with("COUNT", "COUNT 1 1"), "COUNT has 2 values");
  check_refused("a.pcd", with("COUNT", "COUNT 1 1 9999999999999999999"), "64 bits");
  check_refused("a.pcd", with("FIELDS", "FIELDS x y w"), "no field z or Z");
  check_refused("a.pcd", with("FIELDS", "FIELDS x y"), "3 values, expected one for each of the 2");
  check_refused("a.pcd", with("FIELDS", "# FIELDS"), "no FIELDS line");
  check_refused("a.pcd", with("FIELDS", "FIELDS"), "one for each of the 0 fields");
  check_refused("a.pcd", with("VERSION", "WIDTH 1"), "a.pcd:7: error: second WIDTH line");
  check_refused("a.pcd", with("VERSION", "COLOUR blue"), "a.pcd:2: error: expected a PCD header");
  check_refused("a.pcd", with("DATA", "DATA packed"), "found 'packed'");
  check_refused("a.pcd", with("DATA", "DATA"), "found ''");
  check_refused("a.pcd", good.substr(0, good.find("DATA") + 8), "inside the PCD header");
  check_refused("a.pcd", "# .PCD v0.7\n", "the file ends at byte 12");
  check_refused("a.pcd", header("x y z x", "4 4 4 4", "F F F F", "1 1 1 1", 1, "ascii") + "1 2 3 4",
                "two fields are named x");
  check_refused("a.pcd", "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nHEIGHT 1\nDATA ascii\n1 2 3\n",
                "neither a WIDTH nor a POINTS line");
}

TEST_CASE("PCD: absurd counts are refused without allocating for them") {
  for (const std::string data : {"ascii", "binary", "binary_compressed"}) {
    CAPTURE(data);
    for (const std::string counts :
         {"WIDTH 18446744073709551615\nHEIGHT 1\n", "WIDTH 4294967296\nHEIGHT 4294967296\n",
          "WIDTH 1000000000000\nHEIGHT 1000\n", "WIDTH 6148914691236517206\nHEIGHT 1\n",
          "WIDTH 1537228672809129302\nHEIGHT 1\n"}) {
      CAPTURE(counts);
      check_refused("a.pcd",
                    "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n" + counts +
                        "DATA " + data + "\n" + std::string(64, '1'),
                    counts.starts_with("WIDTH 42") ? "do not fit 64 bits" : "expected");
    }
  }
}

TEST_CASE("PCD: ascii errors name the line") {
  const std::string start = xyz_header(2, "ascii");  // 11 lines
  check_refused("a.pcd", start + "1 2 3\n4 five 6\n",
                "a.pcd:13: error: expected a number for y, found 'five'");
  check_refused("a.pcd", start + "1 2 3\n4 5\n",
                "a.pcd:13: error: expected 3 values for point 2 of 2, found 2");
  check_refused("a.pcd", start + "1 2 3 4\n", "a.pcd:12: error: expected 3 values");
  check_refused("a.pcd", start + "1 2 3\n", "after 1 points, expected 2");
  check_refused("a.pcd", start + "1 2 3\n4 5 6\n7 8 9\n", "a.pcd:14: error: expected the end");
  check_refused("a.pcd", start + "1 2 1e999\n", "found '1e999'");
  check_refused("a.pcd", start + "1 2 0x10\n", "found '0x10'");
  check_refused("a.pcd", start + "1 2 3,5\n", "found '3,5'");
  check_refused("a.pcd", start + "1 2 +-3\n", "found '+-3'");
}

TEST_CASE("PCD: damaged compressed data are refused" * doctest::test_suite("slow")) {
  std::string by_field;
  for (int i = 0; i < 300; ++i) by_field += raw(static_cast<float>(i % 10));
  const std::string start = xyz_header(100, "binary_compressed");
  const std::string data = compressed(by_field);
  REQUIRE(read_as("a.pcd", start + data).has_value());

  check_refused("a.pcd", start, "expected the two sizes");
  check_refused("a.pcd", start + data.substr(0, 7), "expected the two sizes");
  check_refused("a.pcd", start + data.substr(0, data.size() - 1), "bytes of compressed data");
  check_refused("a.pcd", start + raw(~0U) + data.substr(4), "bytes of compressed data");
  check_refused("a.pcd", start + data.substr(0, 4) + raw(1201U) + data.substr(8), "claim 1201");
  check_refused("a.pcd", start + raw(2U) + data.substr(4), "cannot hold");
  // A bomb: a header that agrees with the claim, but hardly any data.
  check_refused("a.pcd",
                xyz_header(300'000'000, "binary_compressed") + raw(16U) + raw(3'600'000'000U) +
                    std::string(16, '\0'),
                "cannot hold");
  std::string wrong = data;
  wrong[8] = '\xff';  // a reference back to before the start
  check_refused("a.pcd", start + wrong, "damaged");

  std::mt19937 random(11);
  for (int i = 0; i < 2000; ++i) {
    std::string noisy = data;
    for (int k = 0; k < 3; ++k)
      noisy[8 + random() % (data.size() - 8)] = static_cast<char>(random());
    const auto cloud = read_as("a.pcd", start + noisy);
    if (cloud) {
      CHECK(cloud->points.size() + cloud->dropped == 100);
    } else {
      CHECK(cloud.error().code == ErrorCode::corrupt_data);
    }
  }
}

TEST_CASE("PCD: a file cut at any byte is refused") {
  std::string points;
  for (int i = 0; i < 30; ++i) points += raw(static_cast<float>(i % 3));
  for (const auto& [name, content] :
       {std::pair{"binary", xyz_header(10, "binary") + points},
        std::pair{"compressed", xyz_header(10, "binary_compressed") + compressed(points)}}) {
    CAPTURE(name);
    for (std::size_t size = 0; size < content.size(); ++size) {
      CAPTURE(size);
      const auto cloud = read_as("a.pcd", content.substr(0, size));
      REQUIRE_FALSE(cloud.has_value());
      check_clear(cloud.error(), ErrorCode::corrupt_data, "a.pcd", "expected");
    }
    CHECK(read_as("a.pcd", content).has_value());
  }
}

TEST_CASE("PCD: random damage gives points or an error, never a crash" *
          doctest::test_suite("slow")) {
  const std::string good =
      header("x y z i", "4 8 2 1", "F F I U", "1 1 1 3", 4, "binary") + std::string(4 * 17, '\x42');
  REQUIRE(read_as("a.pcd", good).has_value());
  std::mt19937 random(5);
  CHECK(check_damaged("a.pcd", good, 3000, 4, random) > 1000);
}

TEST_CASE("PCD: a binary file of many blocks keeps its order and drops what is not finite") {
  constexpr std::size_t kPoints = 200'000;  // 3.2 MB: blocks of 1 MiB end inside of it
  std::string content = header("x y i z", "4 4 4 4", "F F U F", "1 1 1 1", kPoints, "binary");
  PointCloud expected;
  for (std::uint32_t k = 0; k < kPoints; ++k) {
    const auto x = static_cast<float>(k);
    const bool bad = k % 65'536 == 0 || k + 1 == kPoints;
    content += raw(x) + raw(0.5F) + raw(k) + raw(bad ? std::nanf("") : -x);
    if (!bad) expected.push_back({x, 0.5, -x});
  }
  const auto cloud = read_as("a.pcd", content);
  REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
  CHECK(cloud->points == expected);
  CHECK(cloud->dropped == 5);
  check_refused("a.pcd", content.substr(0, content.size() - 1),
                "expected 200000 points of 16 bytes");
}

TEST_CASE("PCD: a header longer than what is read first") {
  std::string content = xyz_header(1, "binary");
  content.insert(0, "# .PCD v0.7\n" + std::string(100'000, '#') + "\n");
  const auto cloud = read_as("a.pcd", content + raw(1.0F) + raw(2.0F) + raw(3.0F));
  REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
  CHECK(cloud->points == PointCloud{{1, 2, 3}});
}

}  // namespace
}  // namespace vantage
