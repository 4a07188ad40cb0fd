#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include "common/ndt_coefficients.hpp"
#include "common/steps.hpp"
#include "kernel.hpp"
#include "vantage/pose.hpp"
#include "vantage/scan_score.hpp"
#include "voxel_map.hpp"

namespace vantage::ndt {

/// The Gaussians that a scan point is compared with.
enum class Neighbours : std::uint8_t {
  kdtree,    ///< those whose mean is within one resolution of the point
  direct26,  ///< those of the point's voxel and the 26 around it
  direct7,   ///< those of the point's voxel and the 6 that share a face with it
  direct1,   ///< that of the point's voxel
};
constexpr auto enum_names(Neighbours /*unused*/) {
  using namespace std::string_view_literals;
  return std::array{
      std::pair{"kdtree"sv, Neighbours::kdtree}, std::pair{"direct26"sv, Neighbours::direct26},
      std::pair{"direct7"sv, Neighbours::direct7}, std::pair{"direct1"sv, Neighbours::direct1}};
}

using matching::Matrix6, matching::NdtCoefficients, matching::Vector6;

/// The objective and its derivatives at one pose, in [translation; rotation vector].
struct Derivatives {
  double value = 0.0;
  Vector6 gradient = Vector6::Zero();
  Matrix6 hessian = Matrix6::Zero();
  /// The part of the Hessian that is positive semidefinite by construction. It belongs to the
  /// quadratic that touches the objective here and is nowhere below it (apart from the rotation's
  /// curvature).
  Matrix6 majorizer = Matrix6::Zero();
  /// Scan points with at least one Gaussian; in a map with bare voxels, near an occupied voxel.
  std::size_t matched = 0;
  ScanScore score;  ///< Eq. 12 and its companions, at the same pose
};

/// How much of the objective is computed.
struct Extent {
  /// With `majorizer`, the Hessian is zero; with `score`, all derivatives are.
  kernel::Terms terms = kernel::Terms::everything;
  std::size_t stride = 1;  ///< only one in so many batches of points is used, for all of them
};

/// Scratch memory of one alignment at a time. It grows to fit the largest scan so far; after that,
/// an alignment allocates nothing. It keeps the Gaussians of its last objective around the voxels
/// in which points were last: points that come to the same voxels, as those of a scan at a nearby
/// pose, need no lookup.
class Workspace {
 public:
  Workspace() = default;

 private:
  friend class Objective;
  std::uint64_t objective_ = 0;  // whose Gaussians `neighbours_` has
  std::size_t points_ = 0;
  std::vector<kernel::Batch> batches_;
  std::vector<kernel::Gaussians> neighbours_;
  std::vector<kernel::Sums> sums_;  // of each chunk
};

/// E(T) = sum_i sum_j d1 exp(-d2/2 q_ij^T C_j q_ij), q_ij = T p_i - mu_j, for d1 < 0: the function
/// that Magnusson (2009), Eq. 6.10, minimizes. Poses are relative to the map's origin (`to_local`),
/// so that no digits are lost to a large translation.
///
/// The kernel sums points in single precision, in chunks; the chunks are summed in double
/// precision, in their order. The sums are therefore the same for any number of threads. What a
/// single point adds depends on the pose alone, not on earlier poses.
class Objective {
 public:
  /// @param evaluate  the kernel; all kernels agree to a relative 1e-5
  Objective(VoxelMap map, Neighbours neighbours, const NdtCoefficients& coefficients,
            kernel::Evaluate evaluate = kernel::fastest());

  [[nodiscard]] const VoxelMap& map() const noexcept { return map_; }
  [[nodiscard]] const NdtCoefficients& coefficients() const noexcept { return coefficients_; }
  [[nodiscard]] const kernel::Search& search() const noexcept { return search_; }
  [[nodiscard]] Pose to_local(Pose T_map_scan) const noexcept;
  [[nodiscard]] Pose to_map(Pose T_local_scan) const noexcept;

  /// Prepares a workspace for a scan. Call it before the two functions below.
  void begin(PointsView scan, Workspace& workspace) const;

  /// E and its analytic derivatives with respect to x = t + dt + exp([w]x) R p at dt = w = 0
  /// (Eqs. 6.12-6.13 with the derivatives of a rotation vector in place of Euler angles).
  [[nodiscard]] Derivatives derivatives(const Pose& T_local_scan, Workspace& workspace,
                                        const Extent& extent = {}) const;

  /// Eq. 12 and its companions.
  [[nodiscard]] ScanScore score(const Pose& T_local_scan, Workspace& workspace) const {
    return derivatives(T_local_scan, workspace, {.terms = kernel::Terms::score}).score;
  }

 private:
  [[nodiscard]] kernel::Sums sum_up(const Pose& T_local_scan, Workspace& workspace,
                                    const Extent& extent) const;

  VoxelMap map_;
  kernel::Search search_;
  NdtCoefficients coefficients_;
  kernel::Evaluate evaluate_;
  std::uint64_t id_;  // that no other map of this process has, or had
};

}  // namespace vantage::ndt
