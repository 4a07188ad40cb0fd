#include "localize/weighing.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "vantage/kit/evenly_picked.hpp"

namespace vantage {
namespace {

// A hypothesis beyond doubt is weighed after this way [m] or time [s].
constexpr double kSettledWay = 1.0, kSettledTime = 1.0, kSettledRisk = 2e-4;
// The fit of scans to themselves changes with the surroundings [m].
constexpr double kSurroundings = 25.0;
constexpr std::size_t kScored = 512;
constexpr double kBelieved = 0.5;

/// log(p(deviation | expected) / p(deviation | anything)), at most 0, for the square of a distance
/// in standard deviations. A deviation of the usual size says nothing.
double log_ratio_of_deviation(double squared) {
  constexpr double kUsual = 6.0;  // of a pose, which has six of them
  return std::max(std::log(kOutlier), std::min(0.0, 0.5 * (kUsual - squared)));
}

/// How many independent scans a scan so far from the last one counts for, at least.
double news_of(double metres) { return std::max<double>(metres, kSameMetres) / kBasin; }

}  // namespace

double agreement(const Pose& pose, const PosePrior& prior, bool searched) {
  double squared = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double off = pose.translation[axis] - prior.T_map_sensor.translation[axis];
    squared += off * off / (prior.sigma_translation[axis] * prior.sigma_translation[axis]);
  }
  const double turned =
      std::remainder(heading_of(pose) - heading_of(prior.T_map_sensor), 2.0 * std::numbers::pi);
  squared += turned * turned / (prior.sigma_heading * prior.sigma_heading);
  const double ratio = log_ratio_of_deviation(squared);
  return searched ? std::max(ratio, std::log(kOutlier / (1.0 - kRecall))) : ratio;
}

double agreement(const Pose& pose, const std::optional<Eigen::Vector3d>& up) {
  const bool stands = !up || up_of(pose).dot(up->normalized()) > std::numbers::sqrt2 / 2.0;
  return stands ? 0.0 : std::log(kOutlier);
}

double doubt_of_prediction(const Hypothesis& best) {
  // At each independent scan, the sensor may be at a place that looks alike.
  const double way = (best.predicted().translation - best.last.translation).norm();
  const double carried = kAlike * news_of(way);
  if (best.initial) return carried;
  // All around is matched, too; a prediction vaguer than that may be anywhere.
  const double reach = reach_of(best.sigma());
  const double corrected = kBasin + (2.0 * best.sigma() <= reach + 1.0 ? reach : 0.0);
  return std::min(1.0 - kDoubt,
                  carried + std::erfc(corrected / (best.sigma() * std::numbers::sqrt2)));
}

PointCloud Weighing::scored(const PreparedScan& scan) {
  return evenly_picked(scan.points, kScored);
}

bool Weighing::is_surprising(const Hypothesis& one) const {
  const double usual = std::max(usual_change_, noise_of_level(kScored));
  return (!one.initial && one.is_surprised()) || rise(one) < -kUnusual * usual;
}

double Weighing::rise(const Hypothesis& one) const {
  constexpr double kLeastLevel = 1e-6;
  if (!one.alignment || !(last_level_ > 0.0)) return 0.0;
  return std::log(std::max(level_of(*one.alignment), kLeastLevel) / last_level_);
}

bool Weighing::scores_as_usual(const Hypothesis& one) const {
  const double perfect = reference_ ? reference_->level : 0.0;
  const double usual = usual_level_ > 0.0 ? usual_level_ : perfect;
  return one.alignment && usual > 0.0 && level_of(*one.alignment) >= (1.0 - kChange) * usual;
}

bool Weighing::is_due(const std::vector<Hypothesis>& hypotheses, double belief) const {
  const Hypothesis& first = hypotheses.front();
  return hypotheses.size() > 1 || !weighed_at_ || !first.alignment || adrift_ ||
         1.0 - belief > kSettledRisk || is_surprising(first) ||
         (first.pose().translation - *weighed_at_).norm() >= kSettledWay ||
         first.motion->stamp() - weighed_stamp_ >= kSettledTime;
}

Result<void> Weighing::measure(const PreparedScan& scan, std::vector<Hypothesis>& hypotheses) {
  fresh_ = false;
  const PointCloud some = scored(scan);
  const Pose first = hypotheses.front().pose();
  if (!reference_ || (first.translation - reference_at_).norm() >= kSurroundings) {
    VANTAGE_CHECK(renew_reference(scan, first));
  }
  for (;;) {
    for (Hypothesis& one : hypotheses) VANTAGE_CHECK(measure(one, some, reference_));
    // A poor fit may come from an old reference.
    const auto fits = [](const Hypothesis& one) { return one.told >= 0.0; };
    if (fresh_ || std::ranges::any_of(hypotheses, fits)) break;
    VANTAGE_CHECK(renew_reference(scan, first));
  }
  for (Hypothesis& one : hypotheses) VANTAGE_CHECK(measure_contrast(one, some));
  return {};
}

