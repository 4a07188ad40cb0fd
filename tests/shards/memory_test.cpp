// What --memory promises: the peak of every process of a build in parts, measured.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "support/process.hpp"
#include "support/real_data.hpp"

namespace vantage {
namespace {

using test::Finished;

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20U;

/// A level square with a wall every 10 m, as binary PCD; written piece by piece, because the peak
/// of a new process counts that of the test before it.
/// @return  the number of points
std::uint64_t write_square(const std::filesystem::path& file, double side) {
  constexpr double kStep = 0.2;  // [m]
  const int across = static_cast<int>(side / kStep);
  std::uint64_t points = 0;
  const auto walk = [&](const auto& visit) {
    for (int j = 0; j < across; ++j) {
      const double y = kStep * j;
      for (int i = 0; i < across; ++i) visit(kStep * i, y, 0.02 * std::sin(0.3 * i));
      if (j % 50 != 0) continue;
      for (int i = 0; i < across; ++i) {
        for (int k = 1; k < 12; ++k) visit(kStep * i, y, kStep * k);
      }
    }
  };
  walk([&](double, double, double) { ++points; });
  std::ofstream out(file, std::ios::binary);
  out << "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " << points
      << "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " << points << "\nDATA binary\n";
  walk([&](double x, double y, double z) {
    const std::array<float, 3> p{static_cast<float>(x), static_cast<float>(y),
                                 static_cast<float>(z)};
    out.write(reinterpret_cast<const char*>(p.data()), sizeof(p));
  });
  REQUIRE(out.flush());
  return points;
}

TEST_CASE("memory: no process of a build in parts takes much more than it is allowed") {
  const test::TemporaryFolder folder;
  const auto path = [&](const char* name) { return (folder.path() / name).string(); };
  const std::uint64_t points = write_square(path("map.pcd"), 400.0);
  test::write_text(path("square.toml"),
                   "schema = 1\n[map]\nfiles = [\"tiles\"]\n[partitioner]\nplugin = "
                   "\"uniform_grid\"\nparams = { cell_width = 40.0 }\n[ground]\nplugin = "
                   "\"pmf\"\nparams = { max_window = 5.0 }\n[viewpoints]\nvoxel_size = 20.0\n"
                   "[visibility]\nplugin = \"surface\"\nmax_range = 20.0\nparams = { point_spacing "
                   "= 0.2 }\n[store]\nplugin = \"shared_tiles\"\ncontent = \"points\"\nparams = { "
                   "root = \"bundle\", build_cache = 16 }\n[matcher]\nplugin = \"ndt\"\n");
  const auto peak = [&](const char* program, std::vector<std::string> arguments) {
    arguments.emplace_back("-q");
    const Finished finished = test::run(program, arguments);
    REQUIRE_MESSAGE(finished.exit_code == 0, finished.err);
    MESSAGE(program << ": " << finished.peak_memory / kMiB << " MiB");
    return finished.peak_memory;
  };
  // What is allowed, and a process with its libraries, its plan, the index of the map, and the
  // caches of the store, which are parameters of their own.
  const auto bound = [](std::uint64_t mib) { return (mib + mib / 4 + 100) * kMiB; };
  CHECK(peak("vantage-tile", {path("map.pcd"), "-o", path("tiles"), "--memory", "64MiB"}) <
        bound(64));
  // The same in memory: the bounds below are not there by themselves.
  CHECK(peak("vantage-build", {path("square.toml"), "--set",
                               "store.params.root=" + path("whole")}) > bound(64) + 100 * kMiB);
  CHECK(points * 88 > 2 * bound(64));
  for (const char* shard : {"1/2", "2/2"}) {
    CHECK(peak("vantage-build", {path("square.toml"), "--memory", "64MiB", "--shard", shard}) <
          bound(64));
  }
  CHECK(peak("vantage-merge", {path("square.toml"), "--memory", "64MiB"}) < bound(64));
  CHECK(peak("vantage-assess", {path("square.toml"), "--memory", "16MiB", "--set",
                                "atlas.max_sites=40"}) < bound(16));
}

}  // namespace
}  // namespace vantage
