#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>

#include "vantage/partition.hpp"
#include "vantage/result.hpp"

/// Shared by partitioners whose regions are boxes; and the region nearest to a place.
namespace vantage {

/// The region whose footprint is nearest to a place (the lowest id if several are equally near);
/// the one that owns the place, if any does. None if there is no region, or for a place that is not
/// finite. Takes time in proportion to the number of regions.
[[nodiscard]] std::optional<RegionId> nearest_region(const Partition& partition,
                                                     const Eigen::Vector2d& xy);

/// The largest number of regions that a partitioner makes.
inline constexpr std::size_t kMaxRegions = 1'000'000;

/// The error of a partitioner that would exceed kMaxRegions: `invalid_input`.
/// @param cause  the parameter and its value: "max_points = 5"
[[nodiscard]] tl::unexpected<Error> too_many_regions(const std::string& cause);

/// The box that owns every place from `min` to `max` [m], both included. It ends at the next larger
/// double, because a HalfOpenBox does not own its end.
[[nodiscard]] HalfOpenBox box_owning(const Eigen::Vector2d& min, const Eigen::Vector2d& max);

}  // namespace vantage
