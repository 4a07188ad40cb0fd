#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/gauss_newton.hpp"
#include "common/parallel.hpp"
#include "common/params.hpp"
#include "common/surfel_map.hpp"
#include "common/workspace_pool.hpp"
#include "vantage/metrics.hpp"
#include "vantage/plugin.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage::matching {

/// The nearest map point of each scan point. A search also tells how near the others are, and is
/// not repeated while the scan point has moved too little for another to be nearer.
class Correspondences {
 public:
  /// Forgets the scan before.
  void begin(std::size_t scan_points, double max_distance) {
    found_.assign(scan_points, {});
    radius_ = kReserve * max_distance;
  }

  /// The map point nearest to `x`, where scan point i is now; kNone if it is farther than `limit`,
  /// which is at most max_distance.
  [[nodiscard]] std::uint32_t nearest(const SurfelMap& map, std::size_t i, const Eigen::Vector3d& x,
                                      double limit) {
    if (!map.reaches(x, limit)) return kNone;
    Found& f = found_[i];
    const double moved = (x - f.at).norm();
    const double others = f.others - moved;
    if (f.index == kNone) {
      if (others > limit) return kNone;
    } else {
      const double distance = (x - map.points()[f.index]).norm();
      if (distance < others) return distance <= limit ? f.index : kNone;
    }
    // What was second is within this still, or nothing is within the radius at all.
    const double radius =
        f.index == kNone ? radius_ : std::min(radius_, kRounding * (f.others + moved));
    const PointTree::Nearest found = map.tree().nearest(x, radius);
    f = {.at = x, .others = found.others, .index = found.index};
    if (found.index == kNone || (x - map.points()[found.index]).norm() > limit) return kNone;
    return found.index;
  }

 private:
  // Searched a bit farther than asked, so that a point without a match may move before it is
  // searched for again.
  static constexpr double kReserve = 1.1;
  static constexpr double kRounding = 1.0 + 1e-9;
  struct Found {
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    double others = -std::numeric_limits<double>::infinity();
    std::uint32_t index = kNone;
  };
  std::vector<Found> found_;
  double radius_ = 0.0;
};

/// Scratch memory of one alignment.
struct Workspace {
  Correspondences correspondences;
  std::vector<NormalEquations> equations;     // of each chunk
  std::vector<ScanScoreSum> scores;           // of each chunk
  std::vector<Eigen::Vector3d> scan_normals;  // where a Residual needs them
};

/// A map that scans are matched to by Gauss-Newton steps on
///     E(T) = 1/2 sum_i rho(d_i^T A_i d_i),  d_i = T p_i - q_i,
/// q_i the map point nearest to T p_i; what A_i is, the inverse covariance of d_i, is up to the
/// Residual:
///     void begin(PointsView scan, Workspace&) const;
///     Eigen::Matrix3d information(std::size_t scan_point, const Eigen::Matrix3d& R,
///                                 const Eigen::Vector3d& map_normal, const Workspace&) const;
template <class Residual>
class SurfelTarget final : public MatchTarget {
 public:
  SurfelTarget(SurfelMap map, const MatchingParams& params, const NdtCoefficients& coefficients,
               const Residual& residual)
      : map_(std::move(map)),
        params_(params),
        loss_(params.loss()),
        coefficients_(coefficients),
        residual_(residual) {}

  [[nodiscard]] Result<Alignment> align(PointsView scan,
                                        const Pose& T_map_scan_guess) const noexcept override {
    return guarded([&]() -> Result<Alignment> {
      VANTAGE_CHECK(check(scan, T_map_scan_guess));
      const Lease workspace(workspaces_);
      begin(scan, *workspace);
      const auto linearized = [&](const Pose& pose, std::uint32_t steps) {
        return linearize(scan, pose, params_.distance_after(steps), *workspace);
      };
      const Pose start = map_.to_local(T_map_scan_guess);
      const NormalEquations at_start = linearized(start, 0);
      VANTAGE_CHECK(check_overlap(at_start.matched, scan.size(), "at the guess"));
      const Minimum minimum =
          minimize(start, at_start, params_.steps(), params_.settled(), linearized);
      VANTAGE_CHECK(check_overlap(minimum.at.matched, scan.size(), "at the solution"));
      return Alignment{.T_map_scan = map_.to_map(minimum.T_local_scan),
                       .termination = minimum.termination,
                       .iterations = minimum.iterations,
                       .score = score(scan, minimum.T_local_scan, *workspace),
                       .hessian = minimum.at.hessian};
    });
  }

  [[nodiscard]] Result<ScanScore> score(PointsView scan,
                                        const Pose& T_map_scan) const noexcept override {
    return guarded([&]() -> Result<ScanScore> {
      VANTAGE_CHECK(check(scan, T_map_scan));
      const Lease workspace(workspaces_);
      begin(scan, *workspace);
      return score(scan, map_.to_local(T_map_scan), *workspace);
    });
  }

