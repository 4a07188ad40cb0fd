#pragma once

#include <optional>
#include <string>

#include "simulate/params.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage::benchmarks {

/// How a map differs from a simulated world's own one, which has all of its surfaces.
struct MapDifference {
  /// The map holds everything twice: the second copy is moved by this [m].
  Point second_copy = Point::Zero();
  /// The map is bent like that of a survey that drifts: by this at the border of the campus, by
  /// nothing in its middle [m].
  double bend = 0.0;
  /// The map has no points where x > origin_x.
  bool only_half = false;
  /// The map is made of the scans of a drive with this sensor, one lap on the lane beside.
  std::optional<simulation::SensorModel> surveyed_by = {};
  /// The map is that of another seed.
  bool of_another_place = false;

  /// Different for different maps of a world.
  [[nodiscard]] std::string key() const;
};

/// Where the bent map has what is at a pose of the campus: the position is bent, and the rotation
/// is turned as the map is there. The bend also strains the map, by at most 1.5 bend / size.
[[nodiscard]] Pose bent(const Pose& T_map_sensor, double bend,
                        const simulation::CampusParams& campus);

/// Errors: those of World.
[[nodiscard]] Result<PointCloud> map_of(const simulation::WorldParams& params,
                                        const MapDifference& difference);

}  // namespace vantage::benchmarks
