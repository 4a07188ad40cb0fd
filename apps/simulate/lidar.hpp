#pragma once

#include <cstddef>
#include <cstdint>

#include "simulate/drive.hpp"
#include "simulate/params.hpp"
#include "simulate/world.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage::simulation {

/// A rotating multi-beam LiDAR.
/// Thread safety: const methods may run on one object from many threads at once.
class Lidar {
 public:
  Lidar(const LidarParams& params, std::uint64_t seed);

  /// Unit direction of a ray in the sensor frame: x forward, y left, z up. The sensor turns
  /// clockwise seen from above and starts at the back.
  [[nodiscard]] Eigen::Vector3d direction(int firing, int ring) const noexcept;

  /// One revolution. Noise and losses of a ray depend on the seed, the scan and the ray alone.
  /// @return  points in the sensor frame [m], firing by firing, rings from low to high
  [[nodiscard]] PointCloud scan(const World& world, const Drive& drive, std::size_t index) const;

 private:
  LidarParams params_;
  std::uint64_t seed_;
};

}  // namespace vantage::simulation
