#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/answer.hpp"
#include "common/approach.hpp"
#include "common/gauss_newton.hpp"
#include "common/parallel.hpp"
#include "common/params.hpp"
#include "common/surfel_map.hpp"
#include "vantage/scan_matcher.hpp"
#include "vantage/scan_score.hpp"

namespace vantage::matching {

/// The nearest map point of each scan point. A search also finds a distance below which there is no
/// other map point. It is repeated only when the scan point has moved so far that another map point
/// may be nearer.
class Correspondences {
 public:
  /// Starts a new scan and forgets the previous one.
  void begin(std::size_t scan_points, double max_distance) {
    found_.assign(scan_points, {});
    radius_ = kReserve * max_distance;
  }

  /// The map point nearest to `x`, the current position of scan point i; kNone if it is farther
  /// than `limit`. Precondition: limit <= max_distance.
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
    // The second nearest point is still within this radius, or no point is within the radius at
    // all.
    const double radius =
        f.index == kNone ? radius_ : std::min(radius_, kRounding * (f.others + moved));
    const PointTree::Nearest found = map.tree().nearest(x, radius);
    f = {.at = x, .others = found.others, .index = found.index};
    if (found.index == kNone || (x - map.points()[found.index]).norm() > limit) return kNone;
    return found.index;
  }

 private:
  // The search reaches a little farther than max_distance, so that a point without a match may move
  // before the next search.
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
  std::vector<Eigen::Vector3d> scan_normals;  // only for a Residual that needs them
};

/// A map that scans are matched to by Gauss-Newton steps on
///     E(T) = 1/2 sum_i rho(d_i^T A_i d_i),  d_i = T p_i - q_i,
/// where q_i is the map point nearest to T p_i. Scans are scored by d_i^T S_i d_i. The Residual
/// defines A_i, the inverse covariance of d_i, and S_i:
///     void begin(PointsView scan, Workspace&) const;
///     Eigen::Matrix3d information(std::size_t scan_point, const Eigen::Matrix3d& R,
///                                 const Eigen::Vector3d& map_normal, const Workspace&) const;
///     Eigen::Matrix3d scored_information(...) const;  // the same arguments
///     static constexpr double kInformation;  // of Alignment::hessian
template <class Residual>
class SurfelTarget final : public MatchTarget {
 public:
  SurfelTarget(SurfelMap map, const MatchingParams& params, const NdtCoefficients& coefficients,
               std::vector<NdtCoefficients> coarse, const Residual& residual)
      : map_(std::move(map)),
        params_(params),
        loss_(params.loss()),
        coefficients_(coefficients),
        residual_(residual),
        approach_(std::move(coarse)) {}

  [[nodiscard]] Result<Alignment> align(PointsView scan,
                                        const Pose& T_map_scan_guess) const noexcept override {
    const auto align_with = [&](Scratch& scratch) -> Result<Alignment> {
      const ndt::Start start = from_afar(scan, map_.to_local(T_map_scan_guess), scratch);
      Workspace& workspace = scratch.whole;
      begin(scan, workspace);
      const auto linearized = [&](const Pose& pose, std::uint32_t steps) {
        return linearize(scan, pose, params_.distance_after(steps), workspace);
      };
      const NormalEquations at_start = linearized(start.T_local_scan, 0);
      VANTAGE_CHECK(check_overlap(at_start.matched, scan.size(), "at the guess"));
      StepOptions options = params_.steps();
      options.max_iterations -= start.iterations;
      const Minimum minimum =
          minimize(start.T_local_scan, at_start, options, params_.settled(), linearized);
      VANTAGE_CHECK(check_overlap(minimum.at.matched, scan.size(), "at the solution"));
      return Alignment{.T_map_scan = map_.to_map(minimum.T_local_scan),
                       .termination = minimum.termination,
                       .iterations = start.iterations + minimum.iterations,
                       .score = score(scan, minimum.T_local_scan, workspace),
                       .hessian = Residual::kInformation * minimum.at.hessian};
    };
    return answer_with<Alignment>(scratches_, scan, T_map_scan_guess, align_with);
  }

