#include "vantage/io/tiling.hpp"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>

#include "tiles.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;
using namespace test;

/// Three clouds: float32 PCD, PCD in ascii, PLY.
class TilingWorld {
 public:
  TilingWorld() {
    for (unsigned i = 0; i < 3; ++i) clouds[i] = scattered(i == 1 ? 3000 : 60000, i);
    REQUIRE(io::write_pcd(path("a.pcd"), clouds[0], io::Precision::float32));
    std::string ascii =
        "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 3000\nHEIGHT 1\nPOINTS 3000\n"
        "DATA ascii\n";
    for (const Point& p : clouds[1]) {
      ascii +=
          std::to_string(p.x()) + ' ' + std::to_string(p.y()) + ' ' + std::to_string(p.z()) + '\n';
    }
    put(path("b.pcd"), ascii);
    REQUIRE(io::write_ply(path("c.ply"), clouds[2], io::Precision::float64));
  }
  [[nodiscard]] fs::path path(const std::string& name) const { return folder_.path() / name; }
  [[nodiscard]] std::vector<fs::path> files() const {
    return {path("a.pcd"), path("b.pcd"), path("c.ply")};
  }
  [[nodiscard]] PointCloud canonical() const {
    PointCloud all;
    for (const PointCloud& cloud : clouds) all.insert(all.end(), cloud.begin(), cloud.end());
    return in_canonical_order(all);
  }

  PointCloud clouds[3];

 private:
  TemporaryFolder folder_;
};

void tiling_refused(const std::vector<fs::path>& files, const io::TilingOptions& options,
                    ErrorCode code, const std::string& where, const std::string& expected) {
  const auto report = io::tile_clouds(files, options);
  REQUIRE_FALSE(report);
  check_clear(report.error(), code, where, expected);
}

TEST_CASE("tiling: bytes do not depend on memory, which is not exceeded") {
  const TilingWorld world;
  io::TilingOptions options = little(world.path("little"));
  const io::TilingReport report = tiled(world.files(), options);
  CHECK(report.points == 123000);
  CHECK(report.buffers <= options.memory);
  options.out = world.path("more");
  options.memory = std::uint64_t{64} << 20U;
  const io::TilingReport more = tiled(world.files(), options);
  CHECK(more.buffers <= options.memory);
  CHECK(more.buffers > report.buffers);
  CHECK(files_of_map(world.path("little")) == files_of_map(world.path("more")));
  CHECK(opened(world.path("more")).read().value() == world.canonical());
  CHECK_FALSE(fs::exists(world.path("more.partial")));
  CHECK(files_of_map(world.path("more")).size() == report.packs + 1);  // and the index
  CHECK(report.bytes == [&] {
    std::uint64_t bytes = 0;
    for (const auto& [name, content] : files_of_map(world.path("more"))) bytes += content.size();
    return bytes;
  }());
}

TEST_CASE("tiling: a run that is killed anywhere is continued, and gives the same bytes" *
          doctest::test_suite("slow")) {
  const TilingWorld world;
  const io::TilingOptions whole = little(world.path("whole"));
  std::size_t calls = 0;
  {
    io::TilingOptions counted = whole;
    counted.on_progress = [&](const io::TilingProgress&) { ++calls; };
    tiled(world.files(), counted);
  }
  const auto expected = files_of_map(world.path("whole"));
  REQUIRE(calls > 15);
  bool kept_places = false;
  bool kept_counts = false;
  for (std::size_t at = 0; at < calls; ++at) {
    CAPTURE(at);
    io::TilingOptions options = whole;
    options.out = world.path("killed_" + std::to_string(at));
    const pid_t child = ::fork();
    if (child == 0) {
      std::size_t call = 0;
      options.on_progress = [&](const io::TilingProgress&) {
        if (call++ == at) ::kill(::getpid(), SIGKILL);
      };
      const auto ignored = io::tile_clouds(world.files(), options);
      ::_exit(ignored ? 0 : 1);
    }
    int status = 0;
    REQUIRE(::waitpid(child, &status, 0) == child);
    REQUIRE(WIFSIGNALED(status));
    CHECK_FALSE(fs::exists(options.out));
    CHECK(fs::exists(options.out.string() + ".partial"));
    io::TilingStart start;
    options.on_start = [&](const io::TilingStart& found) { start = found; };
    const io::TilingReport report = tiled(world.files(), options);
    CHECK(start.counted + report.counted_now == 123000);
    CHECK(start.placed + report.placed_now == 123000);
    CHECK(start.resumed == (start.counted > 0));
    kept_counts = kept_counts || (start.counted == 123000 && report.counted_now == 0);
    kept_places = kept_places || start.placed > 0;
    CHECK(files_of_map(options.out) == expected);
    CHECK_FALSE(fs::exists(options.out.string() + ".partial"));
  }
  CHECK(kept_counts);
  CHECK(kept_places);
}

