// Which store opens a bundle, and what a Bundle answers.
#include <doctest/doctest.h>
#include <sys/stat.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "support/bundles.hpp"
#include "support/plugins.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "support/small_config.hpp"
#include "vantage/build/bundle_build.hpp"
#include "vantage/engine/bundle.hpp"

using namespace vantage;
namespace fs = std::filesystem;

namespace {

/// The built stores, and somebody else's.
PluginLoader two_stores() { return PluginLoader({VANTAGE_PLUGIN_DIR, OTHER_STORE_DIR}); }

PluginPtr<MapStore> store(const std::string& plugin, const std::string& key,
                          const fs::path& place) {
  return two_stores()
      .load<MapStore>({.plugin = plugin,
                       .library = {},
                       .params = test::table(key + " = \"" + place.string() + "\""),
                       .where = {}})
      .value();
}

/// Three strips of 10 m; the second holds no points.
void write_bundle(const PluginPtr<MapStore>& store, const std::string& config = "schema = 1\n") {
  std::vector<Region> regions;
  for (int r = 0; r < 3; ++r) {
    regions.push_back({.label = "strip_" + std::to_string(r + 1),
                       .footprint = HalfOpenBox{{10.0 * r, 0.0}, {10.0 * r + 10.0, 10.0}},
                       .height = {}});
  }
  MapIndex index;
  index.partition = Partition::from(std::move(regions)).value();
  index.map_points = 40;
  index.map_bounds = {{0, 0, 0}, {30, 10, 3}};
  index.config = config;
  std::vector<RegionMap> maps(3);
  for (std::uint32_t r = 0; r < 3; ++r) {
    maps[r].viewpoints = {{10.0 * r + 5.0, 5.0, 1.0}};
    if (r != 1) maps[r].points.assign(r + 1, Point(10.0 * r + 1.0, 2.0, 3.0));
  }
  test::write_bundle(store, index, maps);
}

/// Of a file, or of all that is in a folder.
std::uintmax_t bytes_in(const fs::path& place) {
  if (!fs::is_directory(place)) return fs::file_size(place);
  std::uintmax_t sum = 0;
  for (const auto& entry : fs::recursive_directory_iterator(place)) {
    if (entry.is_regular_file()) sum += entry.file_size();
  }
  return sum;
}

std::string message(const Result<Bundle>& bundle) {
  REQUIRE_FALSE(bundle.has_value());
  return to_string(bundle.error());
}

}  // namespace

TEST_CASE("a bundle is opened by the store that made it, whichever stores are installed") {
  const test::TemporaryFolder folder;
  const fs::path tiles = folder.path() / "tiles", file = folder.path() / "maps.bin";
  write_bundle(store("pcd_tiles", "root", tiles));
  write_bundle(store("one_file", "file", file));
  for (const fs::path& place : {tiles, file}) {
    CAPTURE(place);
    const auto bundle = Bundle::open(place, two_stores());
    REQUIRE_MESSAGE(bundle, to_string(bundle.error()));
    CHECK(bundle->name() == place.string());
    CHECK(bundle->directory()->summary().regions == 3);
    CHECK((*bundle->index())->partition.size() == 3);
    CHECK(bundle->get(RegionId{2})->points.size() == 3);
  }
  CHECK(Bundle::open(tiles, test::built_plugins()));
}

TEST_CASE(
    "a bundle that is replaced while it is open is an error, never the regions of the other") {
  const test::TemporaryFolder folder;
  const fs::path tiles = folder.path() / "tiles";
  write_bundle(store("pcd_tiles", "root", tiles));
  const auto bundle = Bundle::open(tiles, test::built_plugins());
  REQUIRE_MESSAGE(bundle, to_string(bundle.error()));
  fs::remove_all(tiles);
  write_bundle(store("pcd_tiles", "root", tiles), "schema = 1 # another\n");
  CHECK(bundle->directory()->summary().config == "schema = 1\n");  // what was read stays
  const auto map = bundle->get(RegionId{2});
  REQUIRE_FALSE(map);
  CHECK(to_string(map.error()) ==
        tiles.string() +
            ": error: another bundle has been put in the place of the one that was opened: open it "
            "again");
  CHECK((*bundle->index())->config == "schema = 1\n");
  CHECK(bundle->indexed_by().error().code == ErrorCode::io_failure);
  CHECK(Bundle::open(tiles, test::built_plugins())->get(RegionId{2})->points.size() == 3);
}

