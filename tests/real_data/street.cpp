#include "street.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <utility>

#include "support/plugins.hpp"
#include "terminal/input_options.hpp"
#include "vantage/build/build.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/trajectory_io.hpp"

namespace vantage::test {
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

Config street_config(const std::string& name, const std::filesystem::path& bundle,
                     std::vector<std::string> overrides) {
  const std::string file =
      std::string(VANTAGE_SOURCE_DIR) + "/configs/kitti_street/" + name + ".toml";
  overrides.push_back("store.params.root=" + bundle.string());
  auto config = load_config(file, overrides);
  REQUIRE_MESSAGE(config, to_string(config.error()));
  return *std::move(config);
}

}  // namespace

Street::Street(const std::filesystem::path& data, const std::string& config,
               const StreetOptions& options)
    : data_(data),
      shift_(options.shift),
      config_(street_config(config, folder_.path() / "bundle", options.overrides)),
      loader_(built_plugins()) {
  auto map = io::read_point_cloud(data / "map.pcd");
  REQUIRE_MESSAGE(map, to_string(map.error()));
  PointCloud trajectory;
  const auto poses = io::read_trajectory(data / "ref_poses_tum.txt");
  REQUIRE_MESSAGE(poses, to_string(poses.error()));
  for (const auto& moment : *poses) trajectory.push_back(moment.pose.translation);
  if (options.without_ground) {
    const std::size_t before = map->points.size();
    remove_ground(map->points, trajectory);
    MESSAGE("without ground: " << map->points.size() << " of " << before << " points");
  }
  for (PointCloud* cloud : {&map->points, &trajectory}) {
    for (Point& p : *cloud) p += shift_;
  }

  auto plugins = load_build_plugins(config_, loader_);
  REQUIRE_MESSAGE(plugins, to_string(plugins.error()));
  const auto report =
      build_region_maps(map->points, trajectory, *plugins, BuildParams::from(config_));
  REQUIRE_MESSAGE(report, to_string(report.error()));
}

RunInputs Street::inputs(const std::filesystem::path& scans) const {
  auto inputs = InputOptions{.scans = scans, .reference = data_ / "ref_poses_tum.txt"}.open();
  REQUIRE_MESSAGE(inputs, to_string(inputs.error()));
  for (auto& moment : *inputs->reference) moment.pose.translation += shift_;
  return *std::move(inputs);
}

Run Street::localize(const RunInputs& inputs) const {
  auto run = localize_scans(config_, loader_, inputs);
  REQUIRE_MESSAGE(run, to_string(run.error()));
  return *std::move(run);
}

}  // namespace vantage::test