Result<void> Weighing::measure(const PreparedScan& scan, const Fit& to_itself,
                               Hypothesis& found) const {
  const PointCloud some = scored(scan);
  VANTAGE_CHECK(measure(found, some, to_itself));
  return measure_contrast(found, some);
}

Result<void> Weighing::measure(Hypothesis& one, PointsView some,
                               const std::optional<Fit>& reference) const {
  one.evidence.reset();
  one.is_refuted = one.silent = false;
  one.told = some.empty() || one.alignment ? 0.0 : std::log(kDoubt);  // off the map, or covered
  if (some.empty() || !one.alignment || !reference) return {};
  VANTAGE_TRY(const Fit fit, fit_at(*one.map->target, some, one.alignment->T_map_scan, limit_));
  one.evidence = evidence_of(fit, *reference);
  one.is_refuted = log_likelihood_ratio(*one.evidence) < 0.0;
  one.silent = one.belief >= kBelieved && one.is_refuted && scores_as_usual(one);
  // Where nothing holds the matcher, its wandering says nothing either.
  one.told = one.silent
                 ? log_likelihood_ratio_of_margin(*one.evidence)
                 : log_ratio_to_far(*one.evidence) + log_ratio_of_deviation(one.innovation());
  return {};
}

Result<void> Weighing::measure_contrast(Hypothesis& one, PointsView some) const {
  one.contrast.reset();
  const auto is_due = [&] {
    return one.is_new || !one.contrast_at || one.support.shows_twin() ||
           (one.pose().translation - *one.contrast_at).norm() >= kBasin;
  };
  if (!one.evidence || !is_due()) return {};
  const Pose& T_map_scan = one.alignment->T_map_scan;
  VANTAGE_TRY(one.contrast,
              contrast_at(*one.map->target, some, T_map_scan, limit_.metres, *one.evidence));
  one.contrast_at = T_map_scan.translation;
  return {};
}

void Weighing::take(std::vector<Hypothesis>& hypotheses) {
  const Hypothesis& first = hypotheses.front();
  const Point at = first.pose().translation;
  const bool adrift = first.evidence ? !first.silent && !first.fits() : first.told < 0.0;
  const bool anew = std::exchange(adrift_, adrift) != adrift || !weighed_at_;
  news_ = anew ? 1.0 : std::min(1.0, news_of((at - *weighed_at_).norm()));
  weighed_at_ = at;
  weighed_stamp_ = first.motion->stamp();
  for (Hypothesis& one : hypotheses) take(one, news_);
}

void Weighing::take(Hypothesis& one, double news) const {
  if (one.contrast) one.support.take(*one.contrast);
  one.support.take(one.told, news);
  if (one.evidence && !one.silent) one.support.take(*one.evidence, news);
}

void Weighing::compare(std::vector<Hypothesis>& hypotheses) const {
  const auto evidence = [](const Hypothesis& one) { return one.evidence.value_or(Evidence{}); };
  const auto share = [&](const Hypothesis& one) { return std::max(0.0, evidence(one).share); };
  const auto error = [&](const Hypothesis& one) {
    return std::hypot(evidence(one).noise, evidence(one).bias);
  };
  const auto best = std::ranges::max_element(hypotheses, {}, share);
  if (best == hypotheses.end() || share(*best) <= 0.0) return;
  for (Hypothesis& one : hypotheses) {
    if (one.silent) continue;
    // A smaller difference may come from noise, or from the elements that the maps happen to have.
    const double by_chance = std::hypot(error(*best), error(one));
    const double worse = std::max(0.0, share(*best) - share(one) - by_chance) / share(*best);
    // Scans near each other tell two poses apart by the same points.
    const double news = best->is_new || one.is_new ? 1.0 : news_;
    one.support.favour(-news * kPreference * worse);
  }
}

Result<void> Weighing::renew_reference(const PreparedScan& scan, const Pose& T_map_scan) {
  VANTAGE_TRY(reference_, fit_to_itself(*matcher_, scan.finite, scored(scan), up_of(T_map_scan)));
  reference_at_ = T_map_scan.translation;
  fresh_ = true;
  return {};
}

void Weighing::learn(const Hypothesis& first, bool tracked) {
  constexpr double kNew = 0.5 / kMeanOf;
  const double change = std::abs(rise(first));
  if (first.alignment) last_level_ = level_of(*first.alignment);
  if (!tracked) return;
  if (change > 0.0) {  // one jump of the level does not make jumps usual
    usual_change_ = std::lerp(usual_change_, std::min(change, kUnusual * usual_change_), kNew);
  }
  usual_level_ = usual_level_ == 0.0 ? last_level_ : std::lerp(usual_level_, last_level_, kNew);
}

}  // namespace vantage
