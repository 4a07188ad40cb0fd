// vantage-export on a bundle that vantage-build has made of a small map.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "support/bundles.hpp"
#include "support/plugins.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "support/small_config.hpp"
#include "vantage/io/map_files.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/kit/checksum.hpp"
#include "vantage/map_store.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;
using test::run;

/// A street with a wall beside it, 60 m long, as two LAS files; and bundles of it.
class World {
 public:
  explicit World(const Point& middle = Point::Zero()) {
    PointCloud halves[2];
    for (int i = 0; i < 240; ++i) {
      const double x = 0.25 * i;
      PointCloud& half = halves[i < 120 ? 0 : 1];
      for (int j = 0; j < 40; ++j) half.push_back(middle + Point(x, 0.25 * j, 0.01 * (j % 2)));
      for (int k = 1; k < 12; ++k) half.push_back(middle + Point(x, 10.0, 0.25 * k));
    }
    for (const PointCloud& half : halves) map.insert(map.end(), half.begin(), half.end());
    fs::create_directory(path("maps"));
    REQUIRE(io::write_las(path("maps/part_1.las"), halves[0]));
    REQUIRE(io::write_las(path("maps/part_2.las"), halves[1]));
  }

  [[nodiscard]] fs::path path(const std::string& name) const { return folder_.path() / name; }

  /// Builds a bundle whose region maps overlap: each holds the map as far as 30 m.
  [[nodiscard]] std::string build(const std::string& name, const std::string& files,
                                  const std::string& store) const {
    test::write_text(
        path(name + ".toml"),
        to_text(test::SmallConfig{.files = files,
                                  .partitioner_params = "cell_width = 20.0",
                                  .viewpoints = "voxel_size = 5.0\n",
                                  .visibility = "plugin = \"keep_all\"\nmax_range = 30.0\n",
                                  .store = "params = { root = \"" + name + "\" }\n" + store,
                                  .matcher = ""}));
    const auto built = run("vantage-build", {path(name + ".toml").string(), "--json", "-q"});
    REQUIRE_MESSAGE(built.exit_code == 0, built.err);
    CHECK(nlohmann::json::parse(built.out)["map_points"] == map.size());
    return path(name + ".toml").string();
  }

  PointCloud map;

 private:
  test::TemporaryFolder folder_;
};

/// Whether two clouds hold the same points, but for `tolerance` [m]; neighbours are further apart.
bool same_points(PointCloud a, PointCloud b, double tolerance) {
  const auto sort = [](PointCloud& cloud) {
    std::sort(cloud.begin(), cloud.end(), [](const Point& p, const Point& q) {
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        const double d = std::round(200 * p[axis]) - std::round(200 * q[axis]);
        if (d != 0.0) return d < 0.0;
      }
      return false;
    });
  };
  sort(a);
  sort(b);
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](const Point& p, const Point& q) {
    return (p - q).cwiseAbs().maxCoeff() <= tolerance;
  });
}

PointCloud read_folder(const fs::path& folder) {
  const std::vector<fs::path> patterns{folder};
  return io::read_point_clouds(io::map_files(patterns).value().files).value().points;
}

TEST_CASE("vantage export autoware: what is exported is each point of the bundle once") {
  const World world;
  const std::string config = world.build("b", "[\"maps/*.las\"]", "");
  const std::string out = world.path("tiles").string();
  const auto exported = run("vantage-export", {"autoware", config, "--out", out, "--json", "-q"});
  REQUIRE_MESSAGE(exported.exit_code == 0, exported.err);
  CHECK(exported.err.empty());
  const auto report = nlohmann::json::parse(exported.out);
  CHECK(report["points"] == world.map.size());
  CHECK(report["repeated_points"] > world.map.size() / 2);  // the region maps do overlap
  CHECK(report["tiles"] == 3);
  CHECK(same_points(read_folder(out), world.map, 1e-4));

  SUBCASE("its tiles are a map to build from, by folder or pattern, and give the same export") {
    const std::string again = world.build("c", "[\"tiles\", \"til*/pointcloud_map.pcd/*\"]", "");
    const std::string other = world.path("other").string();
    REQUIRE(run("vantage-export", {"autoware", again, "--out", other, "-q"}).exit_code == 0);
    CHECK(same_points(read_folder(other), read_folder(out), 1e-5));
    CHECK(test::read_text(world.path("other/pointcloud_map_metadata.yaml")) ==
          test::read_text(world.path("tiles/pointcloud_map_metadata.yaml")));
  }
  SUBCASE("nothing is overwritten without --overwrite, and with it only an export") {
    const auto second = run("vantage-export", {"autoware", config, "--out", out, "-q"});
    CHECK(second.exit_code == 1);
    CHECK(second.err.find("--overwrite") != std::string::npos);
    CHECK(run("vantage-export",
              {"autoware", config, "--out", out, "-q", "--overwrite", "--resolution", "10"})
              .exit_code == 0);
    CHECK(same_points(read_folder(out), world.map, 1e-4));
    const auto bundle = run("vantage-export", {"autoware", config, "--out",
                                               world.path("b").string(), "-q", "--overwrite"});
    CHECK(bundle.exit_code == 1);
    CHECK(bundle.err.find("is not an earlier export") != std::string::npos);
    CHECK(fs::exists(world.path("b/index.json")));
  }
  SUBCASE("a tile that is missing is told by build") {
    fs::remove(world.path("tiles/pointcloud_map.pcd/pointcloud_map_20_0.pcd"));
    const auto built =
        run("vantage-build", {config, "-q", "--set", "map.files=[\"" + out + "\"]", "--set",
                              "store.params.root=\"" + world.path("d").string() + "\""});
    CHECK(built.exit_code == 1);
    CHECK(built.err.find("pointcloud_map_20_0.pcd: there is no such tile") != std::string::npos);
  }
}

