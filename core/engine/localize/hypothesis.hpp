#pragma once

#include <memory>
#include <optional>
#include <string>

#include "localize/evidence.hpp"
#include "localize/motion.hpp"
#include "vantage/engine/region_maps.hpp"
#include "vantage/partition.hpp"
#include "vantage/pose.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {

/// A pose that a sensor may have.
struct Hypothesis {
  Motion motion;
  std::optional<Pose> initial = {};  ///< a pose that was given or found, and is not yet in `motion`
  Pose predicted = {};               ///< the prediction for this scan
  RegionId region = {};              ///< the region whose map this scan is matched to
  std::shared_ptr<const ReadyRegion> map = {};  ///< of the region; held so that it stays ready
  std::optional<Alignment> alignment = {};
  std::string failure = {};  ///< why there is no alignment
  std::optional<Evidence> evidence = {};
  bool proven = false;  ///< was tracked, and has been followed since

  /// The pose at this scan: aligned if possible, otherwise predicted.
  [[nodiscard]] const Pose& pose() const { return alignment ? alignment->T_map_scan : predicted; }
  /// The pose at the scan before.
  [[nodiscard]] const Pose& last() const { return initial ? *initial : motion.pose(); }
  /// How the sensor moved since the scan before; not at all if it was elsewhere then.
  [[nodiscard]] Pose step() const {
    if (initial) return {};
    return motion.pose().inverse() * (fits() ? pose() : predicted);
  }
  /// Whether the scan fits the map at this pose. Without evidence, an alignment is enough.
  [[nodiscard]] bool fits() const { return alignment && (!evidence || vantage::fits(*evidence)); }
  /// How far matching moved the predicted position [m]. Precondition: aligned.
  [[nodiscard]] double correction() const {
    return (alignment->T_map_scan.translation - predicted.translation).norm();
  }
};

/// How well a scan fits where it was aligned.
[[nodiscard]] inline double level_of(const Alignment& alignment) noexcept {
  return alignment.score.nvtl * alignment.score.coverage;
}

/// Whether two poses are nearer to each other than both limits.
[[nodiscard]] inline bool is_near(const Pose& a, const Pose& b, double metres, double radians) {
  return (a.translation - b.translation).norm() < metres && rotation_between(a, b) < radians;
}

/// The direction of the sensor's x axis in plan view [rad].
[[nodiscard]] double heading_of(const Pose& pose);

}  // namespace vantage
