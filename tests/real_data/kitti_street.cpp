// Real scans against region maps of a real street, by the shipped configurations.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "io/point_cloud_io.hpp"
#include "io/trajectory_io.hpp"
#include "localize/run.hpp"
#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "vantage/build.hpp"

using namespace vantage;
namespace fs = std::filesystem;

namespace {

/// Drops what lies more than 1.4 m below the place of the sensor that is nearest in plan; the
/// sensor was 1.73 m above the road.
void remove_ground(PointCloud& map, const PointCloud& trajectory) {
  std::erase_if(map, [&](const Point& p) {
    const auto nearer = [&](const Point& a, const Point& b) {
      return (a - p).head<2>().squaredNorm() < (b - p).head<2>().squaredNorm();
    };
    const auto nearest = std::min_element(trajectory.begin(), trajectory.end(), nearer);
    return p.z() < nearest->z() - 1.4;
  });
}

/// The recorded street, moved as a whole by `shift`.
struct StreetRun {
  fs::path data;
  Point shift = Point::Zero();
  bool without_ground = false;
  std::vector<std::string> overrides = {};

  /// Builds and localizes with configs/kitti_street/<name>.toml, the bundle in a temporary folder.
  [[nodiscard]] Run operator()(const std::string& name) const {
    const test::TemporaryFolder folder;
    const std::string file =
        std::string(VANTAGE_SOURCE_DIR) + "/configs/kitti_street/" + name + ".toml";
    std::vector<std::string> all = overrides;
    all.push_back("store.params.root=" + (folder.path() / "bundle").string());
    auto config = load_config(file, all);
    REQUIRE_MESSAGE(config, to_string(config.error()));

    auto map = io::read_point_cloud(data / "map.pcd");
    REQUIRE_MESSAGE(map, to_string(map.error()));
    PointCloud trajectory;
    const auto poses = io::read_trajectory(data / "ref_poses_tum.txt");
    REQUIRE_MESSAGE(poses, to_string(poses.error()));
    for (const auto& moment : *poses) trajectory.push_back(moment.pose.translation);
    if (without_ground) {
      const std::size_t before = map->points.size();
      remove_ground(map->points, trajectory);
      MESSAGE("without ground: " << map->points.size() << " of " << before << " points");
    }
    for (PointCloud* cloud : {&map->points, &trajectory}) {
      for (Point& p : *cloud) p += shift;
    }

    const PluginLoader loader = test::built_plugins();
    auto plugins = load_build_plugins(*config, loader);
    REQUIRE_MESSAGE(plugins, to_string(plugins.error()));
    const auto report =
        build_region_maps(map->points, trajectory, *plugins, BuildParams::from(*config));
    REQUIRE_MESSAGE(report, to_string(report.error()));

    auto inputs =
        InputOptions{.scans = data / "scans", .reference = data / "ref_poses_tum.txt"}.open();
    REQUIRE_MESSAGE(inputs, to_string(inputs.error()));
    for (auto& moment : *inputs->reference) moment.pose.translation += shift;
    auto run = localize_scans(*config, loader, *inputs);
    REQUIRE_MESSAGE(run, to_string(run.error()));
    return *std::move(run);
  }
};

/// What must hold of a run over all 77 scans, here and with everything 5,000,000 m away.
void check_street(const fs::path& data, const std::string& name, double max_mean_error_m,
                  double max_mean_error_deg, bool without_ground = false) {
  const Run run = StreetRun{data, Point::Zero(), without_ground}(name);
  const RunSummary s = summarize(run);
  MESSAGE(name << ": " << run.index.partition.size() << " regions, " << s.tracked << "/" << s.scans
               << " tracked, " << s.switches << " switches, mean " << 100 * s.error_m.mean
               << " cm, p95 " << 100 * s.error_m.p95 << " cm, " << s.error_deg.mean
               << " deg, T_align " << s.align_ms.mean << " ms");
  CHECK(s.scans == 77);
  CHECK(s.tracked == 77);
  CHECK(s.error_m.count == 77);
  CHECK(s.error_m.mean <= max_mean_error_m);
  CHECK(s.error_deg.mean <= max_mean_error_deg);
  CHECK(s.far_off == 0);
  CHECK(s.outside == 0);
  if (name != "wide") {
    CHECK(s.switches >= 2);
    CHECK(s.map_points.max < 0.9 * static_cast<double>(run.index.map_points));
  }

  const RunSummary far = summarize(StreetRun{data, Point(0, 5e6, 0), without_ground}(name));
  MESSAGE(name << ", 5,000 km away: mean " << 100 * far.error_m.mean << " cm");
  CHECK(far.tracked == 77);
  CHECK(std::abs(far.error_m.mean - s.error_m.mean) < 1e-3);
  CHECK(std::abs(far.error_m.max - s.error_m.max) < 1e-3);
}

}  // namespace

TEST_CASE("kitti_street, whole map: every scan localized, also 5,000,000 m away") {
  if (const auto data = test::real_data("kitti_street")) check_street(*data, "wide", 0.035, 0.1);
}

TEST_CASE("kitti_street, regions of 20 m: every scan localized, also 5,000,000 m away") {
  if (const auto data = test::real_data("kitti_street")) check_street(*data, "L20", 0.05, 0.1);
}

TEST_CASE("kitti_street, pieces of surface: as good as the whole map, also 5,000,000 m away") {
  if (const auto data = test::real_data("kitti_street")) check_street(*data, "surface", 0.025, 0.1);
}

TEST_CASE("kitti_street without its ground, viewpoints along the drive: every scan localized") {
  if (const auto data = test::real_data("kitti_street")) {
    check_street(*data, "from_trajectory", 0.06, 0.1, true);
    const RunSummary whole = summarize(StreetRun{
        *data, Point::Zero(), true, {"localizer.min_coverage=0.3", "localizer.min_nvtl=0.5"}}(
        "wide"));
    MESSAGE("the whole map without ground: "
            << whole.tracked << " tracked, mean " << 100 * whole.error_m.mean << " cm, p95 "
            << 100 * whole.error_m.p95 << " cm, coverage " << whole.coverage.mean);
    CHECK(whole.error_m.mean > 0.0);
    CHECK(whole.error_m.mean <= 0.06);
  }
}
