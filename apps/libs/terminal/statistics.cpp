#include "terminal/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

namespace vantage::cli {
namespace {

double percentile(const std::vector<double>& sorted, double share) {
  const double position = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return std::lerp(sorted[below], sorted[above], position - static_cast<double>(below));
}

}  // namespace

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

nlohmann::ordered_json to_json(const Statistics& s) {
  return {{"count", s.count},   {"mean", s.mean}, {"rmse", s.rmse}, {"std", s.std}, {"min", s.min},
          {"median", s.median}, {"p95", s.p95},   {"p99", s.p99},   {"max", s.max}};
}

}  // namespace vantage::cli
