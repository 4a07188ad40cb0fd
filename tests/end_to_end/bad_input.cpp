// Bad input through the programs: one clear line and exit code 1, or a stated degradation; nothing
// half-written stays behind.
#include <doctest/doctest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "support/small_map.hpp"
#include "support/text.hpp"
#include "world.hpp"

using namespace vantage;
namespace fs = std::filesystem;

namespace {

using test::has;

/// Failed with exactly one line on stderr, which it returns without "\n".
std::string failure(const test::Finished& finished, int exit_code = 1) {
  CHECK_MESSAGE(finished.exit_code == exit_code, finished.err);
  CHECK(finished.out.empty());
  CHECK_MESSAGE(std::count(finished.err.begin(), finished.err.end(), '\n') == 1, finished.err);
  return finished.err.substr(0, finished.err.find('\n'));
}

/// A folder with a map of one flat square and a configuration over it.
struct SmallMap : test::SmallMap {
  SmallMap() : test::SmallMap({.viewpoints = ""}) {}

  void write(const std::string& partitioner, const std::string& params) const {
    test::SmallMap::write(
        {.partitioner = partitioner, .partitioner_params = params, .viewpoints = ""});
  }
  [[nodiscard]] test::Finished build(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {config, "--quiet"});
    return test::run("vantage-build", more);
  }
  /// Nothing but the input is there.
  void check_clean() const {
    for (const auto& entry : fs::directory_iterator(folder.path())) {
      const std::string name = entry.path().filename().string();
      CHECK_MESSAGE((name == "c.toml" || name == "map.pcd"), name);
    }
  }
};

}  // namespace

TEST_CASE("build: mistakes in the configuration point at the line") {
  const SmallMap small;
  small.write("uniform_grid", "cel_width = 5.0");
  CHECK(failure(small.build()) ==
        small.config + ":6:12: error: unknown key 'cel_width'; did you mean 'cell_width'?");
  small.write("uniform_grid", "cell_width = -5.0");
  CHECK(failure(small.build()) ==
        small.config + ":6:25: error: 'cell_width' must be > 0 m, not -5.0");
  small.write("uniform_gird", "cell_width = 5.0");
  CHECK(failure(small.build())
            .starts_with(small.config + ":5:10: error: no partitioner plugin 'uniform_gird'; did "
                                        "you mean 'uniform_grid'? (there are: "));
  test::write_text(small.config, "schema = 1\n[map\n");
  CHECK(failure(small.build()).starts_with(small.config + ":2:"));
  test::write_text(small.config, "schema = 1\n");
  CHECK(failure(small.build()) ==
        small.config + ": error: missing table [map], which building region maps needs");
  CHECK(failure(test::run("vantage-build", {small.config + ".none"})) ==
        small.config + ".none: error: cannot read the configuration: No such file or directory");
  small.check_clean();
}

TEST_CASE("build: missing, cut, empty and all-NaN maps") {
  const SmallMap small;
  const fs::path map = small.folder.path() / "map.pcd";
  const std::string whole = test::read_text(map);

  fs::remove(map);
  CHECK(failure(small.build()) == small.config + ":3:10: error: " + map.string() +
                                      ": there is no such file, expected a point cloud or a folder "
                                      "of them");
  CHECK(failure(small.build({"--set", "map.files=[\"none.pcd\"]"}))
            .starts_with("--set map.files=[\"none.pcd\"]: error: "));
  test::write_text(map, whole.substr(0, whole.size() - 100));
  CHECK(has(failure(small.build()), map.string()));
  test::write_text(map, "");
  CHECK(has(failure(small.build()), map.string()));
  test::write_text(map, "no point cloud at all");
  CHECK(has(failure(small.build()), map.string()));
  test::write_text(
      map,
      "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 0\nHEIGHT 1\n"
      "POINTS 0\nDATA ascii\n");
  CHECK(has(failure(small.build()), map.string() + ": error: the map holds no finite point"));
  test::write_text(
      map,
      "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n"
      "POINTS 2\nDATA ascii\nnan 0 0\n1 inf 0\n");
  CHECK(has(failure(small.build()), "the map holds no finite point (2 dropped)"));
  small.check_clean();
}

TEST_CASE("build: NaN points are dropped and counted, the rest is used") {
  const SmallMap small;
  std::string text =
      "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 403\nHEIGHT 1\n"
      "POINTS 403\nDATA ascii\nnan 0 0\ninf 1 1\n2 2 nan\n";
  for (int i = 0; i < 400; ++i) {
    text += std::to_string(i % 20) + " " + std::to_string(i / 20) + " 0\n";
  }
  test::write_text(small.folder.path() / "map.pcd", text);
  const auto done = small.build({"--json"});
  REQUIRE_MESSAGE(done.exit_code == 0, done.err);
  const auto report = nlohmann::json::parse(done.out);
  CHECK(report["dropped_points"] == 3);
  CHECK(report["map_points"] == 400);
}

