#pragma once

#include <string>
#include <vector>

#include "localize/hypothesis.hpp"
#include "vantage/engine/localizer.hpp"
#include "vantage/engine/localizer_params.hpp"

namespace vantage {

/// What is known of the hypotheses.
struct Known {
  double elsewhere = 0.0;        ///< belief that the sensor is at none of them
  bool compared = false;         ///< the hypotheses, with all other places of the map
  bool scores_as_usual = false;  ///< the scan, at the best hypothesis
  bool upright = true;           ///< at the best hypothesis
};

/// A reason, and why the search did not mend it, if it failed.
[[nodiscard]] std::string with_failure(std::string reason, const ScanReport& report);

/// The covariance that is reported of a pose. Errors of the map and of the place repeat from scan
/// to scan; the filter takes them for new at every scan, and averages them away.
[[nodiscard]] PoseMatrix published_covariance(const MotionFilter& motion);

/// Turns the beliefs in the hypotheses into the report of a scan: fills in the alignment, the
/// confidence, the risk, the state and its reason. The risk is
/// sum of w_i P(the reported pose is beyond the alert limit | hypothesis i) + w_elsewhere.
/// @param hypotheses     the first is reported
/// @param inputs, noise  of the motion
/// @param report  already has its stamp, the region and the number of its points
/// @return        the motion that the report stands for: with the scan, or without it
[[nodiscard]] MotionFilter conclude(const std::vector<Hypothesis>& hypotheses, const Known& known,
                                    const MotionInputs& inputs, const MotionNoise& noise,
                                    const LocalizerParams& params, ScanReport& report);

}  // namespace vantage
