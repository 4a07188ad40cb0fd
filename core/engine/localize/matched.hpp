#pragma once

#include <cmath>
#include <optional>
#include <utility>

#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {

/// A matcher's answer; nothing if it found too few matches.
template <class T>
[[nodiscard]] Result<std::optional<T>> if_matched(Result<T> answer) {
  if (answer) return std::optional<T>(*std::move(answer));
  if (answer.error().code == ErrorCode::too_few_matches) return std::optional<T>();
  return fail(std::move(answer).error());
}

/// Whether an alignment has a rigid pose and finite numbers. A plugin may return others.
[[nodiscard]] inline bool is_sound(const Alignment& alignment) {
  const ScanScore& score = alignment.score;
  return is_valid(alignment.T_map_scan) && alignment.hessian.allFinite() &&
         std::isfinite(score.fitness) && std::isfinite(score.nvtl) && std::isfinite(score.coverage);
}

/// Where a scan is aligned to; nothing if nothing matches there.
/// Errors: those of MatchTarget::align, except `too_few_matches`.
[[nodiscard]] inline Result<std::optional<Alignment>> aligned_at(const MatchTarget& target,
                                                                 PointsView scan,
                                                                 const Pose& start) {
  VANTAGE_TRY(auto alignment, if_matched(target.align(scan, start)));
  if (alignment && !is_sound(*alignment)) alignment.reset();
  return alignment;
}

}  // namespace vantage
