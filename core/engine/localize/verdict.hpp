#pragma once

#include "localize/hypothesis.hpp"
#include "vantage/engine/localizer.hpp"
#include "vantage/engine/localizer_params.hpp"

namespace vantage {

/// Turns the belief in a hypothesis into the report of a scan.
class Verdict {
 public:
  explicit Verdict(const LocalizerParams& params) : params_(params) {}

  /// Fills in the poses, the alignment, the risk, the state and its reason.
  /// @param belief     belief in the best hypothesis
  /// @param elsewhere  belief that the sensor is at none of the hypotheses
  /// @param compared   whether the hypotheses were compared with all other places of the map
  /// @param report     already has the region and the number of its points
  void conclude(const Hypothesis& best, double belief, double elsewhere, bool compared,
                ScanReport& report);

  void forget(bool lost);

 private:
  /// The probability that the pose is off by more than the alert limit although the place is right.
  /// @param fits  whether the scan fits the map at the pose
  [[nodiscard]] double imprecision(const Hypothesis& best, bool fits, const ScanReport& report);
  /// Applies the limits that a user may set.
  void limit(const Hypothesis& best, ScanReport& report) const;

  LocalizerParams params_;
  bool was_lost_ = false;                   // since the last tracked scan
  double sigma_m_ = 0.0, sigma_rad_ = 0.0;  // of the reported pose; 0 before the first
};

}  // namespace vantage
