#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage::benchmarks {

/// A scan of the recorded drive and where it was taken.
struct Frame {
  double stamp;     ///< [s]
  PointCloud scan;  ///< sensor frame [m], thinned
  Pose T_map_scan;  ///< the reference
};

/// The recorded drive.
struct Drive {
  PointCloud map;  ///< [m]
  std::vector<Frame> frames;
};

/// @param folder      holds map.pcd, scans/ and ref_poses_tum.txt
/// @param scan_voxel  scans become the centroids of voxels of this edge [m]
/// @param scans       only the first of those that have a reference pose; 0: all
/// Errors: those of the readers; `invalid_input` if no scan has a reference pose.
[[nodiscard]] Result<Drive> load_drive(const std::filesystem::path& folder, double scan_voxel,
                                       std::size_t scans = 0);

/// Constant velocity in the sensor's own frame, as the localizer predicts; the first pose is the
/// reference's.
/// Precondition: fewer estimates than frames.
[[nodiscard]] Pose predicted(const std::vector<Pose>& estimates, const std::vector<Frame>& frames);

struct PoseError {
  double centimetres = 0.0, degrees = 0.0;
};
[[nodiscard]] PoseError error_of(const Pose& estimate, const Pose& reference);

/// What following a drive with an aligner gave.
struct DriveErrors {
  std::vector<double> centimetres, degrees;  ///< of every frame
  std::size_t failed = 0;                    ///< frames whose pose is only predicted
};

/// Follows the drive, each guess predicted from the estimates before.
/// @param align  scan and guess to pose; an error is a failed scan, not one of the drive
[[nodiscard]] DriveErrors follow(
    const std::vector<Frame>& frames,
    const std::function<Result<Pose>(PointsView scan, const Pose& T_map_scan_guess)>& align);

/// CPU time of the process [s]: what others do on the machine tells less in it than in wall time.
[[nodiscard]] double cpu_seconds();

/// A row of a markdown table on stdout.
void print_row(const std::vector<std::string>& cells);
/// Its title, above an empty line, and its first two rows.
void print_head(const std::string& title, const std::vector<std::string>& columns);

}  // namespace vantage::benchmarks
