// One viewpoint on the recorded street: the plugin beside Open3D's HiddenPointRemoval.
#include <benchmark/benchmark.h>
#include <open3d/geometry/PointCloud.h>
#include <open3d/geometry/TriangleMesh.h>

#include <string>

#include "io/point_cloud_io.hpp"
#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "vantage/visibility.hpp"

namespace {

using vantage::IndexList, vantage::Point, vantage::PointCloud, vantage::Result;

constexpr double kAlpha = 100.0;

// Near the first pose of the drive, amid it, at its end, and above the roofs.
const Point kViewpoints[] = {
    {0.34, 0.01, 0.0}, {30.0, 2.0, 0.0}, {63.97, 9.27, -0.53}, {30.0, 2.0, 40.0}};

// Every n-th point of the map, so that `size` remain; empty where the recorded data is absent.
PointCloud street(std::size_t size) {
  const auto path = vantage::test::real_data("kitti_street/map.pcd");
  if (!path) return {};
  const auto loaded = vantage::io::read_point_cloud(*path);
  if (!loaded) return {};
  PointCloud kept;
  for (std::size_t i = 0; i < size; ++i) {
    kept.push_back(loaded->points[i * loaded->points.size() / size]);
  }
  return kept;
}

void with_plugin(benchmark::State& state, const std::string& params) {
  const PointCloud map = street(static_cast<std::size_t>(state.range(0)));
  if (map.empty()) return state.SkipWithError("no recorded data");
  const auto hpr = vantage::test::plugin<vantage::VisibilityOperator>("hpr", params);
  const auto scene = hpr->prepare(map, {.map_bounds = vantage::bounds_of(map)});
  if (!scene) return state.SkipWithError(scene.error().message.c_str());
  std::size_t seen = 0;
  for (auto _ : state) {
    const Result<IndexList> indices = (*scene)->visible(kViewpoints[state.range(1)]);
    if (!indices) return state.SkipWithError(indices.error().message.c_str());
    seen = indices->size();
  }
  state.counters["seen"] = static_cast<double>(seen);
}

void vantage_flip(benchmark::State& state) {
  with_plugin(state, "alpha = " + std::to_string(kAlpha));
}
void vantage_inversion(benchmark::State& state) { with_plugin(state, "kernel = \"inversion\""); }

void open3d_flip(benchmark::State& state) {
  const PointCloud map = street(static_cast<std::size_t>(state.range(0)));
  if (map.empty()) return state.SkipWithError("no recorded data");
  const double radius = kAlpha * vantage::bounds_of(map).diagonal();
  const open3d::geometry::PointCloud cloud(map);
  std::size_t seen = 0;
  for (auto _ : state) {
    seen = std::get<1>(cloud.HiddenPointRemoval(kViewpoints[state.range(1)], radius)).size();
  }
  state.counters["seen"] = static_cast<double>(seen);
}

void arguments(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgNames({"points", "viewpoint"})->Unit(benchmark::kMillisecond);
  benchmark->Args({50'000, 1});
  for (const std::int64_t viewpoint : {0, 1, 2, 3}) benchmark->Args({862'424, viewpoint});
}

BENCHMARK(vantage_flip)->Apply(arguments);
BENCHMARK(open3d_flip)->Apply(arguments);
BENCHMARK(vantage_inversion)->Apply(arguments);

}  // namespace

BENCHMARK_MAIN();
