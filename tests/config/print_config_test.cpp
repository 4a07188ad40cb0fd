// `vantage build --print-config`: the configuration as it counts.
#include <doctest/doctest.h>

#include "shipped.hpp"
#include "support/plugins.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "vantage/engine/config.hpp"

using namespace vantage;
namespace fs = std::filesystem;

namespace {

std::string printed(const fs::path& config, std::vector<std::string> more = {}) {
  more.insert(more.begin(), {config.string(), "--print-config"});
  const auto finished = test::run("vantage-build", more);
  REQUIRE_MESSAGE(finished.exit_code == 0, finished.err);
  CHECK(finished.err.empty());
  return finished.out;
}

}  // namespace

TEST_CASE("--print-config: what it prints loads again, anywhere, and prints the same") {
  const test::TemporaryFolder elsewhere;
  const fs::path copy = elsewhere.path() / "copy.toml";
  std::size_t configs = 0;
  for (const fs::path& config : test::shipped_configs()) {
    if (!load_config(config)) continue;  // a world file
    CAPTURE(config.string());
    ++configs;
    const std::string once = printed(config);
    test::write_text(copy, once);
    CHECK(printed(copy) == once);
  }
  CHECK(configs >= 8);
}

TEST_CASE("--print-config fills in defaults and --set, makes paths absolute, builds nothing") {
  const test::TemporaryFolder folder;
  const fs::path root = fs::canonical(folder.path());
  test::write_text(root / "c.toml", R"(schema = 1
[map]
files = ["maps/../a.pcd"]
[partitioner]
plugin = "whole_map"
[store]
plugin = "pcd_tiles"
params = { root = "bundle" }
[matcher]
plugin = "ndt"
)");
  const fs::path before = fs::current_path();
  fs::current_path(root);
  const std::string text = printed(
      "c.toml", {"--set", "partitioner.params.margin=2.5", "--set", "map.trajectory=drive.tum"});
  fs::current_path(before);
  const Table table = test::table(text);
  const auto string_at = [&](const char* section, const char* key) {
    return std::get<std::string>(std::get<Table>(table.find(section)->data).find(key)->data);
  };
  CHECK(string_at("map", "trajectory") == (root / "drive.tum").string());
  CHECK(text.find("files = [\"" + (root / "a.pcd").string() + "\"]") != std::string::npos);
  CHECK(text.find("root = \"" + (root / "bundle").string() + "\"") != std::string::npos);
  CHECK(text.find("# scan_max_range is left out: scan points farther from the sensor than this are "
                  "dropped; unlimited if left out\n") != std::string::npos);
  CHECK(text.find("# d1 is left out: ") != std::string::npos);  // of a plugin
  CHECK(text.find("overwrite = false") != std::string::npos);
  CHECK(text.find("margin = 2.5") != std::string::npos);
  CHECK(text.find("resolution = 1.0") != std::string::npos);       // of the matcher
  CHECK(text.find("sensor_height = 1.0") != std::string::npos);    // of [viewpoints], left out
  CHECK(text.find("scan_voxel_size = 0.5") != std::string::npos);  // of [localizer], left out
  CHECK(std::distance(fs::directory_iterator(root), {}) == 1);
}

TEST_CASE("--print-config: a mistake is an error with the file's name as it was given") {
  const test::TemporaryFolder folder;
  test::write_text(folder.path() / "c.toml",
                   "schema = 1\n[matcher]\nplugin = \"ndt\"\nparams = { resolution = -1 }\n");
  const fs::path before = fs::current_path();
  fs::current_path(folder.path());
  const auto finished = test::run("vantage-build", {"c.toml", "--print-config"});
  fs::current_path(before);
  CHECK(finished.exit_code == 1);
  CHECK(finished.out.empty());
  CHECK(finished.err == "c.toml:4:25: error: 'resolution' must be > 0 m, not -1\n");
}
