#include "localize/share_model.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

namespace vantage {
namespace {

// What the default model counts as, in samples.
constexpr double kPriorSamples = 3000.0, kPriorAlikeSamples = 10000.0;
// Virtual scans are thinner and cleaner than real ones, so that all their shares are larger. Those
// of real scans at right poses are about this (docs/localization.md); a smaller one is kept.
constexpr double kUsualRight = 0.75;
// A wrong pose with this part of a usual right share is alike.
constexpr double kAlikePart = 0.5;

double exponential(double x, double scale) { return std::exp(-x / scale) / scale; }

/// Fits the two exponentials by expectation and maximization, from the default model on.
/// @param weight  how many samples each share stands for
void fit_wrong(const std::vector<double>& shares, double weight, ShareModel& model) {
  constexpr int kSteps = 30;
  const ShareModel prior = model;
  const double prior_similar = kPriorSamples * prior.similar;
  const double prior_other = kPriorSamples - prior_similar;
  for (int step = 0; step < kSteps; ++step) {
    double similar = prior_similar, other = prior_other;
    double similar_sum = prior_similar * prior.similar_scale;
    double other_sum = prior_other * prior.wrong_scale;
    for (const double share : shares) {
      const double x = std::max(0.0, share);
      const double a = model.similar * exponential(x, model.similar_scale);
      const double b = (1.0 - model.similar) * exponential(x, model.wrong_scale);
      const double part = a + b > 0.0 ? a / (a + b) : 1.0;
      similar += weight * part;
      similar_sum += weight * part * x;
      other += weight * (1.0 - part);
      other_sum += weight * (1.0 - part) * x;
    }
    model.similar = similar / (similar + other);
    model.similar_scale = similar_sum / similar;
    model.wrong_scale = other_sum / other;
  }
}

void fit_right(const Calibration& calibration, double unit, ShareModel& model) {
  constexpr double kBelow = 0.5, kLeastShare = 0.01;
  constexpr std::size_t kLow = Calibration::kQuantiles / 16;
  const double low = std::max(kLeastShare, kBelow * unit * calibration.right[kLow]);
  const auto samples = static_cast<double>(calibration.right_samples);
  const double news = samples / (samples + kPriorSamples);
  model.least_right *= std::pow(std::min(1.0, low / model.least_right), news);
}

}  // namespace

ShareModel fitted_model(const Calibration& calibration) {
  ShareModel model;
  if (calibration.right.empty() || calibration.wrong.empty()) return model;
  const double usual = calibration.right[Calibration::kQuantiles / 2];
  const auto samples = static_cast<double>(calibration.wrong_samples);
  const double weight = samples / static_cast<double>(Calibration::kQuantiles);
  const double unit = kUsualRight / std::max(kUsualRight, usual);
  std::vector<double> wrong;
  for (const double share : calibration.wrong) {
    if (usual <= 0.0 || share < kAlikePart * usual) wrong.push_back(unit * share);
  }
  const double alike = weight * static_cast<double>(calibration.wrong.size() - wrong.size());
  model.alike = (kPriorAlikeSamples * model.alike + alike) / (kPriorAlikeSamples + samples);
  fit_wrong(wrong, weight, model);
  fit_right(calibration, unit, model);
  return model;
}

Result<ShareModel> share_model_of(const Bundle& bundle, const PluginChoice& matcher,
                                  const PluginLoader& plugins) {
  VANTAGE_TRY(const std::optional<Atlas> atlas, Atlas::of_bundle(bundle));
  if (!atlas) return ShareModel{};
  VANTAGE_TRY(const MatcherChoice choice, MatcherChoice::of(matcher, plugins));
  return atlas->calibration.matcher == choice ? fitted_model(atlas->calibration) : ShareModel{};
}

}  // namespace vantage
