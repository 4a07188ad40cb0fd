#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vantage/result.hpp"

namespace vantage::io {

/// What the name and the type of a field say about the times in it.
struct TimeFormat {
  double per_second = 1.0;      ///< units of the numbers a second
  bool has_named_unit = false;  ///< the name says it
  bool is_floating_point = false;
  bool is_wide = false;        ///< 8 bytes: enough for the time of day
  std::size_t preference = 0;  ///< among the fields of one file the smallest is taken
};

/// Whether a field holds point times, and how. The rules are those of PointTimes.
/// @param size  of a value [bytes]
[[nodiscard]] std::optional<TimeFormat> time_format(std::string_view name, bool is_floating_point,
                                                    std::size_t size);

/// When the points of one file were measured, as the file has it.
///
/// The field is named offset_time, time_offset, relative_time, rel_time, t, time, time_stamp or
/// timestamp, in upper or lower case; the first of these that there is. CloudCompare's prefix
/// `scalar_` and a unit at the end (_ns, _us, _ms, _s) may be added.
/// The unit is that of the name; else seconds for floating point (nanoseconds from 1e14 on, which
/// would be three million years), nanoseconds for integers of 4 or 8 bytes, microseconds for
/// shorter ones.
struct PointTimes {
  std::vector<double> values;  ///< of each point; empty if the file has none
  TimeFormat format;
  std::string field;  ///< its name
};

/// The points' times after the scan's stamp [s].
///
/// - Times within 10 s of zero count from the stamp.
/// - Times of 8 bytes within 10 s of the stamp are absolute. Where both could be (a clock that has
///   just started), they are what puts the farthest point nearer to the stamp, in doubt the first.
/// - Others are those of another clock (of the sensor, or the stamps are made from frame numbers):
///   they count from the earliest point.
/// @return  as many as there are values
/// Errors (`where` is the file): `corrupt_data` for a time that is not finite, a sweep of more than
/// 10 s, or one of 1000 points or more at over 2e7 points a second: then the unit is another one.
[[nodiscard]] Result<std::vector<float>> seconds_after(double stamp, const PointTimes& times,
                                                       const std::filesystem::path& file);

}  // namespace vantage::io