TEST_CASE("build: a configuration without a matcher gets one note") {
  const auto notes = [](const std::string& matcher, const std::vector<std::string>& more) {
    const test::SmallMap small({.viewpoints = "", .matcher = matcher});
    std::vector<std::string> arguments{small.config};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto built = test::run("vantage-build", arguments);
    CHECK_MESSAGE(built.exit_code == 0, built.err);
    std::string found;
    std::istringstream lines(built.err);
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("note: ")) found += line + '\n';
    }
    return found;
  };
  CHECK(notes("", {}) ==
        "note: the configuration has no [matcher]: the bundle gets points, but no prepared maps, "
        "and `vantage assess` and `vantage localize` need one: add the lines `[matcher]` and "
        "`plugin = \"ndt\"`\n");
  CHECK(notes("", {"--quiet"}).empty());
  CHECK(notes("plugin = \"ndt\"\n", {}).empty());
}

TEST_CASE("build: the command that is named can be given to a shell") {
  const SmallMap small;
  const std::string spaced = (small.folder.path() / "small map.toml").string();
  fs::copy_file(small.config, spaced);
  const auto built = test::run("vantage-build", {spaced});
  REQUIRE_MESSAGE(built.exit_code == 0, built.err);
  CHECK(has(built.out, "`vantage assess '" + spaced + "'` measures how well a sensor is"));
}

TEST_CASE("assess: what is missing is named, and the bundle stays as it is") {
  const SmallMap small;
  const std::string bundle = (small.folder.path() / "bundle").string();
  const auto assess = [](std::vector<std::string> arguments) {
    arguments.emplace_back("--quiet");
    return test::run("vantage-assess", arguments);
  };
  CHECK(has(failure(assess({small.config})), "`vantage build` makes it"));
  const auto built = test::run("vantage-build", {small.config, "--set", "store.content=points"});
  REQUIRE_MESSAGE(built.exit_code == 0, built.err);
  CHECK(has(built.out, "`vantage assess " + small.config + "` measures how well a sensor is"));
  CHECK(failure(assess({bundle})) ==
        bundle +
            ": error: the bundle keeps points, and says nothing of a matcher: name it with "
            "--set matcher.plugin=ndt, or give the configuration instead of the bundle");
  fs::rename(small.folder.path() / "map.pcd", small.folder.path() / "moved.pcd");
  const std::string ndt = "matcher.plugin=ndt";
  CHECK(has(failure(assess({bundle, "--set", ndt})), "name it with --set 'map.files=[\"FILE\"]'"));
  CHECK(has(failure(assess({small.config})), small.config + ":3:"));
  CHECK_FALSE(fs::exists(small.folder.path() / "bundle/atlas.dat"));

  const std::string moved = "map.files=[\"" + (small.folder.path() / "moved.pcd").string() + "\"]";
  const auto done = assess({bundle, "--set", ndt, "--set", moved, "--json"});
  REQUIRE_MESSAGE(done.exit_code == 0, done.err);
  CHECK(nlohmann::json::parse(done.out)["sites"] == 1);
  CHECK(fs::exists(small.folder.path() / "bundle/atlas.dat"));
}

TEST_CASE("build: an existing bundle is not touched without overwrite") {
  const SmallMap small;
  REQUIRE(small.build().exit_code == 0);
  const fs::path index = small.folder.path() / "bundle/index.json";
  const std::string before = test::read_text(index);
  CHECK(has(failure(small.build({"--set", "partitioner.params.cell_width=2.5"})), "bundle"));
  CHECK(test::read_text(index) == before);
  CHECK(small.build({"--set", "partitioner.params.cell_width=2.5", "--overwrite"}).exit_code == 0);
  CHECK(test::read_text(index) != before);
}

TEST_CASE("wrong usage is exit code 2") {
  CHECK(test::run("vantage-build", {}).exit_code == 2);
  CHECK(test::run("vantage-build", {"c.toml", "--jbos", "2"}).exit_code == 2);
  CHECK(test::run("vantage", {}).exit_code == 2);
  CHECK(has(failure(test::run("vantage", {"biuld"}), 2), "no job 'biuld'; did you mean 'build'?"));
  CHECK(test::run("vantage", {"--help"}).exit_code == 0);
  CHECK(test::run("vantage", {"build", "--help"}).exit_code == 0);
  const SmallMap small;
  CHECK(has(failure(test::run("vantage-localize", {small.config, "--scans", "s", "--out", "o"}), 2),
            "no first pose: give --initial-pose (a pose or 'auto'), --prior or --reference"));
  CHECK(has(
      failure(test::run("vantage-localize", {small.config, "--scans", small.folder.path().string(),
                                             "--out", "o", "--initial-pose", "1,2,3"}),
              2),
      "six numbers"));
}

