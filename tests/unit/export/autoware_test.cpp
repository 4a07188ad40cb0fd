// Exports of bundles that are made here, without programs.
#include "export/autoware.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "export/regions.hpp"
#include "export/sidecar.hpp"
#include "io/autoware_tiles.hpp"
#include "support/plugins.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "vantage/io/map_files.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/kit/directory_of.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;
using Existing = io::OutputFolder::Existing;

/// A bundle in memory.
class MemoryReader final : public MapReader {
 public:
  MemoryReader(MapIndex index, std::vector<RegionMap> maps)
      : index_(std::move(index)), maps_(std::move(maps)) {}
  [[nodiscard]] Result<MapIndex> index() const noexcept override { return index_; }
  [[nodiscard]] Result<std::unique_ptr<const RegionDirectory>> directory() const noexcept override {
    return directory_of(index_);
  }
  [[nodiscard]] Result<RegionMap> get(RegionId region) const noexcept override {
    if (maps_[region.value].points.size() == 1 && std::isnan(maps_[region.value].points[0].x())) {
      return fail(ErrorCode::io_failure, "the store fails");
    }
    return maps_[region.value];
  }

 private:
  MapIndex index_;
  std::vector<RegionMap> maps_;
};

Bundle bundle_of(std::vector<RegionMap> maps) {
  MapIndex index;
  std::vector<Region> regions;
  for (std::size_t r = 0; r < maps.size(); ++r) {
    const double x = 10.0 * static_cast<double>(r);
    regions.push_back({.label = "r" + std::to_string(r),
                       .footprint = HalfOpenBox{{x, 0.0}, {x + 10.0, 10.0}},
                       .height = {}});
    index.regions.push_back({.points = maps[r].points.size()});
    index.map_points += maps[r].points.size();
  }
  index.partition = Partition::from(regions).value();
  return Bundle::of(
             PluginPtr<const MapReader>(new MemoryReader(std::move(index), std::move(maps)), {}),
             "memory")
      .value();
}

RegionMap map_of(PointCloud points) {
  return {.points = std::move(points), .viewpoints = {}, .prepared = {}};
}

/// An export into a folder of its own.
struct Exported {
  explicit Exported(const Bundle& bundle, const exporting::AutowareOptions& options = {})
      : out(folder.path() / "out"),
        report(exporting::export_autoware(bundle, options, out, Existing::refuse, {})) {}

  /// What Autoware would load: all points, and each tile's corner.
  [[nodiscard]] PointCloud points() const {
    const std::vector<fs::path> patterns{out};
    return io::read_point_clouds(io::map_files(patterns).value().files).value().points;
  }
  [[nodiscard]] io::AutowareTiles tiles() const {
    const fs::path file = out / "pointcloud_map_metadata.yaml";
    return io::parse_autoware_tiles(test::read_text(file), file.string()).value();
  }
  [[nodiscard]] bool nothing_left() const { return fs::is_empty(folder.path()); }

  test::TemporaryFolder folder;
  fs::path out;
  Result<exporting::AutowareReport> report;
};

PointCloud sorted(PointCloud cloud) {
  std::sort(cloud.begin(), cloud.end(), [](const Point& a, const Point& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  });
  return cloud;
}

TEST_CASE("Autoware: points of overlapping region maps are in one tile each, exactly once") {
  PointCloud all;
  for (int i = -100; i < 100; ++i) {
    for (int j = -40; j < 40; ++j) all.push_back({0.5 * i, 0.25 * j, 0.125 * (i % 5)});
  }
  std::vector<RegionMap> maps(4);
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t r = 0; r < 4; ++r) {
      if (i % 4 == r || i % 3 == 0) maps[r].points.push_back(all[i]);
    }
  }
  maps.push_back(map_of({}));
  std::size_t given = 0;
  for (const RegionMap& map : maps) given += map.points.size();
  const Exported exported(bundle_of(maps));
  REQUIRE_MESSAGE(exported.report, to_string(exported.report.error()));
  CHECK(exported.report->points == all.size());
  CHECK(exported.report->repeated == given - all.size());
  CHECK(exported.report->regions_without_points == 1);
  CHECK(exported.report->rounding == 0.0);
  CHECK(sorted(exported.points()) == sorted(all));

  const io::AutowareTiles tiles = exported.tiles();
  CHECK(tiles.x_resolution == 20.0);
  CHECK(tiles.y_resolution == 20.0);
  CHECK(tiles.tiles.size() == 12);  // x -60 to 40, y -20 and 0
  CHECK(exported.report->tiles == 12);
  for (const io::AutowareTile& tile : tiles.tiles) {
    CHECK(tile.file ==
          "pointcloud_map_" + std::to_string(tile.x) + "_" + std::to_string(tile.y) + ".pcd");
    const fs::path file = exported.out / "pointcloud_map.pcd" / tile.file;
    CHECK(test::read_text(file).find("FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n") !=
          std::string::npos);
    const PointCloud points = io::read_point_cloud(file).value().points;
    CHECK(!points.empty());
    for (const Point& p : points) {
      const bool inside = std::floor(p.x() / 20) * 20 == static_cast<double>(tile.x) &&
                          std::floor(p.y() / 20) * 20 == static_cast<double>(tile.y);
      if (!inside) FAIL("a point outside of its tile");
    }
  }
  const std::string yaml = test::read_text(exported.out / "pointcloud_map_metadata.yaml");
  CHECK(
      yaml.starts_with("x_resolution: 20.0\ny_resolution: 20.0\npointcloud_map_-60_-20.pcd: "
                       "[-60, -20]\n"));
  CHECK(std::count(yaml.begin(), yaml.end(), '\n') == 14);
}

