#include "localize/verdict.hpp"

#include <algorithm>
#include <array>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <numbers>
#include <string>

#include "vantage/engine/confidence.hpp"

namespace vantage {
namespace {

// A scan is lost if the sensor is probably at none of the poses that are followed, unless the scan
// scores as usual.
constexpr double kLost = 0.5;

/// The probability that a normal error is longer than this. Its square is taken for a multiple of a
/// chi-square with the same mean and variance, which is right if some axes are alike and the others
/// have no error. It is at least the probability that the error is so long along its first axis.
/// Source: F. E. Satterthwaite, "An Approximate Distribution of Estimates of Variance Components",
/// Biometrics Bulletin 2(6), 1946.
/// @param sigma  standard deviations along the principal axes, the largest first
/// @return       1 for deviations that are no numbers
double longer_than(double length, const Eigen::Vector3d& sigma) {
  const Eigen::Array3d variances = sigma.array().square();
  const double mean = variances.sum(), unit = variances.square().sum() / mean;
  if (!(length > 0.0) || !(std::isfinite(unit) || mean == 0.0)) return 1.0;
  if (!(unit > 0.0)) return 0.0;
  using Doubles = boost::math::policies::policy<boost::math::policies::promote_double<false>>;
  const double all =
      boost::math::gamma_q(0.5 * mean / unit, 0.5 * length * length / unit, Doubles());
  return std::max(all, std::erfc(length / (sigma[0] * std::numbers::sqrt2)));
}

/// The probability that a pose with these deviations is beyond the limit from another pose.
/// @param metres, radians  between the pose and the other one
double beyond(const AlertLimit& limit, const PoseConfidence& confidence, double metres,
              double radians) {
  return std::min(1.0, longer_than(limit.metres - metres, confidence.sigma_translation) +
                           longer_than(limit.radians - radians, confidence.sigma_rotation));
}

struct Case {
  Tracking tracking;
  std::string reason;
  bool is_limit = false;  ///< that a user may set: matching does not count
};

/// What the scan says whatever the risk: tracked if nothing speaks against it.
Case judge_scan(const Hypothesis& best, const Known& known, const LocalizerParams& params,
                const ScanReport& report) {
  constexpr const char* kDoesNotFit = "the scan does not fit the map here";
  using enum Tracking;
  struct Check {
    bool holds;
    Case of;
  };
  const bool elsewhere = known.elsewhere > kLost;
  const ScanScore score = best.score();
  const double moved = best.correction();
  // A limit that was not set is less than any number.
  const std::array checks{
      Check{report.scan_points == 0, {uncertain, "the scan has no points"}},
      Check{!best.alignment, {lost, best.failure}},
      Check{elsewhere && !known.scores_as_usual, {lost, kDoesNotFit}},
      Check{score.coverage < params.min_coverage,
            {lost, "coverage " + std::to_string(score.coverage) + " below min_coverage", true}},
      Check{score.nvtl < params.min_nvtl,
            {lost, "NVTL " + std::to_string(score.nvtl) + " below min_nvtl", true}},
      Check{best.sigma() < params.max_correction && !(moved <= params.max_correction),
            {lost,
             "matching moved the scan by " + std::to_string(moved) + " m, more than max_correction",
             true}},
      // On an open square, a scan fits as well a few metres beside its pose.
      Check{elsewhere, {uncertain, "the scan fits the map as well beside this pose"}},
      Check{!best.fits(), {uncertain, kDoesNotFit}},
      Check{!known.compared,
            {uncertain, with_failure("not compared with the rest of the map yet", report)}}};
  const auto first = std::ranges::find(checks, true, &Check::holds);
  return first == checks.end() ? Case{tracked, ""} : first->of;
}

/// @param place  the part of the risk that is due to other places
Case judge_risk(const Hypothesis& best, const Known& known, const LocalizerParams& params,
                double place, double risk) {
  constexpr double kKnownSpeed = 1.0;  // [m/s]
  using enum Tracking;
  const double speed = best.motion->covariance().diagonal().segment<3>(6).maxCoeff();
  if (risk <= params.max_risk) return {tracked, ""};
  if (!known.upright) return {uncertain, "the sensor would lie on its side here"};
  if (place > params.max_risk) return {uncertain, "other poses are not ruled out yet"};
  if (speed > kKnownSpeed * kKnownSpeed) {
    return {uncertain, "the speed of the sensor is not known yet"};
  }
  return {uncertain, "the scan leaves open where along one direction the sensor is"};
}

}  // namespace

std::string with_failure(std::string reason, const ScanReport& report) {
  if (!report.search_failure.empty()) reason += ": " + report.search_failure;
  return reason;
}

PoseMatrix published_covariance(const MotionFilter& motion) {
  constexpr double kRepeated = 1.5;  // chosen on the recorded street
  return kRepeated * motion.pose_covariance();
}

MotionFilter conclude(const std::vector<Hypothesis>& hypotheses, const Known& known,
                      const MotionInputs& inputs, const MotionNoise& noise,
                      const LocalizerParams& params, ScanReport& report) {
  const AlertLimit limit = AlertLimit::of(params);
  const Hypothesis& best = hypotheses.front();
  report.alignment = best.alignment;
  if (report.map_points > 0) {
    report.lcp = best.score().fitness / static_cast<double>(report.map_points);  // Eq. 13
  }
  Case decided = judge_scan(best, known, params, report);
  const MotionFilter moved = best.moved();
  const MotionFilter& motion = decided.is_limit ? *best.motion : moved;
  // A pose at the stamp is as sure as the speed that leads to it from the middle of the sweep.
  report.confidence = confidence_of(published_covariance(motion.at(report.stamp, inputs, noise)));
  const auto wrong_if = [&](const Hypothesis& one, const MotionFilter& there,
                            const PoseConfidence& confidence) {
    const Pose reported = motion.pose(), pose = there.pose();
    return one.belief * beyond(limit, confidence, (reported.translation - pose.translation).norm(),
                               rotation_between(reported, pose));
  };
  double place = known.elsewhere;
  for (std::size_t h = 1; h < hypotheses.size(); ++h) {
    const MotionFilter other = hypotheses[h].moved();
    place += wrong_if(hypotheses[h], other, confidence_of(published_covariance(other)));
  }
  report.risk = std::min(1.0, place + wrong_if(best, moved, *report.confidence));
  report.compared = known.compared;
  if (decided.tracking == Tracking::tracked) {
    decided = judge_risk(best, known, params, place, report.risk);
  }
  report.tracking = decided.tracking;
  report.reason = std::move(decided.reason);
  return motion;
}

}  // namespace vantage