TEST_CASE("localize: missing bundle, scans, reference; damaged scans and bundles") {
  const test::Street street;
  const std::string config = street.write_config("c.toml", 20, "bundle");
  CHECK(has(failure(street.localize(config, "run", {"--quiet"})), street.path("bundle")));
  REQUIRE(test::run("vantage-build", {config, "--quiet"}).exit_code == 0);

  CHECK(has(failure(test::run("vantage-localize",
                              {config, "--scans", street.path("none"), "--reference",
                               street.path("reference.tum"), "--out", street.path("run")})),
            street.path("none")));
  CHECK(has(failure(test::run("vantage-localize",
                              {config, "--scans", street.path("scans"), "--reference",
                               street.path("none.tum"), "--out", street.path("run")})),
            street.path("none.tum")));

  // A scan cut short in the middle of the drive: what was localized before it is not lost.
  const fs::path scan = street.folder() / "scans/000012.pcd";
  const std::string whole = test::read_text(scan);
  test::write_text(scan, whole.substr(0, whole.size() / 2));
  const auto cut = street.localize(config, "run", {"--quiet"});
  CHECK(cut.exit_code == 1);
  CHECK(std::count(cut.err.begin(), cut.err.end(), '\n') == 1);
  CHECK(has(cut.err, scan.string()));
  CHECK(has(cut.err, "after 12 scans, which are written"));
  const auto before = io::read_trajectory(street.folder() / "run/trajectory.tum");
  REQUIRE_MESSAGE(before, to_string(before.error()));
  CHECK(before->size() == 12);
  test::write_text(scan, whole);
  fs::remove_all(street.folder() / "run");

  // A region map cut short.
  for (const auto& entry : fs::directory_iterator(street.folder() / "bundle")) {
    if (entry.path().extension() != ".pcd") continue;
    const std::string tile = test::read_text(entry.path());
    test::write_text(entry.path(), tile.substr(0, tile.size() / 2));
  }
  CHECK(has(failure(street.localize(config, "run", {"--quiet"})), ".pcd"));
  CHECK_FALSE(fs::exists(street.folder() / "run"));
}

TEST_CASE(
    "localize: a scan of elsewhere is lost, one of nothing uncertain, and localization goes on") {
  const test::Street street;
  const std::string config = street.write_config("c.toml", 20, "bundle");
  REQUIRE(test::run("vantage-build", {config, "--quiet"}).exit_code == 0);
  // Scan 10 sees only what is far outside the map, scan 11 nothing at all, scan 12 only NaN.
  const PointCloud far(500, Point(5000, 5000, 5000));
  REQUIRE(io::write_pcd(street.folder() / "scans/000010.pcd", far, io::Precision::float32));
  const std::string header = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n";
  test::write_text(street.folder() / "scans/000011.pcd",
                   header + "WIDTH 0\nHEIGHT 1\nPOINTS 0\nDATA ascii\n");
  test::write_text(street.folder() / "scans/000012.pcd",
                   header + "WIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\nnan nan nan\n");
  const auto done = street.localize(config, "run", {"--quiet", "--json"});
  REQUIRE_MESSAGE(done.exit_code == 0, done.err);
  const auto summary = nlohmann::json::parse(done.out);
  CHECK(summary["scans"]["lost"] == 1);
  CHECK(summary["scans"]["uncertain"] == 2);
  CHECK(summary["scans"]["recovered"] == 1);
  CHECK(summary["scans"]["tracked"] == test::Street::kScans - 3);
  CHECK(summary["scans"]["dropped_points"] == 1);
  CHECK(summary["error_m"]["max"] < 0.5);
  CHECK(io::read_trajectory(street.folder() / "run/trajectory.tum")->size() ==
        test::Street::kScans - 3);
}

TEST_CASE("localize: a pose outside every region keeps the nearest map, and the output says so") {
  const test::Street street(true);
  const std::string config = street.write_config("c.toml", 20, "bundle");
  REQUIRE(test::run("vantage-build", {config, "--quiet"}).exit_code == 0);
  const auto from_there = [&](const std::string& recovery, int exit_code) {
    auto done =
        test::run("vantage-localize", {config, "--scans", street.path("scans"), "--out",
                                       street.path("run"), "--initial-pose", "-500,-500,0,0,0,0",
                                       "--json", "--quiet", "--set", "localizer." + recovery});
    REQUIRE_MESSAGE(done.exit_code == exit_code, done.err);
    return nlohmann::json::parse(done.out);
  };
  const auto summary = from_there("recovery_radius=0", 1);
  CHECK(summary["scans"]["outside"] == test::Street::kScans);
  CHECK(summary["scans"]["lost"] == test::Street::kScans);

  // Where it may look for the sensor, it finds it.
  const auto found = from_there("recovery_radius=1000", 0);
  CHECK(found["scans"]["tracked"] >= test::Street::kScans - 1);
  CHECK(found["scans"]["lost"] <= 1);
}