TEST_CASE("an index that is a pipe is refused, without waiting for somebody who writes to it") {
  const test::TemporaryFolder folder;
  REQUIRE(::mkfifo((folder.path() / "index.json").c_str(), 0600) == 0);
  const auto bundle = Bundle::open(folder.path(), test::built_plugins());
  REQUIRE_FALSE(bundle);
  CHECK(bundle.error().code == ErrorCode::io_failure);
  CHECK(bundle.error().message.find("not a regular file") != std::string::npos);
}

TEST_CASE("of a large index only the beginning is read to find its store") {
  const test::TemporaryFolder folder;
  const std::string format = "\"format\": \"vantage elsewhere\"",
                    long_text = "\"text\": \"" + std::string(std::size_t{5} << 20U, 'a') + "\"";
  const auto told = [&](const std::string& index) {
    test::write_text(folder.path() / "index.json", index);
    return message(Bundle::open(folder.path(), test::built_plugins()));
  };
  CHECK(told("{" + format + ", " + long_text + "}").find("no store plugin 'elsewhere'") !=
        std::string::npos);
  CHECK(told("{" + long_text + ", " + format + "}").find("elsewhere") == std::string::npos);
}

TEST_CASE("a store that is named and not installed is told") {
  const test::TemporaryFolder folder;
  test::write_text(folder.path() / "index.json",
                   R"({"regions": [{"format": "vantage wrong"}], "format": "vantage elsewhere"})");
  const std::string told = message(Bundle::open(folder.path(), two_stores()));
  CHECK(told.find("no store plugin 'elsewhere' (there are: grid_pcd, one_file, pcd_tiles") !=
        std::string::npos);
  CHECK(told.find("(while opening the bundle " + folder.path().string()) != std::string::npos);
  CHECK(told.find("vantage build") == std::string::npos);
}

TEST_CASE("where no bundle is, the store says so, or each of several, and what makes one") {
  const test::TemporaryFolder folder;
  const std::string here = folder.path().string();
  CHECK(message(Bundle::open(folder.path(), test::built_plugins())) ==
        here +
            ": error: there is no bundle of region maps here: no index.json; `vantage build` "
            "makes it");
  CHECK(message(Bundle::open(folder.path() / "none", two_stores())) ==
        here +
            "/none: error: no store finds a bundle of region maps here; one_file: no bundle at " +
            here +
            "/none; `vantage build` makes it; pcd_tiles: there is no bundle of region maps "
            "here: no index.json; `vantage build` makes it");
  CHECK(message(Bundle::open(folder.path(), PluginLoader({folder.path()}))) ==
        here + ": error: no store plugin was found that could open it");

  for (const std::string text : {"", "[1, {\"format\": \"vantage pcd_tiles\"}]", "{\"format\": 7}",
                                 "{\"format\": {\"a\": \"vantage pcd_tiles\"}}", "{\"a\": [[[["}) {
    CAPTURE(text);
    test::write_text(folder.path() / "index.json", text);
    const auto damaged = Bundle::open(folder.path(), test::built_plugins());
    REQUIRE_FALSE(damaged.has_value());
    CHECK(damaged.error().code == ErrorCode::corrupt_data);
  }
}

TEST_CASE("a bundle that [store] names: a missing table says what needs it") {
  const test::TemporaryFolder folder;
  Config config;
  config.file = "c.toml";
  CHECK(message(Bundle::open(config, two_stores(), "exporting")) ==
        "c.toml: error: missing table [store], which exporting needs");
  config.store =
      StoreConfig{.plugin = "pcd_tiles", .library = {}, .content = {}, .params = {}, .where = {}};
  config.store->params = test::table("root = \"" + (folder.path() / "b").string() + "\"");
  CHECK(message(Bundle::open(config, two_stores(), "exporting")).find("`vantage build` makes it") !=
        std::string::npos);
  write_bundle(store("pcd_tiles", "root", folder.path() / "b"));
  CHECK(Bundle::open(config, two_stores(), "exporting")->name() == "c.toml");
}

