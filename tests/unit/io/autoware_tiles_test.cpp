#include "io/autoware_tiles.hpp"

#include <random>

#include "files.hpp"

namespace vantage {
namespace {

using io::AutowareTiles;
using io::parse_autoware_tiles;
using test::check_clear;

constexpr const char* kName = "pointcloud_map_metadata.yaml";

void refused(std::string_view yaml, const std::string& expected) {
  CAPTURE(yaml);
  const auto tiles = parse_autoware_tiles(yaml, kName);
  REQUIRE_FALSE(tiles.has_value());
  check_clear(tiles.error(), ErrorCode::corrupt_data, kName, expected);
}

const AutowareTiles kTiles{.x_resolution = 20.0,
                           .y_resolution = 20.0,
                           .tiles = {{"map_1200_2500.pcd", 1200, 2500}, {"map_-20_0.pcd", -20, 0}}};

TEST_CASE("Autoware's metadata: lists in one line or below each other, quotes and comments") {
  for (const std::string_view yaml : {
           "x_resolution: 20.0\ny_resolution: 20.0\nmap_1200_2500.pcd: [1200, 2500]\n"
           "map_-20_0.pcd: [-20, 0]\n",
           "# made by hand\nmap_1200_2500.pcd:\n  - 1200\n  - 2500\n\"map_-20_0.pcd\": [ -20,0 ]\n"
           "y_resolution: 20\nx_resolution: 2e1\n",
           "--- {x_resolution: 20, y_resolution: 20.0, map_1200_2500.pcd: [1200, 2500], "
           "'map_-20_0.pcd': [-20, 0]}\n...\n",
           "x_resolution: 20.0\r\ny_resolution: 20.0\r\nmap_1200_2500.pcd: [1200, 2500]\r\n"
           "map_-20_0.pcd: [-20, 0]",
       }) {
    CAPTURE(yaml);
    const auto tiles = parse_autoware_tiles(yaml, kName);
    REQUIRE_MESSAGE(tiles, to_string(tiles.error()));
    CHECK(*tiles == kTiles);
  }
  CHECK(parse_autoware_tiles("x_resolution: 1\ny_resolution: 2.5", kName)->tiles.empty());
}

TEST_CASE("Autoware's metadata: what is written is read back") {
  CHECK(io::to_yaml(kTiles) ==
        "x_resolution: 20.0\ny_resolution: 20.0\nmap_1200_2500.pcd: [1200, 2500]\n"
        "map_-20_0.pcd: [-20, 0]\n");
  CHECK(parse_autoware_tiles(io::to_yaml(kTiles), kName).value() == kTiles);
}

TEST_CASE("Autoware's metadata: malformed") {
  const std::string good = "x_resolution: 20.0\ny_resolution: 20.0\n";
  REQUIRE(parse_autoware_tiles(good, kName));
  refused("", "expected a mapping of file names to corners");
  refused("- a\n- b\n", "expected a mapping of file names to corners, found a list");
  refused("text", "found 'text'");
  refused("y_resolution: 20.0\n", "there is no x_resolution");
  refused("x_resolution: 20.0\n", "there is no y_resolution");
  refused(good + "x_resolution: 20.0\n", ":3: error: 'x_resolution' occurs twice");
  refused(good + "a.pcd: [0, 0]\na.pcd: [20, 0]\n", ":4: error: 'a.pcd' occurs twice");
  for (const char* number : {"0", "-20", ".nan", ".inf", "nan", "inf", "1e999", "twenty", "''"}) {
    refused("y_resolution: 20\nx_resolution: " + std::string(number) + "\n",
            ":2: error: x_resolution must be a positive length in metres");
  }
  refused("x_resolution: [20]\n", "expected a length in metres, found a list");
  refused(good + "a.pcd: 3\n", ":3: error: expected the corner of 'a.pcd', two whole numbers");
  refused(good + "a.pcd:\n", "found ''");
  refused(good + "a.pcd: [1]\n", "found the end of the list");
  refused(good + "a.pcd: [1, 2, 3]\n", "found '3'");
  refused(good + "a.pcd: [1.5, 2]\n", "found '1.5'");
  refused(good + "a.pcd: [1, 99999999999999999999]\n", "found '99999999999999999999'");
  refused(good + "a.pcd: [[1, 2]]\n", "found a list");
  refused(good + "a.pcd: {x: 1, y: 2}\n", "found a mapping");
  refused(good + "origin: here\n", "expected the corner of 'origin'");
  refused(good + "[1, 2]: 3\n", "expected the name of a file, found a list");
  refused(good + "a.pcd: &here [1, 2]\nb.pcd: *here\n", ":4: error: expected the corner");
  for (const char* name :
       {"../a.pcd", "/etc/passwd", "tiles/a.pcd", ".", "..", "''", "\"a\\0b\""}) {
    refused(good + name + ": [0, 0]\n", "expected the name of a file in the folder of tiles");
  }
  refused(good + "a.pcd: [1, 2\n", "is no YAML");
  refused(good + "\tb: [1, 2]\n", "is no YAML");
  refused(good + "\xff\xfe\x01", "is no YAML");
  refused(good + "---\nb: 1\n", "expected the end of the only document");
  refused(good + std::string(100'000, '['), "error: ");
  refused(good + "a.pcd: " + std::string(100'000, '['), "error: ");
  refused(good + std::string(100'000, 'x') + ": 1\n", "error: ");
}

TEST_CASE("Autoware's metadata: any bytes give tiles or one line") {
  const std::string good = io::to_yaml(kTiles);
  for (std::size_t size = 0; size < good.size(); ++size) {
    const auto tiles = parse_autoware_tiles(std::string_view(good).substr(0, size), kName);
    if (!tiles) check_clear(tiles.error(), ErrorCode::corrupt_data, kName, "");
  }
  std::mt19937 random(3);
  for (int round = 0; round < 20'000; ++round) {
    std::string noise = good;
    for (int i = 0; i < 3; ++i) noise[random() % noise.size()] = static_cast<char>(random() & 0xff);
    const auto tiles = parse_autoware_tiles(noise, kName);
    if (!tiles) check_clear(tiles.error(), ErrorCode::corrupt_data, kName, "");
  }
}

}  // namespace
}  // namespace vantage
