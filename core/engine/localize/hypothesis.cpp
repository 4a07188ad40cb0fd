#include "localize/hypothesis.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

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
  const Eigen::Matrix2d plan = motion->pose_covariance().topLeftCorner<2, 2>();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(plan, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, axes.eigenvalues()[1]));
}

double Hypothesis::innovation() const {
  // Matching errs by this much more once in a while, where a map has changed.
  if (!alignment || !motion) return 0.0;
  PoseMatrix S = motion->pose_covariance() + R;
  S.diagonal().head<3>().array() += kSameMetres * kSameMetres;
  S.diagonal().tail<3>().array() += kSameRadians * kSameRadians;
  const PoseVector off = difference(alignment->T_map_scan, predicted());
  return off.dot(S.ldlt().solve(off));
}

double update_beliefs(std::vector<Hypothesis>& hypotheses) {
  double most = 0.0;  // the log odds of elsewhere
  for (Hypothesis& one : hypotheses) {
    one.belief = one.support.log_odds();
    most = std::max(most, one.belief);
  }
  double elsewhere = std::exp(-most), total = elsewhere;
  for (Hypothesis& one : hypotheses) {
    one.belief = std::exp(one.belief - most);
    const double near = one.belief * one.support.odds_near();
    elsewhere += near;
    total += one.belief + near;
  }
  for (Hypothesis& one : hypotheses) one.belief /= total;
  return elsewhere / total;
}

void doubt(std::vector<Hypothesis>& hypotheses, double share) {
  if (!(share > 0.0)) return;
  double all = 0.0;  // the odds of all against elsewhere
  for (const Hypothesis& one : hypotheses) all += std::exp(one.support.log_odds());
  for (Hypothesis& one : hypotheses) {
    one.support.doubt(one.support.log_odds() + std::log1p(-share) - std::log1p(share * all));
  }
}

double sort_out(std::vector<Hypothesis>& hypotheses, std::size_t most) {
  constexpr double kLeastBelief = 1e-4;
  std::ranges::stable_sort(hypotheses, std::greater(), &Hypothesis::belief);
  std::vector<Hypothesis> kept;
  std::vector<double> beliefs;
  double dropped = 0.0;
  for (Hypothesis& one : hypotheses) {
    const auto same = std::ranges::find_if(
        kept, [&](const Hypothesis& other) { return is_same_pose(one.pose(), other.pose()); });
    if (same != kept.end()) {
      beliefs[static_cast<std::size_t>(same - kept.begin())] += one.belief;
    } else if (kept.empty() || (kept.size() < most && one.belief >= kLeastBelief)) {
      beliefs.push_back(one.belief);
      kept.push_back(std::move(one));
    } else {
      dropped += one.belief;
    }
  }
  for (std::size_t h = 0; h < kept.size(); ++h) {
    if (beliefs[h] <= kept[h].belief) continue;
    kept[h].support.favour(std::log(beliefs[h] / kept[h].belief));
    kept[h].belief = beliefs[h];
  }
  hypotheses = std::move(kept);
  if (hypotheses.size() == 1) hypotheses.front().support.be_alone();
  doubt(hypotheses, dropped);
  return dropped;
}

double heading_of(const Pose& pose) {
  const Eigen::Matrix3d R = pose.rotation.toRotationMatrix();
  return std::atan2(R(1, 0), R(0, 0));
}

}  // namespace vantage
