#include "info/tiled_info.hpp"

#include <doctest/doctest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "support/real_data.hpp"
#include "support/small_config.hpp"
#include "vantage/io/tiling.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;

TEST_CASE("info: a tiled map, and a damaged one") {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "map.pcd";
  const fs::path tiled = folder.path() / "tiled";
  const PointCloud points = test::small_square();
  REQUIRE(io::write_pcd(file, points, io::Precision::float32));
  const std::vector<fs::path> files{file};
  REQUIRE(io::tile_clouds(files, {.out = tiled, .tile_size = 5.0}));
  CHECK_FALSE(inspect_tiled_map(file, {}).value());
  CHECK_FALSE(inspect_tiled_map(folder.path(), {}).value());

  std::size_t last = 0;
  auto info = inspect_tiled_map(tiled, [&](std::size_t done, std::size_t total) {
    CHECK(total == points.size());
    CHECK(done > last);
    last = done;
  });
  REQUIRE(info);
  REQUIRE(*info);
  CHECK(last == points.size());
  const auto json = to_json(**info);
  CHECK(json["format"] == "tiled map");
  CHECK(json["points"] == points.size());
  CHECK(json["tiles"] == (*info)->map.tiles().size());
  CHECK(json["precision"] == "float32");
  const std::string text = to_text(**info, cli::Style::of(-1, "never"));
  CHECK(text.find("float32") != std::string::npos);
  CHECK(text.find("of 5 m, in 1 pack") != std::string::npos);

  std::fstream pack(tiled / "points_0000.pack", std::ios::in | std::ios::out | std::ios::binary);
  pack.seekp(10);
  pack.put('\x55');
  pack.close();
  const auto damaged = inspect_tiled_map(tiled, {});
  REQUIRE_FALSE(damaged);
  CHECK(damaged.error().code == ErrorCode::corrupt_data);
}

}  // namespace
}  // namespace vantage
