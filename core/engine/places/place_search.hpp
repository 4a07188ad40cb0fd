#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <stop_token>
#include <vector>

#include "places/place_index.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"

namespace vantage {

/// An area in which a sensor may be.
struct PlaceArea {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();         ///< map frame [m]
  double radius = std::numeric_limits<double>::infinity();  ///< in plan view [m]
  double heading = 0.0;                                     ///< of the sensor's x axis [rad]
  double heading_within = std::numbers::pi;                 ///< to either side of `heading` [rad]
  bool complete = true;  ///< whether the sensor cannot be outside the area
};

/// A place from which a scan may have been taken.
struct Place {
  Pose T_map_scan;  ///< upright; accurate to about a voxel and half a step of the heading
  /// The share of the scan's points that fall into an occupied voxel here, less the same share a
  /// few metres away. A scan falls into a thicket's voxels anywhere in the thicket; it fits its own
  /// place only there.
  double contrast = 0.0;
};

struct PlacesFound {
  std::vector<Place> places;  ///< that differ from each other, the greatest contrast first
  std::uint64_t words = 0;    ///< 128 voxels that were compared with a point: the work
};

/// Finds the places that a scan fits best. It tries all translations by whole voxels, all headings
/// in steps of 5 degrees, and the heights that a sensor may have above the lowest points nearby.
/// It tests 128 translations at once as bits. A bound excludes places that cannot be among the
/// best. The result does not depend on the number of threads.
/// @param scan  points on upright things, sensor frame, z up [m]
/// @param most  how many places to return at most
/// @param stop  ends the search early; the answer is then worthless
[[nodiscard]] PlacesFound find_places(const PlaceIndex& index, PointsView scan,
                                      const PlaceArea& area, std::size_t most,
                                      const std::stop_token& stop = {});

}  // namespace vantage
