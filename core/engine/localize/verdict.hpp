#pragma once

#include "localize/hypothesis.hpp"
#include "vantage/engine/localizer.hpp"
#include "vantage/engine/localizer_params.hpp"

namespace vantage {

/// What is known of the best hypothesis.
struct Known {
  double belief = 0.0;           ///< in the best hypothesis
  double elsewhere = 0.0;        ///< belief that the sensor is at none of the hypotheses
  bool compared = false;         ///< the hypotheses, with all other places of the map
  bool scores_as_usual = false;  ///< the scan, at the best hypothesis
};

/// Turns the belief in a hypothesis into the report of a scan.
class Verdict {
 public:
  explicit Verdict(const LocalizerParams& params) : params_(params) {}

  /// Fills in the alignment, the confidence, the risk, the state and its reason.
  /// @param inputs, noise  of the motion
  /// @param report  already has its stamp, the region and the number of its points
  /// @return        the motion that the report stands for: with the scan, or without it
  [[nodiscard]] MotionFilter conclude(const Hypothesis& best, const Known& known,
                                      const MotionInputs& inputs, const MotionNoise& noise,
                                      ScanReport& report);

  void forget(bool lost);

 private:
  /// The probability that the pose is off by more than the alert limit although the place is right.
  [[nodiscard]] double imprecision(const PoseConfidence& confidence) const;
  /// Sets the state and its reason. @param fits  whether the scan fits the map at the pose
  void judge(const Hypothesis& best, bool fits, const Known& known, ScanReport& report) const;
  /// Applies the limits that a user may set. @return whether the scan is within them
  [[nodiscard]] bool limit(const Hypothesis& best, ScanReport& report) const;

  LocalizerParams params_;
  bool was_lost_ = false;  // since the last tracked scan
  bool adrift_ = false;    // the last scans that did not fit have not been made good by a firm one
};

}  // namespace vantage
