#pragma once

#include "localize/hypothesis.hpp"
#include "vantage/engine/prepared_scan.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Matches a scan at a hypothesis's predicted pose. Where nothing says how far the sensor came
/// since the scan before (after a start without odometry), it is matched all around the prediction
/// too, and the alignment that scores best is taken: in an open place, a matcher stops at the next
/// rise.
/// @param scan    of the points
/// @param points  prepared, sensor frame [m]
/// Errors: those of MatchTarget::align.
[[nodiscard]] Result<Alignment> align_at_prediction(const Hypothesis& one, const Scan& scan,
                                                    PointsView points);

}  // namespace vantage
