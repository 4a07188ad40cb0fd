#include "localize/weighing.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "vantage/kit/evenly_picked.hpp"

namespace vantage {
namespace {

// Scans taken this near to each other say the same [m].
constexpr double kIndependent = 2.0, kLeastNews = 0.1;
// But if the log likelihood ratio of the first hypothesis changes by this much, they do not.
constexpr double kChange = 3.0;
// A hypothesis beyond doubt is weighed after this way [m] or time [s].
constexpr double kSettledWay = 1.0, kSettledTime = 1.0, kSettledRisk = 2e-4;
constexpr double kFall = 0.2;  // of the level, where it is still as usual
// The fit of scans to themselves changes with the surroundings [m].
constexpr double kSurroundings = 25.0;
// From one scan to the next, the logarithm of the level hardly changes. A fall by so many times its
// usual change is a surprise: the sensor may have been carried away.
constexpr double kUnusual = 6.0, kFirstChange = 0.05, kLeastChange = 0.01, kLeastLevel = 1e-6;
constexpr std::size_t kScored = 512;
// A scan that matches nothing may come from a place off the map, or from a covered sensor.
constexpr double kNothingFits = -3.0;

/// A wrong pose does not move as the sensor does: matching pulls it about.
double surprise(const Hypothesis& one) {
  constexpr double kMost = 6.0, kUsual = 6.0;
  return -std::min(kMost, 0.5 * std::max(0.0, one.innovation() - kUsual));
}

}  // namespace

double agreement(const Pose& pose, const PosePrior& prior) {
  constexpr double kElsewhere = 3.0;
  constexpr double kWrong = 1e-3;  // of all priors
  double squared = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double off = pose.translation[axis] - prior.T_map_sensor.translation[axis];
    squared += off * off / (prior.sigma_translation[axis] * prior.sigma_translation[axis]);
  }
  const double turned =
      std::remainder(heading_of(pose) - heading_of(prior.T_map_sensor), 2.0 * std::numbers::pi);
  squared += turned * turned / (prior.sigma_heading * prior.sigma_heading);
  return std::clamp(kElsewhere - 0.5 * squared, std::log(kWrong), 0.0);
}

double doubt_of_prediction(const Hypothesis& best) {
  constexpr double kCarriedAway = 3e-5;  // a metre, unnoticed
  constexpr double kLeastWay = 0.3;      // [m]
  constexpr double kBasin = 2.0;         // [m]; matching corrects less than this
  constexpr double kMost = 0.9;
  const double way = (best.predicted().translation - best.last.translation).norm();
  const double carried = kCarriedAway * std::max(kLeastWay, way);
  if (best.initial) return carried;
  // All around is matched, too; a prediction vaguer than that may be anywhere.
  const double reach = reach_of(best.sigma());
  const double corrected = kBasin + (2.0 * best.sigma() <= reach + 1.0 ? reach : 0.0);
  return std::min(kMost, carried + std::erfc(corrected / (best.sigma() * std::numbers::sqrt2)));
}

PointCloud Weighing::scored(const PreparedScan& scan) {
  return evenly_picked(scan.points, kScored);
}

bool Weighing::is_surprising(const Hypothesis& one) const {
  return (!one.initial && one.is_surprised()) || rise(one) < -unusual_change();
}

double Weighing::rise(const Hypothesis& one) const {
  if (!one.alignment || !(last_level_ > 0.0)) return 0.0;
  return std::log(std::max(level_of(*one.alignment), kLeastLevel) / last_level_);
}

double Weighing::unusual_change() const { return kUnusual * std::max(usual_change_, kLeastChange); }

bool Weighing::scores_as_usual(const Hypothesis& one) const {
  if (!one.alignment) return false;
  const double perfect = reference_ ? reference_->level : 0.0;
  const double usual = usual_level_ > 0.0 ? usual_level_ : perfect;
  return usual > 0.0 && level_of(*one.alignment) >= (1.0 - kFall) * usual;
}

bool Weighing::is_silent(const Hypothesis& one) const {
  return one.proven && one.evidence && !fits(*one.evidence) && scores_as_usual(one);
}

double Weighing::stamp_of(const Hypothesis& one) { return one.motion ? one.motion->stamp() : 0.0; }

bool Weighing::is_due(const std::vector<Hypothesis>& hypotheses, double belief) const {
  const Hypothesis& first = hypotheses.front();
  if (hypotheses.size() > 1 || !weighed_at_ || !first.alignment || !fitted_) return true;
  if (1.0 - belief > kSettledRisk || is_surprising(first)) return true;
  return (first.pose().translation - *weighed_at_).norm() >= kSettledWay ||
         stamp_of(first) - weighed_stamp_ >= kSettledTime;
}

