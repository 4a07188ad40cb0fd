#include "vantage/track/samples.hpp"

#include <cmath>

namespace vantage {

bool is_valid(const ImuSample& sample) noexcept {
  return std::isfinite(sample.stamp) && sample.angular_velocity.allFinite() &&
         sample.specific_force.allFinite();
}

bool is_valid(const OdometrySample& sample) noexcept {
  return std::isfinite(sample.stamp) && is_valid(sample.T_odom_body);
}

}  // namespace vantage
