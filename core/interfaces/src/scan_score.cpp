#include "vantage/scan_score.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace vantage {

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

void ScanScoreSum::add(std::span<const double> squared_mahalanobis) noexcept {
  ++points_;
  if (squared_mahalanobis.empty()) return;
  ++matched_;
  double sum = 0.0;
  double best = -std::numeric_limits<double>::infinity();
  for (const double m : squared_mahalanobis) {
    const double likelihood = d_.likelihood(m);
    sum += likelihood - d_.d3;
    best = std::max(best, likelihood);
  }
  fitness_ += sum / static_cast<double>(squared_mahalanobis.size());
  best_ += best;
}

void ScanScoreSum::add(const ScanScoreSum& other) noexcept {
  fitness_ += other.fitness_;
  best_ += other.best_;
  points_ += other.points_;
  matched_ += other.matched_;
}

ScanScore ScanScoreSum::mean() const noexcept {
  ScanScore score;
  if (points_ == 0) return score;
  score.fitness = fitness_ / static_cast<double>(points_);
  score.coverage = static_cast<double>(matched_) / static_cast<double>(points_);
  if (matched_ > 0) score.nvtl = best_ / static_cast<double>(matched_);
  return score;
}

double localization_contribution_per_point(double fitness, std::size_t map_points) noexcept {
  return map_points == 0 ? 0.0 : fitness / static_cast<double>(map_points);
}

}  // namespace vantage
