#include <benchmark/benchmark.h>

#include <tbb/global_control.h>
#include <optional>
#include <string>
#include <vector>

#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "support/required.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "vantage/kit/voxel_points.hpp"
#include "vantage/scan_matcher.hpp"

// Times each matcher on kitti_street: the whole map, frame 37 thinned to 0.5 m voxel centroids, a
// guess about 0.1 m and 1 degree off.
namespace vantage {
namespace {

using test::required;

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

struct Variant {
  std::string name, plugin, params;

  [[nodiscard]] PluginPtr<ScanMatcher> make() const {
    return test::plugin<ScanMatcher>(plugin, params);
  }
};

std::vector<Variant> variants() {
  std::vector<Variant> all;
  for (const std::string mode : {"direct7", "direct1", "direct26", "kdtree"}) {
    all.push_back({"ndt_" + mode, "ndt", "neighbours = \"" + mode + "\""});
  }
  all.push_back({"icp", "icp", ""});
  all.push_back({"gicp", "gicp", ""});
  return all;
}

tbb::global_control threads_of(const benchmark::State& state) {
  return {tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(state.range(0))};
}

void prepare(benchmark::State& state, const Variant& variant, const Street& street) {
  const tbb::global_control threads = threads_of(state);
  const auto matcher = variant.make();
  for (auto _ : state) {
    const auto target = in_library_of(matcher, required(matcher->prepare(street.map)));
    benchmark::DoNotOptimize(target.get());
  }
}

void align(benchmark::State& state, const Variant& variant, const Street& street) {
  const tbb::global_control threads = threads_of(state);
  const auto matcher = variant.make();
  const auto target = in_library_of(matcher, required(matcher->prepare(street.map)));
  const Pose guess =
      street.T_map_scan * pose_from_xyz_rpy({0.1, -0.05, 0.02}, {0.002, -0.003, 0.017});
  std::uint32_t iterations = 0;
  for (auto _ : state) iterations = required(target->align(street.scan, guess)).iterations;
  state.counters["iterations"] = iterations;
  state.counters["points"] = static_cast<double>(street.scan.size());
}

void score(benchmark::State& state, const Variant& variant, const Street& street) {
  const tbb::global_control threads = threads_of(state);
  const auto matcher = variant.make();
  const auto target = in_library_of(matcher, required(matcher->prepare(street.map)));
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
  for (const vantage::Variant& variant : vantage::variants()) {
    const auto add = [&](const std::string& what, auto function) {
      benchmark::RegisterBenchmark((variant.name + "/" + what).c_str(), function, variant, street)
          ->ArgName("threads")
          ->Arg(1)
          ->Arg(2)
          ->UseRealTime()
          ->Unit(benchmark::kMillisecond);
    };
    add("prepare", vantage::prepare);
    add("align", vantage::align);
    add("score", vantage::score);
  }
  benchmark::RunSpecifiedBenchmarks();
}
