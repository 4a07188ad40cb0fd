#pragma once

#include <numbers>

namespace vantage {

/// In a radian.
inline constexpr double kDegrees = 180.0 / std::numbers::pi;

}  // namespace vantage
