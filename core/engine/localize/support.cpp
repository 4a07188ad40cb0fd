#include "localize/support.hpp"

#include <algorithm>
#include <cmath>

namespace vantage {
namespace {

// However clear the evidence: odds that reached 0 could never recover.
constexpr double kLeast = -60.0;
constexpr double kLeastMargin = -1.0;  // of a scan in the mean

/// What part of a mean a new value is. @param all  the weights in the mean; takes that of the value
double part_of_mean(double weight, double& all) {
  all = std::min<double>(kMeanOf, all + weight);
  return weight / all;
}

}  // namespace

void Support::take(double told, double news) {
  far_ = std::clamp<double>(far_ + news * told, kLeast, kMostFar);
  // A pose that scans refuted, and that fits again, may have been led astray.
  const double refuted = std::log(kDoubt);
  if (prior_ + far_ >= refuted) return;
  prior_ = std::min(prior_, refuted);
  searched_ = 0.0;
}

void Support::take(const Evidence& evidence, double news) {
  const double precision = weight_of_share(evidence);
  const double weight = news * precision * precision;
  if (!(weight > 0.0)) return;
  Evidence bounded = evidence;  // one bad scan does not outweigh all others
  bounded.share = std::clamp(evidence.share, 0.0, kMostShare);
  bounded.margin = std::max(kLeastMargin, evidence.margin);
  const double part = part_of_mean(weight, scans_);
  for (double Evidence::*const value : {&Evidence::share, &Evidence::noise, &Evidence::bias,
                                        &Evidence::margin, &Evidence::margin_noise}) {
    mean_.*value = std::lerp(mean_.*value, bounded.*value, part);
  }
  lookalike_ = odds_of_lookalike(mean_, among_);
}

void Support::take(const Contrast& contrast) {
  const double part = part_of_mean(weight_of(contrast), contrasts_);
  Contrast mean = contrast_.value_or(contrast);
  for (double Contrast::*const value : {&Contrast::summit, &Contrast::slope, &Contrast::noise}) {
    mean.*value = std::lerp(mean.*value, contrast.*value, part);
  }
  contrast_ = mean;
}

void Support::start_anew() {
  scans_ = contrasts_ = 0.0;
  searched_ = 0.0;
}

void Support::be_found(double missed) {
  prior_ = std::max(prior_, std::log(kRecall));
  searched_ = std::max(searched_, -std::log(missed));
}

void Support::favour(double log_odds) { relative_ = std::max(kLeast, relative_ + log_odds); }

void Support::doubt(double log_odds) {
  const double far = std::exp(log_prior() - log_odds) - lookalike_.elsewhere;
  if (far > std::exp(-far_)) far_ = std::max(kLeast, -std::log(far));
}

double Support::log_odds() const {
  return log_prior() + std::max(kLeast, -std::log(std::exp(-far_) + lookalike_.elsewhere));
}

double Support::odds_near() const {
  return std::min(std::exp(-kLeast), ratio_of_contrasts() * lookalike_.near);
}

double Support::ratio_of_contrasts() const { return contrast_ ? ratio_of_twin(*contrast_) : 1.0; }

}  // namespace vantage
