#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/partition.hpp"
#include "vantage/region_directory.hpp"

namespace vantage {

/// Finds the regions that a sensor is in or about to enter. It holds the regions around the place
/// that it was last asked about, and no others.
/// Thread safety: const methods may run on one object from many threads at once.
class VANTAGE_API RegionsAhead {
 public:
  explicit RegionsAhead(std::shared_ptr<const RegionDirectory> directory);

  /// Number of regions with a map.
  [[nodiscard]] std::size_t size() const noexcept {
    return directory_->summary().regions - directory_->summary().empty_regions;
  }

  struct Choice {
    RegionId region;
    bool outside;  ///< no region with a map owns the place
  };
  /// The region to localize in (Eq. 11), with hysteresis: the one in use stays in use within
  /// `margin` of its footprint, and outside of all regions. Without one, the nearest is taken
  /// there.
  /// @param margin  [m]
  /// Errors of this and of the other methods: those of the directory.
  [[nodiscard]] Result<Choice> choose(const std::optional<RegionId>& in_use, const Point& place,
                                      double margin) const;

  /// The regions with a map that are within `margin` of the way ahead, in the order in which the
  /// sensor reaches them. The way is a straight line, with an allowance for turns.
  /// @param xy        plan position [m]
  /// @param velocity  [m/s]
  /// @param seconds   how far ahead to look
  /// @param margin    [m]
  [[nodiscard]] Result<std::vector<RegionId>> operator()(const Eigen::Vector2d& xy,
                                                         const Eigen::Vector2d& velocity,
                                                         double seconds, double margin) const;

  /// "'<label>'" for messages; the number of a region whose label cannot be read.
  [[nodiscard]] std::string name_of(RegionId region) const;

 private:
  struct Place {
    RegionId region;
    Bounds2 box;  // of the footprint
    bool has_map;
  };
  /// The regions that meet an area, by id.
  struct Around {
    Bounds2 area;
    Partition regions;
    std::vector<Place> places;  // of the same regions

    [[nodiscard]] double distance_to(std::size_t k, const Eigen::Vector2d& xy) const {
      return distance(regions.regions()[k].footprint, xy);
    }
  };
  /// The region with a map that is nearest to a place; there always is one.
  [[nodiscard]] Result<RegionId> nearest(const Eigen::Vector2d& xy) const;
  /// The region that owns a place, if it has a map.
  [[nodiscard]] Result<std::optional<RegionId>> owner_of(const Point& place) const;
  /// At least that area, as it was read last or reads it.
  [[nodiscard]] Result<std::shared_ptr<const Around>> around(const Bounds2& area) const;
  [[nodiscard]] Result<Around> read(const Bounds2& area) const;
  struct Nearest {
    RegionId region;
    double distance = std::numeric_limits<double>::infinity();  // [m]
  };
  /// Of the regions with a map; of several equally near the one with the lowest id.
  [[nodiscard]] static Nearest nearest_of(const Around& around, const Eigen::Vector2d& xy);

  std::shared_ptr<const RegionDirectory> directory_;
  mutable std::mutex mutex_;
  mutable std::shared_ptr<const Around> around_;  // what was last read
};

}  // namespace vantage
