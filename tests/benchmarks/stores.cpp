#include <benchmark/benchmark.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/plugins.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/partition.hpp"

// Times the switches of a drive: the maps of a bundle's regions are read one after another, each
// from the region that lies next to the one before. Arguments: bundles, of any store.
namespace vantage::benchmarks {
namespace {

Eigen::Vector2d centre_of(const Region& region) {
  const Bounds2 box = bounds_of(region.footprint);
  return 0.5 * (box.min + box.max);
}

/// All regions that have a map, each time the nearest that was not there yet.
std::vector<RegionId> drive_through(const MapIndex& index) {
  std::vector<std::uint32_t> left;
  for (std::uint32_t r = 0; r < index.regions.size(); ++r) {
    if (!index.regions[r].empty()) left.push_back(r);
  }
  std::vector<RegionId> drive;
  Eigen::Vector2d here =
      left.empty() ? Eigen::Vector2d(0, 0) : centre_of(index.partition.regions()[left.front()]);
  while (!left.empty()) {
    const auto nearer = [&](std::uint32_t a, std::uint32_t b) {
      const auto& regions = index.partition.regions();
      return (centre_of(regions[a]) - here).norm() < (centre_of(regions[b]) - here).norm();
    };
    const auto next = std::min_element(left.begin(), left.end(), nearer);
    here = centre_of(index.partition.regions()[*next]);
    drive.push_back(RegionId{*next});
    left.erase(next);
  }
  return drive;
}

void switches(benchmark::State& state, const std::string& place) {
  const auto plugins = test::built_plugins();
  auto bundle = Bundle::open(place, plugins);
  if (!bundle) throw std::runtime_error(to_string(bundle.error()));
  const auto index = bundle->index();
  if (!index) throw std::runtime_error(to_string(index.error()));
  const std::vector<RegionId> drive = drive_through(**index);
  std::size_t at = 0, points = 0;
  for (auto _ : state) {
    const auto map = bundle->get(drive[at++ % drive.size()]);
    if (!map) throw std::runtime_error(to_string(map.error()));
    points += map->points.size();
  }
  state.counters["points"] = static_cast<double>(points) / static_cast<double>(at);
}

}  // namespace
}  // namespace vantage::benchmarks

int main(int argc, char** argv) {
  using namespace vantage;
  benchmark::Initialize(&argc, argv);
  for (int i = 1; i < argc; ++i) {
    benchmark::RegisterBenchmark(argv[i], benchmarks::switches, std::string(argv[i]))
        ->UseRealTime()
        ->Unit(benchmark::kMillisecond);
  }
  benchmark::RunSpecifiedBenchmarks();
}
