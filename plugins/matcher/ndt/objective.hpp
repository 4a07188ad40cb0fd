#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "vantage/metrics.hpp"
#include "vantage/pose.hpp"
#include "voxel_map.hpp"
#include "voxel_tree.hpp"

namespace vantage::ndt {

/// Which Gaussians a scan point is compared with.
enum class Neighbours : std::uint8_t {
  kdtree,    ///< those with their mean within one resolution of the point
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

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// The objective and its derivatives at one pose, in [translation; rotation vector].
struct Derivatives {
  double value = 0.0;
  Vector6 gradient = Vector6::Zero();
  Matrix6 hessian = Matrix6::Zero();
  /// The part of the Hessian that is positive semidefinite by construction: that of the quadratic
  /// which touches the objective here and lies nowhere below it (but for the rotation's curvature).
  Matrix6 majorizer = Matrix6::Zero();
  std::size_t matched = 0;  ///< scan points with at least one Gaussian
};

/// Scratch memory of one alignment. It grows to the largest scan it has seen, after which an
/// alignment allocates nothing.
class Workspace {
 public:
  Workspace() = default;

 private:
  friend class Objective;
  /// Sum over points of J^T A J for a symmetric 3x3 A and J = [I, -[y]x], upper triangle by blocks.
  struct Quadratic {
    std::array<double, 6> tt{}, rr{};
    std::array<double, 9> tr{};
  };
  /// What one chunk of points adds.
  struct Partial {
    double value = 0.0;
    std::array<double, 3> gradient{};  // with respect to x
    std::array<double, 9> torque{};    // g y^T
    Quadratic positive, negative;
    std::size_t matched = 0;
  };
  std::vector<Partial> partials_;
  std::vector<ScanScoreSum> scores_;
  // The Gaussians of each point's neighbourhood, kept while the point stays in its voxel.
  std::vector<VoxelKey> keys_;
  std::vector<std::uint8_t> sizes_;
  std::vector<std::uint32_t> lists_;
};

/// E(T) = sum_i sum_j d1 exp(-d2/2 q_ij^T C_j q_ij), q_ij = T p_i - mu_j, for d1 < 0: what
/// Magnusson (2009), Eq. 6.10, minimizes. Poses are relative to the map's origin (`to_local`),
/// where their digits are not spent on a large translation.
class Objective {
 public:
  Objective(VoxelMap map, Neighbours neighbours, const NdtCoefficients& coefficients);

  [[nodiscard]] const VoxelMap& map() const noexcept { return map_; }
  [[nodiscard]] Pose to_local(Pose T_map_scan) const noexcept;
  [[nodiscard]] Pose to_map(Pose T_local_scan) const noexcept;

  /// Readies a workspace for a scan; to be called before the first of the two below.
  void begin(PointsView scan, Workspace& workspace) const;

  /// E and its analytic derivatives with respect to x = t + dt + exp([w]x) R p at dt = w = 0
  /// (Eqs. 6.12-6.13 with the derivatives of a rotation vector in place of Euler angles).
  [[nodiscard]] Derivatives derivatives(PointsView scan, const Pose& T_local_scan,
                                        Workspace& workspace) const;

  /// Eq. 12 and its companions.
  [[nodiscard]] ScanScoreSum score(PointsView scan, const Pose& T_local_scan,
                                   Workspace& workspace) const;

 private:
  /// Calls `use(search)` with what finds a point's Gaussians in the mode chosen.
  template <class Use>
  auto with_search(Workspace& workspace, const Use& use) const;
  template <class Search>
  void sum_derivatives(PointsView scan, const Pose& T_local_scan, const Search& search,
                       Workspace& workspace) const;
  template <class Search>
  void sum_scores(PointsView scan, const Pose& T_local_scan, const Search& search,
                  Workspace& workspace) const;

  VoxelMap map_;
  Neighbours neighbours_;
  NdtCoefficients coefficients_;
  std::optional<VoxelTree> tree_;  // only where the mode needs it
};

}  // namespace vantage::ndt
