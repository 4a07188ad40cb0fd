// What is said of a bundle and of its atlas.
#include "info/bundle_info.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include "info/recording_info.hpp"
#include "localizability/localizability.hpp"
#include "support/bundles.hpp"
#include "support/made_atlas.hpp"
#include "support/plugins.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "support/text.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/kit/directory_of.hpp"

namespace vantage {
namespace {

using test::has;
using test::made_atlas;
using test::TemporaryFolder;

/// Two strips of 20 m; the second is empty.
MapIndex strips() {
  MapIndex index;
  index.partition = Partition::from({{"west", HalfOpenBox{{0, 0}, {20, 10}}, {}},
                                     {"east", HalfOpenBox{{20, 0}, {40, 10}}, {}}})
                        .value();
  index.regions = {{.points = 3}, {}};
  index.map_points = 5;
  index.map_bounds = {{0, 0, 0}, {40, 10, 3}};
  index.config = "schema = 1\n";
  return index;
}

/// A bundle of them in a folder.
void write_strips(const std::filesystem::path& folder, std::span<const std::byte> atlas) {
  const auto store = test::plugin<MapStore>("pcd_tiles", "root = \"" + folder.string() + "\"");
  auto writer = test::begun(store, strips());
  if (!atlas.empty()) {
    REQUIRE(writer->attach(Atlas::kAttachment, atlas));
    REQUIRE(writer->attach(Bundle::kPlaceIndex, std::vector<std::byte>(7)));
  }
  test::finish(
      std::move(writer),
      {{.points = {{1, 2, 3}, {2, 2, 3}, {3, 2, 3}}, .viewpoints = {{5, 5, 1}}, .prepared = {}},
       {}});
}

BundleInfo info_with(std::optional<Atlas> atlas) {
  const MapIndex index = strips();
  BundleInfo info{.path = "maps/strips",
                  .bytes = 2'500'000,
                  .files = {},
                  .summary = directory_of(index).value()->summary(),
                  .matcher = {},
                  .relocalizer = {},
                  .atlas = std::move(atlas),
                  .predicted = {},
                  .target_error = {},
                  .labels = {},
                  .regions = {}};
  for (std::uint32_t r = 0; r < index.regions.size(); ++r) {
    info.labels[RegionId{r}] = index.partition[RegionId{r}].label;
  }
  return info;
}

TEST_CASE("an atlas in a few numbers") {
  const Atlas atlas = made_atlas({0, 0, 1});
  const Localizability all = localizability_of(atlas, 0.5);
  CHECK(all.sites == 4);
  CHECK(all.unmatched == 1);
  CHECK(all.beyond_limit == 2);  // the one with alike places, and the one that matches nothing
  CHECK(all.weak == 1);
  CHECK(all.alike == 1);
  CHECK(all.share(all.weak) == 0.25);
  CHECK(all.expected_error.median == 0.3);
  CHECK(all.expected_error.max == 5.5);
  CHECK(all.basin.min == 0.0);
  CHECK(all.basin.median == 1.0);

  const auto worst = worst_sites(atlas, 3);
  REQUIRE(worst.size() == 3);
  CHECK(worst[0] == &atlas.sites[3]);
  CHECK(worst[1] == &atlas.sites[2]);
  CHECK(worst[2] == &atlas.sites[1]);
  CHECK(worst_sites(atlas, 99).size() == 4);

  CHECK(nearest_alike(atlas.sites[0]) == nullptr);
  CHECK(nearest_alike(atlas.sites[2]) == &atlas.sites[2].alike[1]);
  CHECK(distance(atlas.sites[2], atlas.sites[2].alike[0]) == doctest::Approx(20.0));

  const Localizability none = localizability_of(Atlas{}, 0.5);
  CHECK(none.sites == 0);
  CHECK(none.share(0) == 0.0);
}

TEST_CASE("a weak direction as a bearing from the map's y axis") {
  const auto bearing = [](double degrees) {
    return weak_bearing({.weak_direction = degrees * std::numbers::pi / 180.0});
  };
  CHECK(bearing(0) == doctest::Approx(90));
  CHECK(bearing(30) == doctest::Approx(60));
  CHECK(bearing(90) == doctest::Approx(0));
  CHECK(bearing(120) == doctest::Approx(150));
  CHECK(bearing(179) == doctest::Approx(91));
}

TEST_CASE("info: a bundle with an atlas") {
  const BundleInfo info = info_with(made_atlas({5, 5, 1}));
  const std::string text = to_text(info, {});
  CAPTURE(text);
  for (const char* part :
       {"regions              2, 1 of them empty\n", "points of the map    5\n",
        "atlas for            ndt\n", "sites                4\n",
        "matching nothing     1 site (25.0 %)\n",
        "0.300 median, 4.980 or less at 95 % of the sites",
        "error above 0.5 m    2 sites (50.0 %)\n",
        "weak in a direction  1 site (25.0 %): sigma more than 2 times that across\n",
        "basin [m]            1.0 median, 0.0 smallest\n", "with alike places    1 site (25.0 %)\n",
        "no match", "clockwise from the map's y axis"}) {
    CAPTURE(part);
    CHECK(has(text, part));
  }
  CHECK(text.find("no match") < text.find("5.500", text.find("worst")));  // the worst first

  const auto json = to_json(info)["atlas"];
  CHECK(json["matcher"]["plugin"] == "ndt");
  CHECK(json["sites"] == 4);
  CHECK(json["unmatched_sites"] == 1);
  CHECK(json["sites_beyond_alert_limit"] == 2);
  CHECK(json["weak_sites"] == 1);
  CHECK(json["sites_with_alike_places"] == 1);
  CHECK(json["expected_error"]["median"] == 0.3);
  CHECK(json["basin"]["min"] == 0.0);
  REQUIRE(json["worst_sites"].size() == 4);
  CHECK(json["worst_sites"][0]["expected_error"].is_null());
  CHECK(json["worst_sites"][1]["nearest_alike"]["position"][0] == 30.0);
  CHECK(json["worst_sites"][1]["nearest_alike"]["distance"] == doctest::Approx(5.0));
  CHECK(json["worst_sites"][2]["weak_bearing"] == doctest::Approx(60.0));
  CHECK(json["worst_sites"][2]["nearest_alike"].is_null());
}

TEST_CASE("info: what a selector's elements are expected to do") {
  BundleInfo info = info_with({});
  info.predicted = PredictedErrors{
      {{{{1, 1, 1}, 0.001F, 0.004F, 0.003F}, {{2, 2, 1}, 0.009F, 0.031F, 0.012F}}, {}}};
  CHECK(has(
      to_text(info, {}),
      "predicted error [m]  0.001 expected and 0.004 promised (medians), at most 0.031 promised at "
      "95 % of 2 places; 1 region without a "
      "place that sees anything\n"));
  CHECK_FALSE(has(to_text(info, {}), "target"));
  info.target_error = 0.02;
  CHECK(has(to_text(info, {}),
            "target of 0.02 m     missed in 1 region: west 0.031 (0.012 with all elements)\n"));
  CHECK(to_json(info)["predicted_error"]["worst_regions"][0]["region"] == "west");
  info.target_error = 0.04;
  CHECK(has(to_text(info, {}), "target of 0.04 m     kept in all regions\n"));
  CHECK(to_json(info)["predicted_error"]["regions_missing_it"] == 0);
  info.predicted->regions[0][1].error = std::numeric_limits<float>::infinity();
  CHECK(has(to_text(info, {}), "at most unbounded promised at 95 %"));
  CHECK(to_json(info)["predicted_error"]["p95"].is_null());
  info.predicted = PredictedErrors{{{}, {}}};
  CHECK(has(to_text(info, {}),
            "predicted error [m]  none; 2 regions without a place that sees anything\n"));
}

TEST_CASE("info: a bundle without an atlas says how to get one") {
  const std::string text = to_text(info_with({}), {});
  CHECK(has(text, "atlas              none: `vantage assess` makes it\n"));
  CHECK_FALSE(has(text, "worst"));
  CHECK(to_json(info_with({}))["atlas"].is_null());
  // One without sites is no reason to fail.
  CHECK(has(to_text(info_with(Atlas{}), {}), "sites                0\n"));
  CHECK(to_json(info_with(Atlas{}))["atlas"]["expected_error"].is_null());
}

TEST_CASE("info: a folder is a bundle if a store opens it; scans are no bundle") {
  const TemporaryFolder folder;
  write_strips(folder.path() / "with", made_atlas({5, 5, 1}).encode());
  write_strips(folder.path() / "without", {});
  const auto with = inspect_bundle(folder.path() / "with", test::built_plugins());
  REQUIRE_MESSAGE(with, to_string(with.error()));
  REQUIRE(*with);
  REQUIRE((*with)->atlas);
  CHECK((*with)->atlas->sites.size() == 4);
  CHECK((*with)->bytes > 100);
  CHECK((*with)->summary.map_points == 5);
  // Without a configuration that says another one.
  CHECK(has(to_text(**with, {}), "index of places      voxel_search\n"));
  CHECK(to_json(**with)["relocalizer"]["plugin"] == "voxel_search");
  const auto without = inspect_bundle(folder.path() / "without", test::built_plugins());
  REQUIRE(without);
  REQUIRE(*without);
  CHECK_FALSE((*without)->atlas);
  CHECK(
      has(to_text(**without, {}), "index of places    none: a search makes it from the points\n"));
  CHECK(to_json(**without)["relocalizer"].is_null());

  std::filesystem::create_directory(folder.path() / "scans");
  REQUIRE(
      io::write_pcd(folder.path() / "scans/0.pcd", PointCloud{{1, 2, 3}}, io::Precision::float32));
  for (const char* name : {"scans", "scans/0.pcd", "nothing"}) {
    CAPTURE(name);
    const auto none = inspect_bundle(folder.path() / name, test::built_plugins());
    REQUIRE_MESSAGE(none, to_string(none.error()));
    CHECK_FALSE(*none);
  }
}

TEST_CASE("info: a bundle of prepared maps, or of shared tiles, shows what it holds") {
  const TemporaryFolder folder;
  const std::filesystem::path place = folder.path() / "bundle";
  MapIndex index = strips();
  index.config = "schema = 1\n[matcher]\nplugin = \"ndt\"\n";
  RegionMap west{.points = {}, .viewpoints = {{5, 5, 1}}, .prepared = {}};
  SUBCASE("prepared maps only") {
    west.prepared = {.bytes = std::vector<std::byte>(100), .elements = 1234};
  }
  SUBCASE("points") { west.points = {{1, 2, 3}, {2, 2, 3}, {3, 2, 3}}; }
  const auto store = test::plugin<MapStore>("shared_tiles", "root = \"" + place.string() + "\"");
  test::write_bundle(store, index, {west, {}});
  const auto info = inspect_bundle(place, test::built_plugins());
  REQUIRE_MESSAGE(info, to_string(info.error()));
  const std::string text = to_text(**info, {});
  const auto json = to_json(**info);
  CAPTURE(text);
  CHECK(has(text, "2 .region files 0.00 MB"));
  CHECK(has(text, "tiles.bin 0.00 MB"));
  if (west.points.empty()) {
    CHECK(has(text, "content            prepared maps of ndt\n"));
    CHECK(has(text, "elements a region  617, 1,234 in all"));
    CHECK_FALSE(has(text, "points a region"));
    CHECK(json["prepared_for"] == "ndt");
    CHECK(json["region_elements"]["mean"] == 617.0);
  } else {
    CHECK(has(text, "content            points\n"));
    CHECK(has(text, "points a region    2 (0 to 3)"));
    CHECK_FALSE(has(text, "elements"));
    CHECK(json["prepared_for"].is_null());
  }
  CHECK(json["files"].size() >= 3);
}

/// A bundle of a region of every shape.
void write_shapes(const std::filesystem::path& folder) {
  MapIndex index = strips();
  index.partition =
      Partition::from({{"hall", HalfOpenBox{{0.125, -1}, {20, 10.5}}, {}},
                       {"storey.1", ConvexPolygon{{{20, 0}, {40, 0}, {40, 10}}}, {-2.5, 3}},
                       {"yard",
                        BoxUnion{{{{0, 10}, {5, 20}}, {{5, 12}, {9, 20}}}},
                        {.min = 3, .max = std::numeric_limits<double>::infinity()}}})
          .value();
  RegionMap hall, storey;
  hall.points.assign(1200, Point(1, 2, 3));
  hall.viewpoints = {{5, 5, 1}};
  hall.views.assign(1200, 1);
  storey.viewpoints = {{30, 2, 1}, {31, 2, 1}};
  storey.prepared = {.bytes = std::vector<std::byte>(100), .elements = 34};
  const auto store = test::plugin<MapStore>("pcd_tiles", "root = \"" + folder.string() + "\"");
  test::write_bundle(store, index, {hall, storey, {}});
}

TEST_CASE("info --regions: every region with what the bundle says of it") {
  const TemporaryFolder folder;
  const std::string place = (folder.path() / "bundle").string();
  write_shapes(place);
  const auto bytes = [&](const std::string& label) {
    return std::filesystem::file_size(place + "/" + label + ".pcd");
  };
  const auto table = test::run("vantage-info", {place, "--regions", "--quiet"});
  REQUIRE_MESSAGE(table.exit_code == 0, table.err);
  for (const std::vector<std::string>& cells : std::vector<std::vector<std::string>>{
           {"hall ", " box ", " 0 ", " 0.12 to 20.00 ", " -1.00 to 10.50 ", " any ", " 1,200 "},
           {"storey.1 ", " 3 corners ", " 1 ", " 20.00 to 40.00 ", " -2.50 to 3.00 ", " 34 "},
           {"yard ", " 2 boxes ", " 2 ", " 0.00 to 9.00 ", " 10.00 to 20.00 ", " from 3.00 "}}) {
    const std::size_t begin = table.out.find("\n" + cells.front());
    CAPTURE(table.out);
    REQUIRE(begin != std::string::npos);
    const std::string line = table.out.substr(begin, table.out.find('\n', begin + 1) - begin);
    for (const std::string& cell : cells) CHECK_MESSAGE(has(line + " ", cell), line);
  }
  const auto done = test::run("vantage-info", {place, "--regions", "--json", "--quiet"});
  REQUIRE_MESSAGE(done.exit_code == 0, done.err);
  const auto regions = nlohmann::json::parse(done.out)["each_region"];
  CHECK(regions == nlohmann::json::parse(fmt::format(
                       R"([{{"number": 0, "label": "hall", "height": [null, null],
                             "footprint": {{"box": {{"min": [0.125, -1.0], "max": [20.0, 10.5]}}}},
                             "points": 1200, "viewpoints": 1, "elements": 0, "max_views": 1,
                             "bytes": {}}},
                           {{"number": 1, "label": "storey.1", "height": [-2.5, 3.0],
                             "footprint": {{"polygon": [[20.0, 0.0], [40.0, 0.0], [40.0, 10.0]]}},
                             "points": 0, "viewpoints": 2, "elements": 34, "max_views": 0,
                             "bytes": {}}},
                           {{"number": 2, "label": "yard", "height": [3.0, null],
                             "footprint": {{"boxes": [{{"min": [0.0, 10.0], "max": [5.0, 20.0]}},
                                                      {{"min": [5.0, 12.0], "max": [9.0, 20.0]}}]}},
                             "points": 0, "viewpoints": 0, "elements": 0, "max_views": 0,
                             "bytes": {}}}])",
                       bytes("hall"), bytes("storey.1"), bytes("yard"))));
  // Only if they are asked for, and only of a bundle.
  const auto without = test::run("vantage-info", {place, "--json", "--quiet"});
  CHECK_FALSE(nlohmann::json::parse(without.out).contains("each_region"));
  std::filesystem::create_directory(folder.path() / "scans");
  REQUIRE(
      io::write_pcd(folder.path() / "scans/0.pcd", PointCloud{{1, 2, 3}}, io::Precision::float32));
  const auto scans = test::run("vantage-info", {(folder.path() / "scans").string(), "--regions"});
  CHECK(scans.exit_code == 2);
  CHECK_MESSAGE(has(scans.err, "--regions takes a bundle of region maps, and "), scans.err);
}

TEST_CASE("info: a damaged bundle is an error, not a folder of scans") {
  const TemporaryFolder folder;
  const auto place = folder.path() / "bundle";
  write_strips(place, made_atlas({5, 5, 1}).encode());
  SUBCASE("its index") {
    test::write_text(place / "index.json", "{\"format\": \"vantage pcd_tiles\"");
  }
  SUBCASE("its regions") { test::write_text(place / "regions.idx", std::string(4096, 'x')); }
  SUBCASE("its atlas") { test::write_text(place / "atlas.dat", "no atlas"); }
  const auto info = inspect_bundle(place, test::built_plugins());
  REQUIRE_FALSE(info);
  CHECK(info.error().code == ErrorCode::corrupt_data);
}

}  // namespace
}  // namespace vantage