TEST_CASE("localize: where places are alike, scans are uncertain until one place is left") {
  const test::Street street;
  const std::string config = street.write_config("c.toml", 20, "bundle");
  REQUIRE(test::run("vantage-build", {config, "--quiet"}).exit_code == 0);
  const auto done = street.localize(config, "run", {"--initial-pose", "auto", "--json", "--quiet"});
  REQUIRE_MESSAGE(done.exit_code == 0, done.err);
  const auto summary = nlohmann::json::parse(done.out);
  CHECK(summary["scans"]["uncertain"] >= 1);
  CHECK(summary["scans"]["lost"] == 0);
  CHECK(summary["scans"]["tracked"] >= test::Street::kScans - 6);
  CHECK(summary["error_m"]["max"] < 0.5);  // of tracked scans
}

TEST_CASE("evaluate: a missing bundle is told before any scan is localized") {
  const test::Street street;
  const std::string there = street.write_config("there.toml", 0, "maps/there");
  const std::string missing = street.write_config("missing.toml", 20, "maps/missing");
  REQUIRE(test::run("vantage-build", {there, "--quiet"}).exit_code == 0);
  const auto done = test::run("vantage-evaluate",
                              {there, missing, "--scans", street.path("scans"), "--reference",
                               street.path("reference.tum"), "--out", street.path("evaluation")});
  const std::string message = failure(done);
  CHECK(has(message, "there is no bundle"));
  CHECK(has(message, "`vantage build` makes it (while evaluating " + missing + ")"));
  CHECK_FALSE(fs::exists(street.path("evaluation")));
}

TEST_CASE("plugins new: what cannot be made is refused, and nothing is left") {
  const test::TemporaryFolder folder;
  const std::string out = (folder.path() / "p").string();
  const auto refused = [&](const std::string& kind, const std::string& name) {
    return failure(test::run("vantage-plugins", {"new", kind, name, "--out", out}));
  };
  CHECK(refused("partitoner", "mine") ==
        "error: no kind 'partitoner'; did you mean 'partitioner'? (there are: partitioner, ground, "
        "visibility, store, matcher, selector, relocalizer)");
  CHECK(has(failure(test::run("vantage-plugins", {"new", "ground", "", "--out", out}), 2),
            "error: NAME is given an empty value"));
  for (const std::string name : {"My", "1st", "a-b", "a/b", "..", "a b", "\xc3\xa4"}) {
    CHECK(refused("ground", name) ==
          "error: '" + name +
              "' is not a name for a plugin: expected 1 to 64 lower-case letters, "
              "digits and '_', the first a letter, as in 'my_plugin'");
  }
  CHECK(has(refused("partitioner", "uniform_grid"),
            "error: there is a partitioner plugin 'uniform_grid' already: "));
  CHECK_FALSE(fs::exists(out));

  test::write_text(out, "a file of somebody's");
  CHECK(refused("store", "mine") ==
        "error: " + out + " exists already; expected a folder to create, or an empty one");
  CHECK(test::read_text(out) == "a file of somebody's");
  fs::remove(out);

  REQUIRE(test::run("vantage-plugins", {"new", "store", "mine", "--out", out}).exit_code == 0);
  CHECK(fs::exists(fs::path(out) / "mine.cpp"));
  CHECK(has(test::read_text(fs::path(out) / "mine.cpp"), "class MineStore final"));
  CHECK(has(refused("store", "other"), " exists already"));
  CHECK(std::distance(fs::directory_iterator(folder.path()), {}) == 1);
  CHECK(test::run("vantage-plugins", {"list", "--plugin-dir", out + "/none"}).exit_code == 2);
}

TEST_CASE("plugins: list, describe and check answer a person and a program") {
  const auto listed = test::run("vantage", {"plugins", "list", "--json"});
  REQUIRE(listed.exit_code == 0);
  CHECK(nlohmann::json::parse(listed.out).size() >= 7);
  const auto described = test::run("vantage", {"plugins", "describe", "hpr"});
  CHECK(has(described.out, "alpha"));
  CHECK(has(failure(test::run("vantage", {"plugins", "describe", "hrp"})), "did you mean 'hpr'?"));
  const std::string grid =
      (fs::path(VANTAGE_PLUGIN_DIR) / "vantage_partitioner_uniform_grid.so").string();
  CHECK(test::run("vantage", {"plugins", "check", grid}).out ==
        grid + ": ok, partitioner plugin 'uniform_grid'\n");
  CHECK(has(failure(test::run("vantage", {"plugins", "check", "/etc/passwd"})), "/etc/passwd"));
}
