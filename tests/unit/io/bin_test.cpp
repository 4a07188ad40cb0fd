#include <sys/stat.h>
#include <unistd.h>

#include <iostream>
#include <limits>

#include "files.hpp"

namespace vantage {
namespace {

using namespace test;

TEST_CASE("KITTI .bin: x y z of float32 quadruples; NaN dropped and counted") {
  const std::string content = raw(1.F) + raw(2.F) + raw(3.F) + raw(0.5F) + raw(1.F) +
                              raw(std::numeric_limits<float>::quiet_NaN()) + raw(3.F) + raw(0.5F) +
                              raw(4.F) + raw(5.F) + raw(6.F) +
                              raw(std::numeric_limits<float>::quiet_NaN());
  for (const auto* name : {"000000.bin", "SCAN.BIN"}) {
    const auto cloud = read_as(name, content);
    REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
    CHECK(cloud->points == PointCloud{{1, 2, 3}, {4, 5, 6}});
    CHECK(cloud->dropped == 1);
  }
  for (std::size_t size = 1; size < content.size(); ++size) {
    if (size % 16 == 0) continue;
    check_refused("a.bin", content.substr(0, size),
                  "the file ends at byte " + std::to_string(size));
  }
}

TEST_CASE("KITTI .bin: points of five numbers, as those of nuScenes, are refused") {
  std::string content;
  for (int point = 0; point < 4; ++point) {  // 80 bytes, as of five points of KITTI
    content += raw(1.5F) + raw(2.5F) + raw(-1.75F) + raw(30.0F) + raw(static_cast<float>(point));
  }
  check_refused("a.pcd.bin", content,
                "the 4th number of point 1 is -1.75, expected an intensity: has a point of this "
                "file 5 or 6 numbers?");
  const std::string fine = raw(1.F) + raw(2.F) + raw(3.F) + raw(0.F);
  const float infinite = std::numeric_limits<float>::infinity();
  check_refused("a.bin", fine + raw(1.F) + raw(2.F) + raw(3.F) + raw(infinite),
                "the 4th number of point 1 is inf");
  const auto cloud = read_as("a.bin", raw(1.F) + raw(2.F) + raw(3.F) + raw(-0.0F));
  REQUIRE_MESSAGE(cloud, to_string(cloud.error()));
}

TEST_CASE("files that are no point cloud give one clear line") {
  const test::TemporaryFolder folder;
  const auto refused = [&](const std::filesystem::path& path, ErrorCode code,
                           const std::string& expected) {
    const auto cloud = io::read_point_cloud(path);
    REQUIRE_FALSE(cloud.has_value());
    check_clear(cloud.error(), code, path.string(), expected);
  };
  refused(folder.path() / "absent.pcd", ErrorCode::not_found, "No such file");
  refused(put(folder.path() / "file", "x") / "below.pcd", ErrorCode::not_found, "expected");
  refused(folder.path(), ErrorCode::io_failure, "is a directory");
  refused("/dev/null", ErrorCode::io_failure, "is not a regular file");
  refused(put(folder.path() / "empty.pcd", ""), ErrorCode::corrupt_data, "the file is empty");
  refused(put(folder.path() / "notes.txt", "hello\n"), ErrorCode::corrupt_data, "unknown format");
  refused(put(folder.path() / "notes.pcd", "hello\nworld\n"), ErrorCode::corrupt_data,
          "notes.pcd:1: error: expected a PCD header line");
  refused(put(folder.path() / "notes.ply", "hello\n"), ErrorCode::corrupt_data,
          "expected the line 'ply'");
  refused(put(folder.path() / "noise.pcd", std::string(5000, '\xfe').append("\n")),
          ErrorCode::corrupt_data, "??...");

  const auto pipe = folder.path() / "pipe.pcd";
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  refused(pipe, ErrorCode::io_failure, "is not a regular file");

  const auto locked = put(folder.path() / "locked.pcd", "x");
  std::filesystem::permissions(locked, std::filesystem::perms::none);
  if (::geteuid() == 0) {
    std::cout << "SKIPPED: an unreadable file, because root reads every file\n";
  } else {
    refused(locked, ErrorCode::io_failure, "Permission denied");
  }
}

}  // namespace
}  // namespace vantage
