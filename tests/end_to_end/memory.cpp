// What map_memory promises: the peak of localize, measured.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "support/process.hpp"
#include "support/real_data.hpp"

namespace vantage {
namespace {

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20U;

struct Stored {
  std::string content;
  std::uint64_t on_its_way;  // [MiB] of the points of one region, however little is allowed
  std::uint64_t besides;     // [MiB] program, libraries, scans, and what the matcher computes with
};

TEST_CASE("localize takes map_memory, and little more") {
  const test::TemporaryFolder folder;
  const auto path = [&](const std::string& name) { return (folder.path() / name).string(); };
  const auto run = [&](const char* program, std::vector<std::string> arguments) {
    arguments.emplace_back("-q");
    test::Finished finished = test::run(program, arguments);
    REQUIRE_MESSAGE(finished.exit_code == 0, finished.err);
    return finished.peak_memory / kMiB;
  };
  run("vantage-simulate",
      {std::string(VANTAGE_SOURCE_DIR) + "/configs/simulate/campus200.toml", "--out", path("world"),
       "--set", "campus.size_x=150", "--set", "campus.size_y=150", "--set", "drive.speed=10",
       "--set", "drive.scan_every=4"});
  // Regions have up to two million points, and their maps take 0.4 MB prepared.
  for (const Stored& stored : {Stored{"points", 40, 80}, Stored{"prepared", 0, 40}}) {
    CAPTURE(stored.content);
    const std::string config = path(stored.content + ".toml");
    test::write_text(config, R"(schema = 1
[map]
files = ["world/map.pcd"]
[partitioner]
plugin = "uniform_grid"
params = { cell_width = 20.0 }
[ground]
plugin = "pmf"
[viewpoints]
voxel_size = 20.0
[visibility]
plugin = "keep_all"
max_range = 60.0
[matcher]
plugin = "ndt"
[store]
plugin = "shared_tiles"
params = { root = "bundle_)" + stored.content +
                                 "\" }\ncontent = \"" + stored.content + "\"\n");
    run("vantage-build", {config});
    for (const std::uint64_t map_memory : {40U, 4U}) {
      const std::string mib = std::to_string(map_memory);
      const std::uint64_t peak =
          run("vantage-localize",
              {config, "--scans", path("world/scans"), "--reference", path("world/reference.tum"),
               "--odometry", path("world/odometry.tum"), "--out", path(stored.content + mib),
               "--set", "localizer.map_memory=" + mib});
      MESSAGE(stored.content << ", map_memory = " << mib << ": " << peak << " MiB");
      CHECK(peak < std::max(map_memory, stored.on_its_way) + stored.besides);
    }
  }
}

}  // namespace
}  // namespace vantage
