// A bundle has the same bytes, whether it was built in memory, part by part, or in shards.
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "shards/small_town.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;
using test::must_run;
using test::SmallTown;
using test::TownConfig;

constexpr const char* kLittle = "3MiB";

void build(const SmallTown& town, const std::string& config, const std::string& bundle,
           std::vector<std::string> more) {
  more.insert(more.begin(), {config, "-q", "--set", "store.params.root=" + town.path(bundle)});
  must_run("vantage-build", more);
}

/// Builds in memory, part by part, and in shards in another order than theirs.
void check_same_bytes(const SmallTown& town, const TownConfig& wanted,
                      const std::vector<std::size_t>& counts, const char* little = kLittle) {
  const std::string config = town.config(wanted);
  for (const char* bundle : {"whole", "blocks", "shards"}) fs::remove_all(town.path(bundle));
  build(town, config, "whole", {});
  const auto whole = test::bytes_of(town.path("whole"));
  REQUIRE(whole.size() > 2);
  build(town, config, "blocks", {"--memory", little, "-j", "1"});
  CHECK(test::bytes_of(town.path("blocks")) == whole);
  CHECK_FALSE(fs::exists(town.path("blocks.parts")));
  for (const std::size_t count : counts) {
    fs::remove_all(town.path("shards"));
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t number = (5 * k + 2) % count + 1;  // 5 divides none of the counts
      build(town, config, "shards",
            {"--memory", k % 2 == 0 ? little : "64MiB", "--shard",
             std::to_string(number) + "/" + std::to_string(count)});
    }
    must_run("vantage-merge", {config, "-q", "--memory", little, "--set",
                               "store.params.root=" + town.path("shards")});
    CHECK(test::bytes_of(town.path("shards")) == whole);
    CHECK_FALSE(fs::exists(town.path("shards.parts")));
  }
}

TEST_CASE("shards: one, seven and 64 of them give the bytes of a build in memory") {
  const SmallTown town;
  check_same_bytes(town, {.store = "plugin = \"pcd_tiles\"\ncontent = \"both\"\nviews = true"},
                   {1, 7, 64});
}

TEST_CASE("shards: an atlas has the same bytes, whether the map is in memory or read in parts") {
  const SmallTown town;
  const std::string config = town.config(
      {.store = "plugin = \"pcd_tiles\"\ncontent = \"both\"", .more = "[atlas]\nmax_sites = 9\n"});
  build(town, config, "bundle", {});
  auto files = test::bytes_of(town.path("bundle"));
  CHECK_FALSE(files.contains("atlas.dat"));
  const auto assessed = [&](std::vector<std::string> arguments) {
    arguments.emplace_back("-q");
    must_run("vantage-assess", arguments);
    auto after = test::bytes_of(town.path("bundle"));
    std::string atlas = after["atlas.dat"];
    after.erase("atlas.dat");
    CHECK(after == files);
    return atlas;
  };
  const std::string whole = assessed({config, "-j", "1"});
  CHECK(whole.size() > 9 * 40);
  CHECK(assessed({config, "--memory", kLittle, "-j", "2"}) == whole);
  CHECK(assessed({town.path("bundle"), "--memory", kLittle, "--set", "atlas.max_sites=9"}) ==
        whole);
  CHECK(assessed({town.path("bundle"), "--set", "atlas.max_sites=3"}) != whole);
  // The alert limit that is configured counts sites, and changes nothing else.
  for (const auto& [limit, beyond] : {std::pair{"1e-6", 3}, std::pair{"1e6", 0}}) {
    const auto told =
        test::run("vantage-assess", {config, "-q", "--json", "--set", "atlas.max_sites=3", "--set",
                                     "localizer.alert_limit=" + std::string(limit)});
    REQUIRE_MESSAGE(told.exit_code == 0, told.err);
    const auto report = nlohmann::json::parse(told.out);
    CHECK(report["alert_limit"] == std::stod(limit));
    CHECK(report["sites_beyond_alert_limit"] == beyond);
  }
}

TEST_CASE("an assessment of a bundle loads no plugin file that the bundle names") {
  const SmallTown town;
  const std::string config = town.config({.more = "[atlas]\nmax_sites = 3\n"});
  fs::copy_file(fs::path(VANTAGE_PLUGIN_DIR) / "vantage_matcher_ndt.so", town.path("mine.so"));
  build(town, config, "bundle",
        {"--set", "store.content=both", "--set", "matcher.library=" + town.path("mine.so")});
  fs::remove(town.path("mine.so"));  // another machine has none
  must_run("vantage-assess", {town.path("bundle"), "-q", "--set", "atlas.max_sites=3"});
  const auto named = test::run("vantage-assess", {town.path("bundle"), "-q", "--set",
                                                  "matcher.library=" + town.path("mine.so")});
  CHECK(named.exit_code != 0);
  CHECK(named.err.find("mine.so") != std::string::npos);
}

