// The way for data of one's own: `vantage init`, `build` and `localize`, without an edit.
#include <doctest/doctest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "support/process.hpp"
#include "support/real_data.hpp"

namespace vantage::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

bool holds(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// A recording of a place, and the map of it.
struct Data {
  std::string map, scans, reference;
  std::vector<std::string> options;  ///< of init and localize
};

/// Runs init with `more`, build and localize in a folder; returns the summary of the run.
json localized(const Data& data, const TemporaryFolder& folder,
               const std::vector<std::string>& more) {
  const std::string config = (folder.path() / "own.toml").string(),
                    out = (folder.path() / "run").string();
  std::vector<std::string> arguments{data.map, data.scans, "--out",
                                     config,   "--quiet",  "--overwrite"};
  arguments.insert(arguments.end(), data.options.begin(), data.options.end());
  arguments.insert(arguments.end(), more.begin(), more.end());
  const Finished made = run("vantage-init", arguments);
  REQUIRE_MESSAGE(made.exit_code == 0, made.err);
  CHECK(made.err.empty());
  CHECK(holds(made.out, "  vantage build " + config + "\n"));
  const Finished built =
      run("vantage-build", {config, "--quiet", "--set", "store.params.overwrite=true"});
  REQUIRE_MESSAGE(built.exit_code == 0, built.err);
  CHECK_MESSAGE(!holds(built.err, "note:"), built.err);
  arguments = {config,  "--scans", data.scans, "--reference", data.reference,
               "--out", out,       "--quiet",  "--json"};
  arguments.insert(arguments.end(), data.options.begin(), data.options.end());
  const Finished done = run("vantage-localize", arguments);
  REQUIRE_MESSAGE(done.exit_code == 0, done.err);
  CHECK_MESSAGE(!holds(done.err, "note:"), done.err);
  return json::parse(done.out);
}

/// Writes the world of configs/simulate/demo.toml with a shorter drive.
Data demo(const TemporaryFolder& folder) {
  const std::string world = (folder.path() / "world").string();
  const Finished made =
      run("vantage-simulate", {VANTAGE_SOURCE_DIR "/configs/simulate/demo.toml", "--out", world,
                               "--quiet", "--set", "drive.length=40"});
  REQUIRE_MESSAGE(made.exit_code == 0, made.err);
  return {.map = world + "/map.pcd",
          .scans = world + "/scans",
          .reference = world + "/reference.tum",
          .options = {"--odometry", world + "/odometry.tum"}};
}

TEST_CASE("init, build, localize: the demo's world") {
  const TemporaryFolder folder;
  const Data data = demo(folder);
  for (const std::string memory : {"40MiB", "1MiB"}) {  // one region; regions of chosen cells
    CAPTURE(memory);
    const json summary = localized(data, folder, {"--memory", memory});
    CHECK(summary["scans"]["tracked"] == summary["scans"]["total"]);
    // configs/demo/wide.toml has 0.18 cm, and small.toml 0.19 cm.
    CHECK(summary["error_m"]["mean"] < 0.0023);
  }
}

TEST_CASE("init, build, localize: the recorded street") {
  const auto street = real_data("kitti_street");
  if (!street) return;
  const TemporaryFolder folder;
  const Data data{.map = (*street / "map.pcd").string(),
                  .scans = (*street / "scans").string(),
                  .reference = (*street / "ref_poses_tum.txt").string(),
                  .options = {}};
  const json summary = localized(data, folder, {});
  CHECK(summary["scans"]["tracked"] == 77);
  // configs/kitti_street/wide.toml has 2.18 cm.
  CHECK(summary["error_m"]["mean"] < 1.05 * 0.0218);
}

TEST_CASE("init: what it writes, and what it refuses") {
  const TemporaryFolder folder;
  const Data data = demo(folder);
  const std::string config = (folder.path() / "own.toml").string();
  const Finished printed = run("vantage-init", {data.map, "--quiet"});
  CHECK_MESSAGE(printed.exit_code == 0, printed.err);
  CHECK(holds(printed.out, "files = [\"" + data.map + "\"]\n"));
  CHECK(holds(printed.out, "YOURS: the height of the sensor"));
  const Finished as_json = run("vantage-init", {data.map, "--quiet", "--json"});
  CHECK(json::parse(as_json.out)["configuration"].get<std::string>() == printed.out);

  write_text(config, "mine");
  const Finished there = run("vantage-init", {data.map, "--out", config});
  CHECK(there.exit_code == 1);
  CHECK(there.err == config + ": error: exists already; --overwrite replaces it\n");
  CHECK(read_text(config) == "mine");

  const Finished unit = run("vantage-init", {data.map, "--memory", "40"});
  CHECK(unit.exit_code == 2);
  const Finished nothing = run("vantage-init", {"/nowhere/map.pcd"});
  CHECK(nothing.exit_code == 1);
  CHECK_MESSAGE(holds(nothing.err, "/nowhere/map.pcd: error: "), nothing.err);
  const Finished little = run("vantage-init", {data.map, "--memory", "0.5MiB"});
  CHECK(little.exit_code == 1);
  CHECK(little.err ==
        "error: region maps that are useful take about 0.6 MB together: --memory is too little\n");
}

}  // namespace
}  // namespace vantage::test
