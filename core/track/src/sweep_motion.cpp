#include "vantage/track/sweep_motion.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace vantage {
namespace {

/// The mean rate of turn by odometry, if that alone measured it, and all the time [rad/s]. Nothing
/// if no body turns like that: odometry began anew, or jumped.
std::optional<Eigen::Vector3d> mean_rate_of(const std::vector<MotionInput>& pieces) {
  constexpr double kMostChange = 2.0;  // within a sweep [rad/s]
  Eigen::Vector3d angle = Eigen::Vector3d::Zero();
  double seconds = 0.0;
  for (const MotionInput& piece : pieces) {
    if (!piece.odometry || piece.rate) return std::nullopt;
    angle += piece.seconds * piece.odometry->angular;
    seconds += piece.seconds;
  }
  if (!(seconds > 0.0)) return std::nullopt;
  const Eigen::Vector3d mean = angle / seconds;
  const bool is_possible = std::ranges::all_of(pieces, [&](const MotionInput& piece) {
    return (piece.odometry->angular - mean).norm() < kMostChange;
  });
  return is_possible ? std::optional(mean) : std::nullopt;
}

}  // namespace

SweepMotion::SweepMotion(const MotionState& state, const MotionInputs& inputs,
                         const SweepTime& time, double silent_since)
    : first_(time.first) {
  // Between knots, the motion is a straight line: at 3 rad/s, a point 50 m away is 1.4 mm off.
  constexpr double kSeconds = 0.005;
  constexpr std::size_t kMost = 400;
  const double whole = std::max(0.0, time.last - time.first);
  const auto half = std::clamp<std::size_t>(
      static_cast<std::size_t>(std::ceil(0.5 * whole / kSeconds)), 1, kMost);
  seconds_per_knot_ = whole / static_cast<double>(2 * half);
  knots_.resize(2 * half + 1);
  const Pose& T_sensor_body = inputs.T_sensor_body();
  const Pose T_middle_map = T_sensor_body * state.T_map_body.inverse();
  const Pose T_body_sensor = T_sensor_body.inverse();
  const auto mean_rate = mean_rate_of(inputs.between(time.first, time.last, silent_since));
  for (const double side : {-1.0, 1.0}) {
    MotionState there = state;
    double from = time.middle();
    for (std::size_t k = 1; k <= half; ++k) {
      const double to = time.middle() + side * static_cast<double>(k) * seconds_per_knot_;
      for (const MotionInput& input : inputs.between(from, to, silent_since)) {
        if (mean_rate) there.rate_bias = state.rate_bias + *mean_rate - input.odometry->angular;
        there = moved(there, input);
      }
      from = to;
      const Pose T_middle_sensor = T_middle_map * there.T_map_body * T_body_sensor;
      knots_[side < 0.0 ? half - k : half + k] = {T_middle_sensor.rotation.toRotationMatrix(),
                                                  T_middle_sensor.translation};
    }
  }
}

SweepMotion::Place SweepMotion::at(double stamp) const noexcept {
  if (!(seconds_per_knot_ > 0.0)) return {0, 0.0};
  const double place =
      std::clamp((stamp - first_) / seconds_per_knot_, 0.0, static_cast<double>(knots_.size() - 1));
  const auto knot = std::min(static_cast<std::size_t>(place), knots_.size() - 2);
  return {knot, place - static_cast<double>(knot)};
}

SweepMotion::Knot SweepMotion::between(const Place& place) const noexcept {
  const Knot &a = knots_[place.knot], &b = knots_[place.knot + 1];
  return {a.R + place.share * (b.R - a.R), a.t + place.share * (b.t - a.t)};
}

Point SweepMotion::seen_from_middle(const Point& p, double stamp) const noexcept {
  const Knot there = between(at(stamp));
  return there.R * p + there.t;
}

Pose SweepMotion::sensor_at(double stamp) const noexcept {
  const Knot there = between(at(stamp));
  return {.rotation = Eigen::Quaterniond(there.R).normalized(), .translation = there.t};
}

Point SweepMotion::corrected(const Point& p, double stamp, const SweepMotion& by) const noexcept {
  const Knot was = between(at(stamp));
  // A straight line between two rotations is almost one: its inverse is almost its transpose.
  const Point raw = was.R.transpose() * (p - was.t);
  return by.seen_from_middle(raw, stamp);
}

double SweepMotion::apart(const SweepMotion& other, double range) const noexcept {
  double most = 0.0;
  for (const std::size_t k : {std::size_t{0}, knots_.size() - 1}) {
    const double turned = (knots_[k].R - other.knots_[k].R).norm() / std::sqrt(2.0);
    most = std::max(most, (knots_[k].t - other.knots_[k].t).norm() + range * turned);
  }
  return most;
}

}  // namespace vantage
