#include <doctest/doctest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "support/fakes.hpp"
#include "support/plugins.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "vantage/build/assessment.hpp"
#include "vantage/build/bundle_build.hpp"

using namespace vantage;

namespace {

constexpr double kPi = std::numbers::pi;

void add_wall(PointCloud& map, const Point& from, const Point& to, double height) {
  constexpr double kSpacing = 0.25;
  const double length = (to - from).norm();
  for (double along = 0.0; along <= length; along += kSpacing) {
    for (double z = 0.0; z <= height; z += kSpacing) {
      map.push_back(from + along / length * (to - from) + Point(0, 0, z));
    }
  }
}

void add_floor(PointCloud& map, double size_x, double size_y) {
  for (double x = -size_x / 2; x <= size_x / 2; x += 0.4) {
    for (double y = -size_y / 2; y <= size_y / 2; y += 0.4) map.emplace_back(x, y, 0.0);
  }
}

/// Houses beside a street along x, 80 m long, none like another.
PointCloud street_of_houses(unsigned seed) {
  std::mt19937 random(seed);
  const auto number = [&](double from, double to) {
    return from + (to - from) * static_cast<double>(random() % 10000) / 1e4;
  };
  PointCloud map;
  add_floor(map, 84.0, 30.0);
  for (const double side : {-1.0, 1.0}) {
    for (double x = -40.0; x < 34.0; x += number(7.0, 11.0)) {
      const double front = side * number(5.0, 8.0), back = side * 13.0, height = number(3.0, 6.0);
      const double width = number(3.0, 6.0);
      add_wall(map, {x, front, 0}, {x + width, front, 0}, height);
      add_wall(map, {x, front, 0}, {x, back, 0}, height);
      add_wall(map, {x + width, front, 0}, {x + width, back, 0}, height);
    }
  }
  return map;
}

PointCloud path_along_x(double length) {
  PointCloud path;
  for (double x = -length / 2; x <= length / 2; x += 0.5) path.emplace_back(x, 0.0, 1.5);
  return path;
}

PointCloud moved(PointCloud points, double turn, const Point& by) {
  const Pose T = pose_from_xyz_rpy(by, {0, 0, turn});
  for (Point& p : points) p = T * p;
  return points;
}

/// As a survey would see it: 2 cm of noise.
PointCloud noisy(PointCloud points) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.02);
  for (Point& p : points) p += Point(noise(random), noise(random), noise(random));
  return points;
}

Config config_of(const std::filesystem::path& bundle, const std::string& more) {
  auto config = parse_toml(R"(schema = 1
[map]
files = ["map.pcd"]
trajectory = "path.tum"
[partitioner]
plugin = "uniform_grid"
params = { cell_width = 30.0 }
[viewpoints]
source = "trajectory"
voxel_size = 0.5
[visibility]
plugin = "keep_all"
max_range = 60.0
[store]
content = "points"
plugin = "pcd_tiles"
params = { root = ")" + bundle.string() +
                               R"(", overwrite = true }
)" + more,
                           "test")
                    .and_then(parse_config);
  REQUIRE_MESSAGE(config, to_string(config.error()));
  return *std::move(config);
}

const std::string kNdt = "[matcher]\nplugin = \"ndt\"\n";

/// Builds a bundle and opens it.
Bundle built(const Config& config, const PointCloud& map, const PointCloud& path) {
  const PluginLoader plugins = test::built_plugins();
  auto build = BundleBuild::prepare(config, plugins);
  REQUIRE_MESSAGE(build, to_string(build.error()));
  const auto report = build->run(map, path);
  REQUIRE_MESSAGE(report, to_string(report.error()));
  return Bundle::open(config, plugins, "the test").value();
}
Bundle built(const test::TemporaryFolder& folder, const PointCloud& map, const PointCloud& path) {
  return built(config_of(folder.path() / "bundle", kNdt), map, path);
}

std::optional<Atlas> atlas_of(const Bundle& bundle) {
  auto atlas = Atlas::of_bundle(bundle);
  REQUIRE_MESSAGE(atlas, to_string(atlas.error()));
  return *std::move(atlas);
}

