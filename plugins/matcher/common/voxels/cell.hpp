#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

namespace vantage::ndt {

struct Cell;

/// Sums over the points of one voxel, relative to the voxel's centre and in units of its edge. The
/// numbers are small there, and the covariance loses no digits to cancellation.
///
/// Written as pairs: a compiler's own pairing may load two sums at once that were stored one at a
/// time, and stall.
class Moments {
 public:
  void add(double dx, double dy, double dz) noexcept {
    const Pair xy{dx, dy};
    xy_ += xy;
    z_n_ += Pair{dz, 1.0};
    xx_xy_ += Pair{dx, dx} * xy;
    xz_yy_ += xy * Pair{dz, dy};
    yz_zz_ += Pair{dy, dz} * Pair{dz, dz};
  }
  /// Adds the points of one of the eight cells that a voxel consists of.
  /// @param upper  by axis: 1 for a cell in the upper half of the voxel, 0 in the lower
  void add(const Cell& cell, const Eigen::Vector3d& upper) noexcept;
  [[nodiscard]] double count() const noexcept { return z_n_[1]; }
  /// The count, or the largest number that a cell can keep.
  [[nodiscard]] std::uint32_t points() const noexcept {
    return static_cast<std::uint32_t>(std::min(z_n_[1], 4294967295.0));
  }
  [[nodiscard]] Eigen::Vector3d sum() const noexcept { return {xy_[0], xy_[1], z_n_[0]}; }
  [[nodiscard]] Eigen::Matrix3d sum_of_squares() const noexcept {
    Eigen::Matrix3d m;
    m << xx_xy_[0], xx_xy_[1], xz_yy_[0], xx_xy_[1], xz_yy_[1], yz_zz_[0], xz_yy_[0], yz_zz_[0],
        yz_zz_[1];
    return m;
  }

 private:
  using Pair = double __attribute__((vector_size(16)));
  Pair xy_{}, z_n_{}, xx_xy_{}, xz_yy_{}, yz_zz_{};
};

/// The normal distribution of the map points in one voxel (Magnusson 2009, Eqs. 6.2-6.3) in 24
/// bytes, in units of the voxel's edge. Prepared and restored maps both use this form, so both give
/// the same bits.
struct Cell {
  std::array<std::uint16_t, 3> mean{};  ///< in the voxel, in units of 2^-16, plus half a unit
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

/// Eigenvalues of the covariance are raised to at least `eigenvalue_floor` times the largest. The
/// cell is off by at most 2^-17 voxel edges in the mean and 2^-16 of the largest standard deviation
/// in L.
/// @return  no value if all points coincide
[[nodiscard]] std::optional<Cell> cell_of(const Moments& moments, double eigenvalue_floor);

[[nodiscard]] Gaussian gaussian_of(const Cell& cell) noexcept;

}  // namespace vantage::ndt
