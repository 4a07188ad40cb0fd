#pragma once

#include <optional>

#include "localize/verdict_constants.hpp"
#include "vantage/api.hpp"
#include "vantage/engine/localizer_params.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {

/// How well a scan fits a map: the mean likelihood over all its points. A point without a match
/// counts 0.
[[nodiscard]] inline double level_of(const ScanScore& score) noexcept {
  return score.nvtl * score.coverage;
}
/// Standard deviation of the level of so many points that match, as a part of it.
[[nodiscard]] double noise_of_level(double matched) noexcept;

/// How well a scan fits a map at a pose, over all its points.
struct Fit {
  double level = 0.0;  ///< level_of the score at the pose
  double noise = 0.0;  ///< standard deviation of `level`, as a part of it
  /// The level at the pose less the level 2 m beside it. The smallest of these differences counts,
  /// over several horizontal axes. It is about 0 at a wrong pose, however high the level is. It is
  /// also about 0 along a bare wall.
  double sharpness = 0.0;
  /// The level at the pose less the highest level at the alert limit from it, as a part of the
  /// former: the pose is moved along and turned about each of the sensor's three axes, both ways.
  /// Below 0, the scan fits better at the limit than at the pose. 0 if it was not asked for.
  double margin = 0.0;
  double margin_noise = 0.0;  ///< standard deviation of `margin`
  double compared = 1.0;      ///< ScanScore::compared at the pose
};

/// The axes of a sensor without its tilt: x ahead in the horizontal plane, y to the left, z up; in
/// the columns, sensor frame. Where the sensor's x axis is nearly vertical, its z axis is ahead.
/// @param up  sensor frame, of unit length
[[nodiscard]] VANTAGE_API Eigen::Matrix3d level_axes(const Eigen::Vector3d& up);
/// The direction that points up, sensor frame.
[[nodiscard]] inline Eigen::Vector3d up_of(const Pose& T_map_sensor) {
  return T_map_sensor.rotation.toRotationMatrix().row(2);
}

/// How far off a pose may be.
struct AlertLimit {
  double metres, radians;
  [[nodiscard]] static AlertLimit of(const LocalizerParams& params) noexcept;
};

/// @param limit  for the margin
/// Errors: those of MatchTarget::score.
[[nodiscard]] VANTAGE_API Result<Fit> fit_at(const MatchTarget& target, PointsView scan,
                                             const Pose& T_map_scan,
                                             const std::optional<AlertLimit>& limit = {});

/// The fit of a scan to itself. A perfect map would give the same fit.
/// @param all   the points of the scan, sensor frame [m]
/// @param some  those that are scored
/// @param up    sensor frame, of unit length: a fit to the map is compared along the same axes
/// @return      nothing if the scan is too sparse to match anything against
/// Errors: those of the matcher.
[[nodiscard]] VANTAGE_API Result<std::optional<Fit>> fit_to_itself(const ScanMatcher& matcher,
                                                                   PointsView all, PointsView some,
                                                                   const Eigen::Vector3d& up);

/// What a fit says about its pose.
struct Evidence {
  double share = 0.0;  ///< of the sharpness that a perfect map would give
  double noise = 0.0;  ///< standard deviation of `share`: large for a scan with little structure
  /// How far `share` is from that of a map of all elements, root mean square: 0 for such a map.
  double bias = 0.0;
  double margin = 0.0, margin_noise = 0.0;  ///< of the fit
  double sharpness = 0.0;                   ///< Fit::sharpness
};
[[nodiscard]] VANTAGE_API Evidence evidence_of(const Fit& fit, const Fit& to_itself) noexcept;

/// A share is at most that of a perfect map, and what the map may add to it.
inline constexpr double kMostShare = 1.0 + kChange;

/// Wrong poses that fit a little, because a street fits a street. The share of one stays about the
/// same from scan to scan, so further scans do not tell it from a right pose.
struct Lookalikes {
  /// A pose was chosen from so many; below 1: the probability of being one.
  double count = kSimilar;
  double scale = kSimilarScale;  ///< the mean of their shares, which are exponential
};

/// log(p(evidence | pose right) / p(evidence | pose far off)): log(q R), where R is the ratio of
/// the shares' densities, and q = p(margin | right) / p(a margin of at least 0 | right). Scans at
/// different places are independent.
[[nodiscard]] double log_ratio_to_far(const Evidence& evidence);

/// The odds that a pose is wrong in a way that persists, against being right.
struct LookalikeOdds {
  double elsewhere;  ///< one of those that it was chosen from, or a place that is alike
  double near;       ///< beside the right pose, if nothing is known of the contrast
};
/// @param evidence  the mean over independent scans
[[nodiscard]] LookalikeOdds odds_of_lookalike(const Evidence& evidence, const Lookalikes& among);

/// log(p(evidence | pose right) / p(evidence | pose wrong)) of a single scan: -log(1 / (q R) + c),
/// with c the sum of odds_of_lookalike. At most 9.2.
[[nodiscard]] double log_likelihood_ratio(const Evidence& evidence);

/// How much a share says, in [0, 1]: little for a scan without structure.
[[nodiscard]] double weight_of_share(const Evidence& evidence) noexcept;

/// What the margin alone says where the share says nothing: log(q), at most 0.
[[nodiscard]] double log_likelihood_ratio_of_margin(const Evidence& evidence);

}  // namespace vantage