Result<AssessmentReport> assess(const Bundle& bundle, const PointCloud& map,
                                const std::string& matcher = kNdt) {
  const Config config = config_of("unused", matcher);
  return Assessment::prepare(bundle, config, test::built_plugins()).and_then([&](Assessment&& one) {
    return one.run(map);
  });
}

/// Builds, assesses, and reads what the bundle keeps.
Atlas assessed(const test::TemporaryFolder& folder, const PointCloud& map, const PointCloud& path) {
  const Bundle bundle = built(folder, map, path);
  const auto report = assess(bundle, map);
  REQUIRE_MESSAGE(report, to_string(report.error()));
  auto atlas = atlas_of(bundle);
  REQUIRE(atlas);
  CHECK(atlas->encode() == report->atlas.encode());
  return *std::move(atlas);
}

std::map<std::string, std::string> files_in(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    files[entry.path().filename().string()] = test::read_text(entry.path());
  }
  return files;
}

}  // namespace

TEST_CASE("a corridor is weak along its axis, whatever its direction") {
  PointCloud corridor;
  add_floor(corridor, 90.0, 6.0);
  for (const double side : {-3.0, 3.0}) {
    add_wall(corridor, {-45.0, side, 0}, {45.0, side, 0}, 3.0);
  }
  const PointCloud path = path_along_x(40.0);
  for (const double turn : {0.0, 0.6, 2.5}) {
    const test::TemporaryFolder folder;
    const Atlas atlas =
        assessed(folder, noisy(moved(corridor, turn, {7, 3, 0})), moved(path, turn, {7, 3, 0}));
    REQUIRE(atlas.sites.size() >= 2);
    std::size_t found = 0;
    for (const Site& site : atlas.sites) {
      REQUIRE(site.precision);
      if (site.precision->basin > 0.0) ++found;
      CHECK(site.precision->sigma_weak > 2.0 * site.precision->sigma_strong);
      const double off = std::remainder(site.precision->weak_direction - turn, kPi);
      CHECK(std::abs(off) < 5.0 * kPi / 180.0);
    }
    CHECK(2 * found < atlas.sites.size());  // along the axis, scans do not find their own pose
  }
}

TEST_CASE("the atlas says where a sensor is localized well, and is the same for any threads") {
  const PointCloud map = noisy(street_of_houses(5)), path = path_along_x(70.0);
  for (const StoredContent content : {StoredContent::points, StoredContent::prepared}) {
    const test::TemporaryFolder folder;
    Config config = config_of(folder.path() / "bundle", kNdt);
    config.store->content = content;
    const Bundle bundle = built(config, map, path);
    CHECK_FALSE(atlas_of(bundle));  // a build makes none
    std::vector<std::byte> first;
    for (const std::size_t threads : {1U, 2U}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      const auto report = assess(bundle, map);
      REQUIRE_MESSAGE(report, to_string(report.error()));
      CHECK(report->core_seconds > 0.0);
      const auto bytes = bundle.reader().attachment(Atlas::kAttachment).value();
      if (first.empty()) first = bytes;
      CHECK(bytes == first);
      const auto atlas = atlas_of(bundle);
      REQUIRE(atlas);
      CHECK(atlas->sites.size() >= 4);
      CHECK(atlas->matcher.plugin == "ndt");
      CHECK(atlas->matcher.params.find("resolution") != std::string::npos);
      for (const Site& site : atlas->sites) {
        REQUIRE(site.precision);
        CHECK(site.precision->expected_error < 0.1);
        CHECK(site.precision->basin >= 1.0);
      }
    }
  }
}

TEST_CASE("two equal rows of houses name each other as alike") {
  const Point apart(0, 120, 0);
  PointCloud map = noisy(street_of_houses(8)), path = path_along_x(70.0);
  const PointCloud twin = moved(map, 0.0, apart), twin_path = moved(path, 0.0, apart);
  map.insert(map.end(), twin.begin(), twin.end());
  path.insert(path.end(), twin_path.begin(), twin_path.end());
  const test::TemporaryFolder folder;
  const Atlas atlas = assessed(folder, map, path);
  std::size_t named = 0;
  for (const Site& site : atlas.sites) {
    const Point twin_place = site.position + (site.position.y() < 60.0 ? apart : -apart);
    named += std::ranges::any_of(site.alike, [&](const AlikePlace& place) {
      return (place.T_map_scan.translation - twin_place).norm() < 0.5 && place.likeness > 0.8;
    });
  }
  CHECK(named >= atlas.sites.size() * 3 / 4);
}

