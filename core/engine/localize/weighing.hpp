#pragma once

#include <optional>
#include <vector>

#include "localize/hypothesis.hpp"
#include "vantage/engine/prepared_scan.hpp"
#include "vantage/engine/region_maps.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// log(p(prior | pose) / p(prior | elsewhere within three sigma)), in [-10, 0]; 0 without a prior.
[[nodiscard]] double agreement(const Pose& pose, const std::optional<PosePrior>& prior);

/// Whether matching pulled a pose much farther from its prediction than motion explains: the sensor
/// may have been carried to a place that looks alike.
[[nodiscard]] bool is_surprising(const Hypothesis& one);

/// Says how much a scan speaks for each hypothesis.
class Weighing {
 public:
  /// Matcher and maps must outlive the object.
  Weighing(const ScanMatcher& matcher, const RegionMaps& maps, const ShareModel& model)
      : matcher_(matcher), maps_(maps), model_(model) {}

  /// Whether there is anything to be learnt: a hypothesis beyond doubt needs weighing only now and
  /// then, or if its fit becomes worse.
  /// @param belief  in the first of the hypotheses
  [[nodiscard]] bool is_due(const std::vector<Hypothesis>& hypotheses, double belief) const;

  /// log(p(scan | hypothesis right) / p(scan | wrong)) for each of the hypotheses; fills in their
  /// evidence. Scans that are taken side by side share their errors and count less. Hypotheses are
  /// not compared with each other.
  /// Errors: those of the matcher and of RegionMaps::borrow.
  [[nodiscard]] Result<std::vector<double>> operator()(const PreparedScan& scan,
                                                       const std::optional<PosePrior>& prior,
                                                       std::vector<Hypothesis>& hypotheses);

  /// Compares the hypotheses with each other: of several poses for one scan, the wrong ones fit
  /// worse than the right one. For each, what its fit falls short of the best one's says; no more
  /// than 0.
  [[nodiscard]] std::vector<double> compare(const std::vector<Hypothesis>& hypotheses) const;

  /// log(p(scan | pose right) / p(scan | wrong)) for a pose that a search found.
  [[nodiscard]] double of(const Evidence& evidence, const Pose& pose,
                          const std::optional<PosePrior>& prior) const;

  /// The points of a scan that are scored, and the fit of the scan to itself; no fit for a scan
  /// that is too sparse. Errors: those of the matcher.
  [[nodiscard]] static PointCloud scored(const PreparedScan& scan);
  [[nodiscard]] Result<std::optional<Fit>> reference(const PreparedScan& scan) const;

  /// Learns what is usual from a scan that is tracked.
  void learn(const Hypothesis& tracked);
  /// Forgets everything.
  void forget();

 private:
  [[nodiscard]] Result<void> renew_reference(const PreparedScan& scan, const Point& at);
  [[nodiscard]] Result<double> ratio(Hypothesis& one, PointsView some,
                                     const std::optional<PosePrior>& prior) const;

  const ScanMatcher& matcher_;
  const RegionMaps& maps_;
  ShareModel model_;
  std::optional<double> usual_share_;  // of recent tracked scans
  double usual_level_ = 0.0;
  std::optional<Fit> reference_;  // the fit to itself of the scan at `reference_at_`
  Point reference_at_ = Point::Zero();
  std::optional<Point> weighed_at_;  // where the first hypothesis was weighed last
  double share_ = 0.0;               // evidence of the first hypothesis then
  double news_ = 1.0;                // how much the last scan counted, in [0, 1]
};

}  // namespace vantage
