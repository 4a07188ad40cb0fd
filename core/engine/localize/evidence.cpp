#include "localize/evidence.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace vantage {
namespace {

constexpr double kBeside = 2.0;  // [m]; farther than a matcher's basin of one voxel
constexpr int kAxes = 4;

constexpr double kScoreNoise = 0.012;  // of the level, with 512 points
constexpr double kBias = 0.15;         // of the share, if hardly a point was compared
constexpr double kAnything = 0.2;      // share of right poses about which nothing is assumed
constexpr double kSpread = 0.35;       // of the logarithm of the share, from scan to scan

double normal_of_log(double x, double median) {
  const double z = std::log(x / median) / kSpread;
  return std::exp(-0.5 * z * z) / (x * kSpread * std::sqrt(2.0 * std::numbers::pi));
}

}  // namespace

Result<Fit> fit_at(const MatchTarget& target, PointsView scan, const Pose& T_map_scan) {
  Fit fit;
  const auto level_at = [&](const Point& offset) -> Result<double> {
    Pose moved = T_map_scan;
    moved.translation += T_map_scan.rotation.toRotationMatrix() * offset;
    VANTAGE_TRY(const ScanScore score, target.score(scan, moved));
    if (offset == Point::Zero()) fit.compared = score.compared;
    return score.nvtl * score.coverage;
  };
  VANTAGE_TRY(fit.level, level_at(Point::Zero()));
  double beside = -std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < kAxes; ++axis) {
    const double angle = std::numbers::pi * axis / kAxes;
    const Point offset = kBeside * Point(std::cos(angle), std::sin(angle), 0.0);
    VANTAGE_TRY(const double ahead, level_at(offset));
    VANTAGE_TRY(const double behind, level_at(-offset));
    beside = std::max(beside, 0.5 * (ahead + behind));
  }
  fit.sharpness = fit.level - beside;
  return fit;
}

Result<std::optional<Fit>> fit_to_itself(const ScanMatcher& matcher, PointsView all,
                                         PointsView some) {
  if (some.empty()) return std::optional<Fit>();
  auto target = matcher.prepare(all);
  if (!target) {
    if (target.error().code == ErrorCode::too_few_matches) return std::optional<Fit>();
    return fail(std::move(target).error());
  }
  VANTAGE_TRY(const Fit fit, fit_at(**target, some, Pose{}));
  return std::optional<Fit>(fit);
}

Evidence evidence_of(const Fit& fit, const Fit& to_itself) noexcept {
  constexpr double kLeast = 1e-3;  // of the level: no structure at all
  const double perfect = std::max(to_itself.sharpness, kLeast * to_itself.level);
  if (!(perfect > 0.0)) return {.share = 0.0, .noise = 1.0};
  return {.share = fit.sharpness / perfect,
          .noise = kScoreNoise * to_itself.level / perfect,
          .bias = kBias * (1.0 - fit.compared)};
}

double log_likelihood_ratio(const Evidence& evidence, std::optional<double> usual,
                            const ShareModel& model) {
  const double x = std::clamp(evidence.share, 0.0, model.most_right);
  // Little structure makes wrong poses look as sharp as right ones.
  // So does a share that is mostly an estimate.
  const double error = std::hypot(evidence.noise, evidence.bias);
  const double scale = std::hypot(model.wrong_scale, error);
  const double similar = std::hypot(model.similar_scale, error);
  const double wrong = (1.0 - model.similar) * std::exp(-x / scale) / scale +
                       model.similar * std::exp(-x / similar) / similar;
  const double floor = 1.0 / model.most_right;
  const double any =
      x < model.least_right ? floor : 1.0 / (x * std::log(model.most_right / model.least_right));
  const double right =
      kAnything * floor +
      (1.0 - kAnything) * (usual && x > 0.0 ? 0.5 * (normal_of_log(x, *usual) + any) : any);
  // Without structure, nothing can be told from a small share.
  const double told = std::min(1.0, model.wrong_scale / evidence.noise);
  const double ratio = std::log(right / ((1.0 - model.alike) * wrong + model.alike * right));
  return ratio < 0.0 ? std::max(-6.0, ratio) * told : ratio;
}

}  // namespace vantage
