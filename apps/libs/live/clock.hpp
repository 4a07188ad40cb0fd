#pragma once

#include <chrono>
#include <cstdint>

namespace vantage::live {

/// The time by a clock that only runs forward, for durations; see Received::arrival [ns].
[[nodiscard]] inline std::int64_t now() {
  return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
}
/// What the clock of this computer shows [ns since the epoch].
[[nodiscard]] inline std::int64_t time_of_day() {
  return std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace vantage::live
