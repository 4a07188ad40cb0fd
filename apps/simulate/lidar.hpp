#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "simulate/drive.hpp"
#include "simulate/params.hpp"
#include "simulate/world.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage::simulation {

/// One revolution.
struct Sweep {
  PointCloud points;           ///< sensor frame [m], firing by firing, rings from low to high
  std::vector<float> seconds;  ///< time of each point after the scan's stamp, which is that of the
                               ///< first firing; empty without motion distortion
};

/// A rotating multi-beam LiDAR.
/// Thread safety: const methods may run on one object from many threads at once.
class Lidar {
 public:
  Lidar(const LidarParams& params, std::uint64_t seed);

  /// Unit direction of a ray in the sensor frame: x forward, y left, z up. The sensor turns
  /// clockwise seen from above and starts at the back.
  [[nodiscard]] Eigen::Vector3d direction(int firing, int ring) const noexcept;

  /// Noise and losses of a ray depend only on the seed, the scan and the ray.
  /// With `motion_distortion`, a point is in the sensor frame at its own moment; otherwise in the
  /// sensor frame at the scan's stamp.
  [[nodiscard]] Sweep sweep(const World& world, const Drive& drive, std::size_t index) const;
  /// The points of that sweep.
  [[nodiscard]] PointCloud scan(const World& world, const Drive& drive, std::size_t index) const;

 private:
  LidarParams params_;
  std::uint64_t seed_;
};

}  // namespace vantage::simulation
