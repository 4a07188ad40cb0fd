#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

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

/// A moment as messages state it. It converts from and to seconds, but keeps the nanoseconds, which
/// a double of the seconds since 1970 cannot hold.
class Stamp {
 public:
  Stamp() = default;
  Stamp(double seconds) : seconds_(seconds) {}  // NOLINT(google-explicit-constructor)
  /// As a message states it.
  Stamp(double seconds, std::uint32_t nanoseconds)
      : seconds_(seconds + static_cast<double>(nanoseconds) / 1e9) {
    constexpr std::uint32_t kSecond = 1'000'000'000;
    constexpr double kLast = std::numeric_limits<std::int32_t>::max();
    if (nanoseconds < kSecond && seconds >= 0.0 && seconds <= kLast) {
      exact_ = Time{.sec = static_cast<std::int32_t>(seconds), .nanosec = nanoseconds};
    }
  }

  /// [s]
  operator double() const noexcept { return seconds_; }  // NOLINT(google-explicit-constructor)
  [[nodiscard]] double seconds() const noexcept { return seconds_; }
  /// To the nanosecond. Errors: those of time_of.
  [[nodiscard]] Result<Time> time() const {
    if (exact_) return *exact_;
    return time_of(seconds_);
  }

 private:
  double seconds_ = 0.0;
  std::optional<Time> exact_;
};

}  // namespace vantage::io::ros
