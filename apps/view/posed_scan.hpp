#pragma once

#include <optional>

#include "vantage/io/scan_source.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage::view {

/// A scan as it is matched, and where it was taken.
struct PosedScan {
  PointCloud points;  ///< sensor frame at the middle of the sweep [m]
  Pose T_map_scan;
};

/// Thins a scan as a localizer does, and undistorts it by the motion of the reference: the steady
/// one between the ends of the sweep. Where an end has no pose, points stay as they were measured.
/// None if the middle of the sweep has no pose.
/// Errors: those of time_of and of prepare_scan.
[[nodiscard]] Result<std::optional<PosedScan>> posed_scan(const io::StampedScan& scan,
                                                          const io::Trajectory& reference);

}  // namespace vantage::view
