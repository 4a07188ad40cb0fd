#pragma once

#include <optional>
#include <vector>

#include "localize/hypothesis.hpp"
#include "vantage/engine/prepared_scan.hpp"
#include "vantage/engine/region_maps.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// log(p(prior | pose) / p(prior | elsewhere within three sigma)), in [-6.9, 0]: one prior in a
/// thousand is wrong, whatever its deviations say.
[[nodiscard]] double agreement(const Pose& pose, const PosePrior& prior);

/// The probability that the sensor is not where the best hypothesis predicts it: it grows with the
/// way since the scan before.
[[nodiscard]] double doubt_of_prediction(const Hypothesis& best);

/// Measures how strongly a scan supports each hypothesis.
class Weighing {
 public:
  /// Matcher and maps must outlive the object.
  Weighing(const ScanMatcher& matcher, const RegionMaps& maps, const ShareModel& model,
           const AlertLimit& limit)
      : matcher_(matcher), maps_(maps), model_(model), limit_(limit) {}

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

  /// log(p(scan | hypothesis right) / p(scan | wrong)) of each hypothesis. The call also sets the
  /// evidence of each. Scans that are taken near each other share their errors, so they count less.
  /// The hypotheses are not compared with each other.
  /// Errors: those of the matcher and of RegionMaps::borrow.
  [[nodiscard]] Result<std::vector<double>> operator()(const PreparedScan& scan,
                                                       std::vector<Hypothesis>& hypotheses);

  /// Compares the hypotheses with each other: for one scan, a wrong pose fits worse than the right
  /// one. The result has a logarithm of a likelihood ratio for each hypothesis. It is 0 for the
  /// best fit, and the lower the more a fit falls short of it.
  [[nodiscard]] std::vector<double> compare(const std::vector<Hypothesis>& hypotheses) const;

  /// log(p(scan | pose right) / p(scan | wrong)) of a pose that a search found.
  [[nodiscard]] double of(const Evidence& evidence) const;

  /// The points of a scan that are scored.
  [[nodiscard]] static PointCloud scored(const PreparedScan& scan);
  /// The fit to itself of the scan that was weighed last, if that scan needed it.
  [[nodiscard]] std::optional<Fit> fresh_reference() const {
    return fresh_ ? reference_ : std::nullopt;
  }

  /// Learns from the hypothesis that is reported which fit is usual.
  void learn(const Hypothesis& first, bool tracked);
  /// Forgets everything.
  void forget();

 private:
  /// Of the level's logarithm since the scan before; 0 without one.
  [[nodiscard]] double rise(const Hypothesis& one) const;
  /// A change of the level's logarithm that is far from usual.
  [[nodiscard]] double unusual_change() const;
  /// Whether a scan that does not fit says nothing: a proven pose scores as before, so its
  /// surroundings have become featureless.
  [[nodiscard]] bool is_silent(const Hypothesis& one) const;
  /// The time of the scan [s].
  [[nodiscard]] static double stamp_of(const Hypothesis& one);
  [[nodiscard]] Result<void> renew_reference(const PreparedScan& scan, const Point& at);
  [[nodiscard]] Result<double> ratio(Hypothesis& one, PointsView some) const;

  const ScanMatcher& matcher_;
  const RegionMaps& maps_;
  ShareModel model_;
  AlertLimit limit_;
  std::optional<double> usual_share_;  // the share of recent tracked scans
  double usual_level_ = 0.0;
  double last_level_ = 0.0;       // of the scan before
  double usual_change_ = 0.0;     // of the level's logarithm, from scan to scan
  std::optional<Fit> reference_;  // how the scan at `reference_at_` fits itself
  Point reference_at_ = Point::Zero();
  bool fresh_ = false;               // the reference is that of the last scan
  std::optional<Point> weighed_at_;  // where the first hypothesis was weighed last
  double weighed_stamp_ = 0.0;       // of that scan
  bool fitted_ = true;               // whether the first hypothesis fitted then
  double told_ = 0.0;                // the first hypothesis's log likelihood ratio then
  double news_ = 1.0;                // how much the last scan counted, in [0, 1]
};

}  // namespace vantage
