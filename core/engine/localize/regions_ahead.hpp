#pragma once

#include <Eigen/Core>
#include <vector>

#include "vantage/map_store.hpp"

namespace vantage {

/// Finds the regions that a sensor is in or about to enter.
/// Thread safety: const methods may run on one object from many threads at once.
class RegionsAhead {
 public:
  /// @param index  must outlive the object
  explicit RegionsAhead(const MapIndex& index);

  /// Number of regions with a map.
  [[nodiscard]] std::size_t size() const noexcept { return places_.size(); }

  /// The region with a map that is nearest to a place; there always is one.
  [[nodiscard]] RegionId nearest(const Eigen::Vector2d& xy) const;

  /// The region that owns a place if it has a map, otherwise the nearest with one.
  [[nodiscard]] RegionId at(const Point& place) const;

  /// The regions with a map that are within `margin` of the way ahead, in the order in which the
  /// sensor reaches them. The way is a straight line, with an allowance for turns.
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
