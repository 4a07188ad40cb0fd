#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/track/motion_filter.hpp"

namespace vantage {

/// The time that a sweep takes.
struct SweepTime {
  double first = 0.0, last = 0.0;  ///< of its points [s]
  [[nodiscard]] double middle() const noexcept { return 0.5 * (first + last); }
};

/// Where a sensor was during a sweep, in its own frame at the middle of the sweep. An error of the
/// velocity then moves the points before and after by opposite amounts, and cancels.
/// Without a gyroscope, odometry tells how the rate of turn changes during the sweep; its mean is
/// that of the state, which scans have corrected. A speed changes less than odometry is noisy.
class SweepMotion {
 public:
  /// @param state   of the body at the middle of the sweep
  /// @param silent_since  see MotionInputs::between
  SweepMotion(const MotionState& state, const MotionInputs& inputs, const SweepTime& time,
              double silent_since);

  /// A point that was measured at a moment, as it would have been seen at the middle.
  /// @param p      sensor frame at that moment [m]
  /// @param stamp  [s]; moments beyond the sweep count as its ends
  [[nodiscard]] Point seen_from_middle(const Point& p, double stamp) const noexcept;
  /// Where the sensor was at a moment, in its frame at the middle.
  [[nodiscard]] Pose sensor_at(double stamp) const noexcept;
  /// Moves a point that another motion of the same sweep has put to the middle.
  [[nodiscard]] Point corrected(const Point& p, double stamp, const SweepMotion& by) const noexcept;
  /// How far this motion and another put a point apart, at most [m].
  /// @param range  of the point [m]
  [[nodiscard]] double apart(const SweepMotion& other, double range) const noexcept;

 private:
  struct Knot {
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    Eigen::Vector3d t = Eigen::Vector3d::Zero();
  };
  struct Place {
    std::size_t knot;
    double share;
  };
  [[nodiscard]] Place at(double stamp) const noexcept;
  [[nodiscard]] Knot between(const Place& place) const noexcept;

  double first_, seconds_per_knot_;
  std::vector<Knot> knots_;  // T_middle_sensor, evenly spaced in time
};

}  // namespace vantage
