// What headers say of the fields of points.
#include <doctest/doctest.h>

#include "files.hpp"

namespace vantage {
namespace {

using Fields = std::vector<std::string>;

io::CloudLayout layout_of(const std::filesystem::path& path) {
  auto layout = io::read_cloud_layout(path);
  REQUIRE_MESSAGE(layout, to_string(layout.error()));
  return *std::move(layout);
}

TEST_CASE("layout: what the writers write") {
  const test::TemporaryFolder folder;
  const PointCloud points{{1, 2, 3}};
  const std::vector<std::uint32_t> views{4};
  const auto pcd = folder.path() / "a.pcd";
  REQUIRE(io::write_pcd(pcd, points, io::Precision::float64, views));
  CHECK(layout_of(pcd).format == "PCD (binary)");
  CHECK(layout_of(pcd).fields == Fields{"x float64", "y float64", "z float64", "views uint32"});
  const auto ply = folder.path() / "a.ply";
  REQUIRE(io::write_ply(ply, points, io::Precision::float32, views));
  CHECK(layout_of(ply).format == "PLY (binary)");
  CHECK(layout_of(ply).fields == Fields{"x float", "y float", "z float", "scalar_views uint"});
  const auto las = folder.path() / "a.las";
  REQUIRE(io::write_las(las, points, views));
  CHECK(layout_of(las).format == "LAS 1.4 (point format 6)");
  CHECK(layout_of(las).fields.front() == "x int32");
  CHECK(layout_of(las).fields.back() == "4 extra bytes");
  const auto bin = test::put(folder.path() / "a.bin", std::string(16, '\0'));
  CHECK(layout_of(bin).fields.size() == 4);
}

TEST_CASE("layout: files of other programs") {
  const auto folder = test::real_data("formats");
  if (!folder) return;
  CHECK(layout_of(*folder / "las/perm_1.2_3.las").format == "LAS 1.2 (point format 3)");
  CHECK(layout_of(*folder / "las/perm_1.2_3.las").fields.back() == "rgb uint16[3]");
  CHECK(layout_of(*folder / "las/perm_1.0_0.las").fields.back() == "point_source_id uint16");
  CHECK(layout_of(*folder / "pcd/ouster_cloud-ascii.pcd").format == "PCD (ascii)");
}

TEST_CASE("layout: no file and a broken one") {
  const test::TemporaryFolder folder;
  const auto absent = io::read_cloud_layout(folder.path() / "none.pcd");
  REQUIRE_FALSE(absent);
  test::check_clear(absent.error(), ErrorCode::not_found, "none.pcd", "cannot be opened");
  const auto cut = io::read_cloud_layout(test::put(folder.path() / "cut.las", "LASF"));
  REQUIRE_FALSE(cut);
  test::check_clear(cut.error(), ErrorCode::corrupt_data, "cut.las", "ends at byte 4");
  const auto other = io::read_cloud_layout(test::put(folder.path() / "a.txt", "0 0 0 0"));
  REQUIRE_FALSE(other);
  test::check_clear(other.error(), ErrorCode::corrupt_data, "a.txt", "unknown format at byte 0");
}

}  // namespace
}  // namespace vantage
