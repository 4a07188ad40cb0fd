#include "common/scan_score_sum.hpp"

#include <algorithm>
#include <limits>

namespace vantage::matching {

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

}  // namespace vantage::matching
