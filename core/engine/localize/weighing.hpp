#pragma once

#include <optional>
#include <vector>

#include "localize/hypothesis.hpp"
#include "vantage/engine/prepared_scan.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// log(p(prior | pose) / p(prior | elsewhere within three sigma)), in [-7.6, 0]: some priors are
/// wrong, whatever their deviations say (kOutlier).
/// @param searched  the place where the prior says that the sensor is was searched, and the sensor
///                  was not found: a search rules out kRecall of "elsewhere"; in [-4.1, 0]
[[nodiscard]] double agreement(const Pose& pose, const PosePrior& prior, bool searched);

/// The same for the direction that points up: a sensor that would lie on its side or on its back at
/// a pose is hardly there. A tilt of less than 45 degrees says nothing, because robots climb and
/// brake. In [-7.6, 0].
/// @param up  in the sensor frame, if it is known
[[nodiscard]] double agreement(const Pose& pose, const std::optional<Eigen::Vector3d>& up);

/// The probability that the sensor is not where the best hypothesis predicts it: it grows with the
/// way since the scan before.
[[nodiscard]] double doubt_of_prediction(const Hypothesis& best);

/// Measures how strongly a scan supports each hypothesis.
class Weighing {
 public:
  /// @param matcher  must outlive the object
  Weighing(const ScanMatcher& matcher, const AlertLimit& limit)
      : matcher_(&matcher), limit_(limit) {}

  /// Whether this scan needs to be weighed. While one hypothesis is beyond doubt, that is so once a
  /// metre and once a second, because scans nearer to each other say the same.
  /// @param belief  belief in the first hypothesis
  [[nodiscard]] bool is_due(const std::vector<Hypothesis>& hypotheses, double belief) const;

  /// Whether the sensor may have been carried to a place that looks alike: matching pulled the pose
  /// much farther from its prediction than motion explains, or the scan suddenly fits much worse.
  [[nodiscard]] bool is_surprising(const Hypothesis& one) const;

  /// Whether the scan scores about as high as tracked scans did before, or, if there were none, as
  /// high as it would in a perfect map.
  [[nodiscard]] bool scores_as_usual(const Hypothesis& one) const;

  /// Sets the evidence of each hypothesis, and what it tells.
  /// Errors: those of the matcher.
  [[nodiscard]] Result<void> measure(const PreparedScan& scan, std::vector<Hypothesis>& hypotheses);
  /// The same for a pose that a search found.
  /// @param to_itself  the fit of the scan to itself
  [[nodiscard]] Result<void> measure(const PreparedScan& scan, const Fit& to_itself,
                                     Hypothesis& found) const;

  /// Gives every hypothesis the support of the scan that was measured. Scans that are taken near
  /// each other share their errors, so they count less.
  void take(std::vector<Hypothesis>& hypotheses);
  /// The same for a hypothesis alone. @param news  how much the scan counts, in [0, 1]
  void take(Hypothesis& one, double news) const;

  /// Compares the hypotheses with each other: for one scan, a wrong pose fits worse than the right
  /// one. The support of each but the best fit falls, the lower the more its fit falls short.
  void compare(std::vector<Hypothesis>& hypotheses) const;

  /// Whether the scan that was weighed last did not fit.
  [[nodiscard]] bool was_adrift() const noexcept { return adrift_; }

  /// The points of a scan that are scored.
  [[nodiscard]] static PointCloud scored(const PreparedScan& scan);
  /// The fit to itself of the scan that was weighed last, if that scan needed it.
  [[nodiscard]] std::optional<Fit> fresh_reference() const {
    return fresh_ ? reference_ : std::nullopt;
  }

  /// Learns from the hypothesis that is reported which level is usual.
  void learn(const Hypothesis& first, bool tracked);
  /// Forgets everything.
  void forget() { *this = Weighing(*matcher_, limit_); }

 private:
  /// Of the level's logarithm since the scan before; 0 without one.
  [[nodiscard]] double rise(const Hypothesis& one) const;
  [[nodiscard]] Result<void> renew_reference(const PreparedScan& scan, const Pose& T_map_scan);
  /// @param reference  the fit of the points `some` to their scan
  [[nodiscard]] Result<void> measure(Hypothesis& one, PointsView some,
                                     const std::optional<Fit>& reference) const;
  /// Sets the contrast of a hypothesis with evidence, if it is due.
  [[nodiscard]] Result<void> measure_contrast(Hypothesis& one, PointsView some) const;

  const ScanMatcher* matcher_;
  AlertLimit limit_;
  double usual_level_ = 0.0;  // of recent tracked scans
  double last_level_ = 0.0;   // of the scan before
  // Of the logarithm of the level, from scan to scan. At first, a fall by 2 kChange is a surprise.
  double usual_change_ = 2.0 * kChange / kUnusual;
  std::optional<Fit> reference_;  // how the scan at `reference_at_` fits itself
  Point reference_at_ = Point::Zero();
  bool fresh_ = false;               // the reference is that of the last scan
  std::optional<Point> weighed_at_;  // where the first hypothesis was weighed last
  double weighed_stamp_ = 0.0;       // of that scan
  bool adrift_ = false;              // it did not fit then
  double news_ = 1.0;                // how much the last scan counted, in [0, 1]
};

}  // namespace vantage
