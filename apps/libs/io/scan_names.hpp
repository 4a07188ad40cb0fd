#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "vantage/result.hpp"

namespace vantage::io {

struct ScanStamps {
  std::vector<double> values;  ///< [s]
  std::string rule;            ///< a sentence that says where the stamps come from
};

/// Sorts scans by the numbers in their names. If all names without their ending are `12` or `12.5`
/// after an equal prefix, and a dot occurs, they are in the order of these numbers; otherwise they
/// are in natural order (less_by_natural_order).
void sort_scans(std::vector<std::filesystem::path>& files);

/// The stamps that the names of sorted scans state. If every name is a number after an equal prefix
/// without digits, its form decides:
/// - 18 digits or more: nanoseconds
/// - 16 or 17 digits: microseconds
/// - 13 digits, the first not 0: milliseconds
/// - 10 digits, the first not 0: seconds
/// - digits, a dot, digits: seconds; the digits after the dots are whole nanoseconds, with or
///   without leading zeros, if the most are nine and no fewer begin with a zero
/// - other digits, without a prefix: frame number / rate_hz
/// Otherwise, stamps are the position / rate_hz.
/// Errors: `corrupt_data` for numbers of several forms, for one that does not fit 64 bits, and for
/// stamps that do not increase strictly.
[[nodiscard]] Result<ScanStamps> stamps_from_names(const std::vector<std::filesystem::path>& files,
                                                   double rate_hz);

}  // namespace vantage::io
