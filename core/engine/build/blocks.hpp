#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vantage/map_parts.hpp"
#include "vantage/partition.hpp"
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
/// Errors: `invalid_input` for a region that does not fit alone; it names the region and the memory
/// required, or the limit.
[[nodiscard]] Result<std::vector<RegionBlock>> blocks_of(
    const MapParts& map, const Partition& partition, std::span<const std::uint32_t> regions,
    const std::vector<Bounds2>& areas, std::uint64_t memory, std::uint64_t bytes_a_point);

/// An area and a margin around it [m]; empty areas stay empty.
[[nodiscard]] Bounds2 with_margin(const Bounds2& area, double margin) noexcept;

}  // namespace vantage
