#include "localize/evidence.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "localize/matched.hpp"
#include "vantage/kit/evenly_picked.hpp"

namespace vantage {
namespace {

constexpr int kAxes = 4;

// The margin is measured with so many points. Its deviation is that of a mean over those of them
// that match.
constexpr std::size_t kAtLimit = 256;

/// The fit without its margin.
/// @param level  the horizontal plane is that of its first two columns, map frame
Result<Fit> fit_along(const MatchTarget& target, PointsView scan, const Pose& T_map_scan,
                      const Eigen::Matrix3d& level) {
  VANTAGE_TRY(const ScanScore here, target.score(scan, T_map_scan));
  Fit fit{.level = level_of(here),
          .noise = noise_of_level(here.coverage * static_cast<double>(scan.size())),
          .compared = here.compared};
  const auto level_at = [&](const Point& offset) -> Result<double> {
    Pose moved = T_map_scan;
    moved.translation += level * offset;
    return target.score(scan, moved).map([](const ScanScore& score) { return level_of(score); });
  };
  double beside = -std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < kAxes; ++axis) {
    const double angle = std::numbers::pi * axis / kAxes;
    const Point offset = kBasin * Point(std::cos(angle), std::sin(angle), 0.0);
    VANTAGE_TRY(const double ahead, level_at(offset));
    VANTAGE_TRY(const double behind, level_at(-offset));
    beside = std::max(beside, 0.5 * (ahead + behind));
  }
  fit.sharpness = fit.level - beside;
  return fit;
}

/// Fills in the margin.
Result<void> measure_margin(const MatchTarget& target, PointsView scan, const Pose& T_map_scan,
                            const AlertLimit& limit, Fit& fit) {
  const PointCloud some = evenly_picked(scan, kAtLimit);
  VANTAGE_TRY(const ScanScore here, target.score(some, T_map_scan));
  const double matched = here.coverage * static_cast<double>(some.size());
  fit.margin_noise = noise_of_level(matched);
  if (!(level_of(here) > 0.0)) return {};
  double beside = 0.0;
  for (const Eigen::Index axis : {0, 1, 2}) {
    for (const double side : {-1.0, 1.0}) {
      const Point direction = side * Point::Unit(axis);
      const std::array offs{Pose{.translation = limit.metres * direction},
                            Pose{.rotation = rotation_from_vector(limit.radians * direction)}};
      for (const Pose& off : offs) {
        VANTAGE_TRY(const ScanScore there, target.score(some, T_map_scan * off));
        beside = std::max(beside, level_of(there));
      }
    }
  }
  fit.margin = 1.0 - beside / level_of(here);
  return {};
}

double bounded_share(const Evidence& evidence) {
  return std::clamp(evidence.share, 0.0, kMostShare);
}

/// Density of the share at right poses.
double density_right(const Evidence& evidence) {
  const double x = bounded_share(evidence);
  return x < kLeastRight ? 1.0 / kMostShare : 1.0 / (x * std::log(kMostShare / kLeastRight));
}

/// Little structure makes wrong poses look as sharp as right ones. So does a share that is mostly
/// an estimate.
double scale_of_wrong(double scale, const Evidence& evidence) {
  return std::hypot(scale, std::hypot(evidence.noise, evidence.bias));
}

}  // namespace

double noise_of_level(double matched) noexcept {
  return kPointNoise / std::sqrt(std::max(1.0, matched));
}

AlertLimit AlertLimit::of(const LocalizerParams& params) noexcept {
  return {params.alert_limit, params.alert_limit_deg * std::numbers::pi / 180.0};
}

Eigen::Matrix3d level_axes(const Eigen::Vector3d& up) {
  constexpr double kSteep = 0.9;
  const Eigen::Vector3d ahead =
      std::abs(up.x()) < kSteep ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d left = up.cross(ahead).normalized();
  Eigen::Matrix3d axes;
  axes << left.cross(up), left, up;
  return axes;
}