TEST_CASE(
    "Autoware: a point that float32 rounds over a border is in the tile of its rounded value") {
  const double below = 4000.0 - 1e-5;  // its float32 is 4000
  REQUIRE(static_cast<double>(static_cast<float>(below)) == 4000.0);
  const Exported exported(bundle_of({map_of({{below, 1.0, 0.0}, {-1e-50, 1.0, 0.0}})}));
  REQUIRE_MESSAGE(exported.report, to_string(exported.report.error()));
  CHECK(exported.report->rounding == doctest::Approx(1e-5).epsilon(0.01));
  const auto tiles = exported.tiles().tiles;
  REQUIRE(tiles.size() == 2);
  CHECK(tiles[0].x == 0);  // -1e-50 is -0, not below it
  CHECK(tiles[1].x == 4000);
  CHECK(exported.points() == PointCloud{{0.0, 1.0, 0.0}, {4000.0, 1.0, 0.0}});
}

TEST_CASE("Autoware: an origin where float32 is too coarse") {
  const Point utm(500'000.1, 4'649'776.3, 431.7);
  const Bundle bundle = bundle_of({map_of({utm, utm + Point(30.2, 0.0, 0.3)})});
  const Exported refused(bundle);
  REQUIRE_FALSE(refused.report.has_value());
  CHECK(refused.report.error().code == ErrorCode::invalid_input);
  const std::string line = to_string(refused.report.error());
  CHECK(line.find("--origin X,Y,Z or --origin auto") != std::string::npos);
  CHECK(line.find("(500000.100, 4649776.300, 431.700) by 0.2 m") != std::string::npos);
  CHECK(line.size() < 400);
  CHECK(refused.nothing_left());

  exporting::AutowareOptions options;
  options.resolution = 25;
  options.origin.reset();
  const Exported exported(bundle, options);
  REQUIRE_MESSAGE(exported.report, to_string(exported.report.error()));
  CHECK(exported.report->origin == Point(500'000, 4'649'775, 431));
  const PointCloud points = exported.points();
  REQUIRE(points.size() == 2);
  CHECK((points[0] + exported.report->origin - utm).norm() < 1e-5);
  CHECK(exported.tiles().tiles ==
        std::vector<io::AutowareTile>{{"pointcloud_map_0_0.pcd", 0, 0},
                                      {"pointcloud_map_25_0.pcd", 25, 0}});
  const auto sidecar = nlohmann::json::parse(test::read_text(exported.out / "vantage_export.json"));
  CHECK(sidecar["origin"] == nlohmann::json::array({500000.0, 4649775.0, 431.0}));
  CHECK(sidecar["points"] == 2);
  CHECK(sidecar["files"].size() == 3);

  options.origin = Point(500'100, 4'649'700, 0);
  options.prefix = "mine";
  const Exported other(bundle, options);
  REQUIRE_MESSAGE(other.report, to_string(other.report.error()));
  CHECK(other.tiles().tiles.front() == io::AutowareTile{"mine_-100_75.pcd", -100, 75});
}

TEST_CASE("Autoware: UTM coordinates that float32 holds need no origin; huge ones are refused") {
  const Exported exact(bundle_of({map_of({{500'000.0, 4'649'776.5, 431.0}})}));
  REQUIRE_MESSAGE(exact.report, to_string(exact.report.error()));
  CHECK(exact.tiles().tiles.front().y == 4'649'760);
  for (const double huge : {std::ldexp(1.0, 100), 1e300}) {
    const Exported refused(bundle_of({map_of({{huge, 0.0, 0.0}})}));
    REQUIRE_FALSE(refused.report.has_value());
    CHECK(refused.report.error().code == ErrorCode::invalid_input);
    CHECK(refused.nothing_left());
  }
}

TEST_CASE("exports: nothing is left of one that fails, and nothing is replaced by chance") {
  const Bundle broken =
      bundle_of({map_of({{0, 0, 0}}), map_of({{std::nan(""), 0.0, 0.0}}), map_of({{1, 1, 1}})});
  const Exported failed(broken);
  REQUIRE_FALSE(failed.report.has_value());
  CHECK(failed.report.error().code == ErrorCode::io_failure);
  CHECK(failed.nothing_left());
  const fs::path out = failed.folder.path() / "regions";
  CHECK_FALSE(
      exporting::export_regions(broken, exporting::CloudFormat::ply, out, Existing::refuse, {})
          .has_value());
  CHECK(failed.nothing_left());

  const Bundle bundle = bundle_of({map_of({{0, 0, 0}})});
  const auto again = [&](const fs::path& to, Existing existing) {
    return exporting::export_autoware(bundle, {}, to, existing, {});
  };
  REQUIRE(again(out, Existing::refuse));
  CHECK(again(out, Existing::refuse).error().code == ErrorCode::already_exists);
  const auto check = [](const fs::path& folder) {
    return io::OutputFolder::check(exporting::kind_of_export(), folder, Existing::replace);
  };
  REQUIRE(check(out));
  REQUIRE(
      exporting::export_regions(bundle, exporting::CloudFormat::ply, out, Existing::replace, {}));
  CHECK(fs::exists(out / "r0.ply"));
  CHECK_FALSE(fs::exists(out / "pointcloud_map.pcd"));
  CHECK(std::distance(fs::directory_iterator(failed.folder.path()), fs::directory_iterator()) == 1);

  test::write_text(out / "lanelet2_map.osm", "mine");
  const auto foreign = check(out);
  REQUIRE_FALSE(foreign.has_value());
  CHECK(to_string(foreign.error()).find("lanelet2_map.osm") != std::string::npos);
  fs::remove(out / "lanelet2_map.osm");
  test::write_text(out / "vantage_export.json", "[");
  CHECK(to_string(check(out).error()).find("the list of exported files is damaged") !=
        std::string::npos);
  fs::remove(out / "vantage_export.json");
  CHECK(check(out).error().code == ErrorCode::already_exists);
  CHECK(check(failed.folder.path() / "none"));
  test::write_text(failed.folder.path() / "file", "x");
  CHECK(again(failed.folder.path() / "file", Existing::replace).error().code ==
        ErrorCode::already_exists);
}

TEST_CASE("regions: a file each with the views, in every format") {
  RegionMap seen = map_of({{0.5, 0.25, 1.0}, {3.0, 4.0, 5.0}});
  seen.views = {3, 70000};
  seen.viewpoints = {{1.0, 1.0, 2.0}};
  RegionMap utm = map_of({{500'000.1, 4'649'776.3, 431.7}});
  utm.views = {1};
  const Bundle bundle = bundle_of({seen, map_of({}), utm});
  const test::TemporaryFolder folder;
  using exporting::CloudFormat;
  for (const auto& [format, suffix] :
       {std::pair{CloudFormat::pcd, ".pcd"}, std::pair{CloudFormat::ply, ".ply"},
        std::pair{CloudFormat::las, ".las"}}) {
    const fs::path out = folder.path() / ("out" + std::string(suffix));
    const auto report = exporting::export_regions(bundle, format, out, Existing::refuse, {});
    REQUIRE_MESSAGE(report, to_string(report.error()));
    CHECK(report->files == 2);
    CHECK(report->points == 3);
    CHECK(report->has_views);
    CHECK(report->regions_without_points == 1);
    const auto first = io::read_point_cloud(out / ("r0" + std::string(suffix)));
    const auto last = io::read_point_cloud(out / ("r2" + std::string(suffix)));
    REQUIRE(first);
    REQUIRE(last);
    REQUIRE(first->points.size() == 2);
    const double most = format == CloudFormat::las ? 0.0005 : 0.0;
    CHECK((first->points[1] - seen.points[1]).cwiseAbs().maxCoeff() <= most);
    CHECK((last->points[0] - utm.points[0]).cwiseAbs().maxCoeff() <= most + 1e-9);
    CHECK_FALSE(fs::exists(out / ("r1" + std::string(suffix))));
    const auto sidecar = nlohmann::json::parse(test::read_text(out / "vantage_export.json"));
    CHECK(sidecar["regions"].size() == 2);
    CHECK(sidecar["regions"][0]["max_views"] == 70000);
    CHECK(sidecar["regions"][0]["viewpoints"][0] == nlohmann::json::array({1.0, 1.0, 2.0}));
  }
  const std::string small = test::read_text(folder.path() / "out.ply/r0.ply");
  CHECK(small.find("property float x\nproperty float y\nproperty float z\n"
                   "property uint scalar_views\n") != std::string::npos);
  CHECK(test::read_text(folder.path() / "out.pcd/r2.pcd").find("SIZE 8 8 8 4") !=
        std::string::npos);
}

}  // namespace
}  // namespace vantage
