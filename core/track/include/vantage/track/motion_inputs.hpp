#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "vantage/pose.hpp"
#include "vantage/result.hpp"
#include "vantage/track/rotation.hpp"
#include "vantage/track/samples.hpp"

namespace vantage {

/// What was measured of the motion of a body during some time. All of it is in the body's frame,
/// and constant.
struct MotionInput {
  static constexpr double kSteady = 0.04;  ///< [s]

  double seconds = 0.0;                       ///< negative: backwards in time
  std::optional<Eigen::Vector3d> rate = {};   ///< by the gyroscope, with its bias [rad/s]
  std::optional<Eigen::Vector3d> force = {};  ///< specific force, with its bias [m/s^2]
  std::optional<Twist> odometry = {};         ///< by the samples before and after [m/s, rad/s]
  double odometry_seconds = 0.0;              ///< the time between those samples
  /// The same for the time of several samples, kSteady at least: less noisy, if samples are dense.
  Twist steady_odometry = {};
  bool coasts = false;  ///< nothing was measured for so long that the body may have stopped
};

/// Where the sensors of motion sit.
struct MotionMounts {
  Pose T_sensor_imu = {};   ///< the IMU in the LiDAR's frame
  Pose T_sensor_body = {};  ///< the frame of the odometry in the LiDAR's frame
};

/// The samples of IMU and odometry of the last seconds, in order of time. The body is the IMU.
class MotionInputs {
 public:
  explicit MotionInputs(const MotionMounts& mounts) : mounts_(mounts) {}

  /// Samples may come late, as long as no scan has used later ones. Samples that come later still,
  /// or twice, are dropped and counted; so is a sample that is more than a minute ahead of the one
  /// after it, or behind those before it, unless the next one is, too: then the clock was set back,
  /// and all that was before is dropped.
  /// Errors: `invalid_input` for a sample with a number that is not finite.
  [[nodiscard]] Result<void> add(const ImuSample& sample);
  [[nodiscard]] Result<void> add(const OdometrySample& sample);

  [[nodiscard]] const MotionMounts& mounts() const noexcept { return mounts_; }
  [[nodiscard]] const Pose& T_sensor_body() const noexcept { return mounts_.T_sensor_imu; }
  [[nodiscard]] bool has_imu() const noexcept { return !imu_.empty(); }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }
  /// The number of samples that are held: those of a minute at most.
  [[nodiscard]] std::size_t samples() const noexcept { return imu_.size() + odometry_.size(); }

  /// What was measured from one moment to another, piece by piece. If `to` is earlier than `from`,
  /// the pieces go backwards in time.
  /// @param silent_since  when the motion was measured last, by a scan, too [s]
  [[nodiscard]] std::vector<MotionInput> between(double from, double to, double silent_since) const;

  /// The mean of gyroscope and accelerometer if the IMU has been at rest since a moment; a rest
  /// takes half a second at least.
  struct Rest {
    Eigen::Vector3d rate = Eigen::Vector3d::Zero(), force = Eigen::Vector3d::Zero();
  };
  [[nodiscard]] std::optional<Rest> rest(double until) const;
  /// The direction that points up, in the LiDAR's frame, by the accelerometer: its mean over the
  /// last moments.
  [[nodiscard]] std::optional<Eigen::Vector3d> up(double stamp) const;

  /// Forgets all samples, but not how many were dropped.
  void forget();
  /// Forgets what was measured before a moment. Samples up to then that come later are dropped.
  void forget_before(double stamp);

 private:
  struct Odometry {
    double stamp;
    Pose T_odom_imu;
  };
  using Sample = std::deque<Odometry>::const_iterator;
  /// The mean between two samples, which is the twist at the middle of that time.
  struct MeanTwist {
    Twist twist;
    double middle, seconds;
  };
  /// The mean from the sample before to this one; nothing without one of them. Nothing either if it
  /// took so long that odometry was silent in between, or if no robot moves like that: the odometry
  /// began anew, or jumped.
  [[nodiscard]] std::optional<MeanTwist> mean_until(Sample next) const;
  /// The mean of the samples around a moment, for MotionInput::kSteady at least if odometry was not
  /// silent. @param next  the first sample later than the moment, not the first of all
  [[nodiscard]] Twist mean_around(double stamp, Sample next) const;
  void learn_interval(double last);
  [[nodiscard]] MotionInput at(double from, double to, double silent_since) const;

  MotionMounts mounts_;
  std::deque<ImuSample> imu_;
  std::deque<Odometry> odometry_;
  std::deque<double> last_intervals_;  // of odometry [s]
  double odometry_interval_ = 0.0;     // the usual one [s]
  std::optional<double> imu_far_back_, odometry_far_back_;
  std::optional<double> forgotten_;  // up to here [s]
  std::uint64_t dropped_ = 0;
};

}  // namespace vantage
