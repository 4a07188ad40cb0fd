#include <benchmark/benchmark.h>

#include <tbb/global_control.h>
#include <array>
#include <optional>
#include <stdexcept>
#include <string>

#include "io/point_cloud_io.hpp"
#include "io/trajectory_io.hpp"
#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "vantage/scan_matcher.hpp"
#include "vantage/viewpoints.hpp"

// Times ScanMatcher on kitti_street: the whole map, frame 37 thinned to 0.5 m voxel centroids, a
// guess about 0.1 m and 1 degree off.
namespace vantage {
namespace {

template <class T>
T required(Result<T> result) {
  if (!result) throw std::runtime_error(to_string(result.error()));
  return *std::move(result);
}

struct Street {
  PointCloud map, scan;
  Pose T_map_scan;
};

Street load(const std::filesystem::path& folder) {
  const io::Trajectory reference = required(io::read_trajectory(folder / "ref_poses_tum.txt"));
  const PointCloud scan = required(io::read_point_cloud(folder / "scans/000037.pcd")).points;
  return {.map = required(io::read_point_cloud(folder / "map.pcd")).points,
          .scan = required(voxel_centroids(scan, 0.5)),
          .T_map_scan = io::pose_at(reference, 3.7).value()};
}

constexpr std::array kModes{"direct7", "direct1", "direct26", "kdtree"};

PluginPtr<ScanMatcher> matcher(std::int64_t mode) {
  return test::plugin<ScanMatcher>(
      "ndt", std::string("neighbours = \"") + kModes[static_cast<std::size_t>(mode)] + "\"");
}

void prepare(benchmark::State& state, const Street& street) {
  state.SetLabel(kModes[static_cast<std::size_t>(state.range(0))]);
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(state.range(1)));
  const auto ndt = matcher(state.range(0));
  for (auto _ : state) {
    const auto target = in_library_of(ndt, required(ndt->prepare(street.map)));
    benchmark::DoNotOptimize(target.get());
  }
}

void align(benchmark::State& state, const Street& street) {
  state.SetLabel(kModes[static_cast<std::size_t>(state.range(0))]);
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(state.range(1)));
  const auto ndt = matcher(state.range(0));
  const auto target = in_library_of(ndt, required(ndt->prepare(street.map)));
  const Pose guess =
      street.T_map_scan * pose_from_xyz_rpy({0.1, -0.05, 0.02}, {0.002, -0.003, 0.017});
  std::uint32_t iterations = 0;
  for (auto _ : state) iterations = required(target->align(street.scan, guess)).iterations;
  state.counters["iterations"] = iterations;
  state.counters["points"] = static_cast<double>(street.scan.size());
}

void score(benchmark::State& state, const Street& street) {
  state.SetLabel(kModes[static_cast<std::size_t>(state.range(0))]);
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(state.range(1)));
  const auto ndt = matcher(state.range(0));
  const auto target = in_library_of(ndt, required(ndt->prepare(street.map)));
  for (auto _ : state) {
    benchmark::DoNotOptimize(required(target->score(street.scan, street.T_map_scan)));
  }
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  const auto folder = vantage::test::real_data("kitti_street");
  if (!folder) return 0;
  const vantage::Street street = vantage::load(*folder);
  const auto add = [&](const char* name, auto function) {
    benchmark::RegisterBenchmark(name, function, street)
        ->ArgsProduct({{0, 1, 2, 3}, {1, 2}})
        ->ArgNames({"mode", "threads"})
        ->UseRealTime()
        ->Unit(benchmark::kMillisecond);
  };
  add("ndt/prepare", vantage::prepare);
  add("ndt/align", vantage::align);
  add("ndt/score", vantage::score);
  benchmark::RunSpecifiedBenchmarks();
}
