#pragma once

#include <cstddef>
#include <span>

#include "common/ndt_coefficients.hpp"
#include "vantage/scan_score.hpp"

namespace vantage::matching {

/// Adds up Eq. 12 point by point.
class ScanScoreSum {
 public:
  explicit ScanScoreSum(const NdtCoefficients& coefficients) noexcept : d_(coefficients) {}

  /// Adds one scan point, given its squared Mahalanobis distances to the neighbouring voxels. A
  /// point without a distance has no voxel and contributes 0.
  void add(std::span<const double> squared_mahalanobis) noexcept;
  /// Adds the sums of another part of the same scan.
  void add(const ScanScoreSum& other) noexcept;
  /// All values are zero if no point was added.
  [[nodiscard]] ScanScore mean() const noexcept;

 private:
  NdtCoefficients d_;
  double fitness_ = 0.0, best_ = 0.0;
  std::size_t points_ = 0, matched_ = 0;
};

}  // namespace vantage::matching
