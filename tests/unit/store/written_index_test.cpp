#include "common/written_index.hpp"

#include <doctest/doctest.h>

#include <limits>
#include <random>

#include "format.hpp"

namespace vantage::bundle_folder {
namespace {

using pcd_tiles::kFormat;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Footprints of every sort, numbers of every size.
BundleIndex sample(std::size_t regions) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> exponent(-12.0, 12.0), mantissa(-1.0, 1.0);
  const auto number = [&] { return mantissa(random) * std::pow(10.0, exponent(random)); };
  const auto box = [&] {
    const Eigen::Vector2d a(number(), number()), b(number(), number());
    return HalfOpenBox{a.cwiseMin(b), a.cwiseMax(b)};
  };
  std::vector<Region> list;
  BundleIndex index;
  for (std::size_t r = 0; r < regions; ++r) {
    Region region{"r" + std::to_string(r), box(), {}};
    if (r % 3 == 1) region.footprint = BoxUnion{{box(), box()}};
    if (r % 3 == 2) region.footprint = ConvexPolygon{{{0.1, 0.0}, {1e6, 0.0}, {0.3, 5e-3}}};
    if (r % 2 == 1) region.height = {-1.0 / 3.0, kInfinity};
    list.push_back(region);
    RegionFile tile{.points = 1 + random() % 1000,
                    .viewpoints = random() % 100,
                    .elements = random(),
                    .prepared_bytes = 1 + random() % 1000,
                    .origin = {number(), -0.0, number()}};
    if (r % 2 == 1) tile.max_views = static_cast<std::uint32_t>(1 + random() % 100);
    tile.bytes = pcd_tiles::file_size(tile);
    tile.checksum = random();
    index.files.push_back(tile);
    index.map.regions.push_back(tile.summary());
  }
  index.map.partition = Partition::from(std::move(list)).value();
  index.map.map_bounds = {Point(-1.0 / 3.0, 0.1, -0.0), Point(1e6, 5e6 + 0.1, kInfinity)};
  index.map.map_points = std::numeric_limits<std::uint64_t>::max();
  index.map.config = "schema = 1\n# \"quoted\" \\ text, {[ä]}, \t tab, \x01\n";
  return index;
}

void check_equal(const BundleIndex& a, const BundleIndex& b) {
  CHECK(a.map.partition.regions() == b.map.partition.regions());
  CHECK(a.map.map_bounds.min == b.map.map_bounds.min);
  CHECK(std::signbit(a.map.map_bounds.min.z()) == std::signbit(b.map.map_bounds.min.z()));
  CHECK(a.map.map_bounds.max == b.map.map_bounds.max);
  CHECK(a.map.map_points == b.map.map_points);
  CHECK(a.map.config == b.map.config);
  REQUIRE(a.files.size() == b.files.size());
  for (std::size_t r = 0; r < a.files.size(); ++r) {
    CHECK(a.files[r].points == b.files[r].points);
    CHECK(a.files[r].viewpoints == b.files[r].viewpoints);
    CHECK(a.files[r].elements == b.files[r].elements);
    CHECK(a.files[r].prepared_bytes == b.files[r].prepared_bytes);
    CHECK(a.files[r].origin == b.files[r].origin);
    CHECK(a.files[r].bytes == b.files[r].bytes);
    CHECK(a.files[r].checksum == b.files[r].checksum);
    CHECK(a.files[r].max_views == b.files[r].max_views);
    CHECK(a.map.regions[r].max_views == b.map.regions[r].max_views);
    CHECK(a.map.regions[r].points == b.map.regions[r].points);
    CHECK(a.map.regions[r].viewpoints == b.map.regions[r].viewpoints);
    CHECK(a.map.regions[r].elements == b.map.regions[r].elements);
    CHECK(a.map.regions[r].bytes == b.map.regions[r].bytes);
  }
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  REQUIRE(at != std::string::npos);
  return text.replace(at, what.size(), by);
}

TEST_CASE("what a build writes is read in one pass, bit for bit, in any layout") {
  const BundleIndex index = sample(200);
  const std::string text = to_json(kFormat, index).value();
  const auto read = read_as_written(kFormat, text);
  REQUIRE(read);
  check_equal(*read, index);

  std::string one_line;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"' && text[i - 1] != '\\') in_string = !in_string;
    if (in_string || (text[i] != '\n' && text[i] != ' ')) one_line += text[i];
  }
  REQUIRE(one_line.size() < text.size());
  const auto again = read_as_written(kFormat, one_line);
  REQUIRE(again);
  check_equal(*again, index);
}

