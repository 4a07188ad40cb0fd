#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vantage/kit/map_parts.hpp"
#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Regions that are worked on together, and the part of the map that decides about them.
struct RegionBlock {
  std::vector<std::uint32_t> regions;  ///< ascending
  Bounds2 area;                        ///< empty if the regions need no points
};

/// Points have indices of 32 bits, of which the last says that there is none.
inline constexpr std::uint64_t kMostBlockPoints = 0xffff'fffeU;

/// Divides regions into blocks of which each fits into memory and has at most kMostBlockPoints.
/// Neighbours are in one block, because they share most of the area that they need.
/// @param regions  to be divided
/// @param areas   what each region needs, by RegionId; empty if it needs no points
/// @param memory  for a block [bytes]
/// @param bytes_a_point  of memory that the work takes
/// Errors: `invalid_input` if a region does not fit alone; it names the one that needs most, and
/// the memory required, or the limit.
[[nodiscard]] Result<std::vector<RegionBlock>> blocks_of(
    const MapParts& map, const Partition& partition, std::span<const std::uint32_t> regions,
    const std::vector<Bounds2>& areas, std::uint64_t memory, std::uint64_t bytes_a_point);

/// Which region of a block owns each point (Eqs. 2-3): its place in the block; the number of the
/// block's regions for a point that none of them owns.
[[nodiscard]] std::vector<std::uint32_t> owners_in(const RegionBlock& block, PointsView points,
                                                   const Partition& partition);

/// Brings neighbours next to each other: divides regions into halves of halves, each across the
/// longer side of their box, at the median of their middles.
/// @param middles  of all regions, by RegionId
/// @param box_of   the box of some regions; none: they are not divided further. Asked from front to
///                 back
void halve(std::span<std::uint32_t> regions, const std::vector<Eigen::Vector2d>& middles,
           const std::function<std::optional<Bounds2>(std::span<const std::uint32_t>)>& box_of);

/// What a region and what decides about it take.
struct RegionNeed {
  std::uint32_t region = 0;
  std::uint64_t points = 0;
};

/// Of those that need most, the first one. Precondition: there is one.
[[nodiscard]] RegionNeed largest_need(const MapParts& map, std::span<const std::uint32_t> regions,
                                      const std::vector<Bounds2>& areas);

/// The refusal of a region that does not fit: `invalid_input`.
/// @param points  the region's and those that decide about it
/// @param enough  what all regions fit into [bytes], if that may be more; 0 if it is not
[[nodiscard]] tl::unexpected<Error> does_not_fit(const std::string& label, std::uint64_t points,
                                                 std::uint64_t memory, std::uint64_t bytes_a_point,
                                                 std::uint64_t enough = 0);

/// An area and a margin around it [m]; empty areas stay empty.
[[nodiscard]] Bounds2 with_margin(const Bounds2& area, double margin) noexcept;

}  // namespace vantage
