#include "vantage/evaluation/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace vantage {

double percentile(std::span<const double> sorted, double share) {
  const double position = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return std::lerp(sorted[below], sorted[above], position - static_cast<double>(below));
}

Statistics statistics_of(std::span<const double> sample) {
  Statistics s;
  s.count = sample.size();
  if (sample.empty()) return s;
  const auto n = static_cast<double>(sample.size());
  double sum = 0, squares = 0;
  for (const double x : sample) {
    sum += x;
    squares += x * x;
  }
  s.sum = sum;
  s.mean = sum / n;
  s.rmse = std::sqrt(squares / n);
  double spread = 0;
  for (const double x : sample) spread += (x - s.mean) * (x - s.mean);
  s.std = std::sqrt(spread / n);
  std::vector<double> sorted(sample.begin(), sample.end());
  std::sort(sorted.begin(), sorted.end());
  s.min = sorted.front();
  s.max = sorted.back();
  s.median = percentile(sorted, 0.5);
  s.p95 = percentile(sorted, 0.95);
  s.p99 = percentile(sorted, 0.99);
  return s;
}

}  // namespace vantage