  [[nodiscard]] Result<ScanScore> score(PointsView scan,
                                        const Pose& T_map_scan) const noexcept override {
    return answer_with<ScanScore>(scratches_, scan, T_map_scan, [&](Scratch& scratch) {
      begin(scan, scratch.whole);
      return score(scan, map_.to_local(T_map_scan), scratch.whole);
    });
  }

  /// The scratch memory of alignments is not included.
  [[nodiscard]] std::size_t bytes() const noexcept override {
    return sizeof(*this) + map_.bytes() + approach_.bytes();
  }
  [[nodiscard]] std::size_t elements() const noexcept override { return map_.points().size(); }

 private:
  static constexpr std::size_t kPointChunk = 256;

  // A guess is judged by the fit of this many points. On kitti_street and the demo's campus, it is
  // at least 0.7 at 5 cm off, and at most 0.65 at 0.3 m and 1 degree, or at more.
  static constexpr std::size_t kJudgedPoints = 256;
  static constexpr double kNearGuess = 0.7;

  struct Scratch {
    Workspace whole;
    PointCloud points;  // a part of the scan
    Correspondences part;
    Approach::Workspace approach;
  };

  [[nodiscard]] Result<void> check_overlap(std::size_t matched, std::size_t points,
                                           const char* where) const {
    return params_.least_overlap().check(matched, points, "a map point near", where);
  }

  void begin(PointsView scan, Workspace& workspace) const {
    const std::size_t chunks = (scan.size() + kPointChunk - 1) / kPointChunk;
    workspace.correspondences.begin(scan.size(), params_.max_distance);
    workspace.equations.resize(chunks);
    workspace.scores.assign(chunks, ScanScoreSum(coefficients_));
    residual_.begin(scan, workspace);
  }

  /// Goes through coarse voxels if the guess is far off, and keeps the guess if they lead to a
  /// worse pose.
  [[nodiscard]] ndt::Start from_afar(PointsView scan, const Pose& guess, Scratch& scratch) const {
    const std::size_t points = std::min(kJudgedPoints, scan.size());
    PointCloud& part = scratch.points;
    part.resize(points);
    for (std::size_t i = 0; i < points; ++i) part[i] = scan[i * scan.size() / points];
    scratch.part.begin(points, params_.max_distance);
    const double at_guess = fit(part, guess, scratch.part);
    if (at_guess >= kNearGuess || at_guess == 0.0) return {guess};
    const ndt::Start start =
        approach_.nearer(map_.points(), scan, guess, params_.steps(), scratch.approach);
    const double there = fit(part, start.T_local_scan, scratch.part);
    return there > at_guess ? start : ndt::Start{guess};
  }
  /// The mean likelihood of the points' distances from the map's surface, 1 at most.
  [[nodiscard]] double fit(PointsView part, const Pose& T_local_scan,
                           Correspondences& correspondences) const {
    const double precision = 0.5 * coefficients_.d2 / (params_.sigma * params_.sigma);
    double sum = 0.0;
    for (std::size_t i = 0; i < part.size(); ++i) {
      const Eigen::Vector3d x = T_local_scan * part[i];
      const std::uint32_t j = correspondences.nearest(map_, i, x, params_.max_distance);
      if (j == kNone) continue;
      const Eigen::Vector3d d = x - map_.points()[j];
      const Eigen::Vector3d& n = map_.normals()[j];
      const double squared = n.isZero() ? d.squaredNorm() : d.dot(n) * d.dot(n);
      sum += std::exp(-precision * squared);
    }
    return sum / static_cast<double>(part.size());
  }

