#include "common/approach.hpp"

#include <tbb/task_arena.h>

#include <utility>

namespace vantage::matching {
namespace {

// As ndt's defaults.
constexpr double kEdge = 1.0;  // [m]; of the voxels that the coarse ones are merged from
constexpr double kOutlierRatio = 0.55;

}  // namespace

Result<std::vector<NdtCoefficients>> Approach::coefficients() {
  std::vector<NdtCoefficients> all;
  for (const double factor : {2.0, 4.0, 8.0}) {
    VANTAGE_TRY(all.emplace_back(), NdtCoefficients::derive(kOutlierRatio, factor * kEdge));
  }
  return all;
}

ndt::Start Approach::nearer(PointsView map, PointsView scan, const Pose& guess,
                            const StepOptions& options, Workspace& workspace) const {
  const auto make = [&] {
    auto built = ndt::VoxelMap::build(map, {.resolution = kEdge});
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
