#include "localize/alignment.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <vector>

namespace vantage {
namespace {

/// Poses all around the prediction that the sensor may have reached.
std::vector<Pose> reached_from(const Hypothesis& one, const Scan& scan) {
  constexpr double kSpeed = 5.0, kFarthest = 3.0;  // [m/s, m]
  constexpr double kApart = 1.0;  // [m]; from half of that, a matcher arrives by itself
  std::vector<Pose> poses{one.predicted};
  if (one.initial || one.motion.step() || (scan.odometry && one.motion.has_odometry())) {
    return poses;
  }
  const double reach = std::min(kFarthest, kSpeed * (scan.stamp - one.motion.stamp()));
  const Eigen::Matrix3d axes = one.predicted.rotation.toRotationMatrix();
  for (double metres = kApart; metres < reach + 0.5 * kApart; metres += kApart) {
    for (const Eigen::Index axis : {0, 1}) {
      for (const double side : {1.0, -1.0}) {
        poses.push_back(one.predicted);
        poses.back().translation += side * metres * axes.col(axis);
      }
    }
  }
  return poses;
}

}  // namespace

Result<Alignment> align_at_prediction(const Hypothesis& one, const Scan& scan, PointsView points) {
  const std::vector<Pose> starts = reached_from(one, scan);
  const MatchTarget& target = *one.map->target;
  if (starts.size() == 1) return target.align(points, starts.front());
  std::vector<Result<Alignment>> found(starts.size());
  tbb::parallel_for(std::size_t{0}, starts.size(),
                    [&](std::size_t k) { found[k] = target.align(points, starts[k]); });
  std::size_t best = 0;
  for (std::size_t k = 1; k < found.size(); ++k) {
    if (!found[k] || !is_valid(found[k]->T_map_scan)) continue;
    if (!found[best] || level_of(*found[k]) > level_of(*found[best])) best = k;
  }
  return std::move(found[best]);
}

}  // namespace vantage
