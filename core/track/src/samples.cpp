#include "vantage/track/samples.hpp"

#include <cmath>

namespace vantage {

bool is_valid(const ImuSample& sample) noexcept {
  // NaN is not below anything.
  return std::isfinite(sample.stamp) && sample.angular_velocity.norm() < kFastestTurn &&
         sample.specific_force.norm() < kLargestForce;
}

bool is_valid(const OdometrySample& sample) noexcept {
  return std::isfinite(sample.stamp) && is_valid(sample.T_odom_body) &&
         is_on_earth(sample.T_odom_body);
}

}  // namespace vantage
