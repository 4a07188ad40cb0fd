#include "localize/weighing.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace vantage {
namespace {

// Scans taken this near to each other say the same [m].
constexpr double kIndependent = 2.0, kLeastNews = 0.1;
// If the fit of the first hypothesis changes by this share, something has happened.
constexpr double kChange = 0.4;
// A hypothesis beyond doubt is weighed after this way [m], or if its level fell by this share.
constexpr double kSettledWay = 2.5, kFall = 0.2, kSettledRisk = 1e-4;
// The fit of scans to themselves changes with the surroundings [m].
constexpr double kSurroundings = 25.0;
constexpr std::size_t kScored = 512;
// A scan that matches nothing may come from a place off the map, or from a covered sensor.
constexpr double kNothingFits = -3.0;

double level_of(const Alignment& alignment) {
  return alignment.score.nvtl * alignment.score.coverage;
}

/// How far matching pulls a right pose from its prediction, in units of what is expected; nothing
/// before there is a prediction.
std::optional<double> pull(const Hypothesis& one) {
  constexpr double kWithOdometry = 0.3, kWithoutOdometry = 1.0;  // [m]
  if (!one.alignment || one.initial) return {};
  if (one.motion.has_odometry()) return one.correction() / kWithOdometry;
  if (!one.motion.step()) return {};
  return one.correction() / kWithoutOdometry;
}

/// A wrong pose does not move as the sensor does: matching pulls it about.
double surprise(const Hypothesis& one) {
  constexpr double kMost = 6.0;
  const double pulled = pull(one).value_or(0.0);
  return -std::min(kMost, pulled * pulled);
}

}  // namespace

double heading_of(const Pose& pose) {
  const Eigen::Matrix3d R = pose.rotation.toRotationMatrix();
  return std::atan2(R(1, 0), R(0, 0));
}

double agreement(const Pose& pose, const std::optional<PosePrior>& prior) {
  constexpr double kMost = 10.0, kElsewhere = 3.0;
  if (!prior) return 0.0;
  double squared = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double off = pose.translation[axis] - prior->T_map_sensor.translation[axis];
    squared += off * off / (prior->sigma_translation[axis] * prior->sigma_translation[axis]);
  }
  const double turned =
      std::remainder(heading_of(pose) - heading_of(prior->T_map_sensor), 2.0 * std::numbers::pi);
  squared += turned * turned / (prior->sigma_heading * prior->sigma_heading);
  return std::max(-kMost, std::min(0.0, kElsewhere - 0.5 * squared));
}

bool is_surprising(const Hypothesis& one) { return pull(one).value_or(0.0) > 2.0; }

PointCloud Weighing::scored(const PreparedScan& scan) {
  return evenly_picked(scan.points, kScored);
}

Result<std::optional<Fit>> Weighing::reference(const PreparedScan& scan) const {
  return fit_to_itself(matcher_, scan.finite, scored(scan));
}

bool Weighing::is_due(const std::vector<Hypothesis>& hypotheses, double belief) const {
  const Hypothesis& first = hypotheses.front();
  if (hypotheses.size() > 1 || !weighed_at_ || !first.alignment) return true;
  if (1.0 - belief > kSettledRisk || is_surprising(first)) return true;
  if (level_of(*first.alignment) < (1.0 - kFall) * usual_level_) return true;
  return (first.pose().translation - *weighed_at_).norm() >= kSettledWay;
}

Result<std::vector<double>> Weighing::operator()(const PreparedScan& scan,
                                                 const std::optional<PosePrior>& prior,
                                                 std::vector<Hypothesis>& hypotheses) {
  const PointCloud some = scored(scan);
  const Point at = hypotheses.front().pose().translation;
  VANTAGE_CHECK(renew_reference(scan, at));
  std::vector<double> ratios(hypotheses.size(), 0.0);
  for (const bool again : {false, true}) {
    for (std::size_t h = 0; h < hypotheses.size(); ++h) {
      VANTAGE_TRY(ratios[h], ratio(hypotheses[h], some, prior));
    }
    // A poor fit may come from an old reference.
    if (again || reference_at_ == at || std::ranges::max(ratios) >= 0.0) break;
    reference_.reset();
    VANTAGE_CHECK(renew_reference(scan, at));
  }
  news_ =
      weighed_at_ ? std::clamp((at - *weighed_at_).norm() / kIndependent, kLeastNews, 1.0) : 1.0;
  const double share = hypotheses.front().evidence ? hypotheses.front().evidence->share : 0.0;
  if (std::abs(share - share_) > kChange * std::max(share, share_)) news_ = 1.0;
  share_ = share;
  for (double& ratio : ratios) ratio *= news_;
  weighed_at_ = at;
  return ratios;
}

std::vector<double> Weighing::compare(const std::vector<Hypothesis>& hypotheses) const {
  constexpr double kPreference = 15.0;
  const auto share = [](const Hypothesis& one) {
    return one.evidence ? std::max(0.0, one.evidence->share) : 0.0;
  };
  double best = 0.0;
  for (const Hypothesis& one : hypotheses) best = std::max(best, share(one));
  std::vector<double> ratios(hypotheses.size(), 0.0);
  if (best <= 0.0) return ratios;
  for (std::size_t h = 0; h < hypotheses.size(); ++h) {
    ratios[h] = news_ * kPreference * (share(hypotheses[h]) - best) / best;
  }
  return ratios;
}

double Weighing::of(const Evidence& evidence, const Pose& pose,
                    const std::optional<PosePrior>& prior) const {
  return log_likelihood_ratio(evidence, usual_share_, model_) + agreement(pose, prior);
}

Result<void> Weighing::renew_reference(const PreparedScan& scan, const Point& at) {
  if (reference_ && (at - reference_at_).norm() < kSurroundings) return {};
  VANTAGE_TRY(reference_, reference(scan));
  reference_at_ = at;
  return {};
}

Result<double> Weighing::ratio(Hypothesis& one, PointsView some,
                               const std::optional<PosePrior>& prior) const {
  one.evidence.reset();
  if (some.empty()) return 0.0;  // says nothing
  if (!one.alignment) return kNothingFits;
  if (!reference_) return 0.0;
  VANTAGE_TRY(const auto ready, maps_.borrow(one.region));
  VANTAGE_TRY(const Fit fit, fit_at(*ready->target, some, one.alignment->T_map_scan));
  one.evidence = evidence_of(fit, *reference_);
  return of(*one.evidence, one.pose(), prior) + surprise(one);
}

void Weighing::learn(const Hypothesis& tracked) {
  constexpr double kNew = 0.1;  // the usual value is that of about the last ten scans
  const double level = level_of(*tracked.alignment);
  usual_level_ = usual_level_ == 0.0 ? level : std::lerp(usual_level_, level, kNew);
  if (!tracked.evidence || !(tracked.evidence->share > 0.0)) return;
  const double share = tracked.evidence->share;
  usual_share_ = usual_share_ ? std::lerp(*usual_share_, share, kNew) : share;
}

void Weighing::forget() {
  usual_share_.reset();
  usual_level_ = 0.0;
  reference_.reset();
  weighed_at_.reset();
  news_ = 1.0;
  share_ = 0.0;
}

}  // namespace vantage
