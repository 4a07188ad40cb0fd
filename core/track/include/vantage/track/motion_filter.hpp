#pragma once

#include <Eigen/Core>

#include "vantage/pose.hpp"
#include "vantage/track/motion_inputs.hpp"

namespace vantage {

/// How fast what is not measured may change, and how exact what is measured is. Spectral densities:
/// a deviation of 1 /sqrt(s) grows to 1 within a second.
struct MotionNoise {
  double acceleration = 1.0;        ///< of the velocity, without accelerometer [m/s/sqrt(s)]
  double turning = 1.0;             ///< of the rate of turn, without gyroscope [rad/s/sqrt(s)]
  double upright = 1.0;             ///< factor on both for height and tilt; small on flat ground
  double force = 0.05;              ///< accelerometer with vibration [m/s^2 sqrt(s)]
  double rate = 0.003;              ///< gyroscope with vibration [rad/s sqrt(s)]
  double force_bias = 0.002;        ///< walk of the accelerometer's bias [m/s^2/sqrt(s)]
  double rate_bias = 0.0005;        ///< walk of the gyroscope's bias [rad/s/sqrt(s)]
  double odometry_metres = 0.04;    ///< odometry's error after a metre [m/sqrt(m)]
  double odometry_radians = 0.003;  ///< odometry's rotation after a metre [rad/sqrt(m)]
  double odometry_turning = 0.02;   ///< odometry's rotation after a radian [rad/sqrt(rad)]
};

/// Where a body is and how it moves. The map's z points up.
struct MotionState {
  Pose T_map_body = {};
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< of the body, in its frame [m/s]
  /// The gyroscope reads the rate of turn and this; without a gyroscope, which then reads 0, the
  /// rate of turn is minus this [rad/s].
  Eigen::Vector3d rate_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d force_bias = Eigen::Vector3d::Zero();  ///< of the accelerometer [m/s^2]
};

/// The rows of errors: position and rotation vector in map axes, rotation about the body; velocity,
/// bias of the rate, bias of the force in the body's frame.
using MotionMatrix = Eigen::Matrix<double, 15, 15>;
using PoseMatrix = Eigen::Matrix<double, 6, 6>;
using MotionVector = Eigen::Matrix<double, 15, 1>;
using PoseVector = Eigen::Matrix<double, 6, 1>;

/// The state after a piece of time: a measured one where there is an input, otherwise with a
/// constant twist.
[[nodiscard]] MotionState moved(const MotionState& state, const MotionInput& input) noexcept;
/// The derivative of that state's error by the error of the state before.
[[nodiscard]] MotionMatrix moved_jacobian(const MotionState& state,
                                          const MotionInput& input) noexcept;
/// The covariance that the piece of time adds.
[[nodiscard]] MotionMatrix moved_noise(const MotionState& state, const MotionInput& input,
                                       const MotionNoise& noise) noexcept;
/// The state with an error added.
[[nodiscard]] MotionState plus(const MotionState& state, const MotionVector& error) noexcept;
/// How far a pose is from another, as rows of errors.
[[nodiscard]] PoseVector difference(const Pose& pose, const Pose& from) noexcept;
/// The twist of the body at this moment, in its frame.
[[nodiscard]] Twist twist_of(const MotionState& state, const MotionInput& input) noexcept;

/// An error-state Kalman filter of the motion of a LiDAR. It answers where the sensor is at a
/// moment, and how sure that is. Its state is that of the body, the IMU; poses that go in and come
/// out are those of the LiDAR.
/// After Sola, "Quaternion kinematics for the error-state Kalman filter", 2017, with errors in map
/// axes (his "global angular error", Sec. 7).
class MotionFilter {
 public:
  /// A pose whose squared distance from the prediction, in standard deviations, is larger than this
  /// says that the motion was another one: chi squared of six dimensions, 99.9 %.
  static constexpr double kUnusual = 22.5;

