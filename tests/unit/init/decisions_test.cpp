#include "init/decisions.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "evaluation/degrees.hpp"
#include "terminal/shell_word.hpp"
#include "vantage/engine/config.hpp"

namespace vantage::init {
namespace {

constexpr std::uint64_t kMiB = 1U << 20U;

/// A street of 12,000 square metres, recorded by a sensor 1.73 m above it that sees 76 m far.
Known street() {
  Known known;
  known.map.points = 860'000;
  known.map.spacing = 0.111;
  known.map.flat_share = 0.54;
  known.cells = {.cells = 13'000, .area = 12'000.0};
  known.scans.emplace();
  known.scans->scans = 5;
  known.scans->points = 40'000.0;
  for (int k = 0; k < 1000; ++k) {
    known.scans->ranges.push_back(3.0F + 0.073F * static_cast<float>(k));
  }
  known.scans->elevations = {-0.42, -0.1, 0.03};
  known.scans->below = checks::GroundPlane{.distance = 1.734, .tilt = 0.01, .share = 0.7};
  known.files = "map.pcd";
  known.root = "maps/street";
  known.memory = 40 * kMiB;
  return known;
}
/// The same street as a part of a large map.
Known city() {
  Known known = street();
  known.cells = {.cells = 2'000'000, .area = 2e6};
  return known;
}

std::string value_of(const std::vector<Decision>& decisions, const std::string& key) {
  const auto found = std::ranges::find_if(
      decisions, [&](const Decision& d) { return d.table + "." + d.key == key; });
  return found == decisions.end() ? "none" : found->value;
}
std::string decided(const Known& known, const std::string& key) {
  const auto decisions = decide(known);
  REQUIRE_MESSAGE(decisions, to_string(decisions.error()));
  return value_of(*decisions, key);
}

TEST_CASE("every decision is a configuration that parses, with a reason for what is not given") {
  for (const Known& known : {street(), city()}) {
    const auto decisions = decide(known);
    REQUIRE(decisions);
    const std::string text = to_toml(*decisions, {"a head", ""});
    CHECK(text.starts_with("# a head\n#\nschema = 1\n"));
    const auto table = parse_toml(text, "made");
    REQUIRE_MESSAGE(table, to_string(table.error()), text);
    const auto config = parse_config(*table);
    REQUIRE_MESSAGE(config, to_string(config.error()));
    for (const Decision& d : *decisions) {
      if (d.table.empty() || d.key == "files") continue;
      CHECK_MESSAGE(!d.why.empty(), d.table, ".", d.key);
    }
    std::size_t begin = 0;
    for (std::size_t end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
      if (text[begin] == '#') CHECK(end - begin <= 100);
    }
  }
}

TEST_CASE("a map that fits into the memory is one region, and a larger one is cut") {
  CHECK(decided(street(), "partitioner.plugin") == "\"whole_map\"");
  CHECK(decided(street(), "visibility.plugin") == "\"keep_all\"");
  CHECK(decided(street(), "localizer.scan_max_range") == "none");
  CHECK(decided(street(), "localizer.map_memory") == "40.0");

  CHECK(decided(city(), "partitioner.plugin") == "\"uniform_grid\"");
  CHECK(decided(city(), "visibility.plugin") == "\"surface\"");
  CHECK(decided(city(), "visibility.params") == "{ point_spacing = 0.11 }");
  CHECK(decided(city(), "visibility.max_range") == "80.0");
  CHECK(decided(city(), "localizer.scan_max_range") == "80.0");
}

TEST_CASE("more memory makes wider regions, and little memory a choice of cells") {
  Known known = city();
  const auto width = [&](std::uint64_t mebibytes) {
    known.memory = mebibytes * kMiB;
    return decided(known, "partitioner.params");
  };
  CHECK(width(40) == "{ cell_width = 50.0 }");  // 210 m of reach: 4 * 180 * 44,100 bytes
  CHECK(width(28) == "{ cell_width = 30.0 }");  // 190 m
  CHECK(width(23) == "{ cell_width = 20.0 }");  // 180 m
  CHECK(decided(known, "selector.plugin") == "none");
  CHECK(width(8) == "{ cell_width = 20.0 }");
  CHECK(decided(known, "selector.plugin") == "\"contribution\"");
  CHECK(decided(known, "selector.max_bytes") == "80000");
  CHECK(decided(known, "selector.lowest") == "-24.0");
  CHECK(decided(known, "selector.highest") == "-6.0");  // of three elevations
  known.memory = kMiB;
  CHECK(decided(known, "selector.max_bytes") == "16000");
  known.memory = kMiB / 2;
  const auto refused = decide(known);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message ==
        "region maps that are useful take about 0.6 MB together: --memory is too little");
}

TEST_CASE("a map without ground has viewpoints along a trajectory, or is one region") {
  Known known = street();
  known.map.flat_share = 0.21;
  CHECK(decided(known, "partitioner.plugin") == "\"whole_map\"");
  CHECK(decided(known, "ground.plugin") == "\"pmf\"");  // a build needs one
  known.trajectory = "path.tum";
  CHECK(decided(known, "ground.plugin") == "none");
  CHECK(decided(known, "viewpoints.source") == "\"trajectory\"");
  known = city();
  known.map.flat_share = 0.21;
  const auto refused = decide(known);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message ==
        "the map has no ground above which viewpoints could stand (21 % of its ground plan is "
        "flat), and as one region it takes about 360.0 MB, which is more than --memory: give "
        "--trajectory or more memory");
  known.trajectory = "path.tum";
  CHECK(decided(known, "map.trajectory") == "\"path.tum\"");
  CHECK(decided(known, "partitioner.plugin") == "\"trajectory\"");
  CHECK(decided(known, "viewpoints.source") == "\"trajectory\"");
  CHECK(decided(known, "viewpoints.sensor_height") == "none");
}