  /// Calls `use(i, y, d, map_normal, chunk)` for every scan point i that has a match, with y = R p
  /// and d = T p - q, and `miss(chunk)` for every point without a match.
  template <class Use, class Miss>
  void for_each_match(PointsView scan, const Pose& T_local_scan, const Eigen::Matrix3d& R,
                      double limit, Workspace& workspace, const Use& use, const Miss& miss) const {
    const Eigen::Vector3d t = T_local_scan.translation;
    for_each_chunk(scan.size(), kPointChunk,
                   [&](std::size_t chunk, std::size_t begin, std::size_t end) {
                     for (std::size_t i = begin; i < end; ++i) {
                       const Eigen::Vector3d y = R * scan[i];
                       const Eigen::Vector3d x = y + t;
                       const std::uint32_t j = workspace.correspondences.nearest(map_, i, x, limit);
                       if (j == kNone) {
                         miss(chunk);
                       } else {
                         use(i, y, Eigen::Vector3d(x - map_.points()[j]), map_.normals()[j], chunk);
                       }
                     }
                   });
  }

  [[nodiscard]] NormalEquations linearize(PointsView scan, const Pose& T_local_scan, double limit,
                                          Workspace& workspace) const {
    std::ranges::fill(workspace.equations, NormalEquations{});
    const Eigen::Matrix3d R = T_local_scan.rotation.toRotationMatrix();
    const auto add = [&](std::size_t i, const Eigen::Vector3d& y, const Eigen::Vector3d& d,
                         const Eigen::Vector3d& map_normal, std::size_t chunk) {
      const Eigen::Matrix3d A = residual_.information(i, R, map_normal, workspace);
      const Eigen::Vector3d Ad = A * d;
      const double s = d.dot(Ad);
      workspace.equations[chunk].add(A, Ad, y, loss_.weight(s), loss_.value(s));
    };
    for_each_match(scan, T_local_scan, R, limit, workspace, add, [](std::size_t) {});
    NormalEquations total;
    for (const NormalEquations& part : workspace.equations) total.add(part);
    total.symmetrize();
    return total;
  }

  [[nodiscard]] ScanScore score(PointsView scan, const Pose& T_local_scan,
                                Workspace& workspace) const {
    std::ranges::fill(workspace.scores, ScanScoreSum(coefficients_));
    const Eigen::Matrix3d R = T_local_scan.rotation.toRotationMatrix();
    const auto add = [&](std::size_t i, const Eigen::Vector3d& /*y*/, const Eigen::Vector3d& d,
                         const Eigen::Vector3d& map_normal, std::size_t chunk) {
      const double s = d.dot(residual_.scored_information(i, R, map_normal, workspace) * d);
      workspace.scores[chunk].add(std::span(&s, 1));
    };
    const auto miss = [&](std::size_t chunk) {
      workspace.scores[chunk].add(std::span<const double>{});
    };
    for_each_match(scan, T_local_scan, R, params_.max_distance, workspace, add, miss);
    ScanScoreSum total(coefficients_);
    for (const ScanScoreSum& part : workspace.scores) total.add(part);
    return total.mean();
  }

  SurfelMap map_;
  MatchingParams params_;
  RobustLoss loss_;
  NdtCoefficients coefficients_;
  Residual residual_;
  Approach approach_;
  mutable WorkspacePool<Scratch> scratches_;
};

/// The parameters and `prepare` of a matcher with a Residual, for ScanMatcherOf.
/// `Residual::kPlanesOnly` says which surfels the Residual needs (see SurfelMap::Options).
/// @tparam Params  derives from MatchingParams
template <class Params, class Residual>
struct SurfelMatching : Params {
  [[nodiscard]] Result<std::unique_ptr<MatchTarget>> prepare(PointsView map) const {
    // The defaults of ndt (outlier_ratio, resolution [m]), so that scores are comparable.
    VANTAGE_TRY(const NdtCoefficients coefficients, NdtCoefficients::derive(0.55, 1.0));
    VANTAGE_TRY(auto coarse, Approach::coefficients());
    VANTAGE_TRY(SurfelMap surfels, SurfelMap::build(map, {.voxel = this->map_voxel,
                                                          .neighbours = this->neighbours,
                                                          .planes_only = Residual::kPlanesOnly}));
    return std::make_unique<SurfelTarget<Residual>>(std::move(surfels), *this, coefficients,
                                                    std::move(coarse), Residual(*this));
  }
};

}  // namespace vantage::matching