TEST_CASE(
    "a build knows where its bundle goes, and whether it may, whatever the store calls that") {
  const test::TemporaryFolder folder;
  for (const auto& store : {std::pair{"pcd_tiles", "root"}, std::pair{"one_file", "file"}}) {
    const std::string plugin = store.first, key = store.second;
    CAPTURE(plugin);
    const fs::path place = folder.path() / plugin;
    auto config = parse_toml(test::to_text({.matcher = ""}), "").and_then(parse_config);
    REQUIRE_MESSAGE(config, to_string(config.error()));
    config->store->plugin = plugin;
    config->store->params = test::table(key + " = \"" + place.string() + "\"");
    const auto prepared = [&] {
      auto build = BundleBuild::prepare(*config, two_stores());
      REQUIRE_MESSAGE(build, to_string(build.error()));
      return *std::move(build);
    };
    BundleBuild build = prepared();
    CHECK(build.place() == place);
    CHECK(build.may_begin());
    CHECK_FALSE(fs::exists(place));
    REQUIRE(build.run(test::small_square(), {}));
    CHECK(fs::exists(place));
    const auto made = build.bundle();
    REQUIRE_MESSAGE(made, to_string(made.error()));
    CHECK(made->bytes() == bytes_in(place));
    CHECK(Bundle::open(*config, two_stores(), "exporting")->bytes() == bytes_in(place));
    CHECK(Bundle::open(place, two_stores())->bytes() == bytes_in(place));
    const auto again = prepared().may_begin();
    if (plugin == "one_file") continue;  // it does not tell before it begins
    REQUIRE_FALSE(again.has_value());
    CHECK(again.error().code == ErrorCode::already_exists);
    config->store->params = test::table("overwrite = true\nroot = \"" + place.string() + "/\"");
    CHECK(prepared().may_begin());
    CHECK(prepared().place() == place);
    test::write_text(place / "notes.txt", "mine");
    CHECK(prepared().may_begin().error().code == ErrorCode::already_exists);
  }
}

TEST_CASE("regions: by label or number, and those that hold points, in their order") {
  const test::TemporaryFolder folder;
  write_bundle(store("one_file", "file", folder.path() / "b"));
  const auto bundle = Bundle::open(folder.path() / "b", two_stores());
  REQUIRE(bundle);
  CHECK(bundle->find_region("strip_2") == RegionId{1});
  CHECK(bundle->find_region("2") == RegionId{2});
  CHECK(bundle->find_region("strip_4").error().message ==
        "no region 'strip_4'; did you mean 'strip_1', 'strip_2' or 'strip_3'?; there are 3 "
        "regions, 0 ('strip_1') to 2 ('strip_3')");
  CHECK_FALSE(bundle->find_region("3").has_value());
  CHECK_FALSE(bundle->find_region("2x").has_value());

  std::vector<std::uint32_t> taken;
  std::vector<std::pair<std::size_t, std::size_t>> told;
  REQUIRE(bundle->for_each_region(
      [&](RegionId region, const RegionMap& map) -> Result<void> {
        taken.push_back(region.value);
        CHECK(map.points.size() == region.value + 1);
        return {};
      },
      [&](std::size_t done, std::size_t total) { told.emplace_back(done, total); }));
  CHECK(taken == std::vector<std::uint32_t>{0, 2});
  CHECK(told == std::vector<std::pair<std::size_t, std::size_t>>{{1, 3}, {2, 3}, {3, 3}});
  CHECK(bundle
            ->for_each_region([](RegionId, const RegionMap&) -> Result<void> {
              return fail(ErrorCode::io_failure, "full");
            })
            .error()
            .message == "full");
  CHECK(bundle->regions_without_points() == 1);
  CHECK(bundle->has_points());
  CHECK(bundle->need_points("show"));
  CHECK_FALSE(bundle->has_views());
}

TEST_CASE("what a bundle was built with: a configuration, or nothing that this version reads") {
  const test::TemporaryFolder folder;
  const std::vector<std::pair<std::string, bool>> texts{
      {"schema = 1\n[map]\nfiles = [\"maps/a.pcd\"]\n[visibility]\nplugin = \"hpr\"\nmax_range = "
       "40.0\n",
       true},
      {"", false},
      {"the configuration", false},
      {"schema = 2\n", false},
      {"schema = 1\n[later]\nkey = 1\n", false}};
  for (std::size_t i = 0; i < texts.size(); ++i) {
    CAPTURE(texts[i].first);
    const fs::path place = folder.path() / std::to_string(i);
    write_bundle(store("pcd_tiles", "root", place), texts[i].first);
    const auto bundle = Bundle::open(place, test::built_plugins());
    REQUIRE(bundle);
    REQUIRE(bundle->built_with().has_value() == texts[i].second);
    if (!texts[i].second) continue;
    CHECK(bundle->built_with()->visibility->max_range == 40.0);
    CHECK(bundle->built_with()->map->files.front() == "maps/a.pcd");
  }
}