Result<Fit> fit_at(const MatchTarget& target, PointsView scan, const Pose& T_map_scan,
                   const std::optional<AlertLimit>& limit) {
  const Eigen::Matrix3d level =
      T_map_scan.rotation.toRotationMatrix() * level_axes(up_of(T_map_scan));
  VANTAGE_TRY(Fit fit, fit_along(target, scan, T_map_scan, level));
  if (limit) VANTAGE_CHECK(measure_margin(target, scan, T_map_scan, *limit, fit));
  return fit;
}

Result<std::optional<Fit>> fit_to_itself(const ScanMatcher& matcher, PointsView all,
                                         PointsView some, const Eigen::Vector3d& up) {
  if (some.empty()) return std::optional<Fit>();
  VANTAGE_TRY(const auto target, if_matched(matcher.prepare(all)));
  if (!target) return std::optional<Fit>();
  VANTAGE_TRY(const Fit fit, fit_along(**target, some, Pose{}, level_axes(up)));
  return std::optional<Fit>(fit);
}

Evidence evidence_of(const Fit& fit, const Fit& to_itself) noexcept {
  constexpr double kLeast = 1e-3;  // of the level: no structure at all
  const double perfect = std::max(to_itself.sharpness, kLeast * to_itself.level);
  Evidence evidence{.margin = fit.margin, .margin_noise = fit.margin_noise};
  if (!(perfect > 0.0)) {
    evidence.noise = 1.0;
    return evidence;
  }
  evidence.sharpness = fit.sharpness;
  evidence.share = fit.sharpness / perfect;
  evidence.noise = to_itself.noise * to_itself.level / perfect;
  evidence.bias = kChange * (1.0 - fit.compared);
  return evidence;
}

double log_ratio_to_far(const Evidence& evidence) {
  const double scale = scale_of_wrong(kFarScale, evidence);
  const double far = std::exp(-bounded_share(evidence) / scale) / scale;
  const double ratio = std::log(density_right(evidence) / far);
  return log_likelihood_ratio_of_margin(evidence) +
         (ratio < 0.0 ? ratio * weight_of_share(evidence) : ratio);
}

LookalikeOdds odds_of_lookalike(const Evidence& evidence, const Lookalikes& among) {
  const double x = bounded_share(evidence);
  const double scale = scale_of_wrong(among.scale, evidence);
  // The best of several has the density of their maximum. A share below its mode is no better.
  const double above = std::min(std::exp(-x / scale), 1.0 / std::max(1.0, among.count));
  const double others = among.count > 1.0 ? std::pow(1.0 - above, among.count - 1.0) : 1.0;
  const double similar = among.count * others * above / scale;
  const double q = std::exp(log_likelihood_ratio_of_margin(evidence));
  return {(similar / density_right(evidence) + kAlike) / q, kOutlier / q};
}

double log_likelihood_ratio(const Evidence& evidence) {
  const LookalikeOdds odds = odds_of_lookalike(evidence, {});
  return -std::log(std::exp(-log_ratio_to_far(evidence)) + odds.elsewhere + odds.near);
}

double weight_of_share(const Evidence& evidence) noexcept {
  return std::min(1.0, kFarScale / evidence.noise);
}

double log_likelihood_ratio_of_margin(const Evidence& evidence) {
  const double noise = std::hypot(evidence.margin_noise, evidence.bias);
  if (evidence.margin >= 0.0 || !(noise > 0.0)) return 0.0;
  // The mean of the highest of twelve noisy differences, in deviations of a single level.
  constexpr double kHighestOfTwelve = 1.63 * std::numbers::sqrt2;
  const double below = -evidence.margin / noise - kHighestOfTwelve;
  // A right pose's margin is below 0 by noise only, but for a few poses.
  const double by_noise = 0.5 * std::erfc(below / std::numbers::sqrt2);
  const double q = std::lerp(by_noise, std::exp(evidence.margin / kChange), kAlike);
  return std::log(std::max(std::numeric_limits<double>::min(), q));
}

}  // namespace vantage
