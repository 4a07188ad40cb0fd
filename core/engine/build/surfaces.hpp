#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "build/plan_index.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage {

/// The rays of a spinning LiDAR.
struct Rays {
  double lowest = -23.0, highest = 15.0;  ///< elevations [deg]
  double max_range = 80.0;                ///< [m]; at most Surfaces::kFarthestReturn is used
};

/// The surfaces of a map as small discs, one for the points in each voxel (surfels, Pfister et al.,
/// SIGGRAPH 2000), for virtual scans: a scan shares the surfaces with the map, but not the noise of
/// the map's points.
/// Thread safety: const methods may run on one object from many threads at once.
class Surfaces {
 public:
  static constexpr double kFarthestReturn = 80.0;  ///< [m]
  /// What a scan depends on lies no farther than this out of its range [m].
  static constexpr double kMargin = 1.0;
  /// Uses all threads of the caller's TBB arena.
  /// @param map  N points, map frame [m]; finite, only used during this call
  explicit Surfaces(PointsView map);

  /// What each ray hits first, in the order of the rays. It is the same for every map that has the
  /// same points within `max_range` and kMargin of the sensor.
  /// @param sensor  map frame [m]
  /// @return        map frame [m]
  [[nodiscard]] PointCloud scan(const Point& sensor, const Rays& rays) const;

 private:
  struct Disc {
    Eigen::Vector3f normal;  // zero if the points are no surface: then `middles` has one of them
    float radius;            // [m]
  };
  /// The discs of a cube of voxels.
  struct Cube {
    std::uint32_t begin, end;  // their indices
    float radius;              // of the ball around them [m]
  };
  struct Parts;

  explicit Surfaces(Parts parts);
  [[nodiscard]] static Parts parts_of(PointsView map);

  PointCloud middles_;  // map frame [m]; by cube
  std::vector<Disc> discs_;
  PointCloud cube_middles_;  // map frame [m]
  std::vector<Cube> cubes_;
  float widest_;    // of the radii of the cubes [m]
  PlanIndex plan_;  // of the cubes
};

}  // namespace vantage