TEST_CASE("what is spelt another way is left to the reader of any JSON, which gives the same") {
  const BundleIndex index = sample(5);
  const std::string text = to_json(kFormat, index).value();
  for (const std::string& other :
       {replaced(text, "1000000.0", "1e6"), replaced(text, "\"r1\"", "\"\\u00721\""),
        replaced(text, "\\t", "\\u0009")}) {
    const auto read = from_json(kFormat, other, "index.json");
    REQUIRE_MESSAGE(read, to_string(read.error()));
    check_equal(*read, index);
  }
  CHECK_FALSE(read_as_written(kFormat, replaced(text, "1000000.0", "1e6")));
}

TEST_CASE("an index that contradicts itself is not read, whatever its checksum says") {
  const auto refused = [](void (*change)(RegionFile&), const std::string& member) {
    BundleIndex index = sample(3);
    change(index.files[1]);
    const std::string text = to_json(kFormat, index).value();
    CHECK_FALSE(read_as_written(kFormat, text));
    const auto read = from_json(kFormat, text, "index.json");
    REQUIRE_FALSE(read);
    CHECK(read.error().code == ErrorCode::corrupt_data);
    CHECK_MESSAGE(read.error().message.find("'regions[1]." + member + "'") != std::string::npos,
                  read.error().message);
  };
  refused([](RegionFile& tile) { tile.bytes += 1; }, "bytes");
  refused([](RegionFile& tile) { tile.viewpoints += 1; }, "bytes");
  refused([](RegionFile& tile) { tile.prepared_bytes += 4; }, "bytes");
  refused([](RegionFile& tile) { tile.max_views = 0; }, "bytes");
  refused(
      [](RegionFile& tile) {
        tile.points = 0;
        tile.bytes = pcd_tiles::file_size(tile);
      },
      "max_views");
  refused([](RegionFile& tile) { tile.origin.x() = kInfinity; }, "origin");
  refused(
      [](RegionFile& tile) {
        tile.points = kMaxPoints + 1;
        tile.bytes = pcd_tiles::file_size(tile);
      },
      "points");
  refused(
      [](RegionFile& tile) {
        tile.viewpoints = kMaxPoints + 1;
        tile.bytes = pcd_tiles::file_size(tile);
      },
      "viewpoints");
  refused(
      [](RegionFile& tile) {
        tile.prepared_bytes = kMaxPreparedBytes + 1;
        tile.bytes = pcd_tiles::file_size(tile);
      },
      "prepared_bytes");
  refused(
      [](RegionFile& tile) {
        tile.prepared_bytes = 0;
        tile.bytes = pcd_tiles::file_size(tile);
      },
      "elements");
}

TEST_CASE("no damage is read: every byte but white space counts") {
  const BundleIndex index = sample(3);
  const std::string text = to_json(kFormat, index).value();
  std::mt19937 random(4);
  int refused = 0;
  for (std::size_t at = 0; at < text.size(); ++at) {
    std::string bad = text;
    bad[at] = "\"{}[]:,09a-. \n\\\xff"[random() % 16];
    const auto read = read_as_written(kFormat, bad);
    if (read) check_equal(*read, index);  // white space for white space
    refused += read ? 0 : 1;
    if (at + 1 < text.size()) {  // without its last line feed it is whole
      CHECK_FALSE(read_as_written(kFormat, std::string_view(text).substr(0, at)));
    }
  }
  CHECK(refused > 100);
}

}  // namespace
}  // namespace vantage::bundle_folder
