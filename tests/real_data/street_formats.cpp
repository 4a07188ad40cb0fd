// The same scans give the same points and the same trajectory, whatever container they came in.
#include <doctest/doctest.h>

#include <cmath>
#include <fstream>
#include <string>
#include <tuple>
#include <unordered_set>
#include <vector>

#include "street.hpp"
#include "support/bags/cloud_bags.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/scan_source.hpp"

namespace fs = std::filesystem;

namespace vantage::test {
namespace {

std::vector<io::StampedScan> scans_of(const fs::path& path) {
  const auto source = io::open_scans({.path = path, .topic = {}});
  REQUIRE_MESSAGE(source, to_string(source.error()));
  std::vector<io::StampedScan> scans;
  for (;;) {
    auto scan = (*source)->next();
    REQUIRE_MESSAGE(scan, to_string(scan.error()));
    if (!*scan) break;
    scans.push_back(**std::move(scan));
  }
  CHECK((*source)->skipped().total() == 0);
  return scans;
}

/// Checks that `scans` are the first of `expected`, bit for bit.
void check_same(const std::vector<io::StampedScan>& scans,
                const std::vector<io::StampedScan>& expected) {
  REQUIRE(scans.size() <= expected.size());
  for (std::size_t i = 0; i < scans.size(); ++i) {
    CAPTURE(i);
    CHECK(scans[i].stamp == expected[i].stamp);
    CHECK(scans[i].points == expected[i].points);
    CHECK(scans[i].seconds == expected[i].seconds);
    CHECK(scans[i].dropped == 0);
  }
}

/// The scans' points as float32, which holds them as they are.
std::vector<FloatScan> float_scans(const std::vector<io::StampedScan>& scans) {
  std::vector<FloatScan> all;
  bool is_float32 = true;
  for (const io::StampedScan& scan : scans) {
    FloatScan& out = all.emplace_back();
    out.stamp = std::llround(scan.stamp * 1e9);
    for (const Point& p : scan.points) {
      const Eigen::Vector3f point = p.cast<float>();
      is_float32 = is_float32 && point.cast<double>() == p;
      out.points.push_back({point.x(), point.y(), point.z()});
    }
  }
  REQUIRE(is_float32);
  return all;
}

/// PCL's layout in one of the containers, so that both are read.
PointLayout layout_in(const CloudBag& bag) {
  return bag.name == "mcap_lz4" ? PointLayout::padded : PointLayout::packed;
}

void check_same_trajectory(const Run& run, const Run& expected) {
  REQUIRE(run.scans.size() == expected.scans.size());
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    CAPTURE(i);
    const ScanReport &is = run.scans[i].report, &wanted = expected.scans[i].report;
    CHECK(is.stamp == wanted.stamp);
    CHECK(is.tracking == wanted.tracking);
    CHECK(is.T_map_scan.translation == wanted.T_map_scan.translation);
    CHECK(is.T_map_scan.rotation.coeffs() == wanted.T_map_scan.rotation.coeffs());
  }
}

}  // namespace

TEST_CASE("street frames recorded by other programs are the same in every container") {
  const auto folder = real_data("formats");
  if (!folder) return;
  const auto all = scans_of(*folder / "rosbag1/kitti0005_5frames_none.bag");
  REQUIRE(all.size() == 5);
  for (const auto& [path, frames] :
       std::vector<std::pair<std::string, std::size_t>>{{"rosbag1/kitti0005_2frames_bz2.bag", 2},
                                                        {"rosbag1/kitti0005_3frames_lz4.bag", 3},
                                                        {"rosbag2/kitti0005_3frames", 3},
                                                        {"mcap/kitti0005_2frames_lz4.mcap", 2},
                                                        {"mcap/kitti0005_2frames_zstd.mcap", 2},
                                                        {"mcap/kitti0005_4frames_none.mcap", 4}}) {
    CAPTURE(path);
    const auto scans = scans_of(*folder / path);
    CHECK(scans.size() == frames);
    check_same(scans, all);
  }
}

TEST_CASE("the first recorded frame is the street's frame 0, which the map was made of") {
  // None of the street's scans is among the frames of the bags; the map begins with its frame 0,
  // thinned but not moved.
  const auto bag = real_data("formats/rosbag1/kitti0005_5frames_none.bag");
  const auto street = real_data("kitti_street");
  if (!bag || !street) return;
  const auto map = io::read_point_cloud(*street / "map.pcd");
  REQUIRE_MESSAGE(map, to_string(map.error()));
  const auto hash = [](const Point& p) {
    return std::hash<double>()(p.x()) ^ (std::hash<double>()(p.y() + 1000.0) << 1);
  };
  std::vector<std::size_t> in_map;
  for (const io::StampedScan& scan : scans_of(*bag)) {
    const std::unordered_set<Point, decltype(hash)> points(scan.points.begin(), scan.points.end(),
                                                           scan.points.size(), hash);
    in_map.push_back(0);
    for (const Point& p : map->points) in_map.back() += points.count(p);
  }
  CHECK(in_map[0] == 52924);
  for (std::size_t i = 1; i < in_map.size(); ++i) CHECK(in_map[i] < 100);  // by chance
}

TEST_CASE("street scans written into every container: the same points, the same trajectory") {
  const auto data = real_data("kitti_street");
  if (!data) return;
  const auto from_pcd = scans_of(*data / "scans");
  REQUIRE(from_pcd.size() == 77);
  const auto scans = float_scans(from_pcd);
  const Street street(*data, "wide");
  const auto localize = [&street](const fs::path& path) {
    RunInputs inputs = street.inputs(path);
    inputs.window.duration = 4.0;
    return street.localize(inputs);
  };
  const Run expected = localize(*data / "scans");
  CHECK(expected.scans.size() >= 20);
  CHECK(summarize(expected).tracked == expected.scans.size());
  for (const CloudBag& bag : cloud_bags()) {
    CAPTURE(bag.name);
    const TemporaryFolder folder;
    const fs::path path = folder.path() / bag.name;
    std::ofstream(path, std::ios::binary) << bag.write(scans, layout_in(bag));
    CHECK(io::open_scans({.path = path, .topic = {}}).value()->describe().format == bag.format);
    const auto read = scans_of(path);
    CHECK(read.size() == 77);
    check_same(read, from_pcd);
    check_same_trajectory(localize(path), expected);
  }
}

}  // namespace vantage::test
