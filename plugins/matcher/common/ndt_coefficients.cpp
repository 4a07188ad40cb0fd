#include "common/ndt_coefficients.hpp"

#include <cmath>
#include <string>

namespace vantage::matching {

Result<NdtCoefficients> NdtCoefficients::derive(double outlier_ratio, double resolution) {
  if (!(outlier_ratio > 0.0 && outlier_ratio < 1.0)) {
    return fail(ErrorCode::invalid_input,
                "outlier ratio must lie in (0, 1), not " + std::to_string(outlier_ratio));
  }
  if (!(resolution > 0.0) || !std::isfinite(resolution)) {
    return fail(ErrorCode::invalid_input,
                "NDT resolution must be a positive length, not " + std::to_string(resolution));
  }
  const double c1 = 10.0 * (1.0 - outlier_ratio);
  const double c2 = outlier_ratio / (resolution * resolution * resolution);
  NdtCoefficients d;
  d.d3 = -std::log(c2);
  d.d1 = -std::log(c1 + c2) - d.d3;
  d.d2 = -2.0 * std::log((-std::log(c1 * std::exp(-0.5) + c2) - d.d3) / d.d1);
  return d;
}

double NdtCoefficients::likelihood(double squared_mahalanobis) const noexcept {
  return -d1 * std::exp(-0.5 * d2 * squared_mahalanobis);
}

}  // namespace vantage::matching
