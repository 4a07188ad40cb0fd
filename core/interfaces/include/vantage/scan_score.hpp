#pragma once

#include <cstddef>
#include <span>

#include "vantage/api.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// d1, d2, d3 of Eq. 12: the Gaussian that approximates the log-likelihood of a normal distribution
/// mixed with uniform outliers (Magnusson 2009, Eqs. 6.8-6.9).
struct NdtCoefficients {
  double d1 = 0.0, d2 = 0.0, d3 = 0.0;

  /// Derives the coefficients: c1 = 10 (1 - outlier_ratio), c2 = outlier_ratio / resolution^3,
  /// d3 = -ln c2, d1 = -ln(c1 + c2) - d3, d2 = -2 ln((-ln(c1 e^-0.5 + c2) - d3) / d1).
  /// Errors: `invalid_input` unless 0 < outlier_ratio < 1 and 0 < resolution [m].
  [[nodiscard]] VANTAGE_API static Result<NdtCoefficients> derive(double outlier_ratio,
                                                                  double resolution);

  /// The likelihood that one voxel's distribution gives a point: -d1 exp(-d2/2 m), where m is the
  /// squared Mahalanobis distance. The term in the braces of Eq. 12 is this value minus d3.
  [[nodiscard]] VANTAGE_API double likelihood(double squared_mahalanobis) const noexcept;
};

/// How well a scan fits a map at one pose. S_fitness alone rewards a map with missing points (a
/// scan point without a voxel scores 0, a badly matched one below 0), so read it together with
/// coverage and NVTL.
struct ScanScore {
  double fitness = 0.0;  ///< S_fitness, Eq. 12: mean over all N points of the mean over N_i
  double nvtl = 0.0;  ///< nearest voxel transformation likelihood: mean over the matched points of
                      ///< the best voxel's likelihood
  double coverage = 0.0;  ///< share of scan points with at least one voxel, in [0, 1]
  /// Of those points, the share that was compared with the map. The rest met voxels of which a
  /// selector kept only that they are occupied: their part of the score is estimated.
  double compared = 1.0;
};

/// Adds up Eq. 12 point by point.
class VANTAGE_API ScanScoreSum {
 public:
  explicit ScanScoreSum(const NdtCoefficients& coefficients) noexcept : d_(coefficients) {}

  /// Adds one scan point, given its squared Mahalanobis distances to the neighbouring voxels. A
  /// point without a distance has no voxel and contributes 0.
  void add(std::span<const double> squared_mahalanobis) noexcept;
  /// Adds the sums of another part of the same scan.
  void add(const ScanScoreSum& other) noexcept;
  /// All values are zero if no point was added.
  [[nodiscard]] ScanScore mean() const noexcept;
  [[nodiscard]] std::size_t matched_points() const noexcept { return matched_; }

 private:
  NdtCoefficients d_;
  double fitness_ = 0.0, best_ = 0.0;
  std::size_t points_ = 0, matched_ = 0;
};

/// LCP, Eq. 13: S_fitness / N_point; 0 for a map without points.
[[nodiscard]] VANTAGE_API double localization_contribution_per_point(
    double fitness, std::size_t map_points) noexcept;

}  // namespace vantage
