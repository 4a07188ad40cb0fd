// Point clouds, scans and trajectories that other programs wrote. The expected numbers come from
// reading the files with Python's struct module.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <vector>

#include "files.hpp"
#include "io/scan_sequence.hpp"
#include "vantage/io/trajectory_io.hpp"

namespace vantage {
namespace {

using test::check_clear;
using test::real_data;

struct ExpectedCloud {
  const char* file;
  std::size_t points;
  Point first, last, sum;
};

void check_cloud(const std::filesystem::path& path, const ExpectedCloud& expected) {
  CAPTURE(path.string());
  const auto cloud = io::read_point_cloud(path);
  REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
  REQUIRE(cloud->points.size() == expected.points);
  CHECK(cloud->dropped == 0);
  CHECK(cloud->points.front() == expected.first);
  CHECK(cloud->points.back() == expected.last);
  Point sum = Point::Zero();
  for (const Point& p : cloud->points) sum += p;
  CHECK((sum - expected.sum).norm() <= 1e-9 * expected.sum.norm());
}

std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder,
                                            const std::vector<std::string>& suffixes) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (std::count(suffixes.begin(), suffixes.end(), entry.path().extension().string()) > 0) {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

TEST_CASE("recorded: PCD and PLY files of other programs") {
  const auto folder = real_data("formats");
  if (!folder) return;
  const ExpectedCloud files[] = {
      {"pcd/nebula_vlp16_1673400472138016708.pcd",
       14831,
       {0.9658387303352356, -0.005225741770118475, 0.0168590247631073},
       {0.7166033983230591, 0.012758709490299225, 0.192043736577034},
       {-15976.413811807754, 5498.52846281993, 5695.354016476311}},
      {"pcd/pdal_autzen-utm.pcd",
       1065,
       {494428.61, 4877455.58, 131.57},
       {494490.24, 4878741.67, 129.21},
       {526636816.6400003, 5195213595.259997, 140913.34000000005}},
      {"pcd/ouster_cloud-ascii.pcd", 1, {1, 2, 3}, {1, 2, 3}, {1, 2, 3}},
      {"pcd/ouster_cloud-binary.pcd", 1, {1, 2, 3}, {1, 2, 3}, {1, 2, 3}},
      {"ply/ouster_cloud-ascii.ply", 1, {1, 2, 3}, {1, 2, 3}, {1, 2, 3}},
      {"ply/pdal_simple_binary.ply", 3, {-1, 0, 0}, {1, 0, 0}, {0, 1, 0}},
      {"ply/pdal_simple_text.ply", 3, {-1, 0, 0}, {1, 0, 0}, {0, 1, 0}},
  };
  for (const ExpectedCloud& expected : files) check_cloud(*folder / expected.file, expected);

  const auto ascii = io::read_point_cloud(*folder / "pcd/pcl_sac_plane_test.pcd");
  REQUIRE_MESSAGE(ascii, to_string(ascii.error()));
  CHECK(ascii->points.size() == 3283);
  CHECK(ascii->points.front() == Point(1.068, 0.094720997, -0.016231));
  CHECK(ascii->points.back() == Point(1.2798001, -0.41073, -0.18623));

  const auto source = io::read_point_cloud(*folder / "ply/small_gicp_source.ply");
  REQUIRE_MESSAGE(source, to_string(source.error()));
  REQUIRE(source->points.size() == 69792);
  CHECK(source->points.front() ==
        Point(0.004045109264552593, 2.5751945972442627, -1.5272173881530762));
  CHECK(source->points.back() ==
        Point(-0.004093721974641085, 1.804250717163086, 0.3399392366409302));
}

TEST_CASE("recorded: no PCD or PLY file is left out of the test above") {
  const auto folder = real_data("formats");
  if (!folder) return;
  std::size_t files = 0;
  for (const auto* name : {"pcd", "ply"}) {
    for (const auto& path : files_in(*folder / name, {".pcd", ".ply"})) {
      const auto cloud = io::read_point_cloud(path);
      REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
      CHECK(cloud->points.size() > 0);
      ++files;
    }
  }
  CHECK(files >= 9);
}

TEST_CASE("recorded: malformed files are refused with a clear line") {
  const auto folder = real_data("formats/malformed");
  if (!folder) return;
  const std::pair<const char*, const char*> files[] = {
      {"missingheader.pcd", ":1: error: expected a PCD header line"},
      {"no_vertex.ply", ":3: error: the PLY header has no element 'vertex'"},
      {"unsized_dims.ply", "element 'vertex' has no property z"},
      {"empty_pcap.pcap", "unknown format"},
      {"bad_vlr_count.las", "variable length record 3 of 3 (counted at byte 100) is at byte 429"},
      {"garbage_nVariableLength.las", "1069128089 variable length records according to byte 100"},
  };
  for (const auto& [file, expected] : files) {
    const auto cloud = io::read_point_cloud(*folder / file);
    REQUIRE_FALSE(cloud.has_value());
    check_clear(cloud.error(), ErrorCode::corrupt_data, file, expected);
  }
  for (const auto& path : files_in(*folder, {".pcd", ".ply"})) {
    CAPTURE(path.string());
    CHECK_FALSE(io::read_point_cloud(path).has_value());
  }
}

TEST_CASE("recorded: a file cut at every 97th byte is refused") {
  struct Cut {
    const char* file;
    std::size_t complete;  // the bytes that hold all points; what follows is padding
  };
  const Cut cuts[] = {
      {"formats/pcd/nebula_vlp16_1673400472138016708.pcd", 282 + 14831 * 32},
      {"formats/pcd/pdal_autzen-utm.pcd", 368 + 1065 * 52},
      {"kitti_street/scans/000001.pcd", 172 + 45429 * 12},
      {"formats/pcd/pcl_sac_plane_test.pcd", 250'720 - 80},  // the last line may lose its end
      {"formats/ply/small_gicp_source.ply", 1'116'940},
  };
  for (const Cut& cut : cuts) {
    const auto path = real_data(cut.file);
    if (!path) return;
    CAPTURE(path->string());
    REQUIRE(cut.complete <= std::filesystem::file_size(*path));
    const test::TemporaryFolder folder;
    const auto copy = test::put(folder.path() / path->filename(), test::content_of(*path));
    // Downwards, so that each cut is a truncation of the copy before.
    for (std::size_t size = (cut.complete - 1) / 97 * 97;; size -= 97) {
      CAPTURE(size);
      std::filesystem::resize_file(copy, size);
      const auto cloud = io::read_point_cloud(copy);
      REQUIRE_FALSE(cloud.has_value());
      REQUIRE(cloud.error().code == ErrorCode::corrupt_data);
      REQUIRE(to_string(cloud.error()).find('\n') == std::string::npos);
      REQUIRE(to_string(cloud.error()).find(copy.string()) != std::string::npos);
      if (size == 0) break;
    }
  }
}

TEST_CASE("recorded: the street map, its scans and its reference") {
  const auto folder = real_data("kitti_street");
  if (!folder) return;
  check_cloud(*folder / "map.pcd", {"map.pcd",
                                    862424,
                                    {22.7189998626709, 0.03099999949336052, 0.9769999980926514},
                                    {64.28443145751953, 6.947351455688477, -1.6864746809005737},
                                    {19775591.826574877, 10860275.698085932, -834903.341057099}});

  const auto scans = io::ScanSequence::open(*folder / "scans", 10.0);
  REQUIRE_MESSAGE(scans, to_string(scans.error()));
  REQUIRE(scans->size() == 77);
  CHECK(scans->stamp_rule().find("frame numbers") != std::string::npos);
  const auto first = scans->read(0);
  REQUIRE_MESSAGE(first, to_string(first.error()));
  CHECK(std::filesystem::path(first->name).filename() == "000001.pcd");
  CHECK(first->points.size() == 45429);

  const auto tum = io::read_trajectory(*folder / "ref_poses_tum.txt");
  REQUIRE_MESSAGE(tum, to_string(tum.error()));
  const auto kitti = io::read_trajectory(*folder / "ref_poses.txt");
  REQUIRE_MESSAGE(kitti, to_string(kitti.error()));
  REQUIRE(tum->size() == 77);
  REQUIRE(kitti->size() == 77);
  for (std::size_t i = 0; i < scans->size(); ++i) {
    CAPTURE(i);
    CHECK((*tum)[i].stamp == scans->stamp(i));
    CHECK((*kitti)[i].stamp == scans->stamp(i));
    CHECK(((*tum)[i].pose.translation - (*kitti)[i].pose.translation).norm() < 1e-3);
    CHECK(rotation_between((*tum)[i].pose, (*kitti)[i].pose) < 1e-5);
    CHECK(io::pose_at(*tum, scans->stamp(i)).has_value());
  }
}

TEST_CASE("recorded: a map of 862,424 points is read in less than a second") {
  const auto map = real_data("kitti_street/map.pcd");
  if (!map) return;
  auto best = std::chrono::duration<double>::max();
  for (int run = 0; run < 5; ++run) {
    const auto start = std::chrono::steady_clock::now();
    const auto cloud = io::read_point_cloud(*map);
    REQUIRE(cloud.has_value());
    best = std::min<std::chrono::duration<double>>(best, std::chrono::steady_clock::now() - start);
  }
  std::cout << "read_point_cloud: " << best.count() * 1e3
            << " ms for 862,424 points (binary PCD)\n";
  CHECK(best.count() < 1.0);  // an order of magnitude above what it takes, for sanitizer builds
}

}  // namespace
}  // namespace vantage
