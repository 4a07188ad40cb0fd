#include "objective.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <utility>

#include "common/parallel.hpp"

namespace vantage::ndt {
namespace {

constexpr std::size_t kChunk = 32;  // batches
// In voxels; farther away, single precision would lose the place in the voxel.
constexpr double kFarthest = 65536.0;

/// Steps to the surrounding voxels whose indices differ by at most one along at most `axes` axes.
kernel::Search steps_along(int axes) {
  kernel::Search search;
  search.only_faces = axes <= 1;
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        if (std::abs(x) + std::abs(y) + std::abs(z) > axes) continue;
        const int step[3] = {x, y, z};
        for (int axis = 0; axis < 3; ++axis) {
          search.steps[search.size][axis] = step[axis];
          search.offsets[search.size][axis] = static_cast<float>(step[axis]);
        }
        ++search.size;
      }
    }
  }
  return search;
}

kernel::Search search_of(Neighbours neighbours) {
  switch (neighbours) {
    case Neighbours::direct1: return steps_along(0);
    case Neighbours::direct7: return steps_along(1);
    case Neighbours::direct26:
    case Neighbours::kdtree: break;
  }
  // A mean lies in its voxel, so only the 27 voxels around a point can have a mean within an edge.
  kernel::Search search = steps_along(3);
  search.within_edge = neighbours == Neighbours::kdtree;
  return search;
}

std::uint64_t next_id() noexcept {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

/// Points of which nothing is kept.
kernel::Batch unknown_batch() {
  kernel::Batch batch{};
  for (auto& axis : batch.voxel) std::ranges::fill(axis, kernel::kUnknown);
  std::ranges::fill(batch.kind, kernel::kKinds);
  return batch;
}

using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

kernel::Pose pose_in_voxels(const Pose& T_local_scan, double resolution) {
  kernel::Pose pose{};
  const RowMajor3 rotation = T_local_scan.rotation.toRotationMatrix();
  std::transform(rotation.data(), rotation.data() + 9, pose.rotation,
                 [](double x) { return static_cast<float>(x); });
  constexpr double kBeyond = 4.0 * kHalfRange;  // beyond every map
  for (int axis = 0; axis < 3; ++axis) {
    const double t = std::clamp(T_local_scan.translation[axis] / resolution, -kBeyond, kBeyond);
    const double voxel = std::floor(t);
    pose.voxel[axis] = static_cast<std::int32_t>(voxel);
    pose.translation[axis] = static_cast<float>(t - voxel);
  }
  return pose;
}

/// Kernel sums consist only of doubles, one after the other.
void add(kernel::Sums& total, const kernel::Sums& part) {
  static_assert(sizeof(kernel::Sums) % sizeof(double) == 0);
  auto* to = reinterpret_cast<double*>(&total);
  const auto* from = reinterpret_cast<const double*>(&part);
  for (std::size_t i = 0; i < sizeof(kernel::Sums) / sizeof(double); ++i) to[i] += from[i];
}

/// Converts from voxels to metres.
Matrix6 matrix_of(const kernel::Quadratic& sum, double per_edge) {
  Matrix6 matrix = Matrix6::Zero();
  std::size_t k = 0;
  for (Eigen::Index row = 0; row < 3; ++row) {
    for (Eigen::Index column = row; column < 3; ++column, ++k) {
      matrix(row, column) = sum.tt[k] * per_edge * per_edge;
      matrix(3 + row, 3 + column) = sum.rr[k];
    }
  }
  matrix.topRightCorner<3, 3>() = Eigen::Map<const RowMajor3>(sum.tr) * per_edge;
  matrix.triangularView<Eigen::StrictlyLower>() = matrix.transpose();
  return matrix;
}

/// Scan points near a voxel that is occupied, or 0 if hardly one of them is near a Gaussian.
double matched_in(const kernel::Sums& sums, bool has_bare) {
  constexpr double kFew = 10.0;
  if (!has_bare) return sums.matched;
  return sums.matched < kFew ? 0.0 : sums.of_kind[0] + sums.of_kind[1];
}

/// The score that the whole map would give, from the points of each kind that were compared.
ScanScore estimate_of(const kernel::Sums& sums, const NdtCoefficients& d, std::size_t points) {
  double matched = 0.0, compared = 0.0, best = 0.0, mean = 0.0;
  for (std::size_t kind = 0; kind < kernel::kKinds; ++kind) {
    matched += sums.of_kind[kind];
    compared += sums.compared[kind];
    if (!(sums.compared[kind] > 0.0)) continue;
    const double each_stands_for = sums.of_kind[kind] / sums.compared[kind];
    best += each_stands_for * sums.best_of_kind[kind];
    mean += each_stands_for * sums.mean_of_kind[kind];
  }
  if (points == 0 || !(matched > 0.0)) return {};
  const double n = static_cast<double>(points);
  return {.fitness = (-d.d1 * mean - d.d3 * matched) / n,
          .nvtl = std::abs(d.d1) * best / matched,
          .coverage = matched / n,
          .compared = compared / matched};
}

ScanScore score_of(const kernel::Sums& sums, const NdtCoefficients& d, std::size_t points) {
  ScanScore score;
  if (points == 0 || !(sums.matched > 0.0)) return score;
  const double n = static_cast<double>(points);
  score.fitness = (-d.d1 * sums.mean - d.d3 * sums.matched) / n;
  score.nvtl = std::abs(d.d1) * sums.best / sums.matched;
  score.coverage = sums.matched / n;
  return score;
}

}  // namespace

