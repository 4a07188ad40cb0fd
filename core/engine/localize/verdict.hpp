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

  /// Fills in the poses, the alignment, the risk, the state and its reason.
  /// @param report  already has the region and the number of its points
  void conclude(const Hypothesis& best, const Known& known, ScanReport& report);

  void forget(bool lost);

 private:
  /// The probability that the pose is off by more than the alert limit although the place is right.
  /// @param fits  whether the scan fits the map at the pose
  [[nodiscard]] double imprecision(const Hypothesis& best, bool fits, const ScanReport& report);
  /// Sets the state and its reason. @param fits  whether the scan fits the map at the pose
  void judge(const Hypothesis& best, bool fits, const Known& known, ScanReport& report) const;
  /// Applies the limits that a user may set.
  void limit(const Hypothesis& best, ScanReport& report) const;

  LocalizerParams params_;
  /// Standard deviations of a coordinate of the reported pose and of its speed; 0 before the first.
  struct Drift {
    double sigma = 0.0, of_speed = 0.0;

    /// What is left of it when a scan says where the sensor is, `seconds` after the last one.
    void measured(double by_scan, double before, double seconds) noexcept;
    /// How it grows without odometry. @param acceleration  its standard deviation
    void coasts(double seconds, double acceleration) noexcept;
  };

  bool was_lost_ = false;  // since the last tracked scan
  Drift metres_, radians_;
  bool adrift_ = false;  // the last scans that did not fit have not been made good by a firm one
  double stamp_ = 0.0;   // of the last scan [s]
};

}  // namespace vantage
