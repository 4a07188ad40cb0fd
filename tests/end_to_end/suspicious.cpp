// Inputs that are not what their user meant: `vantage check`, `init` and `localize` name each.
#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "support/process.hpp"
#include "support/real_data.hpp"
#include "support/small_config.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/scan_source.hpp"

namespace vantage::test {
namespace {

Eigen::Matrix3d rows(const Eigen::Vector3d& x, const Eigen::Vector3d& y, const Eigen::Vector3d& z) {
  Eigen::Matrix3d m;
  m << x.transpose(), y.transpose(), z.transpose();
  return m;
}
const Eigen::Vector3d kX = Eigen::Vector3d::UnitX(), kY = Eigen::Vector3d::UnitY(),
                      kZ = Eigen::Vector3d::UnitZ();

/// A small campus, a drive of 20 scans, and a bundle of the whole map.
class Site {
 public:
  Site() {
    const Finished made =
        test::run("vantage-simulate",
                  {VANTAGE_SOURCE_DIR "/configs/simulate/demo.toml", "--out", path("world"),
                   "--quiet", "--set", "seed=31", "--set", "drive.length=12", "--set",
                   "drive.scan_every=3", "--set", "lidar.motion_distortion=false"});
    REQUIRE_MESSAGE(made.exit_code == 0, made.err);
    SmallConfig config = whole_world();
    config.store = "params = { root = \"maps\" }\n";
    write_text(path("config.toml"), to_text(config));
    const Finished built = test::run("vantage-build", {path("config.toml"), "--quiet"});
    REQUIRE_MESSAGE(built.exit_code == 0, built.err);
    REQUIRE(built.err.find("note:") == std::string::npos);
  }

  [[nodiscard]] std::string path(const std::string& file) const {
    return (folder_.path() / file).string();
  }

  /// The folder of the same scans with every point changed.
  std::string scans(const std::string& name, const Eigen::Matrix3d& change,
                    const Point& by = Point::Zero()) const {
    const std::filesystem::path folder = path(name);
    std::filesystem::create_directories(folder);
    io::ScanOptions options;
    options.path = path("world/scans");
    auto source = io::open_scans(options);
    REQUIRE(source);
    std::ofstream times(folder / "times.txt");
    for (int k = 0;; ++k) {
      auto scan = (*source)->next();
      REQUIRE(scan);
      if (!*scan) break;
      for (Point& p : (*scan)->points) p = change * p + by;
      const std::string file = std::to_string(1000 + k) + ".pcd";
      REQUIRE(io::write_pcd(folder / file, (*scan)->points, io::Precision::float32));
      times << std::to_string((*scan)->stamp) << '\n';
    }
    return folder.string();
  }

  /// The file of the same map with every point changed.
  std::string map_file(const std::string& name, const Eigen::Matrix3d& change,
                       const Point& by = Point::Zero()) const {
    auto cloud = io::read_point_cloud(path("world/map.pcd"));
    REQUIRE(cloud);
    for (Point& p : cloud->points) p = change * p + by;
    REQUIRE(io::write_pcd(path(name), cloud->points, io::Precision::float32));
    return path(name);
  }
  /// `--set map.files=...` for it.
  std::string map(const std::string& name, const Eigen::Matrix3d& change,
                  const Point& by = Point::Zero()) const {
    return "map.files=[\"" + map_file(name, change, by) + "\"]";
  }

