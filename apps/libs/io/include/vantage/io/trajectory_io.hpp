#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage::io {

struct StampedPose {
  double stamp = 0.0;  ///< [s]
  Pose pose;
};

/// Poses with strictly increasing stamps.
using Trajectory = std::vector<StampedPose>;

/// Reads a text file with one pose per line. `#` starts a comment line; blank lines do not count.
/// The first pose determines the format of the whole file by its number of columns:
/// - 8, TUM: `t x y z qx qy qz qw`
/// - 12, KITTI: the row-major 3x4 matrix [R | t]; stamp = row / kitti_rate_hz, rows from 0
/// - 13: a frame number and the 12 columns of KITTI; stamp = frame / kitti_rate_hz
/// Quaternions within 1e-3 of unit length are normalized; matrices must be orthonormal to 1e-3.
/// Errors (`where` is the file and line): `not_found`, `io_failure`; `invalid_input` for a rate
/// that is not positive; `corrupt_data` for malformed text, a rotation that is invalid, stamps that
/// do not increase strictly, or a file without a pose.
[[nodiscard]] Result<Trajectory> read_trajectory(const std::filesystem::path& path,
                                                 double kitti_rate_hz = 10.0);

/// Reads the content of a file; `file` is its name in errors.
[[nodiscard]] Result<Trajectory> parse_trajectory(std::string_view content, const std::string& file,
                                                  double kitti_rate_hz = 10.0);

/// Writes TUM lines, or KITTI lines of 12 columns (which have no stamps). Every double reads back
/// as the same value, except that KITTI rotations pass through a matrix. Atomic, see OutputFile.
/// Errors: `invalid_input` for an invalid pose or for stamps that do not increase strictly; those
/// of OutputFile.
[[nodiscard]] Result<void> write_tum(const std::filesystem::path& path,
                                     const Trajectory& trajectory);
[[nodiscard]] Result<void> write_kitti(const std::filesystem::path& path,
                                       const Trajectory& trajectory);

/// The text that write_tum writes.
/// @param file  the file's name in errors
/// Errors: `invalid_input` as above.
[[nodiscard]] Result<std::string> to_tum(const std::filesystem::path& file,
                                         const Trajectory& trajectory);

/// The pose at a stamp [s]. It is interpolated if the poses before and after are at most
/// `max_gap_s` apart. Otherwise it is the nearest pose within 1e-3 s, so that rounded stamps still
/// match. If there is no such pose, the result is empty. Never extrapolates.
[[nodiscard]] std::optional<Pose> pose_at(const Trajectory& trajectory, double stamp,
                                          double max_gap_s = 1.0);

}  // namespace vantage::io