Objective::Objective(VoxelMap map, Neighbours neighbours, const NdtCoefficients& coefficients,
                     kernel::Evaluate evaluate)
    : map_(std::move(map)),
      search_(search_of(neighbours)),
      coefficients_(coefficients),
      evaluate_(evaluate),
      id_(next_id()) {}

Pose Objective::to_local(Pose T_map_scan) const noexcept {
  T_map_scan.rotation.normalize();
  T_map_scan.translation -= map_.origin();
  return T_map_scan;
}

Pose Objective::to_map(Pose T_local_scan) const noexcept {
  T_local_scan.translation += map_.origin();
  return T_local_scan;
}

void Objective::begin(PointsView scan, Workspace& workspace) const {
  const std::size_t batches = (scan.size() + kernel::kBatch - 1) / kernel::kBatch;
  if (std::exchange(workspace.objective_, id_) != id_) workspace.batches_.clear();
  workspace.points_ = scan.size();
  workspace.neighbours_.resize(batches * search_.size);
  workspace.sums_.resize((batches + kChunk - 1) / kChunk);
  workspace.batches_.resize(batches, unknown_batch());  // last: it says which neighbours are known
  const double per_edge = 1.0 / map_.options().resolution;
  for (std::size_t b = 0; b < batches; ++b) {
    kernel::Batch& batch = workspace.batches_[b];
    for (std::size_t lane = 0; lane < kernel::kBatch; ++lane) {
      const std::size_t i = b * kernel::kBatch + lane;
      batch.x[lane] = batch.y[lane] = batch.z[lane] = kernel::kNowhere;
      if (i >= scan.size()) continue;
      const Eigen::Vector3d p = scan[i] * per_edge;
      if (!(p.cwiseAbs().maxCoeff() < kFarthest)) continue;
      batch.x[lane] = static_cast<float>(p.x());
      batch.y[lane] = static_cast<float>(p.y());
      batch.z[lane] = static_cast<float>(p.z());
    }
  }
}

kernel::Sums Objective::sum_up(const Pose& T_local_scan, Workspace& workspace,
                               const Extent& extent) const {
  const kernel::Task task{
      .map = map_.view(),
      .search = search_,
      .scan = {.batches = workspace.batches_.data(), .neighbours = workspace.neighbours_.data()},
      .pose = pose_in_voxels(T_local_scan, map_.options().resolution),
      .coefficients = {.half_d2 = static_cast<float>(0.5 * coefficients_.d2),
                       .best_is_least = coefficients_.d1 > 0.0},
      .terms = extent.terms,
      .stride = extent.stride};
  const std::size_t batches = workspace.batches_.size();
  const std::size_t chunk = kChunk * extent.stride;
  matching::for_each_chunk(batches, chunk, [&](std::size_t i, std::size_t begin, std::size_t end) {
    evaluate_(task, begin, end, workspace.sums_[i]);
  });
  kernel::Sums total{};
  for (std::size_t i = 0; i * chunk < batches; ++i) add(total, workspace.sums_[i]);
  return total;
}

Derivatives Objective::derivatives(const Pose& T_local_scan, Workspace& workspace,
                                   const Extent& extent) const {
  const kernel::Sums sums = sum_up(T_local_scan, workspace, extent);
  const double per_edge = 1.0 / map_.options().resolution;
  // The objective attracts, whatever the sign of the given d1.
  const double d1 = -std::abs(coefficients_.d1);
  const double scale = -d1 * coefficients_.d2;

  Derivatives total;
  total.value = d1 * sums.value;
  total.matched = static_cast<std::size_t>(matched_in(sums, !map_.bare().empty()));
  total.score = map_.bare().empty() ? score_of(sums, coefficients_, workspace.points_)
                                    : estimate_of(sums, coefficients_, workspace.points_);
  if (extent.terms == kernel::Terms::score) return total;

  // The sum of y x g is the antisymmetric part of torque. The symmetric part is what the second
  // derivatives of x add, (y_a g_b + y_b g_a) / 2 - delta_ab y.g.
  const Eigen::Matrix3d torque = Eigen::Map<const RowMajor3>(sums.torque);
  total.gradient << per_edge * sums.gradient[0], per_edge * sums.gradient[1],
      per_edge * sums.gradient[2], torque(2, 1) - torque(1, 2), torque(0, 2) - torque(2, 0),
      torque(1, 0) - torque(0, 1);
  total.gradient *= scale;
  total.majorizer = scale * matrix_of(sums.positive, per_edge);
  if (extent.terms == kernel::Terms::majorizer) return total;
  total.hessian = total.majorizer - scale * coefficients_.d2 * matrix_of(sums.negative, per_edge);
  total.hessian.bottomRightCorner<3, 3>() +=
      scale * (0.5 * (torque + torque.transpose()) - torque.trace() * Eigen::Matrix3d::Identity());
  return total;
}

}  // namespace vantage::ndt
