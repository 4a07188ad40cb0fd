#include "vantage/track/motion_filter.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <utility>

namespace vantage {
namespace {

const Eigen::Vector3d kGravity(0.0, 0.0, -9.80665);  // standard gravity [m/s^2], map frame
constexpr double kStopping = 1.0;  // [s]; a body that may have stopped slows down within this

// The first row of each part of an error.
constexpr Eigen::Index kP = 0, kR = 3, kV = 6, kB = 9, kF = 12;

double squared(double x) { return x * x; }

/// A piece of time as the twist counts in it. A body that may have stopped slows down: its speeds
/// are those of an Ornstein-Uhlenbeck process.
struct Course {
  double fade = 1.0;  ///< of the speeds
  double way;         ///< the time for which the speeds of the beginning would last [s]
  /// The noise of the speeds adds variance to the integral of the speeds, to the speeds themselves,
  /// and covariance between both. Fading lowers each of these by a factor.
  double integral = 1.0, itself = 1.0, cross = 1.0;
};
Course course_of(const MotionInput& input) {
  constexpr double kShort = 1e-4;  // for less, rounding errors exceed the fading of the variances
  if (!input.coasts) return {.way = input.seconds};
  const double time = std::abs(input.seconds) / kStopping;
  Course course{.fade = std::exp(-time),
                .way = std::copysign(-kStopping * std::expm1(-time), input.seconds)};
  if (time < kShort) return course;
  const double mean = course.way / input.seconds;  // of the fading
  course.itself = -0.5 * std::expm1(-2.0 * time) / time;
  course.cross = mean * mean;
  course.integral = 3.0 * (1.0 - 2.0 * mean + course.itself) / squared(time);
  return course;
}

/// The derivative of `left_jacobian(theta) * v` by theta, to second order.
Eigen::Matrix3d derivative(const Eigen::Vector3d& theta, const Eigen::Vector3d& v) {
  const Eigen::Vector3d across = theta.cross(v);
  return -0.5 * skew(v) - (skew(across) + skew(theta) * skew(v)) / 6.0;
}

}  // namespace

Twist twist_of(const MotionState& state, const MotionInput& input) noexcept {
  return {.linear = state.velocity,
          .angular = input.rate.value_or(Eigen::Vector3d::Zero()) - state.rate_bias};
}

MotionState moved(const MotionState& state, const MotionInput& input) noexcept {
  const double dt = input.seconds;
  const Course course = course_of(input);
  const Twist twist = twist_of(state, input);
  MotionState next = state;
  next.T_map_body.rotation =
      (state.T_map_body.rotation * rotation_from_vector(course.way * twist.angular)).normalized();
  const Eigen::Matrix3d R = state.T_map_body.rotation.toRotationMatrix();
  if (input.force) {
    const Eigen::Matrix3d R_middle =
        R * rotation_from_vector(0.5 * dt * twist.angular).toRotationMatrix();
    const Eigen::Vector3d a = R_middle * (*input.force - state.force_bias) + kGravity;
    const Eigen::Vector3d u = R * state.velocity;
    next.T_map_body.translation += u * dt + 0.5 * dt * dt * a;
    next.velocity = next.T_map_body.rotation.toRotationMatrix().transpose() * (u + dt * a);
    return next;
  }
  next.T_map_body.translation +=
      R * (left_jacobian(course.way * twist.angular) * (course.way * twist.linear));
  next.velocity *= course.fade;
  next.rate_bias *= course.fade;
  return next;
}

MotionMatrix moved_jacobian(const MotionState& state, const MotionInput& input) noexcept {
  const Course course = course_of(input);
  const double dt = course.way;
  const Twist twist = twist_of(state, input);
  const Eigen::Vector3d theta = dt * twist.angular;
  const Eigen::Matrix3d R = state.T_map_body.rotation.toRotationMatrix();
  const Eigen::Matrix3d J = left_jacobian(theta);
  MotionMatrix F = MotionMatrix::Identity();
  F.block<3, 3>(kR, kB) = -dt * R * J;
  if (input.force) {
    const Eigen::Vector3d half = 0.5 * theta;
    const Eigen::Matrix3d R_middle = R * rotation_from_vector(half).toRotationMatrix();
    const Eigen::Vector3d force = R_middle * (*input.force - state.force_bias);
    const Eigen::Vector3d u = R * state.velocity;
    const Eigen::Vector3d u_next = u + dt * (force + kGravity);
    const Eigen::Matrix3d R_next = R * rotation_from_vector(theta).toRotationMatrix();
    Eigen::Matrix<double, 3, 15> du = Eigen::Matrix<double, 3, 15>::Zero();  // of u
    du.block<3, 3>(0, kR) = -skew(u);
    du.block<3, 3>(0, kV) = R;
    Eigen::Matrix<double, 3, 15> da = Eigen::Matrix<double, 3, 15>::Zero();  // of acceleration
    da.block<3, 3>(0, kR) = -skew(force);
    da.block<3, 3>(0, kB) = -skew(force) * R * left_jacobian(half) * (-0.5 * dt);
    da.block<3, 3>(0, kF) = -R_middle;
    F.block<3, 15>(kP, 0) += dt * du + 0.5 * dt * dt * da;
    const Eigen::Matrix<double, 3, 15> turned = F.block<3, 15>(kR, 0);
    F.block<3, 15>(kV, 0) = R_next.transpose() * (du + dt * da + skew(u_next) * turned);
    return F;
  }
  const Eigen::Vector3d v = twist.linear;
  F.block<3, 3>(kP, kR) = -skew(R * (J * v)) * dt;
  F.block<3, 3>(kP, kV) = dt * R * J;
  F.block<3, 3>(kV, kV) *= course.fade;
  F.block<3, 3>(kB, kB) *= course.fade;
  F.block<3, 3>(kP, kB) = -dt * dt * R * derivative(theta, v);
  return F;
}

MotionMatrix moved_noise(const MotionState& state, const MotionInput& input,
                         const MotionNoise& noise) noexcept {
  const double dt = std::abs(input.seconds);
  const Course course = course_of(input);
  const Eigen::Matrix3d R = state.T_map_body.rotation.toRotationMatrix();
  MotionMatrix Q = MotionMatrix::Zero();
  const double ahead = std::copysign(1.0, input.seconds);
  // Adds the noise of a rate: it is integrated into `integral`, and moves `itself`, too. Its
  // variances are those along the map's axes.
  const auto add_walk = [&](Eigen::Index integral, Eigen::Index itself, double side,
                            const Eigen::Vector3d& variance) {
    const Eigen::Matrix3d turned = side * ahead * variance.asDiagonal() * R;
    Q.block<3, 3>(integral, integral).diagonal() += course.integral * variance * dt * dt / 3.0;
    Q.block<3, 3>(integral, itself) += course.cross * turned * dt / 2.0;
    Q.block<3, 3>(itself, integral) += course.cross * turned.transpose() * dt / 2.0;
    Q.block<3, 3>(itself, itself) += course.itself * (R.transpose() * variance.asDiagonal() * R);
  };
  const double upright = squared(noise.upright);
  if (input.force) {
    const Eigen::Vector3d variance = Eigen::Vector3d::Constant(squared(noise.force) * dt);
    add_walk(kP, kV, 1.0, variance);
    Q.block<3, 3>(kF, kF).diagonal().array() += squared(noise.force_bias) * dt;
  } else {
    add_walk(kP, kV, 1.0, squared(noise.acceleration) * dt * Eigen::Vector3d(1.0, 1.0, upright));
  }
  if (input.rate) {
    Q.block<3, 3>(kR, kR).diagonal().array() += squared(noise.rate) * dt;
    Q.block<3, 3>(kB, kB).diagonal().array() += squared(noise.rate_bias) * dt;
  } else {
    add_walk(kR, kB, -1.0, squared(noise.turning) * dt * Eigen::Vector3d(upright, upright, 1.0));
  }
  return Q;
}

MotionState plus(const MotionState& state, const MotionVector& error) noexcept {
  MotionState next = state;
  next.T_map_body.translation += error.segment<3>(kP);
  next.T_map_body.rotation =
      (rotation_from_vector(error.segment<3>(kR)) * state.T_map_body.rotation).normalized();
  next.velocity += error.segment<3>(kV);
  next.rate_bias += error.segment<3>(kB);
  next.force_bias += error.segment<3>(kF);
  return next;
}

PoseVector difference(const Pose& pose, const Pose& from) noexcept {
  PoseVector error;
  error << pose.translation - from.translation,
      rotation_vector_of(Eigen::Quaterniond(pose.rotation * from.rotation.conjugate()));
  return error;
}

MotionFilter::MotionFilter(double stamp, const Pose& T_map_sensor, const PoseMatrix& P,
                           const MotionInputs& inputs)
    : stamp_(stamp),
      measured_(stamp),
      T_body_sensor_(inputs.T_sensor_body().inverse()),
      covariance_(MotionMatrix::Zero()) {
  // Standard deviations in map axes; without a gyroscope, the bias stands for the rate of turn.
  Eigen::Vector3d speed(8.0, 8.0, 1.0), rate(0.3, 0.3, 1.0);  // [m/s], [rad/s]
  constexpr double kForceBias = 0.3, kRateBias = 0.05, kRateAtRest = 0.002;
  if (inputs.has_imu()) rate.setConstant(kRateBias);
  if (const auto rest = inputs.rest(stamp)) {
    state_.rate_bias = rest->rate;
    // At rest, or in an even motion: nothing tells a steady turn from a bias.
    rate.setConstant(std::hypot(kRateAtRest, rest->rate.norm()));
  }
  const Eigen::Matrix3d R_body_map =
      (T_map_sensor.rotation * T_body_sensor_.rotation.conjugate()).toRotationMatrix().transpose();
  const auto in_body = [&](const Eigen::Vector3d& sigma) -> Eigen::Matrix3d {
    return R_body_map * sigma.cwiseAbs2().asDiagonal() * R_body_map.transpose();
  };
  covariance_.block<3, 3>(kV, kV) = in_body(speed);
  covariance_.block<3, 3>(kB, kB) = in_body(rate);
  covariance_.diagonal().segment<3>(kF).setConstant(kForceBias * kForceBias);
  place(T_map_sensor, P);
}

PoseMatrix MotionFilter::sensor_by_body() const {
  PoseMatrix A = PoseMatrix::Identity();
  A.block<3, 3>(kP, kR) =
      -skew(state_.T_map_body.rotation.toRotationMatrix() * T_body_sensor_.translation);
  return A;
}

PoseMatrix MotionFilter::pose_covariance() const {
  const PoseMatrix A = sensor_by_body();
  return A * covariance_.topLeftCorner<6, 6>() * A.transpose();
}

void MotionFilter::advance(double stamp, const MotionInputs& inputs, const MotionNoise& noise,
                           double share) {
  constexpr double kForgotten = 1.0;  // [s]
  double now = stamp_;
  for (const MotionInput& input : inputs.between(stamp_, stamp, measured_)) {
    const bool is_known = std::abs(now - measured_) < kForgotten;
    const bool counts = input.odometry && take_odometry(input, noise, is_known);
    if (input.odometry && !counts) doubted_ += std::abs(input.seconds);
    const MotionMatrix F = moved_jacobian(state_, input);
    covariance_ = F * covariance_ * F.transpose() + share * moved_noise(state_, input, noise);
    state_ = moved(state_, input);
    now += input.seconds;
    if (input.rate || counts) measured_ = std::max(measured_, now);
  }
  stamp_ = stamp;
}

void MotionFilter::predict(double stamp, const MotionInputs& inputs, const MotionNoise& noise) {
  doubted_ = 0.0;
  advance(stamp, inputs, noise, 1.0);
  covariance_ = 0.5 * (covariance_ + covariance_.transpose()).eval();
}

MotionFilter MotionFilter::at(double stamp, const MotionInputs& inputs,
                              const MotionNoise& noise) const {
  constexpr double kBounded = 0.25;
  MotionFilter there = *this;
  there.advance(stamp, inputs, noise, kBounded);
  return there;
}

void MotionFilter::update(const Pose& T_map_sensor, const PoseMatrix& R) {
  Eigen::Matrix<double, 6, 15> H = Eigen::Matrix<double, 6, 15>::Zero();
  H.leftCols<6>() = sensor_by_body();
  correct(difference(T_map_sensor, pose()), H, R);
  measured_ = stamp_;
}

void MotionFilter::update_motion(const Seen& first, const Seen& second,
                                 const MotionInputs& inputs) {
  PoseVector innovation = PoseVector::Zero();
  Eigen::Matrix<double, 6, 15> H = Eigen::Matrix<double, 6, 15>::Zero();
  for (const auto& [seen, side] : {std::pair(&first, -1.0), std::pair(&second, 1.0)}) {
    MotionFilter there = *this;
    MotionMatrix F = MotionMatrix::Identity();
    for (const MotionInput& input : inputs.between(stamp_, seen->stamp, measured_)) {
      F = moved_jacobian(there.state_, input) * F;
      there.state_ = moved(there.state_, input);
    }
    innovation += side * difference(seen->T_map_sensor, there.pose());
    H += side * there.sensor_by_body() * F.topRows<6>();
  }
  correct(innovation, H, first.R + second.R);
}

bool MotionFilter::take_odometry(const MotionInput& input, const MotionNoise& noise,
                                 bool is_known) {
  using Rows = Eigen::Matrix<double, 3, 15>;
  // Chi squared of three dimensions, 99.99 %.
  constexpr double kContradiction = 21.1;
  constexpr double kKnownSpeed = 1.0;  // [m/s]; a standard deviation
  const Twist &twist = *input.odometry, &steady = input.steady_odometry;
  is_known &= covariance_.diagonal().segment<3>(kV).maxCoeff() < squared(kKnownSpeed);
  /// @param per_second  variance of the way or the angle: errors are those of a random walk
  const auto take_part = [&](Eigen::Index part, const Eigen::Vector3d& innovation,
                             const Eigen::Vector3d& steady_innovation, double per_second) {
    Rows H = Rows::Zero();
    H.block<3, 3>(0, part).setIdentity();
    const Eigen::Matrix3d R = per_second * Eigen::Matrix3d::Identity();
    // Wheels slip and lock, and odometry begins anew.
    if (is_known &&
        surprise_of<3>(steady_innovation, H, R / MotionInput::kSteady) > kContradiction) {
      return false;
    }
    take<3>(innovation, H, R / std::abs(input.seconds));
    return true;
  };
  const double speed = twist.linear.norm(), turn = twist.angular.norm();
  const double between = input.odometry_seconds;
  const double metres = squared(noise.odometry_metres) * speed + squared(0.01) * between;
  const double radians = squared(noise.odometry_radians) * speed +
                         squared(noise.odometry_turning) * turn + squared(0.005) * between;
  bool counts =
      take_part(kV, twist.linear - state_.velocity, steady.linear - state_.velocity, metres);
  if (!input.rate) {  // a gyroscope knows better
    counts &= take_part(kB, -twist.angular - state_.rate_bias, -steady.angular - state_.rate_bias,
                        radians);
  }
  return counts;
}

void MotionFilter::correct(const PoseVector& innovation, const Eigen::Matrix<double, 6, 15>& H,
                           const PoseMatrix& R) {
  const double surprise = surprise_of<6>(innovation, H, R);
  if (surprise > kUnusual) covariance_ *= surprise / kUnusual;
  take<6>(innovation, H, R);
}

template <int kRows>
double MotionFilter::surprise_of(const Eigen::Matrix<double, kRows, 1>& innovation,
                                 const Eigen::Matrix<double, kRows, 15>& H,
                                 const Eigen::Matrix<double, kRows, kRows>& R) const {
  const Eigen::Matrix<double, kRows, kRows> S = H * covariance_ * H.transpose() + R;
  return innovation.dot(S.ldlt().solve(innovation));
}

template <int kRows>
void MotionFilter::take(const Eigen::Matrix<double, kRows, 1>& innovation,
                        const Eigen::Matrix<double, kRows, 15>& H,
                        const Eigen::Matrix<double, kRows, kRows>& R) {
  const Eigen::Matrix<double, kRows, kRows> S = H * covariance_ * H.transpose() + R;
  const Eigen::Matrix<double, 15, kRows> PHt = covariance_ * H.transpose();
  const Eigen::Matrix<double, kRows, 15> solved = S.ldlt().solve(PHt.transpose());
  const Eigen::Matrix<double, 15, kRows> K = solved.transpose();
  state_ = plus(state_, K * innovation);
  // Joseph's form: stays positive definite.
  const MotionMatrix kept = MotionMatrix::Identity() - K * H;
  covariance_ = kept * covariance_ * kept.transpose() + K * R * K.transpose();
  covariance_ = 0.5 * (covariance_ + covariance_.transpose()).eval();
}

void MotionFilter::place(const Pose& T_map_sensor, const PoseMatrix& P) {
  state_.T_map_body = T_map_sensor * T_body_sensor_.inverse();
  const PoseMatrix body_by_sensor = sensor_by_body().inverse();
  covariance_.leftCols<6>().setZero();
  covariance_.topRows<6>().setZero();
  covariance_.topLeftCorner<6, 6>() = body_by_sensor * P * body_by_sensor.transpose();
}

}  // namespace vantage
