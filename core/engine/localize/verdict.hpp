#pragma once

#include "localize/hypothesis.hpp"
#include "vantage/engine/localizer.hpp"
#include "vantage/engine/localizer_params.hpp"

namespace vantage {

/// Turns the belief in a hypothesis into what is reported of a scan.
class Verdict {
 public:
  explicit Verdict(const LocalizerParams& params) : params_(params) {}

  /// Fills in the poses, the alignment, the risk, the state and its reason.
  /// @param belief     in the hypothesis
  /// @param elsewhere  belief that the sensor is at none of the hypotheses
  /// @param compared   whether the map was searched for places that look alike
  /// @param report     holds the region and its points
  void conclude(const Hypothesis& best, double belief, double elsewhere, bool compared,
                ScanReport& report);

  void forget(bool lost);

 private:
  /// The probability that the pose is off by more than the alert limit although the sensor is
  /// there.
  /// @param fits  whether the scan fits the map there
  [[nodiscard]] double imprecision(const Hypothesis& best, bool fits, const ScanReport& report);
  /// Applies the limits that a user may set.
  void limit(const Hypothesis& best, ScanReport& report) const;

  LocalizerParams params_;
  bool was_lost_ = false;                   // since the last tracked scan
  double sigma_m_ = 0.0, sigma_rad_ = 0.0;  // of the reported pose; 0 before the first
};

}  // namespace vantage