TEST_CASE("the sensor's height is measured, or left to the user") {
  Known known = street();
  CHECK(decided(known, "viewpoints.sensor_height") == "1.75");  // in steps of 5 cm
  known.scans->below->share = 0.1;
  CHECK(decided(known, "viewpoints.sensor_height") == "1.0");
  known.scans->above = checks::GroundPlane{.distance = 0.8, .tilt = 0.0, .share = 0.6};
  CHECK(decided(known, "viewpoints.sensor_height") == "1.0");
  known.imu.emplace();  // which tells that the sensor hangs upside down
  CHECK(decided(known, "viewpoints.sensor_height") == "0.8");
  known.scans.reset();
  const auto decisions = decide(known);
  REQUIRE(decisions);
  CHECK(to_toml(*decisions, {}).find("# YOURS: the height of the sensor") != std::string::npos);
}

TEST_CASE("cells are as large as the map's density asks for") {
  CHECK(decided(street(), "matcher.params") == "{ resolution = 1.0 }");
  Known known = street();
  known.map.spacing = 0.5;
  CHECK(decided(known, "matcher.params") == "{ resolution = 2.0 }");
}

TEST_CASE("near points, tilt, and times of points") {
  Known known = street();
  CHECK(decided(known, "localizer.scan_min_range") == "1.0");
  CHECK(decided(known, "localizer.gravity") == "none");
  CHECK(decided(known, "localizer.undistort") == "true");
  known.scans->ranges.assign(100, 0.5F);
  CHECK(decided(known, "localizer.scan_min_range") == "0.0");
  known.scans->below->tilt = 15.0 / kDegrees;
  CHECK(decided(known, "localizer.gravity") == "\"unknown\"");
  known.imu.emplace();
  CHECK(decided(known, "localizer.gravity") == "none");
  known.scans->timed = true;
  known.scans->sweep = 0.1;
  CHECK(decided(known, "localizer.undistort") == "true");
  known.scans->sweep = 1e8;
  CHECK(decided(known, "localizer.undistort") == "false");
}

TEST_CASE("the IMU's mount, in metres and radians") {
  Known known = street();
  known.imu.emplace();
  known.imu->T_sensor_imu = pose_from_xyz_rpy({0.01, -0.5, 0.0}, {3.14159265, 0.0, 0.25});
  CHECK(decided(known, "localizer.T_sensor_imu") == "[0.01, -0.5, 0.0, 3.1416, 0.0, 0.25]");
}

TEST_CASE("gravity has to point to the ground that the scans show") {
  checks::ScanFacts scans;
  CHECK(agrees_with_ground({0.0, 1.0, 0.0}, scans));
  scans.below = checks::GroundPlane{.distance = 1.7, .tilt = 0.0, .share = 0.7};
  CHECK(agrees_with_ground({0.0, 0.0, -1.0}, scans));
  CHECK_FALSE(agrees_with_ground({0.0, 0.0, 1.0}, scans));
  CHECK_FALSE(agrees_with_ground({0.0, -1.0, 0.0}, scans));
  scans.above = checks::GroundPlane{.distance = 0.8, .tilt = 0.0, .share = 0.8};
  CHECK(agrees_with_ground({0.0, 0.0, 1.0}, scans));
}

TEST_CASE("cells with six points count, and the ground plan that holds any") {
  PointCloud map(6, Point(0.5, 0.5, 0.5));
  map.insert(map.end(), 5, Point(-0.5, 0.5, 0.5));
  const CellCount count = count_cells(map, 1.0);
  CHECK(count.cells == 1);
  CHECK(count.area == 200.0);
  CHECK(count_cells({}, 1.0).cells == 0);
}

TEST_CASE("a bundle is called as the configuration or the map is") {
  CHECK(bundle_name("campus.toml") == "campus");
  CHECK(bundle_name("config/campus.v2.toml") == "campus.v2");
  CHECK(bundle_name("survey/") == "survey");
  CHECK(bundle_name("survey/.") == "survey");
  for (const char* none :
       {"", ".", "..", "../..", "/", "tiles/*.pcd", "tile_?.pcd", "tile_[0-9].pcd"}) {
    CAPTURE(none);
    CHECK(bundle_name(none) == "map");
  }
}

TEST_CASE("words for the shell") {
  CHECK(cli::shell_word("scans/a.pcd") == "scans/a.pcd");
  CHECK(cli::shell_word("my map.pcd") == "'my map.pcd'");
  CHECK(cli::shell_word("") == "''");
  CHECK(cli::shell_quoted("it's") == "'it'\\''s'");
}

}  // namespace
}  // namespace vantage::init
