#include "simulate/roughness.hpp"

#include <cmath>
#include <numbers>

#include "simulate/random.hpp"

namespace vantage::simulation {
namespace {

constexpr double kWheelBase = 1.2, kTrack = 1.0;  // [m]

}  // namespace

Roughness::Roughness(const DriveParams& params, std::uint64_t seed)
    : amplitude_(params.roughness), length_(params.roughness_length) {
  Random random(hash(seed, Purpose::roughness));
  for (auto& track : phases_) {
    for (double& phase : track) phase = 2.0 * std::numbers::pi * random.uniform();
  }
}

double Roughness::height(std::size_t track, double distance) const noexcept {
  const double angle = 2.0 * std::numbers::pi * distance / length_;
  return amplitude_ *
         (std::sin(angle + phases_[track][0]) +
          std::sin(angle / std::numbers::phi + phases_[track][1])) /
         2.0;
}

Pose Roughness::stand(double distance) const noexcept {
  const double front = distance + kWheelBase / 2.0, rear = distance - kWheelBase / 2.0;
  const double front_left = height(0, front), front_right = height(1, front);
  const double rear_left = height(0, rear), rear_right = height(1, rear);
  const double pitch =
      std::atan((rear_left + rear_right - front_left - front_right) / (2.0 * kWheelBase));
  const double roll =
      std::atan((front_left + rear_left - front_right - rear_right) / (2.0 * kTrack));
  const double middle = (front_left + front_right + rear_left + rear_right) / 4.0;
  return pose_from_xyz_rpy({0.0, 0.0, middle}, {roll, pitch, 0.0});
}

}  // namespace vantage::simulation
