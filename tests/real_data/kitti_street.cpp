// Real scans against region maps of a real street, by the shipped configurations.
#include <doctest/doctest.h>

#include "io/point_cloud_io.hpp"
#include "localize/run.hpp"
#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "vantage/build.hpp"

using namespace vantage;
namespace fs = std::filesystem;

namespace {

/// The recorded street, moved as a whole by `shift`.
struct StreetRun {
  fs::path data;
  Point shift = Point::Zero();

  /// Builds and localizes with configs/kitti_street/<name>.toml, the bundle in a temporary folder.
  [[nodiscard]] Run operator()(const std::string& name) const {
    const test::TemporaryFolder folder;
    const std::string file = std::string(VANTAGE_SOURCE_DIR) + "/configs/kitti_street/" + name + ".toml";
    auto config = load_config(file, {"store.params.root=" + (folder.path() / "bundle").string()});
    REQUIRE_MESSAGE(config, to_string(config.error()));

    auto map = io::read_point_cloud(data / "map.pcd");
    REQUIRE_MESSAGE(map, to_string(map.error()));
    for (Point& p : map->points) p += shift;

    const PluginLoader loader = test::built_plugins();
    auto plugins = load_build_plugins(*config, loader);
    REQUIRE_MESSAGE(plugins, to_string(plugins.error()));
    const auto report = build_region_maps(map->points, {}, *plugins, BuildParams::from(*config));
    REQUIRE_MESSAGE(report, to_string(report.error()));

    auto inputs = open_inputs(data / "scans", 10.0, data / "ref_poses_tum.txt", {});
    REQUIRE_MESSAGE(inputs, to_string(inputs.error()));
    for (auto& moment : *inputs->reference) moment.pose.translation += shift;
    auto run = localize_scans(*config, loader, *inputs);
    REQUIRE_MESSAGE(run, to_string(run.error()));
    return *std::move(run);
  }
};

void report(const std::string& name, const Run& run, const RunSummary& s) {
  MESSAGE(name << ": " << run.index.partition.size() << " regions, " << s.tracked << "/" << s.scans
               << " tracked, " << s.switches << " switches, mean " << 100 * s.error_m.mean << " cm, p95 "
               << 100 * s.error_m.p95 << " cm, " << s.error_deg.mean << " deg, T_align "
               << s.align_ms.mean << " ms");
}

}  // namespace

TEST_CASE("kitti_street, whole map: every scan localized, mean error within 3.5 cm and 0.1 degrees") {
  const auto data = test::real_data("kitti_street");
  if (!data) return;
  const Run run = StreetRun{*data}("wide");
  const RunSummary s = summarize(run);
  report("whole map", run, s);
  CHECK(s.scans == 77);
  CHECK(s.tracked == 77);
  CHECK(s.error_m.count == 77);
  CHECK(s.error_m.mean <= 0.035);
  CHECK(s.error_deg.mean <= 0.1);
  CHECK(s.far_off == 0);
}

TEST_CASE("kitti_street, regions of 20 m: every scan localized, mean error within 5 cm") {
  const auto data = test::real_data("kitti_street");
  if (!data) return;
  const Run run = StreetRun{*data}("L20");
  const RunSummary s = summarize(run);
  report("L = 20 m", run, s);
  CHECK(s.tracked == 77);
  CHECK(s.error_m.count == 77);
  CHECK(s.error_m.mean <= 0.05);
  CHECK(s.far_off == 0);
  CHECK(s.switches >= 2);
  CHECK(s.outside == 0);
  CHECK(s.map_points.max < 0.9 * static_cast<double>(run.index.map_points));
}

TEST_CASE("kitti_street, 5,000,000 m away: the same error to a millimetre") {
  const auto data = test::real_data("kitti_street");
  if (!data) return;
  for (const std::string name : {"wide", "L20"}) {
    const RunSummary here = summarize(StreetRun{*data}(name));
    const RunSummary far = summarize(StreetRun{*data, Point(0, 5e6, 0)}(name));
    MESSAGE(name << ": " << 1000 * here.error_m.mean << " mm here, " << 1000 * far.error_m.mean
                 << " mm there");
    CHECK(far.tracked == 77);
    CHECK(std::abs(here.error_m.mean - far.error_m.mean) < 1e-3);
    CHECK(std::abs(here.error_m.max - far.error_m.max) < 1e-3);
  }
}
