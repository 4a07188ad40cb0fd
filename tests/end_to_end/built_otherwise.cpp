// A bundle that was built with other keys than the configuration asks for is not used silently.
#include <doctest/doctest.h>

#include <algorithm>

#include "support/text.hpp"
#include "world.hpp"

namespace fs = std::filesystem;
using namespace vantage;

namespace {

/// The one line of stderr.
std::string error_of(const test::Finished& finished) {
  CHECK(finished.exit_code == 1);
  CHECK(std::count(finished.err.begin(), finished.err.end(), '\n') == 1);
  return finished.err.substr(0, finished.err.find('\n'));
}

}  // namespace

TEST_CASE(
    "localize and evaluate refuse a bundle that was built otherwise, and name key and values") {
  const test::Street street;
  const std::string config = street.write_config("c.toml", 10, "bundle");
  REQUIRE(test::run("vantage-build", {config, "--quiet"}).exit_code == 0);
  const auto localize = [&](std::vector<std::string> more) {
    more.push_back("--quiet");
    return street.localize(config, "run", more);
  };
  const auto evaluate = [&](std::vector<std::string> more) {
    more.insert(more.begin(),
                {config, "--scans", street.path("scans"), "--reference",
                 street.path("reference.tum"), "--out", street.path("evaluation"), "--quiet"});
    return test::run("vantage-evaluate", more);
  };
  const std::string end =
      ": build the bundle again, or change the key to match it (while opening the bundle of " +
      config;
  const std::string nearer =
      "--set visibility.max_range=15: error: 'visibility.max_range' is "
      "15.0, and the bundle was built without it" +
      end;
  CHECK(error_of(localize({"--set", "visibility.max_range=15"})) == nearer + ")");
  CHECK(error_of(evaluate({"--set", "visibility.max_range=15"})) ==
        nearer + "; while evaluating " + config + ")");
  CHECK(error_of(localize({"--set", "viewpoints.voxel_size=4"})) ==
        "--set viewpoints.voxel_size=4: error: 'viewpoints.voxel_size' is 4.0, and the bundle was "
        "built with 3.0" +
            end + ")");
  CHECK_FALSE(fs::exists(street.path("run")));
  CHECK_FALSE(fs::exists(street.path("evaluation")));

  // What does not change the bundle may differ.
  CHECK(localize({"--set", "localizer.switch_margin=1", "--set", "matcher.params.resolution=1.5",
                  "--set", "viewpoints.voxel_size=3", "--set", "visibility.min_views=1"})
            .exit_code == 0);
  fs::rename(street.path("bundle"), street.path("moved"));
  fs::rename(street.path("map.pcd"), street.path("moved.pcd"));
  CHECK(localize({"--set", "store.params.root=" + street.path("moved"), "--set",
                  "map.files=[\"" + street.path("moved.pcd") + "\"]"})
            .exit_code == 0);
  fs::rename(street.path("moved"), street.path("bundle"));
  fs::rename(street.path("moved.pcd"), street.path("map.pcd"));

  // The configuration was edited after the build: the place is that of the edit.
  test::replace_in_file(config, "cell_width = 10.0", "cell_width = 15.0");
  const std::string edited = error_of(localize({}));
  CHECK(edited.starts_with(config + ":"));
  CHECK(edited.find("error: 'partitioner.params.cell_width' is 15.0, and the bundle was built with "
                    "10.0: build the bundle again") != std::string::npos);
  REQUIRE(test::run("vantage-build", {config, "--quiet", "--overwrite"}).exit_code == 0);
  CHECK(localize({}).exit_code == 0);
}
