#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "simulate/crowd.hpp"
#include "simulate/drive.hpp"
#include "simulate/params.hpp"
#include "simulate/world.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage::simulation {

/// One sweep of the sensor: of a spinning one, a revolution.
struct Sweep {
  PointCloud points;           ///< sensor frame [m], firing by firing, rings from low to high
  std::vector<float> seconds;  ///< time of each point after the scan's stamp, which is that of the
                               ///< first firing; empty without motion distortion
};

/// A LiDAR whose beams turn, and may go up and down while they turn.
/// Thread safety: const methods may run on one object from many threads at once.
class Lidar {
 public:
  Lidar(const LidarParams& params, std::uint64_t seed);

  /// Unit direction of a ray in the sensor frame: x forward, y left, z up. The sensor turns
  /// clockwise seen from above and starts its first sweep at the back.
  /// @param number  of the sweep, counting those that are not kept
  [[nodiscard]] Eigen::Vector3d direction(int firing, int ring,
                                          std::size_t number = 0) const noexcept;

  /// Noise, clutter and losses of a ray depend only on the seed, the scan and the ray. A covered or
  /// cluttered ray, and one that meets a person, changes no other ray.
  /// With `motion_distortion`, a point is in the sensor frame at its own moment; otherwise in the
  /// sensor frame at the scan's stamp.
  [[nodiscard]] Sweep sweep(const World& world, const Drive& drive, std::size_t index) const;
  /// The points of that sweep.
  [[nodiscard]] PointCloud scan(const World& world, const Drive& drive, std::size_t index) const;

 private:
  struct Ray {
    std::size_t scan;
    int firing, ring;
  };
  [[nodiscard]] bool is_disturbed(std::size_t index, std::size_t scans) const noexcept;
  [[nodiscard]] double azimuth(int firing, std::size_t number) const noexcept;              // [rad]
  [[nodiscard]] double elevation(int firing, int ring, std::size_t number) const noexcept;  // [rad]
  [[nodiscard]] bool is_covered(double azimuth) const noexcept;
  /// The range at which clutter before the surface returns a ray [m].
  [[nodiscard]] std::optional<double> cluttered(const std::optional<Hit>& hit,
                                                const Ray& ray) const;
  /// The range that is measured of a surface [m]; nothing if the return is lost.
  [[nodiscard]] std::optional<double> returned(const std::optional<Hit>& hit, const Ray& ray) const;
  /// The direction that is reported of a ray.
  [[nodiscard]] Eigen::Vector3d reported(const Eigen::Vector3d& direction, const Ray& ray) const;

  LidarParams params_;
  std::uint64_t seed_, clutter_seed_, angle_seed_;
  Crowd crowd_;
};

}  // namespace vantage::simulation
