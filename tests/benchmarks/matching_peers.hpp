#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage::benchmarks {

/// Something that matches scans to a map: a plugin, or another library.
class Competitor {
 public:
  struct Answer {
    Pose T_map_scan;
    std::uint32_t iterations = 0;  ///< 0 where it does not tell
  };

  Competitor() = default;
  virtual ~Competitor() = default;
  Competitor(const Competitor&) = delete;
  Competitor& operator=(const Competitor&) = delete;

  /// Everything that is done once a map.
  virtual Result<void> prepare(PointsView map) = 0;
  /// Brings the scan into the form the library wants, which is not timed.
  virtual void take(PointsView scan) = 0;
  virtual Result<Answer> align(const Pose& T_map_scan_guess) = 0;
};

/// PCL's NDT: 1 m voxels, epsilon 1e-6 (PCL compares squares: 1 mm), 35 iterations, step size 0.1.
[[nodiscard]] std::unique_ptr<Competitor> pcl_ndt();
/// PCL's GICP with its own defaults, but for a maximum distance of 1 m and the map thinned.
/// @param map_voxel  edge of the voxels [m]; 0: not thinned
[[nodiscard]] std::unique_ptr<Competitor> pcl_gicp(double map_voxel);
/// Open3D's point-to-plane ICP, within 1 m, at most 30 iterations, the map thinned. Its call builds
/// a tree over the map each time: there is no other way to call it.
[[nodiscard]] std::unique_ptr<Competitor> open3d_icp(double map_voxel);

}  // namespace vantage::benchmarks
