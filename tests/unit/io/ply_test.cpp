#include <limits>
#include <random>

#include "files.hpp"

namespace vantage {
namespace {

using test::check_clear;
using test::check_refused;
using test::raw;
using test::read_as;
using test::reversed;

std::string ply(const std::string& format, const std::string& elements) {
  return "ply\nformat " + format + " 1.0\ncomment made by hand\nobj_info none\n" + elements +
         "end_header\n";
}

const std::string kXyz = "element vertex 2\nproperty float x\nproperty float y\nproperty float z\n";

TEST_CASE("PLY: ascii, with Windows line ends, blank lines and NaN") {
  std::string content = ply("ascii", kXyz) + "1 -2.5 3e1\n\n nan 5 6 \n";
  for (std::size_t at = content.find('\n'); at != std::string::npos;
       at = content.find('\n', at + 2)) {
    content.replace(at, 1, "\r\n");
  }
  const auto cloud = read_as("a.ply", content);
  REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
  CHECK(cloud->points == PointCloud{{1, -2.5, 30}});
  CHECK(cloud->dropped == 1);
}

TEST_CASE("PLY: binary in either byte order, any scalar type, double coordinates kept") {
  const std::string elements =
      "element vertex 2\nproperty uchar red\nproperty double z\nproperty int16 y\n"
      "property float64 quality\nproperty uint32 x\nproperty char c\n";
  const auto point = [](auto bytes, std::uint32_t x, std::int16_t y, double z) {
    return bytes(std::uint8_t{255}) + bytes(z) + bytes(y) + bytes(1e300) + bytes(x) +
           bytes(std::int8_t{-1});
  };
  const auto little = [](auto value) { return raw(value); };
  const auto big = [](auto value) { return reversed(value); };
  const PointCloud expected{{4e9, -300, 0.1}, {7, 8, 5000000.123456789}};

  const auto read_little = read_as("a.ply", ply("binary_little_endian", elements) +
                                                point(little, 4000000000U, -300, 0.1) +
                                                point(little, 7U, 8, 5000000.123456789));
  REQUIRE_MESSAGE(read_little, to_string(read_little.error()));
  CHECK(read_little->points == expected);

  const auto read_big =
      read_as("a.ply", ply("binary_big_endian", elements) + point(big, 4000000000U, -300, 0.1) +
                           point(big, 7U, 8, 5000000.123456789));
  REQUIRE_MESSAGE(read_big, to_string(read_big.error()));
  CHECK(read_big->points == expected);
}

TEST_CASE("PLY: every scalar type under both of its names") {
  const auto read_with = [](const std::string& type, const std::string& value) {
    const auto cloud = read_as(
        "a.ply", ply("binary_little_endian", "element vertex 1\nproperty " + type +
                                                 " x\nproperty float y\nproperty float z\n") +
                     value + raw(1.F) + raw(2.F));
    REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
    CHECK(cloud->points.at(0).y() == 1.0);
    return cloud->points.at(0).x();
  };
  for (const auto* type : {"char", "int8"}) CHECK(read_with(type, raw(std::int8_t{-9})) == -9);
  for (const auto* type : {"uchar", "uint8"}) CHECK(read_with(type, raw(std::uint8_t{250})) == 250);
  for (const auto* type : {"short", "int16"})
    CHECK(read_with(type, raw(std::int16_t{-999})) == -999);
  for (const auto* type : {"ushort", "uint16"}) {
    CHECK(read_with(type, raw(std::uint16_t{65000})) == 65000);
  }
  for (const auto* type : {"int", "int32"}) CHECK(read_with(type, raw(-99999)) == -99999);
  for (const auto* type : {"uint", "uint32"}) CHECK(read_with(type, raw(4000000000U)) == 4e9);
  for (const auto* type : {"float", "float32"}) CHECK(read_with(type, raw(0.5F)) == 0.5);
  for (const auto* type : {"double", "float64"}) CHECK(read_with(type, raw(0.1)) == 0.1);
}

TEST_CASE("PLY: elements and lists around and inside the vertices are skipped") {
  const std::string elements =
      "element camera 2\nproperty list uchar int views\nproperty float f\n"
      "element nothing 1000000000000\n"
      "element frame 1\nproperty double t\n"
      "element vertex 2\nproperty float x\nproperty list uint16 double weights\n"
      "property float y\nproperty float z\n"
      "element face 2\nproperty list uchar int vertex_indices\n";
  const PointCloud expected{{1, 2, 3}, {4, 5, 6}};

  const auto ascii = read_as("a.ply", ply("ascii", elements) +
                                          "3 7 8 9 0.5\n0 0.5\n"
                                          "1.25\n"
                                          "1 0 2 3\n4 2 9.5 9.5 5 6\n"
                                          "3 0 1 1\n3 1 0 0\n");
  REQUIRE_MESSAGE(ascii, to_string(ascii.error()));
  CHECK(ascii->points == expected);

  const auto binary_content = [&](auto bytes) {
    return bytes(std::uint8_t{3}) + bytes(7) + bytes(8) + bytes(9) + bytes(0.5F) +
           bytes(std::uint8_t{0}) + bytes(0.5F) +  //
           bytes(1.25) +                           //
           bytes(1.F) + bytes(std::uint16_t{0}) + bytes(2.F) + bytes(3.F) + bytes(4.F) +
           bytes(std::uint16_t{2}) + bytes(9.5) + bytes(9.5) + bytes(5.F) + bytes(6.F) +
           bytes(std::uint8_t{3}) + bytes(0) + bytes(1) + bytes(1) + bytes(std::uint8_t{3}) +
           bytes(1) + bytes(0) + bytes(0);
  };
  const std::string little = binary_content([](auto value) { return raw(value); });
  const auto read_little = read_as("a.ply", ply("binary_little_endian", elements) + little);
  REQUIRE_MESSAGE(read_little, to_string(read_little.error()));
  CHECK(read_little->points == expected);

  const auto read_big =
      read_as("a.ply", ply("binary_big_endian", elements) +
                           binary_content([](auto value) { return reversed(value); }));
  REQUIRE_MESSAGE(read_big, to_string(read_big.error()));
  CHECK(read_big->points == expected);

  const std::string whole = ply("binary_little_endian", elements) + little;
  for (std::size_t size = 4; size < whole.size(); ++size) {
    CAPTURE(size);
    const auto cut = read_as("a.ply", whole.substr(0, size));
    REQUIRE_FALSE(cut.has_value());
    check_clear(cut.error(), ErrorCode::corrupt_data, "a.ply", "");
  }
}

TEST_CASE("PLY: no vertices is an empty cloud, no vertex element an error") {
  const auto cloud = read_as(
      "a.ply",
      ply("ascii", "element vertex 0\nproperty float x\nproperty float y\nproperty float z\n"));
  REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
  CHECK(cloud->points.empty());
  check_refused("a.ply", ply("ascii", "element face 0\nproperty list uchar int v\n"),
                "no element 'vertex'");
}

TEST_CASE("PLY: headers that make no sense are refused") {
  const auto with = [](const std::string& line) {
    return ply("ascii", kXyz + line + "\n") + "1 2 3\n4 5 6\n";
  };
  REQUIRE(read_as("a.ply", with("comment good")).has_value());
  check_refused("a.ply", with("property float x"), "a.ply:9: error: second property 'x'");
  check_refused("a.ply", with("property quad w"), "found 'quad'");
  check_refused("a.ply", with("property float"), "expected 'property <type> <name>'");
  check_refused("a.ply", with("property float a b"), "expected 'property <type> <name>'");
  check_refused("a.ply", with("property list float int a"), "must be an integer, found float");
  check_refused("a.ply", with("property list uchar a"), "expected");
  check_refused("a.ply", with("element vertex 2"), "second element 'vertex'");
  check_refused("a.ply", with("element face -1"), "found '-1'");
  check_refused("a.ply", with("element face"), "found ''");
  check_refused("a.ply", with("element face two"), "found 'two'");
  check_refused("a.ply", with("elephant"), "found 'elephant'");
  check_refused("a.ply", ply("morse", kXyz), "found 'morse'");
  check_refused("a.ply", "ply\nformat ascii 2.0\n" + kXyz + "end_header\n", "version 1.0");
  check_refused("a.ply", "ply\n" + kXyz + "end_header\n1 2 3\n4 5 6\n", "no format line");
  check_refused("a.ply", ply("ascii", "property float x\n" + kXyz), "before the first element");
  check_refused("a.ply", ply("ascii", "element vertex 1\nproperty float x\nproperty float y\n"),
                "no property z");
  check_refused("a.ply",
                ply("ascii",
                    "element vertex 1\nproperty float x\nproperty float y\n"
                    "property list uchar float z\n"),
                "property z of element 'vertex' is a list");
  check_refused("a.ply", "ply\nformat ascii 1.0\n" + kXyz, "the file ends at byte");
  check_refused("a.ply", "plywood\n", "expected the line 'ply'");
}

TEST_CASE("PLY: bodies that contradict the header are refused") {
  const std::string ascii = ply("ascii", kXyz);  // 9 lines
  check_refused("a.ply", ascii + "1 2 3\n4 five 6\n",
                "a.ply:11: error: expected a number for y, found 'five'");
  check_refused("a.ply", ascii + "1 2\n", "a.ply:10: error: the line ends before property 'z'");
  check_refused("a.ply", ascii + "1 2 3 4\n", "1 more values");
  check_refused("a.ply", ascii + "1 2 3\n", "after 1 of 2 elements 'vertex'");
  check_refused("a.ply", ascii + "1 2 3\n4 5 6\n7 8 9\n", "expected the end of the file");
  const std::string lists = ply("ascii", kXyz + "element face 1\nproperty list char int v\n");
  check_refused("a.ply", lists + "1 2 3\n4 5 6\n3 0 1\n", "after 2 of 3 values of list 'v'");
  check_refused("a.ply", lists + "1 2 3\n4 5 6\n-1 0 1\n", "found '-1'");
  check_refused("a.ply", lists + "1 2 3\n4 5 6\n18446744073709551615 0\n", "after 1 of");

  const std::string faces_first =
      ply("binary_little_endian", "element face 1\nproperty list int double v\n" + kXyz);
  check_refused("a.ply", faces_first + raw(-1) + std::string(64, '\0'), "length -1");
  check_refused("a.ply", faces_first + raw(2147483647) + std::string(64, '\0'),
                "inside element 'face'");
  check_refused(
      "a.ply",
      ply("binary_little_endian", "element face 1\nproperty list uint64 double v\n" + kXyz) +
          raw(~std::uint64_t{0}) + std::string(64, '\0'),
      "inside element 'face'");
}

TEST_CASE("PLY: absurd counts are refused without allocating for them") {
  for (const std::string format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    for (const std::string count :
         {"18446744073709551615", "1537228672809129302", "1000000000000"}) {
      CAPTURE(format);
      CAPTURE(count);
      std::string elements = kXyz;
      elements.replace(elements.find("vertex 2") + 7, 1, count);
      check_refused("a.ply", ply(format, elements) + "1 2 3\n4 5 6\n7 8 9\n", "the file ends");
      check_refused("a.ply", ply(format, elements + "property list uchar int l\n") + "1 2 3 0\n",
                    "the file ends");
    }
  }
}

TEST_CASE("PLY: random damage gives points or an error, never a crash" *
          doctest::test_suite("slow")) {
  std::mt19937 random(5);
  int refused = 0;
  for (const std::string format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    const std::string good =
        ply(format, "element face 2\nproperty list uchar int v\n" + kXyz) +
        (format == "ascii" ? "2 1 1\n1 3\n1 2 3\n4 5 6\n" : std::string(64, '\x01'));
    refused += test::check_damaged("a.ply", good, 2000, 3, random);
  }
  CHECK(refused > 1000);
}

TEST_CASE("PLY: a binary file of many blocks, between other elements") {
  constexpr int kPoints = 100'000;  // 2.4 MB
  std::string content =
      ply("binary_big_endian",
          "element sensor 2\nproperty uchar id\nelement vertex 100000\nproperty double z\n"
          "property double y\nproperty double x\nelement end 1\nproperty int16 mark\n");
  content += "ab";
  PointCloud expected;
  for (int k = 0; k < kPoints; ++k) {
    const bool bad = k % 40'000 == 0;
    const double x = bad ? std::numeric_limits<double>::infinity() : 0.1 * k;
    content += reversed(1.5) + reversed(-1.0 * k) + reversed(x);
    if (!bad) expected.push_back({0.1 * k, -1.0 * k, 1.5});
  }
  check_refused("a.ply", content + "c", "inside element 'end'");
  const auto cloud = read_as("a.ply", content + "cd");
  REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
  CHECK(cloud->points == expected);
  CHECK(cloud->dropped == 3);
}

}  // namespace
}  // namespace vantage
