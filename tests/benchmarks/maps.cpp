#include "maps.hpp"

#include <fmt/format.h>

#include <utility>

#include "simulate/map_sampler.hpp"
#include "simulate/world.hpp"
#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "vantage/ground_filter.hpp"
#include "vantage/io/point_cloud_io.hpp"

namespace vantage::benchmarks {

Result<PointCloud> read_map(const std::filesystem::path& file) {
  VANTAGE_TRY(auto loaded, io::read_point_cloud(file));
  return std::move(loaded.points);
}

Result<std::optional<PointCloud>> street() {
  const auto file = test::real_data("kitti_street/map.pcd");
  if (!file) return std::nullopt;
  VANTAGE_TRY(auto map, read_map(*file));
  return map;
}

Result<PointCloud> campus(double size) {
  VANTAGE_TRY(const auto params,
              simulation::load_world(VANTAGE_SOURCE_DIR "/configs/simulate/campus200.toml",
                                     {fmt::format("campus.size_x={:.1f}", size),
                                      fmt::format("campus.size_y={:.1f}", size)}));
  VANTAGE_TRY(const auto world, simulation::World::create(params));
  PointCloud map = simulation::sample_map(world, params.map, params.seed);
  for (Point& p : map) p = p.cast<float>().cast<double>();  // what map.pcd holds
  return map;
}

Result<PointCloud> viewpoints_over_ground(PointsView map, const ViewpointParams& params) {
  const auto pmf = test::plugin<GroundFilter>("pmf");
  VANTAGE_TRY(const auto ground, pmf->ground(map));
  return viewpoints_over(map, ground, params);
}

}  // namespace vantage::benchmarks
