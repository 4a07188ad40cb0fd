#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <limits>

#include "vantage/result.hpp"

namespace vantage::io::ros {

/// builtin_interfaces/Time.
struct Time {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;  ///< below 1e9

  [[nodiscard]] std::uint64_t nanoseconds() const noexcept {
    return std::uint64_t{1'000'000'000} * static_cast<std::uint32_t>(sec) + nanosec;
  }
};

/// Rounds to the nearest nanosecond.
/// @param stamp  [s]
/// Errors: `invalid_input` for a stamp that is not finite, negative (MCAP's times have no sign) or
/// beyond the 2^31 s of a ROS time.
[[nodiscard]] inline Result<Time> time_of(double stamp) {
  constexpr std::uint32_t kSecond = 1'000'000'000;
  double whole = std::floor(stamp);
  double rest = std::round((stamp - whole) * kSecond);
  if (rest == kSecond) {
    whole += 1.0;
    rest = 0.0;
  }
  if (!(whole >= 0.0 && whole <= std::numeric_limits<std::int32_t>::max())) {
    return fail(ErrorCode::invalid_input,
                fmt::format("the stamp {} s is no ROS time, which runs from 0 to 2^31 s", stamp));
  }
  return Time{.sec = static_cast<std::int32_t>(whole), .nanosec = static_cast<std::uint32_t>(rest)};
}

}  // namespace vantage::io::ros
