#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "localize/hypothesis.hpp"
#include "vantage/engine/localizer_params.hpp"
#include "vantage/engine/prepared_scan.hpp"
#include "vantage/result.hpp"
#include "vantage/track/sweep_motion.hpp"

namespace vantage {

/// A sweep as one motion of the sensor explains it.
struct Sweep {
  SweepTime time;
  PreparedScan prepared;
  std::optional<SweepMotion> motion;  ///< that `prepared` is undistorted by, if it is
};

struct SweepMatch {
  MotionFilter motion;  ///< the prediction, with what the sweep shows of the twist if it was vague
  std::optional<Alignment> alignment = {};
  PoseMatrix R = PoseMatrix::Zero();  ///< covariance of the pose, from scan to scan
  std::string failure = {};           ///< why there is no alignment
  std::uint32_t passes = 0;
  /// Where else the scan fits, of the places around a vague prediction; not undistorted anew.
  std::vector<Alignment> rivals = {};
};

/// The covariance of the errors of an alignment's pose that are new at every scan.
/// @param points  that were aligned
[[nodiscard]] PoseMatrix noise_of(const Alignment& alignment, std::size_t points,
                                  const LocalizerParams& params);

/// Matches a sweep near a predicted motion. Where that is vague, it is matched all around the
/// prediction, too, and the alignment that scores best is taken: a matcher stops at the next rise.
/// Others that score nearly as high, at other poses, are its rivals (kChange).
/// Where the alignment shows another motion than the sweep was undistorted by, the sweep is
/// undistorted by that motion and matched again, until this no longer moves its points by more than
/// they are noisy. A twist that is vague is measured by the sweep itself: both its halves are
/// aligned, and the sensor went from one to the other.
/// @param sweep  its points are moved
/// Errors: those of MatchTarget::align, except `too_few_matches`.
[[nodiscard]] Result<SweepMatch> match_sweep(const MatchTarget& target,
                                             const MotionFilter& predicted,
                                             const MotionInputs& inputs,
                                             const LocalizerParams& params, Sweep& sweep);

}  // namespace vantage