TEST_CASE("shards: the same bytes with every plugin that works part by part") {
  const SmallTown town;
  const TownConfig usual;
  std::vector<TownConfig> configs;
  const auto with = [&](auto TownConfig::*part, const char* text) {
    TownConfig config = usual;
    config.*part = text;
    configs.push_back(config);
  };
  with(&TownConfig::partitioner, "plugin = \"trajectory\"\nparams = { segment_length = 25.0 }");
  with(&TownConfig::partitioner, "plugin = \"kd_split\"\nparams = { max_points = 5000 }");
  with(&TownConfig::ground, "plugin = \"smrf\"\nparams = { max_radius = 3.0 }");
  with(&TownConfig::visibility, "plugin = \"hpr\"\nmax_range = 15.0");
  with(&TownConfig::visibility, "plugin = \"range_image\"\nmax_range = 15.0");
  with(&TownConfig::visibility, "plugin = \"keep_all\"\nmax_range = 15.0\nmin_views = 2");
  with(&TownConfig::visibility,
       "plugin = \"surface\"\nmax_range = 15.0\nscope = \"region\"\nparams = { point_spacing = 0.4 "
       "}");
  with(&TownConfig::viewpoints, "source = \"trajectory\"\nvoxel_size = 6.0");
  with(&TownConfig::viewpoints, "voxel_size = 5.0\nmin_gain = 0.02");
  with(&TownConfig::store, "plugin = \"shared_tiles\"\ncontent = \"both\"");
  with(&TownConfig::store, "plugin = \"pcd_tiles\"\ncontent = \"prepared\"");
  with(&TownConfig::more, "[thinning]\nvoxel_size = 0.8\n");
  TownConfig chosen = usual;
  chosen.store = "plugin = \"pcd_tiles\"\ncontent = \"prepared\"";
  chosen.more =
      "[selector]\nplugin = \"contribution\"\nshare = 0.3\ntarget_error = 0.03\nplaces = 4\n";
  configs.push_back(chosen);
  for (const TownConfig& config : configs) {
    CAPTURE(config.partitioner);
    CAPTURE(config.ground);
    CAPTURE(config.visibility);
    CAPTURE(config.viewpoints);
    CAPTURE(config.store);
    CAPTURE(config.more);
    check_same_bytes(town, config, {3});
  }
  // The whole town does not fit into the memory, so blocks of it must show that it is too much.
  TownConfig limited = usual;
  limited.partitioner = "plugin = \"budget\"\nparams = { max_points = 5000 }";
  limited.viewpoints = "voxel_size = 4.0";
  limited.visibility = "plugin = \"surface\"\nmax_range = 10.0\nparams = { point_spacing = 0.4 }";
  check_same_bytes(town, limited, {3}, "4MiB");

  // Blocks of a region say nothing about what most viewpoints of the region see.
  limited.visibility += "\nmin_views = 2";
  const auto refused = test::run("vantage-build", {town.config(limited), "-q", "--memory", "4MiB"});
  CHECK(refused.exit_code == 1);
  CHECK_MESSAGE(refused.err.find("region 'cell'") != std::string::npos, refused.err);
  CHECK_MESSAGE(refused.err.find("allow more memory") != std::string::npos, refused.err);
}

TEST_CASE("shards: what needs the whole map says so before anything is built") {
  const SmallTown town;
  const TownConfig usual;
  const auto refuses = [&](auto TownConfig::*part, const char* text, const char* what) {
    TownConfig config = usual;
    config.*part = text;
    const auto built = test::run("vantage-build", {town.config(config), "-q", "--memory", kLittle});
    CHECK(built.exit_code == 1);
    CHECK_MESSAGE(built.err.find(what) != std::string::npos, built.err);
    CHECK(built.err.find("needs the whole map at once") != std::string::npos);
    CHECK_FALSE(fs::exists(town.path("bundle")));
    fs::remove_all(town.path("bundle.parts"));
  };
  refuses(&TownConfig::partitioner,
          "plugin = \"visibility_clusters\"\nparams = { min_overlap = 0.3 }", "[partitioner]");
  refuses(&TownConfig::partitioner,
          "plugin = \"uniform_grid\"\nparams = { cell_width = 20.0, origin = \"ground\" }",
          "give the origin as [x, y]");
  refuses(&TownConfig::ground, "plugin = \"pmf\"\noutliers = {}", "ground.outliers");
  refuses(&TownConfig::visibility, "plugin = \"surface\"", "visibility.max_range");
  refuses(&TownConfig::viewpoints, "voxel_size = 8.0\nreachable = true", "viewpoints.reachable");
}

}  // namespace
}  // namespace vantage
