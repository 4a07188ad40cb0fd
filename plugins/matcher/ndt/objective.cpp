#include "objective.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "parallel.hpp"

namespace vantage::ndt {
namespace {

constexpr std::size_t kPointChunk = 256;
// No voxel has this key, not even kNoVoxel: a neighbourhood that has not been looked up.
constexpr VoxelKey kUnknown = kNoVoxel - 1;

constexpr std::array<VoxelKey, 1> kDirect1{0};
constexpr std::array<VoxelKey, 7> kDirect7{
    0, kStepX, VoxelKey{0} - kStepX, kStepY, VoxelKey{0} - kStepY, kStepZ, VoxelKey{0} - kStepZ};
constexpr std::array<VoxelKey, 27> kDirect26 = [] {
  std::array<VoxelKey, 27> steps{};
  for (VoxelKey i = 0; i < 27; ++i) {
    steps[i] =
        (i / 9) * kStepX + (i / 3 % 3) * kStepY + (i % 3) * kStepZ - kStepX - kStepY - kStepZ;
  }
  return steps;
}();

/// A neighbourhood of voxels. Looks its Gaussians up when a point enters another voxel, which late
/// in an alignment few points do.
template <std::size_t N>
struct VoxelSearch {
  const VoxelMap& map;
  const std::array<VoxelKey, N>& steps;
  VoxelKey* keys;
  std::uint8_t* sizes;
  std::uint32_t* lists;

  [[nodiscard]] std::span<const std::uint32_t> operator()(std::size_t i,
                                                          const Eigen::Vector3d& x) const noexcept {
    const VoxelKey key = map.key_of(x);
    std::uint32_t* list = lists + i * N;
    if (keys[i] != key) {
      keys[i] = key;
      std::uint8_t size = 0;
      if (key != kNoVoxel) {
        for (const VoxelKey step : steps) {
          const std::uint32_t gaussian = map.find(key + step);
          if (gaussian != VoxelMap::kNoGaussian) list[size++] = gaussian;
        }
      }
      sizes[i] = size;
    }
    return {list, sizes[i]};
  }
};

struct TreeSearch {
  const VoxelMap& map;
  const VoxelTree& tree;

  struct Found : VoxelTree::Found {
    [[nodiscard]] const std::uint32_t* begin() const noexcept { return gaussians.data(); }
    [[nodiscard]] const std::uint32_t* end() const noexcept { return gaussians.data() + size; }
    [[nodiscard]] bool empty() const noexcept { return size == 0; }
  };
  [[nodiscard]] Found operator()(std::size_t /*unused*/, const Eigen::Vector3d& x) const {
    if (map.key_of(x) == kNoVoxel) return {};
    return {tree.near(x)};
  }
};

/// q^T C q, and C q on the way.
struct Mahalanobis {
  double x, y, z;  // C q
  double squared;