TEST_CASE("tiling: what a killed run was writing is no part of the result") {
  const TilingWorld world;
  const io::TilingOptions options = little(world.path("map"));
  fs::create_directory(world.path("map.partial"));
  put(world.path("map.partial") / ".vantage-partial", "");
  put(world.path("map.partial") / ".vantage-17-0.tmp", "half a sta");
  put(world.path("map.partial") / "state.vtiles", "damaged");
  put(world.path("map.partial") / "points_0999.pack", "of other input");
  const io::TilingReport report = tiled(world.files(), options);
  CHECK(files_of_map(options.out).size() == report.packs + 1);
}

TEST_CASE("tiling: two runs do not work in one folder") {
  const TilingWorld world;
  io::TilingOptions options = little(world.path("map"));
  const io::TilingOptions other = options;
  options.on_disk_use = [&](const io::TilingDiskUse&) {
    tiling_refused(world.files(), other, ErrorCode::already_exists, "map.partial", "right now");
  };
  tiled(world.files(), options);
  CHECK(opened(options.out).points() == 123000);
}

TEST_CASE("tiling: input that has changed meanwhile is read again from the beginning") {
  const TilingWorld world;
  io::TilingOptions options = little(world.path("map"));
  bool changed = false;
  options.on_disk_use = [&](const io::TilingDiskUse&) {
    if (!std::exchange(changed, true)) {
      REQUIRE(io::write_pcd(world.path("a.pcd"), world.clouds[2], io::Precision::float32));
    }
  };
  tiling_refused(world.files(), options, ErrorCode::io_failure, "a.pcd", "changed");
  CHECK_FALSE(fs::exists(world.path("map")));
  io::TilingStart start;
  options.on_start = [&](const io::TilingStart& found) { start = found; };
  tiled(world.files(), options);
  CHECK(start.started_over);
  CHECK(start.counted == 0);
  CHECK(opened(world.path("map")).points() == 123000);
}

TEST_CASE("tiling: a write that fails is an error, and a later run continues") {
  const TilingWorld world;
  const io::TilingOptions options = little(world.path("map"));
  const pid_t child = ::fork();
  if (child == 0) {
    // No file may become larger, as on a full disk.
    std::signal(SIGXFSZ, SIG_IGN);
    io::TilingOptions limited = options;
    limited.on_disk_use = [](const io::TilingDiskUse&) {
      const rlimit limit{1000, 1000};
      ::setrlimit(RLIMIT_FSIZE, &limit);
    };
    const auto report = io::tile_clouds(world.files(), limited);
    const bool clear = !report && report.error().code == ErrorCode::io_failure &&
                       to_string(report.error()).find(".pack") != std::string::npos;
    ::_exit(clear ? 7 : 1);
  }
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  CHECK(WEXITSTATUS(status) == 7);
  CHECK_FALSE(fs::exists(options.out));
  const io::TilingReport report = tiled(world.files(), options);
  CHECK(report.counted_now == 0);
  CHECK(opened(options.out).read().value() == world.canonical());
}

TEST_CASE("tiling: coordinates are exact, float32 only where that changes none") {
  const TemporaryFolder folder;
  const PointCloud far{{500'000.125, 4'000'000.0001, 31.5}, {500'003.1, 4'000'004.9999999, 0.1}};
  REQUIRE(io::write_pcd(folder.path() / "a.pcd", far, io::Precision::float64));
  tiled({folder.path() / "a.pcd"}, {.out = folder.path() / "map"});
  CHECK(opened(folder.path() / "map").precision() == io::Precision::float64);
  CHECK(opened(folder.path() / "map").read().value() == in_canonical_order(far));

  REQUIRE(io::write_las(folder.path() / "b.las", scattered(70000, 3)));
  const PointCloud las = io::read_point_cloud(folder.path() / "b.las").value().points;
  io::TilingOptions options = little(folder.path() / "las");
  CHECK(tiled({folder.path() / "b.las"}, options).precision == io::Precision::float64);
  CHECK(opened(options.out).read().value() == in_canonical_order(las));
}

TEST_CASE("tiling: points that are not finite are dropped and counted") {
  const TemporaryFolder folder;
  std::string ply =
      "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\n"
      "property float y\nproperty float z\nend_header\n";
  for (const float x : {1.0F, NAN, -1.0F}) ply += reversed(x) + reversed(2.0F) + reversed(3.0F);
  put(folder.path() / "a.ply", ply);
  const auto report = tiled({folder.path() / "a.ply"}, {.out = folder.path() / "map"});
  CHECK(report.points == 2);
  CHECK(report.dropped == 1);
  CHECK(opened(folder.path() / "map").dropped() == 1);
  CHECK(opened(folder.path() / "map").read().value() == PointCloud{{-1, 2, 3}, {1, 2, 3}});
}

