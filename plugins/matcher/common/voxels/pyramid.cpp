#include "pyramid.hpp"

#include <tbb/task_arena.h>

#include <algorithm>
#include <cstdint>
#include <utility>

namespace vantage::ndt {
namespace {

constexpr std::size_t kPoints = 512;
constexpr std::size_t kLeastShare = 4;  // one point in so many needs a voxel
// A level ends with steps below this share of its edge, and this rotation [rad]: the next finer
// level goes on.
constexpr double kTranslationEpsilon = 0.02, kRotationEpsilon = 0.005;

/// The iterations that the levels may take; the rest is for the finest map.
constexpr std::uint32_t budget_of(std::uint32_t max_iterations) {
  return max_iterations - (max_iterations + 3) / 4;
}

NewtonOptions options_of(const NewtonOptions& finest, double edge, std::uint32_t iterations) {
  NewtonOptions options = finest;
  options.stride = 1;
  options.max_iterations = iterations;
  options.translation_epsilon = std::max(options.translation_epsilon, kTranslationEpsilon * edge);
  options.rotation_epsilon = std::max(options.rotation_epsilon, kRotationEpsilon);
  return options;
}

}  // namespace

const std::vector<Pyramid::Level>& Pyramid::levels_of(const VoxelMap& finest) const {
  const auto make = [&] {
    std::vector<Level> levels;
    std::size_t bytes = 0;
    double factor = 1.0;
    for (const NdtCoefficients& d : coefficients_) {
      factor *= 2.0;
      VoxelMap map = (levels.empty() ? finest : levels.back().objective.map()).merged();
      bytes += map.bytes();
      const Eigen::Vector3d shift =
          finest.options().resolution * (finest.origin_voxel() - factor * map.origin_voxel());
      levels.push_back({Objective(std::move(map), Neighbours::direct7, d), shift});
    }
    std::ranges::reverse(levels);
    levels_ = std::move(levels);
    bytes_ = bytes;
  };
  // Isolated: while this thread waits for its chunks, it must not begin another alignment, which
  // would wait for these levels.
  std::call_once(made_, [&] { tbb::this_task_arena::isolate(make); });
  return levels_;
}

Start Pyramid::nearer(const VoxelMap& finest, PointsView scan, const Pose& guess,
                      const NewtonOptions& options, Workspace& workspace) const {
  const std::size_t points = std::min(kPoints, scan.size());
  workspace.part.resize(points);
  for (std::size_t i = 0; i < points; ++i) workspace.part[i] = scan[i * scan.size() / points];

  const std::uint32_t budget = budget_of(options.max_iterations);
  Start start{guess};
  const std::vector<Level>& levels = levels_of(finest);
  workspace.levels.resize(levels.size());
  for (std::size_t k = 0; k < levels.size(); ++k) {
    const Level& level = levels[k];
    ndt::Workspace& own = workspace.levels[k];
    const NewtonOptions coarse =
        options_of(options, level.objective.map().options().resolution, budget - start.iterations);
    level.objective.begin(workspace.part, own);
    Pose pose = start.T_local_scan;
    pose.translation += level.shift;
    const Derivatives at = level.objective.derivatives(pose, own, extent_of(coarse));
    if (at.matched * kLeastShare < points) continue;
    const Minimum minimum = minimize(level.objective, pose, at, coarse, own);
    start.T_local_scan = minimum.T_local_scan;
    start.T_local_scan.translation -= level.shift;
    start.iterations += minimum.iterations;
  }
  return start;
}

}  // namespace vantage::ndt
