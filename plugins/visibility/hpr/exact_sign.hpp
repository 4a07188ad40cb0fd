#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace vantage::hpr {

/// The sign of a determinant. The given numbers are taken as exact, so rounding errors have no
/// effect. Valid as long as no product of three coordinates overflows or underflows (Shewchuk 1997,
/// Sec. 2).
enum class Sign : std::int8_t { negative = -1, zero = 0, positive = 1 };

/// The sign of det(a, b, c): positive if a, b, c are counter-clockwise seen from their far side.
[[nodiscard]] Sign sign_of_triple(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                  const Eigen::Vector3d& c);

/// The sign of det(b - a, c - a, d - a), without rounding the differences.
[[nodiscard]] Sign sign_of_volume(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                  const Eigen::Vector3d& c, const Eigen::Vector3d& d);

/// A point seen along an axis: its other two coordinates, in the order of a right-handed frame.
[[nodiscard]] inline Eigen::Vector2d without(Eigen::Index axis, const Eigen::Vector3d& p) {
  return {p[(axis + 1) % 3], p[(axis + 2) % 3]};
}

/// The sign of det(b - a, c - a) in the plane, without rounding the differences.
[[nodiscard]] Sign sign_of_turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                                const Eigen::Vector2d& c);

}  // namespace vantage::hpr
