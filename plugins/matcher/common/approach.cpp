#include "common/approach.hpp"

#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <cmath>
#include <utility>

namespace vantage::matching {
namespace {

// As ndt's defaults.
constexpr double kEdge = 1.0;  // [m]; of the voxels that the coarse ones are merged from
constexpr double kOutlierRatio = 0.55;
constexpr double kDensest = 0.25;  // [m]; so far apart, enough points lie in a voxel

/// Points of the map's surface, as dense as the voxels need them: what stands for a coarse voxel
/// of a thinned map is a square in the plane of its surfel.
PointCloud surface_of(const SurfelMap& map, double edge) {
  const auto across = static_cast<int>(std::ceil(edge / kDensest));
  PointCloud points;
  points.reserve(map.points().size() * static_cast<std::size_t>(across * across));
  for (std::size_t i = 0; i < map.points().size(); ++i) {
    const Point& middle = map.points()[i];
    const Eigen::Vector3d& normal = map.normals()[i];
    if (normal.isZero(0.0)) {
      points.push_back(middle);
      continue;
    }
    const auto off = [&](int k) { return edge * ((k + 0.5) / across - 0.5); };
    const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
    for (int a = 0; a < across; ++a) {
      for (int b = 0; b < across; ++b) points.push_back(middle + off(a) * u + off(b) * v);
    }
  }
  return points;
}

}  // namespace

Result<std::vector<NdtCoefficients>> Approach::coefficients() {
  std::vector<NdtCoefficients> all;
  for (const double factor : {2.0, 4.0, 8.0}) {
    VANTAGE_TRY(all.emplace_back(), NdtCoefficients::derive(kOutlierRatio, factor * kEdge));
  }
  return all;
}

ndt::Start Approach::nearer(const SurfelMap& map, PointsView scan, const Pose& guess,
                            const StepOptions& options, Workspace& workspace) const {
  const auto make = [&] {
    const bool dense = edge_ <= kDensest;
    const PointCloud surface = dense ? PointCloud{} : surface_of(map, edge_);
    auto built =
        ndt::VoxelMap::build(dense ? map.points() : PointsView(surface), {.resolution = kEdge});
    if (built) finest_.emplace(*std::move(built));
  };
  // Isolated: while this thread waits for its chunks, it must not begin another alignment, which
  // would wait for these voxels.
  if (!is_given_) std::call_once(made_, [&] { tbb::this_task_arena::isolate(make); });
  if (!finest_) return {guess};
  Pose local = guess;
  local.translation -= finest_->origin();
  ndt::Start start =
      pyramid_.nearer(*finest_, scan, local, {options, ndt::Optimizer::newton}, workspace);
  start.T_local_scan.translation += finest_->origin();
  return start;
}

}  // namespace vantage::matching
