#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace vantage::hpr {

/// The sign of a determinant of the given numbers taken as exact, whatever its rounding error.
/// Valid while no product of three coordinates over- or underflows (Shewchuk 1997, Sec. 2).
enum class Sign : std::int8_t { negative = -1, zero = 0, positive = 1 };

/// Of det(a, b, c): positive where a, b, c are counter-clockwise seen from their far side.
[[nodiscard]] Sign sign_of_triple(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                  const Eigen::Vector3d& c);

/// Of det(b - a, c - a, d - a), the differences not rounded.
[[nodiscard]] Sign sign_of_volume(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                  const Eigen::Vector3d& c, const Eigen::Vector3d& d);

/// Of det(b - a, c - a) in the plane, the differences not rounded.
[[nodiscard]] Sign sign_of_turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                                const Eigen::Vector2d& c);

}  // namespace vantage::hpr
