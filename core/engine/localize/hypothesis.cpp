#include "localize/hypothesis.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace vantage {

double reach_of(double sigma) {
  constexpr double kFarthest = 3.0;  // [m]
  return std::floor(std::min(kFarthest, 2.0 * sigma));
}

MotionFilter Hypothesis::moved() const {
  if (!fits()) return *motion;
  MotionFilter now = shown.value_or(*motion);
  now.update(alignment->T_map_scan, R);
  return now;
}

double Hypothesis::sigma() const {
  return std::sqrt(motion->pose_covariance().diagonal().head<2>().maxCoeff());
}

double Hypothesis::innovation() const {
  // Matching errs by this much more once in a while, where a map has changed.
  constexpr double kMetres = 0.2, kRadians = 3.0 * std::numbers::pi / 180.0;
  if (!alignment || !motion) return 0.0;
  PoseMatrix S = motion->pose_covariance() + R;
  S.diagonal().head<3>().array() += kMetres * kMetres;
  S.diagonal().tail<3>().array() += kRadians * kRadians;
  const PoseVector off = difference(alignment->T_map_scan, predicted());
  return off.dot(S.ldlt().solve(off));
}

double heading_of(const Pose& pose) {
  const Eigen::Matrix3d R = pose.rotation.toRotationMatrix();
  return std::atan2(R(1, 0), R(0, 0));
}

}  // namespace vantage
