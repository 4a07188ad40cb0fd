#pragma once

#include "vantage/result.hpp"

namespace vantage::matching {

/// d1, d2, d3 of Eq. 12: the Gaussian that approximates the log-likelihood of a normal distribution
/// mixed with uniform outliers (Magnusson 2009, Eqs. 6.8-6.9).
struct NdtCoefficients {
  double d1 = 0.0, d2 = 0.0, d3 = 0.0;

  /// Derives the coefficients: c1 = 10 (1 - outlier_ratio), c2 = outlier_ratio / resolution^3,
  /// d3 = -ln c2, d1 = -ln(c1 + c2) - d3, d2 = -2 ln((-ln(c1 e^-0.5 + c2) - d3) / d1).
  /// Errors: `invalid_input` unless 0 < outlier_ratio < 1 and 0 < resolution [m].
  [[nodiscard]] static Result<NdtCoefficients> derive(double outlier_ratio, double resolution);

  /// The likelihood that one voxel's distribution gives a point: -d1 exp(-d2/2 m), where m is the
  /// squared Mahalanobis distance. The term in the braces of Eq. 12 is this value minus d3.
  [[nodiscard]] double likelihood(double squared_mahalanobis) const noexcept;
};

}  // namespace vantage::matching