  Mahalanobis(const Gaussian& g, const Eigen::Vector3d& at) noexcept {
    const double qx = at.x() - g.mean.x(), qy = at.y() - g.mean.y(), qz = at.z() - g.mean.z();
    x = g.xx * qx + g.xy * qy + g.xz * qz;
    y = g.xy * qx + g.yy * qy + g.yz * qz;
    z = g.xz * qx + g.yz * qy + g.zz * qz;
    squared = qx * x + qy * y + qz * z;
  }
};

struct Symmetric3 {
  double xx = 0.0, xy = 0.0, xz = 0.0, yy = 0.0, yz = 0.0, zz = 0.0;
};

using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// Adds J^T A J for J = [I, -[y]x].
template <class Quadratic>
inline void add_to_pose(const Symmetric3& A, const Eigen::Vector3d& y, Quadratic& sum) noexcept {
  const double a = y.x(), b = y.y(), c = y.z();
  // M = A (-[y]x); the rotation's block is [y]x M.
  const double m00 = b * A.xz - c * A.xy, m01 = c * A.xx - a * A.xz, m02 = a * A.xy - b * A.xx;
  const double m10 = b * A.yz - c * A.yy, m11 = c * A.xy - a * A.yz, m12 = a * A.yy - b * A.xy;
  const double m20 = b * A.zz - c * A.yz, m21 = c * A.xz - a * A.zz, m22 = a * A.yz - b * A.xz;
  sum.tt[0] += A.xx;
  sum.tt[1] += A.xy;
  sum.tt[2] += A.xz;
  sum.tt[3] += A.yy;
  sum.tt[4] += A.yz;
  sum.tt[5] += A.zz;
  sum.tr[0] += m00;
  sum.tr[1] += m01;
  sum.tr[2] += m02;
  sum.tr[3] += m10;
  sum.tr[4] += m11;
  sum.tr[5] += m12;
  sum.tr[6] += m20;
  sum.tr[7] += m21;
  sum.tr[8] += m22;
  sum.rr[0] += b * m20 - c * m10;
  sum.rr[1] += b * m21 - c * m11;
  sum.rr[2] += b * m22 - c * m12;
  sum.rr[3] += c * m01 - a * m21;
  sum.rr[4] += c * m02 - a * m22;
  sum.rr[5] += a * m12 - b * m02;
}

template <class Quadratic>
void add_upper(const Quadratic& part, Matrix6& total) {
  total.topRightCorner<3, 3>() += Eigen::Map<const RowMajor3>(part.tr.data());
  std::size_t k = 0;
  for (Eigen::Index row = 0; row < 3; ++row) {
    for (Eigen::Index column = row; column < 3; ++column, ++k) {
      total(row, column) += part.tt[k];
      total(3 + row, 3 + column) += part.rr[k];
    }
  }
}

}  // namespace

Objective::Objective(VoxelMap map, Neighbours neighbours, const NdtCoefficients& coefficients)
    : map_(std::move(map)), neighbours_(neighbours), coefficients_(coefficients) {
  if (neighbours_ == Neighbours::kdtree) tree_.emplace(map_.gaussians(), map_.resolution());
}

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
  const std::size_t chunks = (scan.size() + kPointChunk - 1) / kPointChunk;
  workspace.partials_.resize(chunks);
  workspace.scores_.assign(chunks, ScanScoreSum(coefficients_));
  const auto fit_lists = [&](std::size_t neighbours) {
    workspace.keys_.assign(scan.size(), kUnknown);
    workspace.sizes_.resize(scan.size());
    workspace.lists_.resize(scan.size() * neighbours);
  };
  switch (neighbours_) {
    case Neighbours::kdtree: break;
    case Neighbours::direct26: fit_lists(kDirect26.size()); break;
    case Neighbours::direct7: fit_lists(kDirect7.size()); break;
    case Neighbours::direct1: fit_lists(kDirect1.size()); break;
  }
}

template <class Use>
auto Objective::with_search(Workspace& workspace, const Use& use) const {
  const auto voxels = [&]<std::size_t N>(const std::array<VoxelKey, N>& steps) {
    return VoxelSearch<N>{map_, steps, workspace.keys_.data(), workspace.sizes_.data(),
                          workspace.lists_.data()};
  };
  switch (neighbours_) {
    case Neighbours::kdtree: return use(TreeSearch{map_, *tree_});
    case Neighbours::direct26: return use(voxels(kDirect26));
    case Neighbours::direct7: break;
    case Neighbours::direct1: return use(voxels(kDirect1));
  }
  return use(voxels(kDirect7));
}

template <class Search>
void Objective::sum_derivatives(PointsView scan, const Pose& T_local_scan, const Search& search,
                                Workspace& workspace) const {
  const Eigen::Matrix3d rotation = T_local_scan.rotation.toRotationMatrix();
  const Eigen::Vector3d translation = T_local_scan.translation;
  const std::span<const Gaussian> gaussians = map_.gaussians();
  const double d2 = coefficients_.d2;

  for_each_chunk(
      scan.size(), kPointChunk, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
        Workspace::Partial sum;
        for (std::size_t i = begin; i < end; ++i) {
          const Eigen::Vector3d y = rotation * scan[i];
          const Eigen::Vector3d x = y + translation;
          const auto neighbours = search(i, x);
          if (neighbours.empty()) continue;

          // First what the point's neighbours say of x, in three dimensions and without the common
          // factor -d1 d2: gradient g, Hessian A - d2 B.
          Symmetric3 positive, negative;
          double value = 0.0, gx = 0.0, gy = 0.0, gz = 0.0;
          for (const std::uint32_t j : neighbours) {
            const Gaussian& g = gaussians[j];
            const Mahalanobis m(g, x);
            const double e = std::exp(-0.5 * d2 * m.squared);
            const double ex = e * m.x, ey = e * m.y, ez = e * m.z;
            value += e;
            gx += ex;
            gy += ey;
            gz += ez;
            positive.xx += e * g.xx;
            positive.xy += e * g.xy;
            positive.xz += e * g.xz;
            positive.yy += e * g.yy;
            positive.yz += e * g.yz;
            positive.zz += e * g.zz;
            negative.xx += ex * m.x;
            negative.xy += ex * m.y;
            negative.xz += ex * m.z;
            negative.yy += ey * m.y;
            negative.yz += ey * m.z;
            negative.zz += ez * m.z;
          }

          // Then to the pose, once a point.
          ++sum.matched;
          sum.value += value;
          const std::array<double, 3> gradient{gx, gy, gz};
          for (std::size_t row = 0; row < 3; ++row) {
            sum.gradient[row] += gradient[row];
            for (std::size_t column = 0; column < 3; ++column) {
              sum.torque[3 * row + column] += gradient[row] * y[static_cast<Eigen::Index>(column)];
            }
          }
          add_to_pose(positive, y, sum.positive);
          add_to_pose(negative, y, sum.negative);
        }
        workspace.partials_[chunk] = sum;
      });
}

