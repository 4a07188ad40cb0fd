#pragma once

#include <Eigen/Core>
#include <vector>

#include "vantage/map_store.hpp"

namespace vantage {

/// Which regions a sensor is about to enter.
class RegionsAhead {
 public:
  /// @param index  outlives the object
  explicit RegionsAhead(const MapIndex& index);

  /// The region with a map that is nearest to a place; there is one.
  [[nodiscard]] RegionId nearest(const Eigen::Vector2d& xy) const;

  /// Regions with a map that come within `margin` of the way, the first first. The way is a
  /// straight one, and a turn away from it is allowed for.
  /// @param xy        plan position [m]
  /// @param velocity  [m/s]
  /// @param seconds   how far ahead to look
  /// @param margin    [m]
  [[nodiscard]] std::vector<RegionId> operator()(const Eigen::Vector2d& xy,
                                                 const Eigen::Vector2d& velocity, double seconds,
                                                 double margin) const;

 private:
  struct Place {
    Eigen::Vector2d min, max;  // of the footprint's box
    RegionId region;
  };
  [[nodiscard]] const Footprint& footprint_of(const Place& place) const {
    return index_.partition[place.region].footprint;
  }
  const MapIndex& index_;
  std::vector<Place> places_;
};

}  // namespace vantage
