#include "localize/sweep_matching.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "localize/matched.hpp"
#include "vantage/engine/confidence.hpp"

namespace vantage {
namespace {

// Errors of an alignment that are new at every scan, whatever its Hessian says [m, rad].
constexpr double kLeastMetres = 0.003, kLeastRadians = 0.0005;
constexpr std::uint32_t kMostPasses = 4;
// Both halves of a sweep have errors of their own; their deviations count so many times. Chosen on
// simulated drives of 1.5 to 15 m/s (seed 7).
constexpr double kHalf = 4.0;
// Another pass is worth its time if it moves a point at this range [m] by more than this [m].
constexpr double kRange = 20.0, kRangeNoise = 0.02;

/// Poses all around the prediction that the sensor may have reached.
std::vector<Pose> reached_by(const MotionFilter& predicted) {
  constexpr double kApart = 1.0;  // [m]; from less than that, a matcher arrives by itself
  std::vector<Pose> poses{predicted.pose()};
  const Eigen::Matrix2d plan = predicted.pose_covariance().topLeftCorner<2, 2>();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(plan);
  for (const Eigen::Index axis : {1, 0}) {
    const double sigma = std::sqrt(std::max(0.0, axes.eigenvalues()[axis]));
    const double reach = reach_of(sigma);
    for (double metres = kApart; metres <= reach; metres += kApart) {
      for (const double side : {1.0, -1.0}) {
        Pose moved = poses.front();
        moved.translation.head<2>() += side * metres * axes.eigenvectors().col(axis);
        poses.push_back(moved);
      }
    }
  }
  return poses;
}

/// @param rivals  takes those that score nearly as high as the best, elsewhere; the best come first
Result<Alignment> align_best(const MatchTarget& target, PointsView points,
                             const std::vector<Pose>& starts, std::vector<Alignment>& rivals) {
  std::vector<Result<Alignment>> found(starts.size());
  tbb::parallel_for(std::size_t{0}, starts.size(),
                    [&](std::size_t k) { found[k] = target.align(points, starts[k]); });
  std::vector<Alignment> aligned;
  for (Result<Alignment>& one : found) {
    if (!one && one.error().code != ErrorCode::too_few_matches) return std::move(one);
    if (one && is_sound(*one)) aligned.push_back(*std::move(one));
  }
  if (aligned.empty()) return std::move(found.front());
  std::ranges::stable_sort(aligned, std::greater(),
                           [](const Alignment& one) { return level_of(one); });
  for (const Alignment& one : aligned) {
    if (level_of(one) < (1.0 - kChange) * level_of(aligned.front())) break;
    const bool same = is_same_pose(one.T_map_scan, aligned.front().T_map_scan) ||
                      std::ranges::any_of(rivals, [&](const Alignment& rival) {
                        return is_same_pose(one.T_map_scan, rival.T_map_scan);
                      });
    if (!same) rivals.push_back(one);
  }
  return std::move(aligned.front());
}

/// Whether the twist leaves open where a sweep's ends were seen from.
bool has_vague_twist(const MotionFilter& motion, const SweepTime& time) {
  constexpr double kVague = 0.1;  // [m]
  const auto variances = motion.covariance().diagonal();
  const double speed = std::sqrt(variances.segment<3>(6).maxCoeff());
  const double rate = std::sqrt(variances.segment<3>(9).maxCoeff());
  return std::max(speed, kRange * rate) * 0.5 * (time.last - time.first) > kVague;
}

/// Measures the twist by both halves of a sweep: they are aligned, and the sensor went from one
/// pose to the other.
/// @param at  where the whole sweep was aligned
/// Errors: those of MatchTarget::align, except `too_few_matches`, which leaves the motion as it is.
Result<void> learn_twist(const MatchTarget& target, const MotionInputs& inputs,
                         const LocalizerParams& params, const Sweep& sweep, const Pose& at,
                         MotionFilter& motion) {
  const PreparedScan& scan = sweep.prepared;
  std::array<MotionFilter::Seen, 2> seen;
  for (const std::size_t h : {0U, 1U}) {
    PointCloud half;
    double stamp = 0.0;
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      if ((scan.times[i] > sweep.time.middle()) != (h == 1)) continue;
      half.push_back(scan.points[i]);
      stamp += scan.times[i];
    }
    if (half.empty()) return {};
    stamp /= static_cast<double>(half.size());
    VANTAGE_TRY(const auto alignment, aligned_at(target, half, at));
    if (!alignment) return {};
    seen[h] = {stamp, alignment->T_map_scan * sweep.motion->sensor_at(stamp),
               kHalf * kHalf * noise_of(*alignment, half.size(), params)};
  }
  motion.update_motion(seen[0], seen[1], inputs);
  return {};
}

}  // namespace

PoseMatrix noise_of(const Alignment& alignment, std::size_t points, const LocalizerParams& params) {
  PoseMatrix R = covariance_of(alignment, points, params.covariance_scale);
  R.diagonal().head<3>().array() += kLeastMetres * kLeastMetres;
  R.diagonal().tail<3>().array() += kLeastRadians * kLeastRadians;
  return R;
}

Result<SweepMatch> match_sweep(const MatchTarget& target, const MotionFilter& predicted,
                               const MotionInputs& inputs, const LocalizerParams& params,
                               Sweep& sweep) {
  SweepMatch match{.motion = predicted};
  const bool vague = sweep.motion && has_vague_twist(predicted, sweep.time);
  PreparedScan& scan = sweep.prepared;
  std::vector<Pose> starts = reached_by(predicted);
  const auto without = [&](const std::string& failure) {
    return SweepMatch{.motion = predicted, .failure = failure, .passes = match.passes};
  };
  for (;;) {
    auto alignment = align_best(target, scan.points, starts, match.rivals);
    ++match.passes;
    if (!alignment && alignment.error().code != ErrorCode::too_few_matches) {
      return fail(std::move(alignment).error());
    }
    if (!alignment) return without(alignment.error().message);
    if (!is_sound(*alignment)) return without("the matcher returned numbers that are no pose");
    match.alignment = *std::move(alignment);
    match.R = noise_of(*match.alignment, scan.points.size(), params);
    if (!sweep.motion) return match;
    match.motion = predicted;
    if (vague) {
      VANTAGE_CHECK(
          learn_twist(target, inputs, params, sweep, match.alignment->T_map_scan, match.motion));
    }
    MotionFilter now = match.motion;
    now.update(match.alignment->T_map_scan, match.R);
    SweepMotion shown(now.state(), inputs, sweep.time, now.measured());
    if (match.passes == kMostPasses) return match;
    if (shown.apart(*sweep.motion, kRange) <= kRangeNoise) return match;
    const auto correct = [&](PointCloud& points, const std::vector<double>& times) {
      for (std::size_t i = 0; i < points.size(); ++i) {
        points[i] = sweep.motion->corrected(points[i], times[i], shown);
      }
    };
    correct(scan.points, scan.times);
    correct(scan.finite, scan.finite_times);
    sweep.motion = std::move(shown);
    starts.assign(1, match.alignment->T_map_scan);
  }
}

}  // namespace vantage