Derivatives Objective::derivatives(PointsView scan, const Pose& T_local_scan,
                                   Workspace& workspace) const {
  with_search(workspace,
              [&](const auto& search) { sum_derivatives(scan, T_local_scan, search, workspace); });

  Derivatives total;
  Matrix6 negative = Matrix6::Zero();
  Eigen::Matrix3d torque = Eigen::Matrix3d::Zero();
  for (const Workspace::Partial& part : workspace.partials_) {
    total.value += part.value;
    total.matched += part.matched;
    total.gradient.head<3>() += Eigen::Map<const Eigen::Vector3d>(part.gradient.data());
    torque += Eigen::Map<const RowMajor3>(part.torque.data());
    add_upper(part.positive, total.majorizer);
    add_upper(part.negative, negative);
  }
  // The sum of y x g is torque's antisymmetric part, and what the second derivatives of x add,
  // (y_a g_b + y_b g_a) / 2 - delta_ab y.g, its symmetric one.
  total.gradient.tail<3>() << torque(2, 1) - torque(1, 2), torque(0, 2) - torque(2, 0),
      torque(1, 0) - torque(0, 1);
  total.hessian = total.majorizer - coefficients_.d2 * negative;
  total.hessian.bottomRightCorner<3, 3>() +=
      0.5 * (torque + torque.transpose()) - torque.trace() * Eigen::Matrix3d::Identity();

  // The objective attracts whatever the sign of a given d1.
  const double d1 = -std::abs(coefficients_.d1);
  total.value *= d1;
  for (Matrix6* matrix : {&total.hessian, &total.majorizer}) {
    *matrix *= -d1 * coefficients_.d2;
    matrix->triangularView<Eigen::StrictlyLower>() = matrix->transpose();
  }
  total.gradient *= -d1 * coefficients_.d2;
  return total;
}

template <class Search>
void Objective::sum_scores(PointsView scan, const Pose& T_local_scan, const Search& search,
                           Workspace& workspace) const {
  const Eigen::Matrix3d rotation = T_local_scan.rotation.toRotationMatrix();
  const std::span<const Gaussian> gaussians = map_.gaussians();
  for_each_chunk(scan.size(), kPointChunk,
                 [&](std::size_t chunk, std::size_t begin, std::size_t end) {
                   ScanScoreSum sum(coefficients_);
                   std::array<double, kDirect26.size()> squared;
                   for (std::size_t i = begin; i < end; ++i) {
                     const Eigen::Vector3d x = rotation * scan[i] + T_local_scan.translation;
                     std::size_t size = 0;
                     for (const std::uint32_t j : search(i, x)) {
                       squared[size++] = Mahalanobis(gaussians[j], x).squared;
                     }
                     sum.add({squared.data(), size});
                   }
                   workspace.scores_[chunk] = sum;
                 });
}

ScanScoreSum Objective::score(PointsView scan, const Pose& T_local_scan,
                              Workspace& workspace) const {
  with_search(workspace,
              [&](const auto& search) { sum_scores(scan, T_local_scan, search, workspace); });
  ScanScoreSum total(coefficients_);
  for (const ScanScoreSum& part : workspace.scores_) total.add(part);
  return total;
}

}  // namespace vantage::ndt
