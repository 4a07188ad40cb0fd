#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

namespace vantage::ndt {

/// Sums over the points of one voxel, each seen from the voxel's centre in units of its edge: there
/// they are small, and the covariance loses no digits to cancellation.
struct Moments {
  std::uint32_t points = 0;
  double x = 0.0, y = 0.0, z = 0.0;
  double xx = 0.0, xy = 0.0, xz = 0.0, yy = 0.0, yz = 0.0, zz = 0.0;

  void add(double dx, double dy, double dz) noexcept {
    ++points;
    x += dx;
    y += dy;
    z += dz;
    xx += dx * dx;
    xy += dx * dy;
    xz += dx * dz;
    yy += dy * dy;
    yz += dy * dz;
    zz += dz * dz;
  }
};

/// The normal distribution of the map points in one voxel (Magnusson 2009, Eqs. 6.2-6.3) in 24
/// bytes, in units of the voxel's edge. This is what a Gaussian *is* here, prepared or restored:
/// both give the same bits.
struct Cell {
  std::array<std::uint16_t, 3> mean{};  ///< in the voxel, in 2^-16 and half a step up
  std::array<std::int16_t, 3> lower{};  ///< L21, L31, L32 of the covariance L L^T, in 2^-15 scale
  std::array<std::uint16_t, 3> diagonal{};  ///< L11, L22, L33 in 2^-16 scale, > 0
  std::uint8_t exponent = 0;                ///< scale = 2^-exponent; at most kMaxExponent
  std::uint32_t points = 0;

  static constexpr std::uint8_t kMaxExponent = 31;
  friend bool operator==(const Cell&, const Cell&) = default;
};

/// Mean and inverse covariance, in units of the voxel's edge.
struct Gaussian {
  Eigen::Vector3d mean;  ///< in its voxel, in (0, 1)
  double xx, xy, xz, yy, yz, zz;
};

/// Eigenvalues of the covariance are raised to `eigenvalue_floor` times the largest. Off by at most
/// 2^-17 voxel edges in the mean and 2^-16 of the largest standard deviation in L.
/// @return nothing for points that all coincide
[[nodiscard]] std::optional<Cell> cell_of(const Moments& moments, double eigenvalue_floor);

[[nodiscard]] Gaussian gaussian_of(const Cell& cell) noexcept;

}  // namespace vantage::ndt