  /// A sensor whose motion is unknown but for what the inputs say: a car at up to about 60 km/h, or
  /// at rest if the IMU is.
  /// @param stamp  [s]
  /// @param P      covariance of the pose; rows as those of Alignment::Hessian
  MotionFilter(double stamp, const Pose& T_map_sensor, const PoseMatrix& P,
               const MotionInputs& inputs);

  [[nodiscard]] double stamp() const noexcept { return stamp_; }
  /// When the motion was measured last [s].
  [[nodiscard]] double measured() const noexcept { return measured_; }
  /// The part of the last prediction's time for which odometry did not count, because it
  /// contradicted what was known of the motion [s].
  [[nodiscard]] double doubted() const noexcept { return doubted_; }
  [[nodiscard]] const MotionState& state() const noexcept { return state_; }
  [[nodiscard]] const MotionMatrix& covariance() const noexcept { return covariance_; }
  [[nodiscard]] Pose pose() const noexcept { return state_.T_map_body * T_body_sensor_; }
  /// Covariance of that pose, rotation about the sensor.
  [[nodiscard]] PoseMatrix pose_covariance() const;
  /// Of the body, map axes [m/s].
  [[nodiscard]] Eigen::Vector3d velocity() const noexcept {
    return state_.T_map_body.rotation.toRotationMatrix() * state_.velocity;
  }

  /// Moves on to a later moment.
  void predict(double stamp, const MotionInputs& inputs, const MotionNoise& noise);
  /// The filter at a moment near its own, later or earlier, by the motion that it knows. Another
  /// scan bounds what the motion adds, so this is a quarter of the noise: the variance of a random
  /// walk half way between two places that are known. For questions, not to go on with.
  [[nodiscard]] MotionFilter at(double stamp, const MotionInputs& inputs,
                                const MotionNoise& noise) const;
  /// Takes a measured pose in. @param R  covariance of its errors
  void update(const Pose& T_map_sensor, const PoseMatrix& R);
  /// A pose at a moment near the filter's own.
  struct Seen {
    double stamp;  ///< [s]
    Pose T_map_sensor;
    PoseMatrix R;  ///< covariance of the pose's errors
  };
  /// Takes in how the sensor came from one pose to another, and nothing of where they are: an error
  /// that both share does not count.
  void update_motion(const Seen& first, const Seen& second, const MotionInputs& inputs);
  /// The sensor is found at another pose, and moves as it did, as far as is known.
  /// @param P  covariance of that pose
  void place(const Pose& T_map_sensor, const PoseMatrix& P);

 private:
  /// The derivative of the sensor's pose by that of the body.
  [[nodiscard]] PoseMatrix sensor_by_body() const;
  /// Moves on, or back. @param share  of the noise, that the covariance grows by
  void advance(double stamp, const MotionInputs& inputs, const MotionNoise& noise, double share);
  /// Takes in the twist by odometry, for a piece of time, unless it contradicts what is known.
  /// @param is_known  whether the motion was measured a moment ago
  /// @return          whether all of it was taken in
  bool take_odometry(const MotionInput& input, const MotionNoise& noise, bool is_known);
  /// Takes in a measurement by scans. If the motion changed more than its noise allows, what was
  /// known of it is worth less, by as much.
  void correct(const PoseVector& innovation, const Eigen::Matrix<double, 6, 15>& H,
               const PoseMatrix& R);
  /// The squared distance of a measurement from what is predicted, in standard deviations.
  template <int kRows>
  [[nodiscard]] double surprise_of(const Eigen::Matrix<double, kRows, 1>& innovation,
                                   const Eigen::Matrix<double, kRows, 15>& H,
                                   const Eigen::Matrix<double, kRows, kRows>& R) const;
  /// Takes in a measurement.
  /// @param innovation  its difference from what is predicted
  /// @param H           the derivative of that difference by the state's error
  template <int kRows>
  void take(const Eigen::Matrix<double, kRows, 1>& innovation,
            const Eigen::Matrix<double, kRows, 15>& H,
            const Eigen::Matrix<double, kRows, kRows>& R);

  double stamp_, measured_, doubted_ = 0.0;
  Pose T_body_sensor_;
  MotionState state_;
  MotionMatrix covariance_;
};

}  // namespace vantage
