#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "places/place_index.hpp"
#include "places/place_search.hpp"
#include "simulate/map_sampler.hpp"
#include "simulate/world.hpp"
#include "support/required.hpp"
#include "vantage/engine/viewpoints.hpp"

// Times the search for a place in simulated campuses of 250 m and of a square kilometre, with five
// points a square metre of ground: at all places and in all headings. A scan is what of the map
// stands up within 60 m of a crossing.
namespace vantage {
namespace {

using test::required;

PointCloud campus_of(double size) {
  const auto params = required(simulation::load_world(
      VANTAGE_SOURCE_DIR "/configs/simulate/campus500.toml",
      {"seed=77", fmt::format("campus.size_x={:.1f}", size),
       fmt::format("campus.size_y={:.1f}", size), "map.point_spacing=0.612"}));
  return simulation::sample_map(required(simulation::World::create(params)), params.map,
                                params.seed);
}

struct Town {
  PointCloud map, scan;
  PlaceIndex index;
};

/// Made at first use.
const Town& town(double size) {
  static std::map<double, Town> towns;
  const auto known = towns.find(size);
  if (known != towns.end()) return known->second;
  PointCloud map = campus_of(size), scan;
  PlaceIndex index = required(PlaceIndex::of(map));
  const Point sensor(25.0, 0.0, 1.5);
  for (const Point& p : map) {
    const Point from_sensor = p - sensor;
    if (from_sensor.norm() < 60.0 && from_sensor.z() > 0.0) scan.push_back(from_sensor);
  }
  scan = required(voxel_centroids(scan, 0.5));
  return towns.emplace(size, Town{std::move(map), std::move(scan), std::move(index)}).first->second;
}

tbb::global_control threads_of(const benchmark::State& state) {
  return {tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(state.range(1))};
}

void find(benchmark::State& state) {
  const Town& in = town(static_cast<double>(state.range(0)));
  const tbb::global_control threads = threads_of(state);
  std::uint64_t words = 0;
  for (auto _ : state) words = find_places(in.index, in.scan, {}, 16).words;
  state.counters["words"] = static_cast<double>(words);
  state.counters["words_per_ms"] = benchmark::Counter(
      static_cast<double>(words) / 1e3, benchmark::Counter::kIsIterationInvariantRate);
}

void decode(benchmark::State& state) {
  const auto bytes = town(static_cast<double>(state.range(0))).index.encode();
  for (auto _ : state) benchmark::DoNotOptimize(required(PlaceIndex::decode(bytes)));
  state.counters["bytes"] = static_cast<double>(bytes.size());
}

void make(benchmark::State& state) {
  const Town& in = town(static_cast<double>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(required(PlaceIndex::of(in.map)));
  state.counters["points"] = static_cast<double>(in.map.size());
}

BENCHMARK(find)
    ->ArgNames({"metres", "threads"})
    ->ArgsProduct({{250, 1000}, {1, 2}})
    ->UseRealTime()
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK(decode)->ArgName("metres")->Arg(250)->Arg(1000)->Unit(benchmark::kMillisecond);
BENCHMARK(make)->ArgName("metres")->Arg(250)->Arg(1000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace vantage

BENCHMARK_MAIN();
