#include "vantage/io/point_times.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "io/text.hpp"

namespace vantage::io {
namespace {

constexpr double kLongestSweep = 10.0;       // [s]
constexpr double kMostPointsASecond = 2e7;   // several times as many as the fastest sensors measure
constexpr double kOneMoment = 1e-6;          // rounding leaves at most this much of equal times [s]
constexpr std::size_t kEnoughToTell = 1000;  // points
constexpr double kFinestStep = 2e-7;         // of times in float64 since the epoch: 256 ns [s]

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

struct Range {
  double least = 0.0, most = 0.0;

  [[nodiscard]] double size() const noexcept { return most - least; }
  /// The distance of the number that is farthest from `zero`.
  [[nodiscard]] double reach(double zero) const noexcept {
    return std::max(std::abs(least - zero), std::abs(most - zero));
  }
  [[nodiscard]] Range in(double units) const noexcept { return {least / units, most / units}; }
};

Range range_of(const std::vector<double>& values) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  return {*least, *most};
}

/// The only unit in which all times are near the stamp. A stamp of a few seconds tells none.
std::optional<double> unit_by_stamp(const Range& times, double stamp) {
  std::optional<double> found;
  for (const auto& [name, units] : kUnits) {
    if (times.in(units).reach(stamp) > kLongestSweep) continue;
    if (found) return std::nullopt;
    found = units;
  }
  return found;
}

/// The times without the quarter of the earliest and the quarter of the latest ones.
Range middle_of(std::vector<double> values) {
  const auto at = [&values](std::size_t rank) {
    const auto place = values.begin() + static_cast<std::ptrdiff_t>(rank);
    std::nth_element(values.begin(), place, values.end());
    return *place;
  };
  return {at(values.size() / 4), at(3 * values.size() / 4)};
}
constexpr double kMostOfStrays = 0.1;  // of the range; half of an even sweep is half of it

/// If stray times alone, as the 0 of a point without one, keep a unit from bringing all times near
/// the stamp: that unit.
std::optional<double> unit_despite_strays(const std::vector<double>& values, const Range& times,
                                          double stamp) {
  const Range middle = middle_of(values);
  if (middle.size() > kMostOfStrays * times.size()) return std::nullopt;
  for (const auto& [name, units] : kUnits) {
    if (times.in(units).size() > kLongestSweep && middle.in(units).reach(stamp) <= kLongestSweep) {
      return units;
    }
  }
  return std::nullopt;
}

/// The unit below a second in which the sweep lasts about as long as sweeps do. Sensors turn 5 to
/// 100 times a second, and units are a thousand times apart, so it is clear. Nothing for few
/// points, or if some of them are strays, which may be what makes the sweep long.
std::optional<double> unit_by_sweep(const std::vector<double>& values, const Range& times) {
  constexpr double kShortest = 0.004, kLongest = 1.5;  // [s]
  if (values.size() < kEnoughToTell) return std::nullopt;
  if (middle_of(values).size() < kMostOfStrays * times.size()) return std::nullopt;
  for (const auto& [name, units] : kUnits) {
    const double seconds = times.in(units).size();
    if (units > 1.0 && seconds >= kShortest && seconds <= kLongest) return units;
  }
  return std::nullopt;
}

double per_second(const TimeFormat& format, const std::vector<double>& values, const Range& times,
                  double stamp) {
  if (format.has_named_unit) return format.per_second;
  if (format.is_wide) {
    if (const auto units = unit_by_stamp(times, stamp)) return *units;
  }
  if (!format.is_floating_point || times.size() <= kLongestSweep) return format.per_second;
  if (const auto units = unit_by_sweep(values, times)) return *units;
  constexpr double kNanoseconds = 1e9;
  const double as_nanoseconds = times.in(kNanoseconds).size();
  const bool only_nanoseconds =
      format.is_wide && as_nanoseconds >= kFinestStep && as_nanoseconds <= kLongestSweep;
  if (!only_nanoseconds) return format.per_second;
  return unit_despite_strays(values, times, stamp).value_or(kNanoseconds);
}

/// Times of a clock of 32 bits that may have started again within the scan. Points are measured
/// within a short time, so the reading with the smaller range is right.
std::vector<double> unwrapped(const PointTimes& times) {
  constexpr double kHalf = 2147483648.0;
  if (!times.format.wraps) return times.values;
  std::vector<double> before = times.values;  // the upper half is before 0
  for (double& value : before) value -= value >= kHalf ? 2.0 * kHalf : 0.0;
  return range_of(before).size() < range_of(times.values).size() ? before : times.values;
}

/// The moment from which the times count, in their own clock [s].
double origin(const Range& times, double stamp, bool may_be_absolute) {
  const double relative = times.reach(0.0), absolute = times.reach(stamp);
  if (may_be_absolute && absolute <= kLongestSweep && absolute < relative) return stamp;
  return relative <= kLongestSweep ? 0.0 : times.least;
}

double time_of(StampedPoint point, const Range& times) {
  switch (point) {
    case StampedPoint::first: return times.least;
    case StampedPoint::middle: return 0.5 * (times.least + times.most);
    case StampedPoint::last: return times.most;
  }
  return times.least;
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
                    .wraps = size == 4 && !is_floating_point,
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
                                         const std::filesystem::path& file,
                                         std::optional<StampedPoint> stamped) {
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
  const std::vector<double> values = unwrapped(times);
  const Range range = range_of(values);
  const double units = per_second(times.format, values, range, stamp);
  const Range sweep = range.in(units);
  const std::string as = fmt::format(
      "read in units of 1/{:.0f} s; a name that ends in _ns, _us, _ms or _s says another one",
      units);
  if (sweep.size() > kLongestSweep) {
    return error(fmt::format("spans {} s, expected a sweep of at most {} s ({})", sweep.size(),
                             kLongestSweep, as));
  }
  const auto points = static_cast<double>(values.size());
  if (values.size() >= kEnoughToTell && sweep.size() > kOneMoment &&
      points > kMostPointsASecond * sweep.size()) {
    return error(fmt::format("has {} points in {} s, more than any sensor ({})", values.size(),
                             sweep.size(), as));
  }
  const double zero =
      stamped ? time_of(*stamped, sweep) : origin(sweep, stamp, times.format.is_wide);
  std::vector<float> seconds;
  seconds.reserve(values.size());
  for (const double value : values) seconds.push_back(static_cast<float>(value / units - zero));
  return seconds;
}

}  // namespace vantage::io
