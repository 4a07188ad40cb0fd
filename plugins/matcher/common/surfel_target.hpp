#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/answer.hpp"
#include "common/approach.hpp"
#include "common/correspondences.hpp"
#include "common/element_numbers.hpp"
#include "common/gauss_newton.hpp"
#include "common/ndt_coefficients.hpp"
#include "common/occupied_cubes.hpp"
#include "common/parallel.hpp"
#include "common/params.hpp"
#include "common/scan_score_sum.hpp"
#include "common/surfel_excerpt.hpp"
#include "common/surfel_map.hpp"
#include "common/surfel_pulls.hpp"
#include "common/surfel_voxels.hpp"
#include "vantage/scan_matcher.hpp"
#include "vantage/scan_score.hpp"

namespace vantage::matching {

/// Scratch memory of one alignment.
struct Workspace {
  Correspondences correspondences;
  std::vector<NormalEquations> equations;  // of each chunk
  std::vector<ScanScoreSum> scores;        // of each chunk
  // Only for a Residual that needs normals of the scan. They stay from call to call: a scan is
  // scored at many poses.
  PointCloud scan;
  std::vector<Eigen::Vector3d> scan_normals;
};

struct Scratch {
  Workspace whole;
  PointCloud points;  // a part of the scan
  Correspondences part;
  Approach::Workspace approach;
};
using Scratches = WorkspacePool<Scratch>;

/// A map that scans are matched to by Gauss-Newton steps on
///     E(T) = 1/2 sum_i rho(d_i^T A_i d_i),  d_i = T p_i - q_i,
/// where q_i is the map point nearest to T p_i. Scans are scored by d_i^T S_i d_i. The Residual
/// defines A_i, the inverse covariance of d_i, and S_i:
///     void begin(PointsView scan, Workspace&) const;
///     Eigen::Matrix3d information(std::size_t scan_point, const Eigen::Matrix3d& R,
///                                 const Eigen::Vector3d& map_normal, const Workspace&) const;
///     Eigen::Matrix3d scored_information(...) const;  // the same arguments
///     static constexpr double kInformation;  // of Alignment::hessian
///
/// Of a stored map, only some surfels may be left, and the occupied cubes of a metre of all. A scan
/// point then matches a surfel in the end only if it is about as near as it would have to be for
/// the surfel to be the nearest one of all: the terms of the others are left out, and no surfel
/// stands for its neighbours. Scores are means over the points that match, which stand for the
/// others in and beside the cubes.
template <class Residual>
class SurfelTarget final : public MatchTarget {
 public:
  /// @param occupied  cubes of a metre, if some of the map's surfels are left out
  SurfelTarget(SurfelMap map, const SurfelMap::Options& options, const MatchingParams& params,
               const NdtCoefficients& coefficients, std::vector<NdtCoefficients> coarse,
               const Residual& residual, std::shared_ptr<Scratches> scratches,
               std::optional<ndt::VoxelMap> occupied = std::nullopt)
      : map_(std::move(map)),
        options_(options),
        params_(params),
        loss_(params.loss()),
        coefficients_(coefficients),
        residual_(residual),
        approach_(std::move(coarse), options.voxel, std::move(occupied)),
        voxels_(options),
        scratches_(std::move(scratches)) {
    own_ =
        std::min(params_.final_distance.value_or(params_.max_distance), kOwnEdges * options.edge());
    if (approach_.occupied() != nullptr) params_.final_distance = own_;
  }

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
      VANTAGE_CHECK(check_overlap(at_start, scan, start.T_local_scan, "at the guess"));
      StepOptions options = params_.steps();
      options.max_iterations -= start.iterations;
      const Minimum minimum =
          minimize(start.T_local_scan, at_start, options, params_.settled(), linearized);
      VANTAGE_CHECK(check_overlap(minimum.at, scan, minimum.T_local_scan, "at the solution"));
      return Alignment{.T_map_scan = map_.to_map(minimum.T_local_scan),
                       .termination = minimum.termination,
                       .iterations = start.iterations + minimum.iterations,
                       .score = score(scan, minimum.T_local_scan, workspace),
                       .hessian = Residual::kInformation * minimum.at.hessian};
    };
    return answer_with<Alignment>(*scratches_, scan, T_map_scan_guess, align_with);
  }

  [[nodiscard]] Result<ScanScore> score(PointsView scan,
                                        const Pose& T_map_scan) const noexcept override {
    return answer_with<ScanScore>(*scratches_, scan, T_map_scan, [&](Scratch& scratch) {
      begin(scan, scratch.whole);
      return score(scan, map_.to_local(T_map_scan), scratch.whole);
    });
  }

  [[nodiscard]] std::size_t bytes() const noexcept override {
    return sizeof(*this) + map_.bytes() + approach_.bytes() + voxels_.bytes();
  }
  [[nodiscard]] std::size_t elements() const noexcept override { return map_.points().size(); }

  [[nodiscard]] Result<PreparedMap> excerpt(PointsView seen) const noexcept override {
    return guarded([&]() -> Result<PreparedMap> {
      VANTAGE_TRY(const std::vector<std::uint32_t> which, surfels_at(seen));
      VANTAGE_TRY(auto bytes, encode(map_, options_, which));
      return PreparedMap{.bytes = std::move(bytes), .elements = which.size()};
    });
  }

  [[nodiscard]] Result<std::vector<MapElement>> elements_at(
      PointsView seen) const noexcept override {
    return guarded([&]() -> Result<std::vector<MapElement>> {
      VANTAGE_TRY(const std::vector<std::uint32_t> which, surfels_at(seen));
      std::vector<MapElement> elements;
      elements.reserve(which.size());
      for (const std::uint32_t j : which) {
        elements.push_back(
            {.number = j, .middle = map_.points()[j] + map_.origin(), .points = map_.count(j)});
      }
      return elements;
    });
  }

  /// Of E times kInformation, as Alignment::hessian. In a map of all surfels, each matches the scan
  /// points that it would match if its neighbours were not kept; in a map of some, those that it
  /// matches in the last steps.
  [[nodiscard]] Result<std::vector<Pull>> pulls(PointsView scan,
                                                const Pose& T_map_scan) const noexcept override {
    const auto pulls_with = [&](Scratch& scratch) -> Result<std::vector<Pull>> {
      return pulls(scan, map_.to_local(T_map_scan), scratch.whole);
    };
    return answer_with<std::vector<Pull>>(*scratches_, scan, T_map_scan, pulls_with);
  }

  [[nodiscard]] Result<PreparedMap> excerpt_of(
      std::span<const std::uint32_t> seen,
      std::span<const std::uint32_t> kept) const noexcept override {
    return guarded([&]() -> Result<PreparedMap> {
      VANTAGE_CHECK(check_numbers(seen, kept, elements()));
      VANTAGE_TRY(auto bytes, encode_some(map_, options_, seen, kept));
      return PreparedMap{.bytes = std::move(bytes), .elements = kept.size()};
    });
  }

 private:
  static constexpr std::size_t kPointChunk = 256;

  // A guess is judged by the fit of this many points. On kitti_street and the demo's campus, it is
  // at least 0.7 at 5 cm off, and at most 0.65 at 0.3 m and 1 degree, or at more.
  static constexpr std::size_t kJudgedPoints = 256;
  static constexpr double kNearGuess = 0.7;
  // If some surfels are left out, fewer points tell.
  static constexpr std::size_t kJudgedPointsOfSome = 4096;
  // If some surfels are left out, a surfel matches points up to this distance in the last steps, in
  // edges of the map's voxels. Chosen on the demo's campus, of 0.7 to 4.
  static constexpr double kOwnEdges = 2.5;

  [[nodiscard]] Result<void> check_overlap(const NormalEquations& at, PointsView scan,
                                           const Pose& T_local_scan, const char* where) const {
    const LeastOverlap least = params_.least_overlap();
    std::size_t matched = at.matched;
    if (approach_.occupied() != nullptr && matched >= least.matches) {
      // Those that match stand for all that are covered.
      matched = covered_points(*approach_.occupied(), scan, T_local_scan, params_.max_distance);
    }
    return least.check(matched, scan.size(), "a map point near", where);
  }

  [[nodiscard]] Result<std::vector<std::uint32_t>> surfels_at(PointsView seen) const {
    if (!seen.empty()) VANTAGE_CHECK(check_points(seen, "what is seen"));
    return voxels_.surfels_at(map_, seen);
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
    const std::size_t points = std::min(
        approach_.occupied() == nullptr ? kJudgedPoints : kJudgedPointsOfSome, scan.size());
    PointCloud& part = scratch.points;
    part.resize(points);
    for (std::size_t i = 0; i < points; ++i) part[i] = scan[i * scan.size() / points];
    scratch.part.begin(points, params_.max_distance);
    const double at_guess = fit(part, guess, scratch.part);
    if (at_guess >= kNearGuess || at_guess == 0.0) return {guess};
    const ndt::Start start = approach_.nearer(map_, scan, guess, params_.steps(), scratch.approach);
    const double there = fit(part, start.T_local_scan, scratch.part);
    return there > at_guess ? start : ndt::Start{guess};
  }

  /// Whether a surfel tells how well a point fits that is `d` away from it: if its neighbours are
  /// not kept, not far along its plane. Across the plane, it may be as far as it is matched at all:
  /// if only near points counted, a wrong pose would fit as well as the right one.
  [[nodiscard]] bool is_own(const Eigen::Vector3d& d, const Eigen::Vector3d& normal) const {
    return approach_.occupied() == nullptr ||
           (d - d.dot(normal) * normal).squaredNorm() <= own_ * own_;
  }

  /// The mean likelihood of the points' distances from the map's surface, 1 at most. Points that
  /// only a surfel that is left out may match do not count.
  [[nodiscard]] double fit(PointsView part, const Pose& T_local_scan,
                           Correspondences& correspondences) const {
    const double precision = 0.5 * coefficients_.d2 / (params_.sigma * params_.sigma);
    const ndt::VoxelMap* const occupied = approach_.occupied();
    double sum = 0.0;
    std::size_t points = 0;
    for (std::size_t i = 0; i < part.size(); ++i) {
      const Eigen::Vector3d x = T_local_scan * part[i];
      const std::uint32_t j = correspondences.nearest(map_, i, x, params_.max_distance);
      if (j == kNone || !is_own(x - map_.points()[j], map_.normals()[j])) {
        if (occupied == nullptr || !is_covered(*occupied, x, params_.max_distance)) ++points;
        continue;
      }
      ++points;
      const Eigen::Vector3d d = x - map_.points()[j];
      const Eigen::Vector3d& n = map_.normals()[j];
      const double squared = n.isZero() ? d.squaredNorm() : d.dot(n) * d.dot(n);
      sum += std::exp(-precision * squared);
    }
    return points == 0 ? 0.0 : sum / static_cast<double>(points);
  }

  /// Calls `use(i, y, d, map_normal, chunk)` for every scan point i that has a match, with y = R p
  /// and d = T p - q, and `miss(T p, chunk)` for every point without a match.
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
                         miss(x, chunk);
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
    const auto use = [&](std::size_t i, const Eigen::Vector3d& y, const Eigen::Vector3d& d,
                         const Eigen::Vector3d& map_normal, std::size_t chunk) {
      add(i, R, y, d, map_normal, workspace, workspace.equations[chunk]);
    };
    for_each_match(scan, T_local_scan, R, limit, workspace, use,
                   [](const Eigen::Vector3d&, std::size_t) {});
    NormalEquations total;
    for (const NormalEquations& part : workspace.equations) total.add(part);
    total.symmetrize();
    return total;
  }

  [[nodiscard]] std::vector<Pull> pulls(PointsView scan, const Pose& T_local_scan,
                                        Workspace& workspace) const {
    begin(scan, workspace);
    const Eigen::Matrix3d R = T_local_scan.rotation.toRotationMatrix();
    std::vector<SurfelMatch> matches;
    for (std::uint32_t i = 0; i < scan.size(); ++i) {
      const Eigen::Vector3d x = R * scan[i] + T_local_scan.translation;
      if (approach_.occupied() == nullptr) {
        map_.tree().for_each_within(x, own_, [&](std::uint32_t j) { matches.push_back({j, i}); });
      } else {
        const std::uint32_t j = workspace.correspondences.nearest(map_, i, x, own_);
        if (j != kNone) matches.push_back({j, i});
      }
    }
    return pulls_of(std::move(matches), Residual::kInformation,
                    [&](const SurfelMatch& match, NormalEquations& equations) {
                      const Eigen::Vector3d y = R * scan[match.point];
                      const Eigen::Vector3d d =
                          y + T_local_scan.translation - map_.points()[match.surfel];
                      add(match.point, R, y, d, map_.normals()[match.surfel], workspace, equations);
                    });
  }

  /// Adds the term of a match.
  void add(std::size_t i, const Eigen::Matrix3d& R, const Eigen::Vector3d& y,
           const Eigen::Vector3d& d, const Eigen::Vector3d& map_normal, const Workspace& workspace,
           NormalEquations& equations) const {
    const Eigen::Matrix3d A = residual_.information(i, R, map_normal, workspace);
    const Eigen::Vector3d Ad = A * d;
    const double s = d.dot(Ad);
    equations.add(A, Ad, y, loss_.weight(s), loss_.value(s));
  }

  [[nodiscard]] ScanScore score(PointsView scan, const Pose& T_local_scan,
                                Workspace& workspace) const {
    std::ranges::fill(workspace.scores, ScanScoreSum(coefficients_));
    const Eigen::Matrix3d R = T_local_scan.rotation.toRotationMatrix();
    const ndt::VoxelMap* const occupied = approach_.occupied();
    const auto miss = [&](const Eigen::Vector3d& x, std::size_t chunk) {
      if (occupied != nullptr && is_covered(*occupied, x, params_.max_distance)) return;
      workspace.scores[chunk].add(std::span<const double>{});
    };
    const auto use = [&](std::size_t i, const Eigen::Vector3d& y, const Eigen::Vector3d& d,
                         const Eigen::Vector3d& map_normal, std::size_t chunk) {
      if (!is_own(d, map_normal)) return miss(y + T_local_scan.translation, chunk);
      const double s = d.dot(residual_.scored_information(i, R, map_normal, workspace) * d);
      workspace.scores[chunk].add(std::span(&s, 1));
    };
    for_each_match(scan, T_local_scan, R, params_.max_distance, workspace, use, miss);
    ScanScoreSum total(coefficients_);
    for (const ScanScoreSum& part : workspace.scores) total.add(part);
    ScanScore score = total.mean();
    if (occupied == nullptr || score.coverage == 0.0) return score;
    const double covered =
        static_cast<double>(covered_points(*occupied, scan, T_local_scan, params_.max_distance)) /
        static_cast<double>(scan.size());
    score.compared = std::min(1.0, score.coverage / covered);
    score.fitness *= covered / score.coverage;
    score.coverage = covered;
    return score;
  }

  SurfelMap map_;
  SurfelMap::Options options_;
  MatchingParams params_;
  double own_ = 0.0;  // up to which a surfel matches if its neighbours are not kept [m]
  RobustLoss loss_;
  NdtCoefficients coefficients_;
  Residual residual_;
  Approach approach_;
  SurfelVoxels voxels_;
  std::shared_ptr<Scratches> scratches_;
};

