#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "localize/support.hpp"
#include "vantage/engine/region_maps.hpp"
#include "vantage/partition.hpp"
#include "vantage/pose.hpp"
#include "vantage/scan_matcher.hpp"
#include "vantage/track/motion_filter.hpp"

namespace vantage {

/// A pose that a sensor may have. All poses are those at the middle of a sweep.
struct Hypothesis {
  std::optional<Pose> initial = {};  ///< a pose that was given or found, before its first scan
  bool is_new = true;                ///< no scan before was matched from it
  Pose last = {};                    ///< the pose at the scan before; `initial` if there is none
  std::optional<MotionFilter> motion = {};      ///< up to this scan, without it
  std::optional<MotionFilter> shown = {};       ///< the same, with the twist that the sweep shows
  RegionId region = {};                         ///< the region whose map this scan is matched to
  std::shared_ptr<const ReadyRegion> map = {};  ///< of the region, held so that it stays ready;
                                                ///< none if it cannot be used
  std::optional<Alignment> alignment = {};
  PoseMatrix R = PoseMatrix::Zero();      ///< covariance of the alignment's pose, from scan to scan
  std::string failure = {};               ///< why there is no alignment
  std::optional<Evidence> evidence = {};  ///< of this scan, if it was weighed
  bool is_refuted = false;                ///< whether that speaks against the pose
  std::optional<Contrast> contrast = {};  ///< of this scan, if it was measured
  std::optional<Point> contrast_at = {};  ///< where that was done last
  double told = 0.0;                      ///< log(p(scan | right) / p(scan | far off)) of this scan
  /// The scan's share says nothing: a pose that is believed in scores as before, so its
  /// surroundings have become featureless.
  bool silent = false;
  Support support = {};
  double belief = 0.0;  ///< the probability of the pose, as update_beliefs sets it

  /// The prediction for this scan.
  [[nodiscard]] Pose predicted() const { return motion ? motion->pose() : last; }
  /// The pose at this scan: aligned if possible, otherwise predicted.
  [[nodiscard]] Pose pose() const { return alignment ? alignment->T_map_scan : predicted(); }
  /// How well the scan fits there; without an alignment, that of a scan that matches nothing.
  [[nodiscard]] ScanScore score() const { return alignment ? alignment->score : ScanScore{}; }
  /// Whether the scan fits the map at this pose. Without evidence, an alignment is enough.
  [[nodiscard]] bool fits() const { return alignment && !is_refuted; }
  /// The motion with this scan. A scan that does not fit says nothing.
  [[nodiscard]] MotionFilter moved() const;
  /// Standard deviation of the predicted position in plan view, along its weakest axis [m].
  [[nodiscard]] double sigma() const;
  /// How far matching moved the predicted position [m]; 0 without an alignment.
  [[nodiscard]] double correction() const {
    return (pose().translation - predicted().translation).norm();
  }
  /// How much farther matching moved the predicted pose than its errors explain: the square of that
  /// distance in standard deviations. 6 is usual; 0 without an alignment or a prediction.
  [[nodiscard]] double innovation() const;
  /// Whether that is so much that the motion must have been another one.
  [[nodiscard]] bool is_surprised() const { return innovation() > MotionFilter::kUnusual; }
};

/// How far around a predicted position a scan is matched, too, because the sensor may be there: in
/// whole metres, 0 where the prediction is sure.
/// @param sigma  of the position along an axis [m]
[[nodiscard]] double reach_of(double sigma);

/// How well a scan fits where it was aligned.
[[nodiscard]] inline double level_of(const Alignment& alignment) noexcept {
  return level_of(alignment.score);
}

/// Whether two poses are nearer to each other than both limits.
[[nodiscard]] inline bool is_near(const Pose& a, const Pose& b, double metres, double radians) {
  return (a.translation - b.translation).norm() < metres && rotation_between(a, b) < radians;
}

/// Whether two poses count as one hypothesis.
[[nodiscard]] inline bool is_same_pose(const Pose& a, const Pose& b) noexcept {
  return is_near(a, b, kSameMetres, kSameRadians);
}

/// Sets the belief in each hypothesis.
/// @return  the belief that the sensor is elsewhere; all beliefs add up to 1
[[nodiscard]] double update_beliefs(std::vector<Hypothesis>& hypotheses);

/// Moves this share of the belief in each hypothesis to elsewhere: the sensor may have been carried
/// away. Scans that fit bring it back.
void doubt(std::vector<Hypothesis>& hypotheses, double share);

/// Orders the hypotheses by belief, and drops those that are refuted, and those beyond `most`.
/// Those that became the same pose become one. The odds that the last one left had shared with the
/// others are its own again.
/// @return  the belief in those that were dropped, which is elsewhere now
[[nodiscard]] double sort_out(std::vector<Hypothesis>& hypotheses, std::size_t most);

/// The direction of the sensor's x axis in plan view [rad].
[[nodiscard]] double heading_of(const Pose& pose);

}  // namespace vantage
