#include "live/priors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "vantage/io/pose_priors.hpp"
#include "vantage/track/rotation.hpp"

namespace vantage::live {
namespace {

// Priors are kept for this long before the last scan [s]. Stamps say nothing of how many there are:
// those of a sender without a clock are all the same.
constexpr double kKeptTime = 10.0;
constexpr std::size_t kMostKept = 5000;  // of 10 s at 500 Hz
// A prior belongs to a scan that is this near to it in time [s].
constexpr double kLargestAge = 0.15;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

double sigma(double variance, double least) {
  return variance > 0.0 ? std::max(std::sqrt(variance), least) : kInfinity;
}

/// Moves a place by an offset whose direction in the plane is not known.
void turn_anywhere(Point& place, std::array<double, 3>& variances, const Eigen::Vector3d& offset) {
  place.z() += offset.z();
  const double plane = offset.head<2>().squaredNorm();
  for (std::size_t axis = 0; axis < 2; ++axis) {
    if (variances[axis] > 0.0) variances[axis] += plane;
  }
}

/// @param least_metres, least_radians  of a sigma
PosePrior of_sensor(const Pose& T_map_base, const io::ros::PoseVariances& variances,
                    const Pose& T_base_sensor, double least_metres, double least_radians) {
  auto [xyz, heading] = variances;
  Pose T_map_sensor = T_map_base * T_base_sensor;
  if (!(heading > 0.0)) {
    T_map_sensor = T_map_base;
    turn_anywhere(T_map_sensor.translation, xyz, T_base_sensor.translation);
  }
  return PosePrior{.T_map_sensor = T_map_sensor,
                   .sigma_translation = {sigma(xyz[0], least_metres), sigma(xyz[1], least_metres),
                                         sigma(xyz[2], least_metres)},
                   .sigma_heading = sigma(heading, least_radians)};
}

}  // namespace

Priors::Prior Priors::of(Input input, const io::ros::PoseMessage& pose) {
  return {.input = input,
          .stamp = pose.header.stamp,
          .T_map_base = pose.pose,
          .variances = pose.variances.value_or(io::ros::PoseVariances{})};
}

void Priors::keep(const Prior& prior) {
  priors_.push_back(prior);
  if (priors_.size() > kMostKept) priors_.pop_front();
}

void Priors::add(const io::ros::PoseMessage& pose) { keep(of(Input::prior, pose)); }

void Priors::hint(const io::ros::PoseMessage& pose) {
  hint_ = of(Input::initial_pose, pose);
  hint_is_aside_ = false;
}

void Priors::add(const io::ros::FixMessage& fix, const StaticFrames& frames) {
  if (!projection_) return;
  const std::string frame(io::ros::frame_name(fix.header.frame));
  if (!fix.has_fix) {
    notices_.tell("fix_missing", "the receiver of " + fix_topic_ + " has no fix");
    return;
  }
  io::GeoPosition position = fix.position;
  const bool has_altitude = std::isfinite(position.altitude);
  if (has_altitude) altitude_ = position.altitude;
  position.altitude = altitude_;  // without one, z says nothing, but can be interpolated
  const auto point = projection_->project(position);
  if (!point) {
    notices_.tell("fix_off_map", fmt::format("a fix is left out: {}", point.error().message));
    return;
  }
  constexpr io::PriorSigmas kUsual;
  const auto variance = [&](std::size_t axis, double usual) {
    const double stated = fix.variances ? (*fix.variances)[axis] : 0.0;
    return stated > 0.0 ? stated : usual * usual;
  };
  Prior prior{
      .input = Input::fix,
      .stamp = fix.header.stamp,
      .T_map_base = {.translation = *point},
      .variances = {.translation = {variance(0, kUsual.horizontal), variance(1, kUsual.horizontal),
                                    variance(2, kUsual.vertical)},
                    .heading = 0.0}};
  if (!has_altitude || !projection_->unknown_heights().empty()) {
    prior.variances.translation[2] = 0.0;
  }
  if (const auto mounted = frames.pose(frame, base_); mounted && *mounted) {
    turn_anywhere(prior.T_map_base.translation, prior.variances.translation,
                  (*mounted)->translation);
  } else if (!frame.empty() && frame != base_) {
    notices_.tell("fix_without_mount",
                  fmt::format("no transform leads from '{}', the antenna's frame, to '{}': the "
                              "antenna is taken to be there",
                              frame, base_));
  }
  keep(prior);
}

std::optional<Priors::Prior> Priors::nearest(double stamp) const {
  const auto age = [&](const Prior& prior) { return std::abs(prior.stamp - stamp); };
  const auto nearest = std::ranges::min_element(priors_, {}, age);
  if (nearest == priors_.end() || age(*nearest) > kLargestAge) return std::nullopt;
  const Prior* other = nullptr;
  for (const Prior& one : priors_) {
    const bool is_beyond = (one.stamp - stamp) * (nearest->stamp - stamp) < 0.0;
    if (one.input != nearest->input || !is_beyond || age(one) > kLargestAge) continue;
    if (other == nullptr || age(one) < age(*other)) other = &one;
  }
  Prior prior = *nearest;
  if (other != nullptr) {
    const double share = (stamp - nearest->stamp) / (other->stamp - nearest->stamp);
    prior.T_map_base = interpolate(nearest->T_map_base, other->T_map_base, share);
  }
  return prior;
}

std::optional<PosePrior> Priors::at(double stamp, const Pose& T_base_sensor) {
  std::erase_if(priors_, [&](const Prior& prior) { return prior.stamp < stamp - kKeptTime; });
  if (hint_ && !hint_is_aside_) {
    // A hand points to a place on a screen: it knows no height, and a heading about.
    constexpr double kMetres = 1.0, kRadians = 15.0 * std::numbers::pi / 180.0;
    return of_sensor(hint_->T_map_base, hint_->variances, T_base_sensor, kMetres, kRadians);
  }
  const auto prior = nearest(stamp);
  if (!prior) return std::nullopt;
  constexpr double kMetres = 0.05, kRadians = 0.01;
  return of_sensor(prior->T_map_base, prior->variances, T_base_sensor, kMetres, kRadians);
}

}  // namespace vantage::live
