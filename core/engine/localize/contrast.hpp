#pragma once

#include <optional>

#include "localize/evidence.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {

/// How much better a scan fits at a pose than elsewhere around it. It shows maps that hold a place
/// twice, a step apart, and poses beside the right one.
struct Contrast {
  /// The level at the pose less that of the highest other summit around it, from the alert limit to
  /// 2 m off, as a part of the sharpness: in plan view, and up to 5 m above and below if the scan
  /// fits better there. Mostly above 0.5 at a right pose, about 0 where another place is as good. 1
  /// without another summit.
  double summit;
  /// The same, less the highest level there, on a slope or not: about 0.5 at a right pose, and
  /// about 0 where two places are so near to each other that their summits merge.
  double slope;
  double noise;  ///< standard deviation of both
};

/// @param scan   points that are scored, sensor frame [m]
/// @param limit  poses that are nearer than this count as the same [m]
/// @param evidence  of the scan at the pose
/// @return       nothing where a scan fits about as well everywhere
/// Errors: those of MatchTarget::score and, except `too_few_matches`, of MatchTarget::align.
[[nodiscard]] Result<std::optional<Contrast>> contrast_at(const MatchTarget& target,
                                                          PointsView scan, const Pose& T_map_scan,
                                                          double limit, const Evidence& evidence);

/// How much more probable a contrast is if another place around the pose is as good than if no
/// place is.
[[nodiscard]] double ratio_of_twin(const Contrast& contrast) noexcept;

/// What a contrast counts in a mean, in (0, 1]: little for a scan without structure.
[[nodiscard]] double weight_of(const Contrast& contrast) noexcept;

}  // namespace vantage