  [[nodiscard]] Finished check(const std::string& scans, const std::string& set = {},
                               const std::string& set_too = {}) const {
    std::vector<std::string> arguments{path("config.toml"), "--quiet", "--scans", scans};
    for (const std::string& change : {set, set_too}) {
      if (!change.empty()) arguments.insert(arguments.end(), {"--set", change});
    }
    return test::run("vantage-check", arguments);
  }
  [[nodiscard]] Finished init(const std::string& map, const std::string& scans,
                              const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments{map, scans, "--quiet", "--out", path("made.toml")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return test::run("vantage-init", arguments);
  }
  [[nodiscard]] Finished localize(const std::string& scans,
                                  const std::vector<std::string>& more) const {
    std::vector<std::string> arguments{path("config.toml"), "--quiet", "--scans", scans, "--out",
                                       path("run")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return test::run("vantage-localize", arguments);
  }

 private:
  TemporaryFolder folder_;
};

bool holds(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST_CASE("check: the right inputs, and a dozen that are not") {
  const Site site;
  const std::string right = site.path("world/scans");
  const Finished good = site.check(right);
  CHECK_MESSAGE(good.exit_code == 0, good.out, good.err);
  CHECK(holds(good.out, "nothing suspicious"));

  const auto named = [&](const Finished& run, const std::string& part) {
    CHECK_MESSAGE(run.exit_code == 1, run.out, run.err);
    CHECK_MESSAGE(holds(run.out, part), run.out);
  };
  const Eigen::Matrix3d as_is = Eigen::Matrix3d::Identity();
  named(site.check(right, site.map("cm.pcd", 100.0 * as_is)), "seems to be in centimetres");
  named(site.check(site.scans("large", 1.02 * as_is)), "when they are made 2 % smaller");
  named(site.check(site.scans("small", 0.98 * as_is)), "when they are made 2 % larger");
  named(site.check(right, site.map("mm.pcd", 1000.0 * as_is)), "seems to be in millimetres");
  named(site.check(right, site.map("feet.pcd", as_is / 0.3048)), "multiply the map by 0.3048");
  named(site.check(right, site.map("mirrored.pcd", rows(kX, -kY, kZ))), "when they are mirrored");
  named(site.check(right, site.map("down.pcd", rows(kX, kY, -kZ))), "in direction -z");
  named(site.check(right, site.map("turned.pcd", rows(kX, -kY, -kZ))), "in direction -z");
  named(site.check(right, site.map("y_up.pcd", rows(kX, kZ, -kY))), "in direction +y");
  named(site.check(right, site.map("utm.pcd", as_is, {458'000.0, 5'428'000.0, 115.0})),
        "32-bit floats are 0.5 m apart");
  named(site.check(site.scans("swapped", rows(kY, kX, kZ))), "when they are mirrored");
  named(site.check(site.scans("camera", rows(-kY, -kZ, kX))), "axes are those of a camera");
  named(site.check(site.scans("hung", rows(kX, -kY, -kZ))), "ground above the sensor");
  named(site.check(site.scans("millimetres", 1000.0 * as_is)), "seem to be in millimetres");
  named(site.check(site.scans("feet", as_is / 0.3048)), "multiply the scans by 0.3048");
  named(site.check(site.scans("aligned", as_is, {300.0, 200.0, 0.0})), "map's frame");
  named(site.check(right, "viewpoints.sensor_height=1.9"), "set it to 1.0");
  named(site.check(right, "visibility.max_range=1"), "visibility.max_range is 1 m");
  named(site.check(right, "localizer.scan_max_range=1"), "of the points");
  const auto selecting = [&](const std::string& highest) {
    return site.check(
        right, "store.content=prepared",
        "selector={plugin=\"contribution\",max_bytes=20000,lowest=-15,highest=" + highest + "}");
  };
  CHECK(holds(selecting("15").out, "nothing suspicious"));
  named(selecting("2"), "points lie between -15.0 and 15.0");
  const Finished negative = site.check(right, "viewpoints.sensor_height=-1.73");
  CHECK(negative.exit_code == 1);
  CHECK(holds(negative.err, "'sensor_height' must be >= 0 m"));
}

TEST_CASE("init: inputs that check names are refused, and written about if they are to be used") {
  const Site site;
  const std::string right = site.path("world/scans"), map = site.path("world/map.pcd");
  const Eigen::Matrix3d as_is = Eigen::Matrix3d::Identity();
  const auto refused = [&](const Finished& run, const std::string& part) {
    CHECK_MESSAGE(run.exit_code == 1, run.out, run.err);
    CHECK_MESSAGE(run.err.starts_with("note: "), run.err);
    CHECK_MESSAGE(holds(run.err, part), run.err);
    CHECK_MESSAGE(holds(run.err,
                        ": error: no configuration was written: the notes above say what is wrong; "
                        "--anyway writes one all the same\n"),
                  run.err);
    CHECK_FALSE(std::filesystem::exists(site.path("made.toml")));
  };
  refused(site.init(site.map_file("mm.pcd", 1000.0 * as_is), right), "seems to be in millimetres");
  refused(site.init(site.map_file("feet.pcd", as_is / 0.3048), right),
          "multiply the map by 0.3048");
  refused(site.init(site.map_file("down.pcd", rows(kX, kY, -kZ)), right), "in direction -z");
  refused(site.init(site.map_file("y_up.pcd", rows(kX, kZ, -kY)), right), "in direction +y");
  refused(site.init(site.map_file("utm.pcd", as_is, {458'000.0, 5'428'000.0, 115.0}), right),
          "32-bit floats are 0.5 m apart");
  refused(site.init(map, site.scans("swapped", rows(kY, kX, kZ))), "when they are mirrored");
  refused(site.init(map, site.scans("camera", rows(-kY, -kZ, kX))), "axes are those of a camera");
  refused(site.init(map, site.scans("hung", rows(kX, -kY, -kZ))), "ground above the sensor");
  refused(site.init(map, site.scans("large", 1.02 * as_is)), "when they are made 2 % smaller");
  refused(site.init(map, site.scans("aligned", as_is, {300.0, 200.0, 0.0})), "map's frame");

  const Finished anyway = site.init(map, site.path("swapped"), {"--anyway"});
  CHECK_MESSAGE(anyway.exit_code == 0, anyway.err);
  const std::string text = read_text(site.path("made.toml"));
  CHECK_MESSAGE(holds(text, "# NOTE: the scans fit the map "), text);
}

TEST_CASE("localize: nothing tracked is an error, with its cause") {
  const Site site;
  const Eigen::Matrix3d as_is = Eigen::Matrix3d::Identity();
  const std::string start = "--initial-pose=auto";
  const Finished good = site.localize(site.path("world/scans"), {start});
  CHECK_MESSAGE(good.exit_code == 0, good.err);
  CHECK_MESSAGE(!holds(good.err, "note:"), good.err);

  const Finished millimetres = site.localize(site.scans("millimetres", 1000.0 * as_is), {start});
  CHECK(millimetres.exit_code == 1);
  CHECK_MESSAGE(holds(millimetres.err, "seem to be in millimetres"), millimetres.err);
  CHECK_MESSAGE(holds(millimetres.err, "scans was tracked"), millimetres.err);
  CHECK(std::filesystem::exists(site.path("run/scans.csv")));  // what was measured is kept

  const Finished swapped = site.localize(site.scans("swapped", rows(kY, kX, kZ)), {start});
  CHECK_MESSAGE(holds(swapped.err, "when they are mirrored"), swapped.err);

  const Finished elsewhere =
      site.localize(site.path("world/scans"),
                    {"--initial-pose=500,500,1,0,0,0", "--set", "localizer.recovery_radius=0"});
  CHECK(elsewhere.exit_code == 1);
  CHECK_MESSAGE(holds(elsewhere.err, "the first pose is wrong"), elsewhere.err);
}

TEST_CASE("a bundle remembers what its build noticed") {
  const Site site;
  const std::string turned = site.map("turned.pcd", rows(kX, -kY, -kZ));
  const Finished built = test::run(
      "vantage-build", {site.path("config.toml"), "--quiet", "--set", turned, "--overwrite"});
  CHECK_MESSAGE(holds(built.err, "in direction -z"), built.err);
  const Finished run = site.localize(site.path("world/scans"), {"--initial-pose=auto"});
  CHECK_MESSAGE(holds(run.err, "in direction -z"), run.err);
}

TEST_CASE("a point_spacing that is left out is measured, the same for every way to build") {
  const Site site;
  const auto build = [&](const std::string& map, const std::vector<std::string>& more) {
    std::vector<std::string> arguments{site.path("config.toml"), "--overwrite",
                                       "--set=visibility={plugin=\"surface\",max_range=20}",
                                       "--set=map.files=[\"" + site.path(map) + "\"]"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Finished built = test::run("vantage-build", arguments);
    REQUIRE_MESSAGE(built.exit_code == 0, built.err);
    return built.err;
  };
  const auto index = [&] {
    std::ifstream in(site.path("maps/index.json"));
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  const std::string measured = "point_spacing 0.1";  // configs/simulate/demo.toml: 0.16
  const std::string told = build("world/map.pcd", {});
  CHECK_MESSAGE(holds(told, measured), told);
  CHECK_MESSAGE(holds(told, " m, measured"), told);
  const std::string from_file = index();
  CHECK_MESSAGE(holds(from_file, "point_spacing = 0.1"), from_file);

  const Finished tiled = test::run(
      "vantage-tile", {site.path("world/map.pcd"), "--out", site.path("tiles"), "--quiet"});
  REQUIRE_MESSAGE(tiled.exit_code == 0, tiled.err);
  build("tiles", {});
  const auto line = [](const std::string& text) {
    return text.substr(text.find("point_spacing = "), 20);
  };
  CHECK(line(index()) == line(from_file));

  const std::string given = build("world/map.pcd", {"--set=visibility.params.point_spacing=0.3"});
  CHECK_MESSAGE(!holds(given, "measured"), given);
  CHECK_MESSAGE(holds(index(), "point_spacing = 0.3"), index());
}

}  // namespace
}  // namespace vantage::test
