#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage::matching {

/// Checks what every matcher requires of a scan and its pose. Errors: those of MatchTarget::align.
[[nodiscard]] inline Result<void> check_scan(PointsView scan, const Pose& T_map_scan) {
  if (scan.empty()) return fail(ErrorCode::too_few_matches, "the scan has no points");
  VANTAGE_CHECK(check_points(scan, "the scan"));
  if (!is_valid(T_map_scan)) {
    return fail(ErrorCode::invalid_input,
                "the scan's pose is not finite or its rotation is not of unit length");
  }
  return {};
}

/// How many scan points must match for an alignment to count.
struct LeastOverlap {
  std::uint32_t matches;
  double coverage;  ///< share of the scan's points

  /// The least number of matches for a scan of `points` points.
  [[nodiscard]] std::size_t of(std::size_t points) const {
    return std::max<std::size_t>(
        matches, static_cast<std::size_t>(std::ceil(coverage * static_cast<double>(points))));
  }
  /// Error: `too_few_matches`, with the message "... scan points have <have> <where>".
  /// @param have   what a matched point has: "a map voxel"
  /// @param where  the pose: "at the guess"
  [[nodiscard]] Result<void> check(std::size_t matched, std::size_t points, const std::string& have,
                                   const char* where) const {
    if (matched >= of(points)) return {};
    return fail(ErrorCode::too_few_matches, std::to_string(matched) + " of " +
                                                std::to_string(points) + " scan points have " +
                                                have + " " + where + "; at least " +
                                                std::to_string(of(points)) + " are needed");
  }
};

}  // namespace vantage::matching
