#pragma once

#include <cstdint>
#include <functional>

#include "build/plan_index.hpp"
#include "vantage/kit/map_parts.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// A spinning LiDAR in a map of points: 720 rays around in each of 20 rings from -23 to 15 degrees.
/// A ray hits the nearest point that it passes within twice the usual distance of neighbours around
/// the sensor. What it sees does not depend on a visibility operator: a real scan also has what a
/// region map lacks. Nor does it depend on points out of its range.
/// Thread safety: const methods may run on one object from many threads at once.
class VirtualLidar {
 public:
  static constexpr double kFarthestReturn = 80.0;  ///< [m]

  /// @param map        N points, map frame [m]; finite, borrowed
  /// @param max_range  [m]; at most kFarthestReturn is used
  VirtualLidar(PointsView map, double max_range);

  /// The map points that are hit, in the order of the rays; some may occur twice [m].
  [[nodiscard]] PointCloud hits(const Point& sensor) const;

 private:
  PointsView map_;
  PlanIndex plan_;
  double range_;
};

/// The points that a VirtualLidar at a place hits. It may be asked from several threads at once.
using HitsAt = std::function<Result<PointCloud>(const Point& sensor)>;
/// Of a map that is not in memory, only the part around each place is read. The same map gives the
/// same points, wherever it is. The map is borrowed.
[[nodiscard]] HitsAt hits_in(const MapParts& map, double max_range);
/// How far around a place the map is read, in plan view [m].
[[nodiscard]] double reach_of_hits(double max_range) noexcept;

/// Makes a scan from the points that rays hit. The scan is as imperfect as one of another day: its
/// ranges have noise (2 cm), a sector of 60 degrees is covered, and one point in thirty is clutter
/// in front of the surface.
/// @param hits  map frame [m]
/// @param seed  decides noise, sector and clutter
/// @return      sensor frame [m]
[[nodiscard]] PointCloud virtual_scan(PointsView hits, const Pose& T_map_scan, std::uint64_t seed);

}  // namespace vantage