TEST_CASE(
    "an assessment that fails leaves the bundle as it was, and one that does not adds a file") {
  const PointCloud map = noisy(street_of_houses(5)), path = path_along_x(20.0);
  const test::TemporaryFolder folder;
  const auto place = folder.path() / "bundle";
  const Config config = config_of(place, kNdt);
  const Bundle bundle = built(config, map, path);
  const auto fails = [&](const Result<AssessmentReport>& report, ErrorCode code, const char* what) {
    REQUIRE_FALSE(report);
    CHECK(report.error().code == code);
    CHECK_MESSAGE(report.error().message.find(what) != std::string::npos, report.error().message);
  };
  const auto refusals = [&] {
    const auto before = files_in(place);
    fails(assess(bundle, map, ""), ErrorCode::invalid_config, "[matcher]");
    PointCloud other = map;
    other.pop_back();
    fails(assess(bundle, other), ErrorCode::invalid_input, "was built of another map");
    other = moved(map, 0.0, {1, 0, 0});
    fails(assess(bundle, other), ErrorCode::invalid_input, "was built of another map");
    CHECK(files_in(place) == before);
  };
  refusals();
  auto before = files_in(place);
  REQUIRE(assess(bundle, map));
  refusals();
  auto after = files_in(place);
  CHECK(after.erase("atlas.dat") == 1);
  CHECK(after == before);

  // Meanwhile it was built again, of other points.
  auto assessment = Assessment::prepare(bundle, config, test::built_plugins());
  REQUIRE(assessment);
  CHECK(assessment->reach() == 61.0);
  built(config, noisy(street_of_houses(6)), path);
  before = files_in(place);
  fails(assessment->run(map), ErrorCode::io_failure, "another bundle");
  CHECK(files_in(place) == before);
}

TEST_CASE("a store that keeps no attachments keeps no atlas") {
  const PointCloud map = noisy(street_of_houses(5)), path = path_along_x(20.0);
  const Config config = config_of("unused", kNdt);
  auto plugins = load_build_plugins(config, test::built_plugins());
  REQUIRE_MESSAGE(plugins, to_string(plugins.error()));
  const auto memory = std::make_shared<test::Memory>();
  plugins->store = test::in_process<test::MemoryStore, MapStore>(memory);
  REQUIRE(build_region_maps(map, path, *plugins, BuildParams::from(config)));
  const auto bundle = test::bundle_in(memory);
  REQUIRE(bundle);
  const auto report = assess(*bundle, map);
  REQUIRE_FALSE(report);
  CHECK(report.error().code == ErrorCode::unsupported);
}

TEST_CASE("sites at which nothing matches say so") {
  class NothingMatches final : public ScanMatcher {
   public:
    [[nodiscard]] Result<std::unique_ptr<MatchTarget>> prepare(PointsView) const noexcept override {
      return fail(ErrorCode::too_few_matches, "too sparse");
    }
  };
  const PointCloud map = noisy(street_of_houses(5)), path = path_along_x(20.0);
  const test::TemporaryFolder folder;
  const Bundle bundle = built(folder, map, path);
  Assessment assessment(bundle, test::in_process<NothingMatches, ScanMatcher>(), {}, nullptr);
  std::vector<std::pair<std::size_t, std::size_t>> told;
  const auto report =
      assessment.run(map, [&](std::size_t done, std::size_t all) { told.emplace_back(done, all); });
  REQUIRE_MESSAGE(report, to_string(report.error()));
  const auto atlas = atlas_of(bundle);
  REQUIRE(atlas);
  REQUIRE_FALSE(atlas->sites.empty());
  // Their steps count as well: the progress comes to its end.
  REQUIRE(told.size() == 1 + 2 * atlas->sites.size());
  CHECK(told.back() == std::pair(2 * atlas->sites.size(), 2 * atlas->sites.size()));
  for (const Site& site : atlas->sites) CHECK_FALSE(site.precision);
}
