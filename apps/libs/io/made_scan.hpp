#pragma once

#include <string>

#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/scan_source.hpp"
#include "vantage/result.hpp"

namespace vantage::io {

/// The scan that a file or a message holds, without points that are no returns or that
/// `options.tags` refuses, and without their times.
/// @param file  the file's name in errors; the scan gets it as its own
/// Errors: those of seconds_after.
[[nodiscard]] Result<StampedScan> made_scan(LoadedCloud cloud, double stamp,
                                            const ScanOptions& options, const std::string& file);

}  // namespace vantage::io