/// The parameters, `prepare` and `restore` of a matcher with a Residual, for ScanMatcherOf.
/// `Residual::kPlanesOnly` says which surfels the Residual needs (see SurfelMap::Options).
/// @tparam Params  derives from MatchingParams
template <class Params, class Residual>
struct SurfelMatching : Params {
  [[nodiscard]] Result<std::unique_ptr<MatchTarget>> prepare(PointsView map) const {
    VANTAGE_TRY(SurfelMap surfels, SurfelMap::build(map, options()));
    return target_of(std::move(surfels), std::nullopt);
  }
  [[nodiscard]] Result<std::unique_ptr<MatchTarget>> restore(
      std::span<const std::byte> prepared) const {
    VANTAGE_TRY(StoredSurfels stored, decode(prepared, options()));
    return target_of(std::move(stored.map), std::move(stored.occupied));
  }

 private:
  [[nodiscard]] SurfelMap::Options options() const {
    SurfelMap::Options options;
    options.voxel = this->map_voxel;
    options.neighbours = this->neighbours;
    options.planes_only = Residual::kPlanesOnly;
    return options;
  }
  [[nodiscard]] Result<std::unique_ptr<MatchTarget>> target_of(
      SurfelMap surfels, std::optional<ndt::VoxelMap> occupied) const {
    // The defaults of ndt (outlier_ratio, resolution [m]), so that scores are comparable.
    VANTAGE_TRY(const NdtCoefficients coefficients, NdtCoefficients::derive(0.55, 1.0));
    VANTAGE_TRY(auto coarse, Approach::coefficients());
    return std::make_unique<SurfelTarget<Residual>>(
        std::move(surfels), options(), *this, coefficients, std::move(coarse), Residual(*this),
        scratches_, std::move(occupied));
  }

  // Of all targets together: a region's map would keep its own until it is dropped.
  std::shared_ptr<Scratches> scratches_ = std::make_shared<Scratches>();
};

}  // namespace vantage::matching
