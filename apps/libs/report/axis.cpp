#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "report/chart.hpp"

namespace vantage::report {
namespace {

/// As few digits as distinguish ticks that are one step apart.
std::string tick_text(double value, double step) {
  if (std::abs(value) < 1e-9 * step) return "0";
  if (std::abs(value) >= 1e6 || std::abs(step) < 1e-4) return fmt::format("{:g}", value);
  const int digits = std::max(0, static_cast<int>(std::ceil(-std::log10(step) - 1e-9)));
  return fmt::format("{:.{}f}", value, digits);
}

double nice_step(double rough) {
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= rough * (1.0 - 1e-9)) return factor * power;
  }
  return 10.0 * power;
}

}  // namespace

double Axis::along(double value) const {
  const auto scaled = [&](double v) { return logarithmic ? std::log10(v) : v; };
  if (logarithmic && value <= 0.0) return 0.0;
  const double low = scaled(ticks.front().value), high = scaled(ticks.back().value);
  return std::clamp((scaled(value) - low) / (high - low), 0.0, 1.0);
}

Axis linear_axis(std::string label, double low, double high, std::size_t most) {
  if (high < low) std::swap(low, high);
  if (high - low <= 1e-12 * std::max(std::abs(low), std::abs(high)) || high == low) {
    const double around = std::max(0.5 * std::abs(low), 0.5);
    low -= low > 0.0 ? std::min(around, low) : around;
    high += around;
  }
  const double step =
      nice_step((high - low) / static_cast<double>(std::max<std::size_t>(most, 3) - 1));
  Axis axis{.label = std::move(label), .ticks = {}};
  const auto first = static_cast<long long>(std::floor(low / step + 1e-9));
  const auto last = static_cast<long long>(std::ceil(high / step - 1e-9));
  for (long long i = first; i <= std::max(last, first + 1); ++i) {
    const double value = static_cast<double>(i) * step;
    axis.ticks.push_back({value, tick_text(value, step)});
  }
  return axis;
}

Axis logarithmic_axis(std::string label, double low, double high) {
  Axis axis{.label = std::move(label), .ticks = {}, .logarithmic = true};
  const auto decades = std::log10(high / low);
  const std::vector<double> factors =
      decades < 3.0 ? std::vector<double>{1.0, 2.0, 5.0} : std::vector<double>{1.0};
  std::vector<double> all;
  const int first = static_cast<int>(std::floor(std::log10(low)));
  const int last = static_cast<int>(std::ceil(std::log10(high))) + 1;
  for (int power = first; power <= last; ++power) {
    for (const double factor : factors) all.push_back(factor * std::pow(10.0, power));
  }
  std::size_t begin = 0, end = all.size() - 1;
  while (begin + 1 < all.size() && all[begin + 1] <= low * (1.0 + 1e-9)) ++begin;
  while (end > begin + 1 && all[end - 1] >= high * (1.0 - 1e-9)) --end;
  for (std::size_t i = begin; i <= end; ++i) {
    axis.ticks.push_back({all[i], fmt::format("{:g}", all[i])});
  }
  return axis;
}

}  // namespace vantage::report
