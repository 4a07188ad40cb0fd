#include "vantage/io/point_times.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "io/text.hpp"

namespace vantage::io {
namespace {

constexpr double kLongestSweep = 10.0;      // [s]
constexpr double kMostPointsASecond = 2e7;  // several times as many as the fastest sensors measure
constexpr double kOneMoment = 1e-6;         // rounding leaves at most this much of equal times [s]

/// Times that count from the stamp come first, because they need no second clock.
constexpr std::array<std::string_view, 8> kNames{"offset_time", "time_offset", "relative_time",
                                                 "rel_time",    "t",           "time",
                                                 "time_stamp",  "timestamp"};
constexpr std::array<std::pair<std::string_view, double>, 4> kUnits{
    {{"_ns", 1e9}, {"_us", 1e6}, {"_ms", 1e3}, {"_s", 1.0}}};

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

double default_unit(bool is_floating_point, std::size_t size) {
  if (is_floating_point) return 1.0;
  return size >= 4 ? 1e9 : 1e6;
}

double per_second(const TimeFormat& format, double largest) {
  constexpr double kNoSeconds = 1e14;
  const bool are_nanoseconds =
      format.is_floating_point && !format.has_named_unit && largest >= kNoSeconds;
  return are_nanoseconds ? 1e9 : format.per_second;
}

/// The moment from which the times count, in their own clock [s].
double origin(double first, double last, double stamp, bool may_be_absolute) {
  const auto farthest_from = [&](double zero) {
    return std::max(std::abs(first - zero), std::abs(last - zero));
  };
  const double relative = farthest_from(0.0), absolute = farthest_from(stamp);
  if (may_be_absolute && absolute <= kLongestSweep && absolute < relative) return stamp;
  return relative <= kLongestSweep ? 0.0 : first;
}

}  // namespace

std::optional<TimeFormat> time_format(std::string_view name, bool is_floating_point,
                                      std::size_t size) {
  const std::string lower = lower_case(name);
  std::string_view base = lower;
  constexpr std::string_view kCloudCompare = "scalar_";
  if (base.starts_with(kCloudCompare)) base.remove_prefix(kCloudCompare.size());
  TimeFormat format{.per_second = default_unit(is_floating_point, size),
                    .has_named_unit = false,
                    .is_floating_point = is_floating_point,
                    .is_wide = size == 8,
                    .preference = 0};
  for (const auto& [suffix, units] : kUnits) {
    if (!base.ends_with(suffix)) continue;
    base.remove_suffix(suffix.size());
    format.per_second = units;
    format.has_named_unit = true;
    break;
  }
  const auto found = std::find(kNames.begin(), kNames.end(), base);
  if (found == kNames.end()) return std::nullopt;
  format.preference = static_cast<std::size_t>(found - kNames.begin());
  return format;
}

Result<std::vector<float>> seconds_after(double stamp, const PointTimes& times,
                                         const std::filesystem::path& file) {
  if (times.values.empty()) return std::vector<float>{};
  const auto error = [&](const std::string& found) {
    return fail(ErrorCode::corrupt_data,
                fmt::format("field {} {}", quoted(std::string_view(times.field)), found),
                SourceLocation{file.string(), 0, 0});
  };
  for (const double value : times.values) {
    if (!std::isfinite(value)) {
      return error(fmt::format("holds the time {}, expected finite numbers", value));
    }
  }
  const auto [least, most] = std::minmax_element(times.values.begin(), times.values.end());
  const double units = per_second(times.format, std::max(std::abs(*least), std::abs(*most)));
  const double first = *least / units, last = *most / units, sweep = last - first;
  const std::string as = fmt::format(
      "read in units of 1/{:.0f} s; a name that ends in _ns, _us, _ms or _s says another one",
      units);
  if (sweep > kLongestSweep) {
    return error(
        fmt::format("spans {} s, expected a sweep of at most {} s ({})", sweep, kLongestSweep, as));
  }
  constexpr std::size_t kEnoughToTell = 1000;
  const auto points = static_cast<double>(times.values.size());
  if (times.values.size() >= kEnoughToTell && sweep > kOneMoment &&
      points > kMostPointsASecond * sweep) {
    return error(fmt::format("has {} points in {} s, more than any sensor ({})",
                             times.values.size(), sweep, as));
  }
  const double zero = origin(first, last, stamp, times.format.is_wide);
  std::vector<float> seconds;
  seconds.reserve(times.values.size());
  for (const double value : times.values) {
    seconds.push_back(static_cast<float>(value / units - zero));
  }
  return seconds;
}

}  // namespace vantage::io