Result<std::vector<double>> Weighing::operator()(const PreparedScan& scan,
                                                 std::vector<Hypothesis>& hypotheses) {
  fresh_ = false;
  const PointCloud some = scored(scan);
  const Point at = hypotheses.front().pose().translation;
  if (!reference_ || (at - reference_at_).norm() >= kSurroundings) {
    VANTAGE_CHECK(renew_reference(scan, at));
  }
  std::vector<double> ratios(hypotheses.size(), 0.0);
  for (const bool again : {false, true}) {
    for (std::size_t h = 0; h < hypotheses.size(); ++h) {
      VANTAGE_TRY(ratios[h], ratio(hypotheses[h], some));
    }
    // A poor fit may come from an old reference.
    if (again || fresh_ || std::ranges::max(ratios) >= 0.0) break;
    VANTAGE_CHECK(renew_reference(scan, at));
  }
  news_ =
      weighed_at_ ? std::clamp((at - *weighed_at_).norm() / kIndependent, kLeastNews, 1.0) : 1.0;
  if (std::abs(ratios.front() - told_) > kChange) news_ = 1.0;
  told_ = ratios.front();
  for (double& ratio : ratios) ratio *= news_;
  weighed_at_ = at;
  weighed_stamp_ = stamp_of(hypotheses.front());
  fitted_ = hypotheses.front().fits();
  return ratios;
}

std::vector<double> Weighing::compare(const std::vector<Hypothesis>& hypotheses) const {
  constexpr double kPreference = 15.0;
  const auto share = [](const Hypothesis& one) {
    return one.evidence ? std::max(0.0, one.evidence->share) : 0.0;
  };
  const auto bias = [](const Hypothesis& one) { return one.evidence ? one.evidence->bias : 0.0; };
  std::vector<double> ratios(hypotheses.size(), 0.0);
  const auto best = std::ranges::max_element(hypotheses, {}, share);
  if (best == hypotheses.end() || share(*best) <= 0.0) return ratios;
  for (std::size_t h = 0; h < hypotheses.size(); ++h) {
    if (is_silent(hypotheses[h])) continue;
    // A smaller difference may come from the elements that the two maps happen to have.
    const double by_chance = std::hypot(bias(*best), bias(hypotheses[h]));
    const double worse =
        std::max(0.0, share(*best) - share(hypotheses[h]) - by_chance) / share(*best);
    ratios[h] = -news_ * kPreference * worse;
  }
  return ratios;
}

double Weighing::of(const Evidence& evidence) const {
  return log_likelihood_ratio(evidence, usual_share_, model_);
}

Result<void> Weighing::renew_reference(const PreparedScan& scan, const Point& at) {
  VANTAGE_TRY(reference_, fit_to_itself(matcher_, scan.finite, scored(scan)));
  reference_at_ = at;
  fresh_ = true;
  return {};
}

Result<double> Weighing::ratio(Hypothesis& one, PointsView some) const {
  one.evidence.reset();
  if (some.empty()) return 0.0;  // says nothing
  if (!one.alignment) return kNothingFits;
  if (!reference_) return 0.0;
  VANTAGE_TRY(const auto ready, maps_.borrow(one.region));
  VANTAGE_TRY(const Fit fit, fit_at(*ready->target, some, one.alignment->T_map_scan, limit_));
  one.evidence = evidence_of(fit, *reference_);
  const double told = log_likelihood_ratio(*one.evidence, usual_share_, model_);
  // Where nothing holds the matcher, its wandering says nothing either.
  if (is_silent(one)) return log_likelihood_ratio_of_margin(*one.evidence);
  return told + surprise(one);
}

void Weighing::learn(const Hypothesis& first, bool tracked) {
  constexpr double kNew = 0.1;   // the usual value is that of about the last ten scans
  constexpr double kMost = 4.0;  // one jump of the level does not make jumps usual
  const double before = last_level_;
  if (first.alignment) last_level_ = level_of(*first.alignment);
  if (!tracked) return;
  if (before > 0.0 && last_level_ > 0.0) {
    const double change = std::abs(std::log(last_level_ / before));
    usual_change_ = std::lerp(usual_change_, std::min(change, kMost * usual_change_), kNew);
  }
  usual_level_ = usual_level_ == 0.0 ? last_level_ : std::lerp(usual_level_, last_level_, kNew);
  if (!first.evidence || !(first.evidence->share > 0.0)) return;
  const double share = first.evidence->share;
  usual_share_ = usual_share_ ? std::lerp(*usual_share_, share, kNew) : share;
}

void Weighing::forget() {
  usual_share_.reset();
  usual_level_ = last_level_ = 0.0;
  usual_change_ = kFirstChange;
  reference_.reset();
  fresh_ = false;
  weighed_at_.reset();
  fitted_ = true;
  told_ = 0.0;
  news_ = 1.0;
}

}  // namespace vantage