TEST_CASE("tiling: a tiled map is an input, too, and keeps the order") {
  const TilingWorld world;
  io::TilingOptions options = little(world.path("map"));
  tiled(world.files(), options);
  options.tile_size = 10.0;
  options.out = world.path("again");
  const auto found = io::map_files(std::vector{world.path("map")});
  REQUIRE(found);
  tiled(found->files, options);
  CHECK(opened(options.out).read().value() == world.canonical());
}

TEST_CASE("tiling: refusals leave nothing behind") {
  const TemporaryFolder folder;
  const auto path = [&](const std::string& name) { return folder.path() / name; };
  REQUIRE(io::write_pcd(path("a.pcd"), scattered(100, 1), io::Precision::float32));
  const std::vector<fs::path> good{path("a.pcd")};
  const io::TilingOptions options{.out = path("map")};
  const auto with = [&](const auto& change) {
    io::TilingOptions changed = options;
    change(changed);
    return changed;
  };
  using Code = ErrorCode;
  for (const double size : {0.0, -5.0, 7.0, 25.5, 1e9, double{NAN}}) {
    tiling_refused(good, with([&](auto& o) { o.tile_size = size; }), Code::invalid_input, "",
                   "expected a multiple of 5 m");
  }
  tiling_refused({}, options, Code::invalid_input, "", "no file");
  tiling_refused({path("none.pcd")}, options, Code::io_failure, "none.pcd", "No such file");
  tiling_refused(good, with([](auto& o) { o.memory = 1000; }), Code::invalid_input, "",
                 "expected 4 MiB");
  tiling_refused(good, with([](auto& o) { o.out = "."; }), Code::invalid_input, "", "folder");
  tiling_refused(good, with([&](auto& o) { o.out = path("a.pcd/map"); }), Code::io_failure, "a.pcd",
                 "cannot be created");

  put(path("empty.pcd"),
      "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nPOINTS 1\n"
      "DATA ascii\nnan 0 0\n");
  tiling_refused({path("empty.pcd")}, options, Code::invalid_input, "empty.pcd",
                 "no finite point (1 dropped)");
  put(path("far.pcd"),
      "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nPOINTS 1\n"
      "DATA ascii\n0 -2e10 0\n");
  tiling_refused({path("a.pcd"), path("far.pcd")}, options, Code::invalid_input, "far.pcd",
                 "y = -2");
  std::string big =
      "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 300000\nHEIGHT 1\n"
      "POINTS 300000\nDATA ascii\n";
  for (int i = 0; i < 300000; ++i) big += "0.125 0 0\n";
  put(path("big.pcd"), big);
  tiling_refused({path("big.pcd")}, with([](auto& o) { o.memory = std::uint64_t{6} << 20U; }),
                 Code::invalid_input, "big.pcd", "only be read as a whole");
  put(path("cut.pcd"), content_of(path("a.pcd")).substr(0, 900));
  tiling_refused({path("cut.pcd")}, options, Code::corrupt_data, "cut.pcd", "expected 100 points");
  PointCloud sparse;
  for (int i = 0; i < 400000; ++i) sparse.emplace_back(5.0 * i, 5.0 * i, 0.0);
  REQUIRE(io::write_pcd(path("sparse.pcd"), sparse, io::Precision::float64));
  tiling_refused({path("sparse.pcd")}, with([](auto& o) { o.memory = std::uint64_t{4} << 20U; }),
                 Code::invalid_input, "", "raise it");
  CHECK_FALSE(fs::exists(path("map")));
  CHECK_FALSE(fs::exists(path("map.partial")));
}

TEST_CASE("tiling: only a tiled map is replaced, and only if asked for") {
  const TilingWorld world;
  io::TilingOptions options = little(world.path("map"));
  tiled({world.path("a.pcd")}, options);
  tiling_refused(world.files(), options, ErrorCode::already_exists, "map", "--overwrite");
  options.overwrite = true;
  tiled(world.files(), options);
  CHECK(opened(options.out).points() == 123000);
  CHECK_FALSE(fs::exists(world.path("map.partial")));

  put(world.path("map") / "notes.txt", "x");
  tiling_refused(world.files(), options, ErrorCode::already_exists, "map", "notes.txt");
  options.out = world.path("a.pcd");
  tiling_refused(world.files(), options, ErrorCode::already_exists, "a.pcd", "not a folder");
  options.out = world.path("other");
  fs::create_directory(world.path("other.partial"));
  put(world.path("other.partial") / "mine.txt", "x");
  tiling_refused(world.files(), options, ErrorCode::already_exists, "other.partial", "mine.txt");
  CHECK(fs::exists(world.path("other.partial") / "mine.txt"));
}

}  // namespace
}  // namespace vantage