  /// Memory that the target holds; scratch memory of alignments comes on top.
  [[nodiscard]] std::size_t bytes() const noexcept { return sizeof(*this) + map_.bytes(); }
  /// Map points that scan points are compared with.
  [[nodiscard]] std::size_t elements() const noexcept { return map_.points().size(); }

 private:
  using Lease = typename WorkspacePool<Workspace>::Lease;
  static constexpr std::size_t kPointChunk = 256;

  [[nodiscard]] static Result<void> check(PointsView scan, const Pose& T_map_scan) {
    if (scan.empty()) return fail(ErrorCode::too_few_matches, "the scan has no points");
    VANTAGE_CHECK(check_points(scan, "the scan"));
    if (!is_valid(T_map_scan)) {
      return fail(ErrorCode::invalid_input,
                  "the scan's pose is not finite or its rotation is not of unit length");
    }
    return {};
  }

  [[nodiscard]] Result<void> check_overlap(std::size_t matched, std::size_t points,
                                           const char* where) const {
    const double needed = std::max(static_cast<double>(params_.min_matches),
                                   std::ceil(params_.min_coverage * static_cast<double>(points)));
    if (static_cast<double>(matched) >= needed) return {};
    return fail(ErrorCode::too_few_matches,
                std::to_string(matched) + " of " + std::to_string(points) +
                    " scan points have a map point near " + where + "; at least " +
                    std::to_string(static_cast<std::size_t>(needed)) + " are needed");
  }

  void begin(PointsView scan, Workspace& workspace) const {
    const std::size_t chunks = (scan.size() + kPointChunk - 1) / kPointChunk;
    workspace.correspondences.begin(scan.size(), params_.max_distance);
    workspace.equations.resize(chunks);
    workspace.scores.assign(chunks, ScanScoreSum(coefficients_));
    residual_.begin(scan, workspace);
  }

  /// Calls `use(match, chunk)` for every scan point that has a match, `use(nullptr, chunk)` for
  /// those that have none.
  struct Match {
    Eigen::Vector3d y, Ad;  // R p, A d
    Eigen::Matrix3d A;
    double squared;  // d^T A d
  };
  template <class Use>
  void for_each_match(PointsView scan, const Pose& T_local_scan, double limit, Workspace& workspace,
                      const Use& use) const {
    const Eigen::Matrix3d R = T_local_scan.rotation.toRotationMatrix();
    const Eigen::Vector3d t = T_local_scan.translation;
    for_each_chunk(scan.size(), kPointChunk,
                   [&](std::size_t chunk, std::size_t begin, std::size_t end) {
                     for (std::size_t i = begin; i < end; ++i) {
                       Match match;
                       match.y = R * scan[i];
                       const Eigen::Vector3d x = match.y + t;
                       const std::uint32_t j = workspace.correspondences.nearest(map_, i, x, limit);
                       if (j == kNone) {
                         use(nullptr, chunk);
                         continue;
                       }
                       const Eigen::Vector3d d = x - map_.points()[j];
                       match.A = residual_.information(i, R, map_.normals()[j], workspace);
                       match.Ad = match.A * d;
                       match.squared = d.dot(match.Ad);
                       use(&match, chunk);
                     }
                   });
  }

  [[nodiscard]] NormalEquations linearize(PointsView scan, const Pose& T_local_scan, double limit,
                                          Workspace& workspace) const {
    std::ranges::fill(workspace.equations, NormalEquations{});
    for_each_match(scan, T_local_scan, limit, workspace, [&](const Match* m, std::size_t chunk) {
      if (m == nullptr) return;
      workspace.equations[chunk].add(m->A, m->Ad, m->y, loss_.weight(m->squared),
                                     loss_.value(m->squared));
    });
    NormalEquations total;
    for (const NormalEquations& part : workspace.equations) total.add(part);
    total.symmetrize();
    return total;
  }

  [[nodiscard]] ScanScore score(PointsView scan, const Pose& T_local_scan,
                                Workspace& workspace) const {
    std::ranges::fill(workspace.scores, ScanScoreSum(coefficients_));
    for_each_match(scan, T_local_scan, params_.max_distance, workspace,
                   [&](const Match* m, std::size_t chunk) {
                     if (m == nullptr)
                       return workspace.scores[chunk].add(std::span<const double>{});
                     workspace.scores[chunk].add(std::span(&m->squared, 1));
                   });
    ScanScoreSum total(coefficients_);
    for (const ScanScoreSum& part : workspace.scores) total.add(part);
    return total.mean();
  }

  SurfelMap map_;
  MatchingParams params_;
  RobustLoss loss_;
  NdtCoefficients coefficients_;
  Residual residual_;
  mutable WorkspacePool<Workspace> workspaces_;
};

/// d1, d2, d3 of the scores: those of ndt at its defaults, so that scores are comparable.
[[nodiscard]] inline Result<NdtCoefficients> score_coefficients() {
  return NdtCoefficients::derive(0.55, 1.0);
}

}  // namespace vantage::matching
