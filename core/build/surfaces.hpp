#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
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
  [[nodiscard]] PointCloud hits(const Point& sensor, const Rays& rays) const;

  /// A scan that is thinned as one for matching: of each disc the mean of its hits.
  [[nodiscard]] PointCloud scan(const Point& sensor, const Rays& rays) const;

 private:
  static constexpr std::size_t kLanes = 4;
  using Lanes = std::array<float, kLanes>;
  /// Discs of one cube. If they are fewer than kLanes, the last ones are far from everything.
  struct alignas(16) Discs {
    Lanes x, y, z;  // of their middles, from that of the cube [m]
    // Zero if the points are no surface: then the middle is one of them.
    Lanes normal_x, normal_y, normal_z;
    Lanes radius;  // [m]
  };
  /// The discs of a cube of voxels.
  struct Cube {
    std::uint32_t begin, end;  // in `discs`
    Eigen::Vector3f half;      // edges of the box around them [m]
  };
  class Raster;
  class Follower;

  PointCloud middles_;  // kLanes for each of `discs`, map frame [m]
  std::vector<Discs> discs_;
  PointCloud cube_middles_;  // of the boxes, map frame [m]
  std::vector<Cube> cubes_;
  float widest_ = 0.0F;            // of the halves of edges in the plan [m]
  std::optional<PlanIndex> plan_;  // of the cubes; made when their places are known
};

}  // namespace vantage
