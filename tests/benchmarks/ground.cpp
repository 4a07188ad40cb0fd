#include <benchmark/benchmark.h>

#include <tbb/global_control.h>
#include <stdexcept>
#include <string>
#include <vector>

#include "ground_samples.hpp"
#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "vantage/ground_filter.hpp"

// Times each ground filter on the recorded street, and on the ISPRS samples side by side.
namespace vantage::benchmarks {
namespace {

void find_ground(benchmark::State& state, const std::string& plugin, const PointCloud& cloud) {
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(state.range(0)));
  const auto filter = test::plugin<GroundFilter>(plugin);
  std::size_t found = 0;
  for (auto _ : state) {
    const auto ground = filter->ground(cloud);
    if (!ground) throw std::runtime_error(to_string(ground.error()));
    found = ground->size();
  }
  state.counters["points"] = static_cast<double>(cloud.size());
  state.counters["ground"] = static_cast<double>(found);
}

void add(const std::string& what, const PointCloud& cloud) {
  for (const std::string plugin : {"pmf", "smrf"}) {
    benchmark::RegisterBenchmark((plugin + "/" + what).c_str(), find_ground, plugin, cloud)
        ->ArgName("threads")
        ->Arg(1)
        ->Arg(2)
        ->UseRealTime()
        ->Unit(benchmark::kMillisecond);
  }
}

}  // namespace
}  // namespace vantage::benchmarks

int main(int argc, char** argv) {
  using namespace vantage;
  benchmark::Initialize(&argc, argv);
  if (const auto street = test::real_data("kitti_street")) {
    benchmarks::add("street", benchmarks::read_labelled(*street / "map.pcd").points);
  }
  if (const auto folder = test::real_data("isprs_ground")) {
    const auto samples = benchmarks::ground_samples(*folder);
    benchmarks::add("isprs_side_by_side",
                    benchmarks::side_by_side(samples, benchmarks::kMany).points);
  }
  benchmark::RunSpecifiedBenchmarks();
}
