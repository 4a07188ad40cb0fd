#include "io/cloud_chunks.hpp"

#include "tiles.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;
using namespace test;

/// Reads a file in parts of `most` positions.
io::LoadedCloud in_parts(const fs::path& file, std::uint64_t most) {
  auto chunks = io::CloudChunks::open(file);
  REQUIRE_MESSAGE(chunks, to_string(chunks.error()));
  io::LoadedCloud cloud;
  std::uint64_t position = 0;
  while (true) {
    const auto read = chunks->add(cloud, position, most);
    REQUIRE_MESSAGE(read, to_string(read.error()));
    CHECK(*read <= most);
    if (*read == 0) return cloud;
    position += *read;
  }
}

TEST_CASE("chunks: a file in parts of any size is the file, in every format") {
  const TemporaryFolder folder;
  const auto path = [&](const std::string& name) { return folder.path() / name; };
  const PointCloud points = scattered(1000, 5);
  REQUIRE(io::write_pcd(path("a.pcd"), points, io::Precision::float32));
  REQUIRE(io::write_ply(path("a.ply"), points, io::Precision::float64));
  REQUIRE(io::write_las(path("a.las"), points));
  std::string bin;
  std::string ascii =
      "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1001\nHEIGHT 1\nPOINTS 1001\nDATA ascii\n"
      "nan 1 2\n";
  for (const Point& p : points) {
    for (const double c : p) bin += raw(static_cast<float>(c));
    bin += raw(NAN);
    ascii +=
        std::to_string(p.x()) + ' ' + std::to_string(p.y()) + ' ' + std::to_string(p.z()) + '\n';
  }
  bin += raw(NAN) + raw(1.0F) + raw(2.0F) + raw(3.0F);
  put(path("a.bin"), bin);
  put(path("ascii.pcd"), ascii);
  tiled({path("a.pcd")}, {.out = path("tiled"), .tile_size = 10.0});

  for (const std::string name : {"a.pcd", "a.ply", "a.las", "a.bin", "ascii.pcd", "tiled"}) {
    CAPTURE(name);
    const io::LoadedCloud whole = io::read_point_cloud(path(name)).value();
    CHECK(whole.points.size() == 1000);
    for (const std::uint64_t most : {1, 7, 333, 1001, 1'000'000}) {
      const io::LoadedCloud parts = in_parts(path(name), most);
      CHECK(parts.dropped == whole.dropped);
      // A tiled map comes tile by tile; within a cell, the order is the same.
      CHECK((name == "tiled" ? in_canonical_order(parts.points) : parts.points) == whole.points);
    }
    const bool at_once = name == "ascii.pcd" || name == "tiled";
    CHECK((io::CloudChunks::open(path(name))->memory() > 0) == at_once);
  }
}

TEST_CASE("chunks: errors are those of the readers") {
  const TemporaryFolder folder;
  const auto error_of = [&](const std::string& name, const std::string& content) {
    const auto chunks = io::CloudChunks::open(put(folder.path() / name, content));
    REQUIRE_FALSE(chunks);
    return chunks.error();
  };
  check_clear(error_of("a.txt", "hello"), ErrorCode::corrupt_data, "a.txt", "unknown format");
  check_clear(error_of("a.bin", "12345"), ErrorCode::corrupt_data, "a.bin", "inside point 0");
  check_clear(error_of("a.e57", "ASTM-E57"), ErrorCode::unsupported, "a.e57", "convert");
  check_clear(error_of("a.las", "LASF"), ErrorCode::corrupt_data, "a.las", "inside the LAS header");
  check_clear(error_of("a.ply", "ply\nformat ascii 1.0\n"), ErrorCode::corrupt_data, "a.ply", "");
  check_clear(error_of("a.pcd", "FIELDS x y\n"), ErrorCode::corrupt_data, "a.pcd", "");
  CHECK(io::CloudChunks::open(folder.path() / "none.pcd").error().code == ErrorCode::not_found);
}

}  // namespace
}  // namespace vantage
