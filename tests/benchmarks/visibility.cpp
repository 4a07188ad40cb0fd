// One viewpoint on the recorded street: the plugin beside Open3D's HiddenPointRemoval.
#include <benchmark/benchmark.h>
#include <open3d/geometry/PointCloud.h>
#include <open3d/geometry/TriangleMesh.h>

#include <string>

#include "maps.hpp"
#include "support/plugins.hpp"
#include "vantage/visibility.hpp"

namespace {

using vantage::IndexList, vantage::Point, vantage::PointCloud, vantage::Result;
using vantage::benchmarks::kStreetViewpoints;

constexpr double kAlpha = 100.0;

// Every n-th point of the street, so that `size` remain; empty where the recorded data is absent.
PointCloud street(std::size_t size) {
  const auto map = vantage::benchmarks::street();
  return map && *map ? vantage::benchmarks::thinned(**map, size) : PointCloud{};
}

const Point& viewpoint(const benchmark::State& state) {
  return kStreetViewpoints.at(static_cast<std::size_t>(state.range(1)));
}

void with_plugin(benchmark::State& state, const char* name, const std::string& params) {
  const PointCloud map = street(static_cast<std::size_t>(state.range(0)));
  if (map.empty()) return state.SkipWithError("no recorded data");
  const auto visibility = vantage::test::plugin<vantage::VisibilityOperator>(name, params);
  const auto scene = visibility->prepare(map, {.map_bounds = vantage::bounds_of(map)});
  if (!scene) return state.SkipWithError(scene.error().message.c_str());
  std::size_t seen = 0;
  for (auto _ : state) {
    const Result<IndexList> indices = (*scene)->visible(viewpoint(state));
    if (!indices) return state.SkipWithError(indices.error().message.c_str());
    seen = indices->size();
  }
  state.counters["seen"] = static_cast<double>(seen);
}

const std::string kFlip = "alpha = " + std::to_string(kAlpha);
void vantage_flip(benchmark::State& state) { with_plugin(state, "hpr", kFlip); }
void open3d_flip(benchmark::State& state) { with_plugin(state, "hpr_open3d", kFlip); }
void vantage_inversion(benchmark::State& state) {
  with_plugin(state, "hpr", "kernel = \"inversion\"");
}

// The defaults' sensor, and one that sees all around as finely.
void vantage_surface(benchmark::State& state) { with_plugin(state, "surface", ""); }
void vantage_range_image(benchmark::State& state) { with_plugin(state, "range_image", ""); }
void vantage_range_image_all_around(benchmark::State& state) {
  with_plugin(state, "range_image",
              "rings = 450\nlowest_elevation = -90.0\nhighest_elevation = 90.0");
}

// Open3D as its users call it, in the map's own order: about a fifth faster than the plugin
// hpr_open3d, which hands it the points sorted by place.
void open3d_call(benchmark::State& state) {
  const PointCloud map = street(static_cast<std::size_t>(state.range(0)));
  if (map.empty()) return state.SkipWithError("no recorded data");
  const double radius = kAlpha * vantage::bounds_of(map).diagonal();
  const open3d::geometry::PointCloud cloud(map);
  std::size_t seen = 0;
  for (auto _ : state) {
    seen = std::get<1>(cloud.HiddenPointRemoval(viewpoint(state), radius)).size();
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
BENCHMARK(open3d_call)->Apply(arguments);
BENCHMARK(vantage_inversion)->Apply(arguments);
BENCHMARK(vantage_surface)->Apply(arguments);
BENCHMARK(vantage_range_image)->Apply(arguments);
BENCHMARK(vantage_range_image_all_around)->Apply(arguments);

}  // namespace

BENCHMARK_MAIN();