TEST_CASE("vantage export: UTM coordinates need an origin for Autoware, and none for LAS") {
  const World world({500'000.0, 4'649'780.0, 430.0});
  const std::string config = world.build("b", "[\"maps\"]", "");
  const std::string out = world.path("tiles").string();
  const auto refused = run("vantage-export", {"autoware", config, "--out", out, "-q"});
  CHECK(refused.exit_code == 1);
  CHECK(refused.err.find("--origin auto") != std::string::npos);
  CHECK_FALSE(fs::exists(out));
  const auto exported =
      run("vantage-export", {"autoware", config, "--out", out, "--origin", "500000,4649780,430"});
  REQUIRE_MESSAGE(exported.exit_code == 0, exported.err);
  CHECK(exported.out.find("subtracted x 500000, y 4649780, z 430 m") != std::string::npos);
  PointCloud tiles = read_folder(out);
  for (Point& p : tiles) p += Point(500'000.0, 4'649'780.0, 430.0);
  CHECK(same_points(tiles, world.map, 1e-4));

  const std::string folder = world.path("b").string();  // the bundle itself, without configuration
  const std::string regions = world.path("regions").string();
  const auto las =
      run("vantage-export", {"regions", folder, "--out", regions, "--format", "las", "-q"});
  REQUIRE_MESSAGE(las.exit_code == 0, las.err);
  CHECK(las.out.find("store.views = true") != std::string::npos);
  for (const Point& p : read_folder(regions)) {
    if ((p - world.map.front()).norm() > 100.0) FAIL("a point far from the map");
  }
}

TEST_CASE("vantage export regions: counts of views, and bundles without points") {
  const World world;
  const std::string config = world.build("b", "[\"maps/part_?.las\"]", "views = true\n");
  const std::string out = world.path("regions").string();
  const auto exported =
      run("vantage-export", {"regions", config, "--out", out, "--format", "ply", "--json", "-q"});
  REQUIRE_MESSAGE(exported.exit_code == 0, exported.err);
  CHECK(nlohmann::json::parse(exported.out)["views"] == true);
  CHECK(nlohmann::json::parse(exported.out)["files"] == 3);
  const auto sidecar =
      nlohmann::json::parse(test::read_text(world.path("regions/vantage_export.json")));
  for (const auto& region : sidecar["regions"]) {
    CHECK(region["max_views"] > 0);
    const std::string file = test::read_text(world.path("regions") / region["file"]);
    CHECK(file.find("property uint scalar_views\n") != std::string::npos);
  }

  const std::string prepared =
      world.build("p", "[\"maps\"]", "content = \"prepared\"\n[matcher]\nplugin = \"ndt\"\n");
  for (const std::string job : {"autoware", "grid", "regions"}) {
    std::vector<std::string> arguments{job, prepared, "--out", world.path("none").string(), "-q"};
    if (job == "regions") arguments.insert(arguments.end(), {"--format", "pcd"});
    const auto refused = run("vantage-export", arguments);
    CHECK(refused.exit_code == 1);
    CHECK(refused.err.find("prepared maps only") != std::string::npos);
    CHECK_FALSE(fs::exists(world.path("none")));
  }
}

/// Gives region 7 of a bundle another label, with the checksum that its entry needs.
void relabel(const fs::path& file, const std::string& from, const std::string& next,
             const std::string& to) {
  std::string bytes = test::read_text(file);
  REQUIRE(from.size() == to.size());
  constexpr std::size_t kBefore = sizeof(std::uint32_t) + sizeof(std::uint64_t);  // id, size
  const std::size_t begin = bytes.find(from) - kBefore, end = bytes.find(next) - kBefore;
  REQUIRE(begin < end);
  bytes.replace(begin + kBefore, to.size(), to);
  const std::uint64_t value = checksum_of(std::string_view(bytes).substr(begin, end - begin - 8));
  bytes.replace(end - 8, 8, reinterpret_cast<const char*>(&value), 8);
  test::write_text(file, bytes);
}

TEST_CASE("vantage export regions: a crafted bundle writes nothing outside of --out") {
  const test::TemporaryFolder folder;
  const fs::path root = folder.path() / "bundle", place = folder.path() / "elsewhere";
  constexpr std::uint32_t kRegions = 9;
  const auto label = [](std::uint32_t r) { return "r" + std::to_string(1'000'000'000U + r); };
  {
    std::vector<Region> regions;
    for (std::uint32_t r = 0; r < kRegions; ++r) {
      regions.push_back({label(r), HalfOpenBox{{r, 0.0}, {r + 1.0, 1.0}}, {}});
    }
    MapIndex index;
    index.partition = Partition::from(std::move(regions)).value();
    const auto store = test::plugin<MapStore>("pcd_tiles", "root = '" + root.string() + "'");
    std::vector<RegionMap> maps(kRegions);
    maps[7].points.emplace_back(7.5, 0.5, 0.0);
    test::write_bundle(store, index, maps);
  }
  fs::create_directory(place);
  const auto out = place / "out";
  const std::vector<std::string> arguments{"regions",  root.string(), "--out", out.string(),
                                           "--format", "pcd",         "-q"};
  REQUIRE(run("vantage-export", arguments).exit_code == 0);
  fs::remove_all(out);

  relabel(root / "regions.idx", label(7), label(8), "../planted7");
  fs::rename(root / (label(7) + ".pcd"), folder.path() / "planted7.pcd");
  const auto refused = run("vantage-export", arguments);
  CHECK(refused.exit_code == 1);
  CHECK_MESSAGE(refused.err.find("regions.idx: error: the entry of region 7") != std::string::npos,
                refused.err);
  CHECK(refused.err.find("a label is 1 to 200 letters") != std::string::npos);
  CHECK(fs::is_empty(place));
}

/// The files of a folder but the one that says what made an export, with their content.
std::map<std::string, std::string> exported_files(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name != "vantage_export.json") files[name] = test::read_text(entry.path());
  }
  return files;
}

TEST_CASE("vantage export grid: the authors' folder, which is a bundle and gives itself back") {
  const World world;
  const std::string config = world.build("b", "[\"maps\"]", "");
  const std::string out = world.path("grid").string();
  const auto exported = run("vantage-export", {"grid", config, "--out", out, "--json", "-q"});
  REQUIRE_MESSAGE(exported.exit_code == 0, exported.err);
  CHECK(nlohmann::json::parse(exported.out)["files"] == 3);
  const auto files = exported_files(out);
  REQUIRE(files.size() == 4);
  CHECK(files.contains("grid_0_0.pcd"));
  CHECK(files.contains("grid_2_0.pcd"));
  // The viewpoint that is farthest along the street, and beside it, is the mean of a voxel.
  CHECK(files.at("grid_meta_data.yaml")
            .find("grid_size: 20\nmin_pt:\n  x: 0\n  y: 0\nmax_pt:\n  x: 5") == 0);
  CHECK(same_points(io::read_point_clouds(std::vector{fs::path(out) / "grid_1_0.pcd"})->points,
                    io::read_point_clouds(std::vector{world.path("b/x+001_y+000.pcd")})->points,
                    1e9));  // as many; the store keeps them relative to another origin

  // By its path, and by a configuration.
  const std::string again = world.path("again").string();
  const auto by_path = run("vantage-export", {"grid", out, "--out", again, "-q"});
  REQUIRE_MESSAGE(by_path.exit_code == 0, by_path.err);
  CHECK(exported_files(again) == files);
  test::write_text(world.path("folder.toml"),
                   "schema = 1\n[store]\nplugin = \"grid_pcd\"\nparams = { root = \"grid\" }\n");
  const std::string folder = world.path("folder.toml").string();
  REQUIRE(run("vantage-export", {"grid", folder, "--out", again, "-q", "--overwrite"}).exit_code ==
          0);
  CHECK(exported_files(again) == files);
  CHECK(run("vantage-export", {"grid", folder, "--out", again, "-q"}).exit_code == 1);

  // Subtracting an origin changes all of them, and the meta data with them.
  REQUIRE(run("vantage-export",
              {"grid", folder, "--out", again, "-q", "--overwrite", "--origin", "-100,50,1"})
              .exit_code == 0);
  CHECK(exported_files(again).at("grid_meta_data.yaml").find("  x: 100\n  y: -50\n") !=
        std::string::npos);

  // A build cannot write there, and says so before it reads a map.
  const auto built = run("vantage-build", {config, "-q", "--set", "store.plugin=grid_pcd"});
  CHECK(built.exit_code == 1);
  CHECK_MESSAGE(built.err.find("only reads bundles") != std::string::npos, built.err);

  fs::remove(fs::path(out) / "grid_meta_data.yaml");
  const auto damaged = run("vantage-export", {"grid", out, "--out", again, "-q", "--overwrite"});
  CHECK(damaged.exit_code == 1);
  CHECK_MESSAGE(
      damaged.err.find("grid: error: grid_meta_data.yaml is missing") != std::string::npos,
      damaged.err);
}

TEST_CASE("vantage export grid: what is no grid, or too far from the origin, is told") {
  const World world({500'000.0, 4'649'780.0, 430.0});
  const std::string config = world.build("b", "[\"maps\"]", "");
  const std::string out = world.path("grid").string();
  const auto refused = run("vantage-export", {"grid", config, "--out", out, "-q"});
  CHECK(refused.exit_code == 1);
  CHECK(refused.err.find("--origin auto") != std::string::npos);
  CHECK_FALSE(fs::exists(out));
  const auto exported = run("vantage-export", {"grid", config, "--out", out, "--origin", "auto"});
  REQUIRE_MESSAGE(exported.exit_code == 0, exported.err);
  CHECK(exported.out.find("subtracted x 500000, y 4649780, z 430 m") != std::string::npos);
  CHECK(test::read_text(world.path("grid/grid_meta_data.yaml")).find("grid_size: 20\n") == 0);

  const auto built =
      run("vantage-build", {config, "-q", "--overwrite", "--set", "partitioner.plugin=kd_split",
                            "--set", "partitioner.params={max_points=4000}"});
  REQUIRE_MESSAGE(built.exit_code == 0, built.err);
  const auto no_grid = run("vantage-export", {"grid", world.path("b").string(), "--out", out, "-q",
                                              "--overwrite", "--origin", "auto"});
  CHECK(no_grid.exit_code == 1);
  CHECK_MESSAGE(
      no_grid.err.find("build the bundle with the partitioner uniform_grid") != std::string::npos,
      no_grid.err);
}

TEST_CASE("vantage export: wrong usage") {
  const World world;
  const std::string config = world.path("none.toml").string();
  CHECK(run("vantage-export", {}).exit_code == 2);
  CHECK(run("vantage-export", {"autoware", config, "--out", "x"}).exit_code == 2);
  test::write_text(config, "schema = 1\n");
  const std::string out = world.path("out").string();
  const auto fails = [&](std::vector<std::string> more, int code, const std::string& expected) {
    more.insert(more.begin(), {"autoware", config, "--out", out});
    const auto finished = run("vantage-export", more);
    CHECK(finished.exit_code == code);
    CHECK_MESSAGE(finished.err.find(expected) != std::string::npos, finished.err);
  };
  fails({}, 1, "missing table [store], which exporting needs");
  fails({"--resolution", "0"}, 2, "--resolution");
  fails({"--resolution", "2.5"}, 2, "--resolution");
  for (const char* origin : {"1,2", "1,2,3,4", "a,b,c", "nan,0,0", ",,", ""}) {
    fails({"--origin", origin}, 2, "--origin");
  }
  fails({"--prefix", "../x"}, 2, "--prefix takes");
  fails({"--set", "store.plugin=pcd_tiles", "--set",
         "store.params.root=\"" + world.path("no_bundle").string() + "\""},
        1, "`vantage build` makes it");
  CHECK(run("vantage-export", {"regions", config, "--out", out, "--format", "xyz"}).exit_code == 2);
}

}  // namespace
}  // namespace vantage
