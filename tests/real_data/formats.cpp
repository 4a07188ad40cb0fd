// Every recording and point cloud of other programs is read, or refused with a clear line.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "support/real_data.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/scan_source.hpp"

namespace fs = std::filesystem;

namespace vantage::test {
namespace {

struct Recording {
  std::string path, format, topic;
  std::vector<std::size_t> points;  // of each scan
  std::size_t incomplete = 0;       // scans left out
};
struct Cloud {
  std::string path;
  std::size_t points = 0;
};
struct Refused {
  std::string path, error;
};

// Points were counted with Python's struct and sqlite3: in the messages' headers; in captures the
// returns that are not zero (of two that are equal, one) from an azimuth of 0 to the next.
const std::vector<Recording> kRecordings{
    {"mcap/kitti0005_2frames_lz4.mcap", "MCAP (lz4)", "/points_raw", {123398, 123224}},
    {"mcap/kitti0005_2frames_zstd.mcap", "MCAP (zstd)", "/points_raw", {123398, 123224}},
    {"mcap/kitti0005_4frames_none.mcap",
     "MCAP (none)",
     "/points_raw",
     {123398, 123224, 122478, 122517}},
    {"pcap/velodyne_hdl32.pcap",
     "pcap (HDL-32E, strongest return)",
     "192.168.17.162:443",
     {57734, 57882},
     2},
    {"pcap/velodyne_vlp16_gps.pcap",
     "pcap (VLP-16, strongest return)",
     "10.0.0.100:2368",
     {18561, 18554, 18482},
     2},
    {"rosbag1/kitti0005_2frames_bz2.bag", "rosbag1 2.0 (bz2)", "/points_raw", {123398, 123224}},
    {"rosbag1/kitti0005_3frames_lz4.bag",
     "rosbag1 2.0 (lz4)",
     "/points_raw",
     {123398, 123224, 122478}},
    {"rosbag1/kitti0005_5frames_none.bag",
     "rosbag1 2.0 (none)",
     "/points_raw",
     {123398, 123224, 122478, 122517, 122692}},
    {"rosbag2/kitti0005_3frames", "rosbag2 (SQLite)", "/points_raw", {123398, 123224, 122478}},
    // Cut between the lasers of a firing; cut between firings it is 14821, 14845, 14879.
    {"rosbag2/nebula_vlp16",
     "rosbag2 (SQLite) (VLP-16, dual return)",
     "/velodyne_packets",
     {14813, 14853, 14879},
     2},
};
const std::vector<Cloud> kClouds{
    {"las/1.2-with-color.las", 1065},
    {"las/autzen_trim.las", 110000},
    {"las/no-points.las", 0},
    {"las/perm_1.0_0.las", 1},
    {"las/perm_1.1_0.las", 1},
    {"las/perm_1.2_3.las", 1},
    {"las/simple.las", 1065},
    {"las/test1_4.las", 1000},
    {"pcd/nebula_vlp16_1673400472138016708.pcd", 14831},
    {"pcd/ouster_cloud-ascii.pcd", 1},
    {"pcd/ouster_cloud-binary.pcd", 1},
    {"pcd/pcl_sac_plane_test.pcd", 3283},
    {"pcd/pdal_autzen-utm.pcd", 1065},
    {"ply/ouster_cloud-ascii.ply", 1},
    {"ply/pdal_simple_binary.ply", 3},
    {"ply/pdal_simple_text.ply", 3},
    {"ply/small_gicp_source.ply", 69792},
};
const std::vector<Refused> kRefused{
    {"malformed/bad_vlr_count.las",
     ": error: variable length record 3 of 3 (counted at byte 100) is at byte 429, too near to "
     "byte "
     "429, where the points begin"},
    {"malformed/empty_pcap.pcap",
     ": error: no data packets of a Velodyne sensor (UDP, 1206 bytes), found no packets at all"},
    {"malformed/garbage_nVariableLength.las",
     ": error: 1069128089 variable length records according to byte 100, expected 0 at most: the "
     "header ends at byte 227, the points begin at byte 227"},
    {"malformed/missingheader.pcd",
     ":1: error: expected a PCD header line (VERSION, FIELDS, SIZE, TYPE, COUNT, WIDTH, HEIGHT, "
     "VIEWPOINT, POINTS, DATA), found '289814.15 4320978.61 170.76'"},
    {"malformed/no_vertex.ply", ":3: error: the PLY header has no element 'vertex'"},
    {"malformed/unsized_dims.ply",
     ":9: error: element 'vertex' has no property z; a point cloud needs x, y and z"},
};

/// Files, and bags that are folders, below `folder`.
std::vector<std::string> recorded_in(const fs::path& folder) {
  std::vector<std::string> found;
  for (auto entry = fs::recursive_directory_iterator(folder); entry != fs::end(entry); ++entry) {
    const bool is_bag = fs::exists(entry->path() / "metadata.yaml");
    if (is_bag) entry.disable_recursion_pending();
    if (is_bag || !entry->is_directory()) {
      found.push_back(entry->path().lexically_relative(folder).generic_string());
    }
  }
  return found;
}

bool is_cloud(const fs::path& path) {
  const auto suffix = path.extension();
  return suffix == ".las" || suffix == ".pcd" || suffix == ".ply";
}

void check_recording(const fs::path& path, const Recording& expected) {
  const auto scans = io::open_scans({.path = path, .topic = {}});
  REQUIRE_MESSAGE(scans, to_string(scans.error()));
  CHECK((*scans)->describe().format == expected.format);
  CHECK((*scans)->describe().topic == expected.topic);
  std::vector<std::size_t> points;
  for (;;) {
    const auto scan = (*scans)->next();
    REQUIRE_MESSAGE(scan, to_string(scan.error()));
    if (!*scan) break;
    CHECK((*scan)->dropped == 0);
    points.push_back((*scan)->points.size() + (*scan)->no_returns);
  }
  CHECK(points == expected.points);
  CHECK((*scans)->skipped().incomplete == expected.incomplete);
  CHECK((*scans)->skipped().not_later == 0);
}

Error refusal(const fs::path& path) {
  if (is_cloud(path)) {
    const auto cloud = io::read_point_cloud(path);
    REQUIRE_FALSE(cloud.has_value());
    return cloud.error();
  }
  const auto scans = io::open_scans({.path = path, .topic = {}});
  REQUIRE_FALSE(scans.has_value());
  return scans.error();
}

}  // namespace

TEST_CASE("formats: every recorded file has a row in the tables, and every row a file") {
  const auto folder = real_data("formats");
  if (!folder) return;
  std::vector<std::string> rows;
  for (const Recording& row : kRecordings) rows.push_back(row.path);
  for (const Cloud& row : kClouds) rows.push_back(row.path);
  for (const Refused& row : kRefused) rows.push_back(row.path);
  const std::vector<std::string> files = recorded_in(*folder);
  for (const std::string& file : files) {
    CHECK_MESSAGE(std::count(rows.begin(), rows.end(), file) == 1,
                  file << " has no row of its own");
  }
  for (const std::string& row : rows) {
    CHECK_MESSAGE(std::count(files.begin(), files.end(), row) == 1, row << " is not there");
  }
}

TEST_CASE("formats: recordings, scan by scan") {
  const auto folder = real_data("formats");
  if (!folder) return;
  for (const Recording& row : kRecordings) {
    CAPTURE(row.path);
    check_recording(*folder / row.path, row);
    if (!fs::is_directory(*folder / row.path)) continue;
    for (const auto& part : fs::directory_iterator(*folder / row.path)) {
      if (part.path().extension() == ".db3") check_recording(part.path(), row);
    }
  }
}

TEST_CASE("formats: point clouds, each also as a scan") {
  const auto folder = real_data("formats");
  if (!folder) return;
  for (const Cloud& row : kClouds) {
    CAPTURE(row.path);
    const auto cloud = io::read_point_cloud(*folder / row.path);
    REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
    CHECK(cloud->points.size() == row.points);
    CHECK(cloud->dropped == 0);
    const std::string suffix = fs::path(row.path).extension().string();
    if (suffix == ".las") continue;  // a format of maps
    const auto scans = io::open_scans({.path = *folder / row.path, .topic = {}});
    REQUIRE_MESSAGE(scans, to_string(scans.error()));
    CHECK((*scans)->describe().format == "files (" + suffix + ")");
    const auto scan = (*scans)->next();
    REQUIRE_MESSAGE(scan, to_string(scan.error()));
    REQUIRE(*scan);
    PointCloud returns = cloud->points;
    std::erase_if(returns, [](const Point& point) { return point.isZero(0.0); });
    CHECK((*scan)->points == returns);
    CHECK((*scan)->no_returns == cloud->points.size() - returns.size());
  }
}

TEST_CASE("formats: malformed files are refused with one line") {
  const auto folder = real_data("formats");
  if (!folder) return;
  for (const Refused& row : kRefused) {
    const Error error = refusal(*folder / row.path);
    CHECK(error.code == ErrorCode::corrupt_data);
    CHECK(to_string(error) == (*folder / row.path).string() + row.error);
  }
}

}  // namespace vantage::test
