#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vantage/result.hpp"

namespace vantage::io {

/// What a field's name and type say about the times in it.
struct TimeFormat {
  double per_second = 1.0;      ///< units of the numbers per second
  bool has_named_unit = false;  ///< whether the name contains the unit
  bool is_floating_point = false;
  bool is_wide = false;        ///< 8 bytes: wide enough for the time of day
  bool wraps = false;          ///< an integer of 4 bytes: its clock starts again after 2^32 units
  std::size_t preference = 0;  ///< of the fields of one file, the smallest value wins
};

/// Whether a field holds point times, and in which format. The rules are those of PointTimes.
/// @param size  size of a value [bytes]
[[nodiscard]] std::optional<TimeFormat> time_format(std::string_view name, bool is_floating_point,
                                                    std::size_t size);

/// When the points of one file were measured, in the units of the file.
///
/// The field is named offset_time, time_offset, relative_time, rel_time, t, time, time_stamp or
/// timestamp, in upper or lower case; the first of these that exists is used. CloudCompare's prefix
/// `scalar_` and a unit at the end (_ns, _us, _ms, _s) may be added.
/// The name gives the unit. Without one, numbers of 8 bytes are in the only unit (s, ms, us or ns)
/// in which all of them are within 10 s of the scan's stamp. If there is no such unit, floating
/// point is in seconds. If it would then span more than 10 s, it is in the unit (ms, us or ns) in
/// which a sweep of 1000 or more points lasts 4 ms to 1.5 s; otherwise, in 8 bytes, in nanoseconds
/// if only these make a sweep of at most 10 s (a clock without synchronization, as of Livox).
/// Integers of 4 or 8 bytes are in nanoseconds, and shorter ones in microseconds.
/// Integers of 4 bytes have wrapped around if they span less with their upper half before 0.
struct PointTimes {
  std::vector<double> values;  ///< one per point; empty if the file has none
  TimeFormat format;
  std::string field;  ///< the field's name
};

/// The point of a sweep whose time a scan's stamp is.
enum class StampedPoint : std::uint8_t { first, middle, last };

/// The points' times after the scan's stamp [s].
///
/// - Times within 10 s of zero count from the stamp.
/// - Times of 8 bytes within 10 s of the stamp are absolute. If both could be true (a clock that
///   has just started), the reading that puts the farthest point nearer to the stamp is used; in a
///   tie, the first.
/// - All other times belong to another clock (of the sensor, or because the stamps are made from
///   frame numbers): they count from the earliest point.
/// - With `stamped`, the stamp is the time of the earliest or the latest point, or of the middle
///   between them, whatever the times count from.
/// @return  one time per value
/// Errors (`where` is the file): `corrupt_data` for a time that is not finite, for a sweep of more
/// than 10 s, and for a sweep of 1000 or more points at over 2e7 points per second: the unit must
/// be another one.
[[nodiscard]] Result<std::vector<float>> seconds_after(
    double stamp, const PointTimes& times, const std::filesystem::path& file,
    std::optional<StampedPoint> stamped = std::nullopt);

}  // namespace vantage::io
