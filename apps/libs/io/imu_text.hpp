#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "io/raw_imu.hpp"
#include "vantage/result.hpp"

namespace vantage::io {

/// Whether the first line of a text names the columns of inertial samples.
[[nodiscard]] bool looks_like_imu_csv(std::string_view head) noexcept;

/// Reads the content of a CSV file, see read_imu; `file` is its name in errors.
/// Errors (`where` is the file and the line): `corrupt_data`.
[[nodiscard]] Result<RawImu> parse_imu_csv(std::string_view content, const std::string& file);

/// Whether a folder is KITTI's oxts.
[[nodiscard]] bool looks_like_oxts(const std::filesystem::path& folder) noexcept;

/// Reads KITTI's folder oxts, see read_imu. Errors: those of read_imu.
[[nodiscard]] Result<RawImu> read_oxts(const std::filesystem::path& folder,
                                       std::optional<double> frame_rate_hz);

}  // namespace vantage::io
