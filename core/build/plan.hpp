#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "build/sight.hpp"
#include "vantage/build/build.hpp"
#include "vantage/kit/map_parts.hpp"
#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"
#include "vantage/visibility.hpp"

namespace vantage {

/// What a build decides before it looks at visibility.
struct BuildPlan {
  Partition partition;
  std::vector<PointCloud> viewpoints;  ///< by RegionId (Eqs. 4-5)
  std::vector<std::uint64_t> owned;    ///< by RegionId: points of P_ij
  VisibilityLimits limits;
  std::uint64_t map_points = 0;
  std::uint64_t ground_points = 0;
  std::uint64_t unreachable_voxels = 0;
  std::uint64_t places_outside = 0;
  std::vector<std::byte> place_index;  ///< of the relocalizer; none for a map that it cannot index
  /// What making it took, wall clock; not kept in a file.
  double seconds_ground = 0, seconds_partition = 0;
};

/// Plans a build: cuts the map, and finds the ground and the viewpoints block by block. The plan of
/// a map in parts is that of the same points in memory.
/// @param memory  for points and what is made of them [bytes]
/// @param whole   sees in the whole map, if it is in memory and the only block: a partitioner may
///                ask what is seen. None: only a part of the map is in memory at a time
/// Errors: `unsupported` for a plugin or an option that needs the whole map at once, if there is
/// none; it says which and why. `invalid_input` for a region that does not fit into the memory, now
/// or when its visibility is decided: those that may need most are planned first. Those of
/// build_region_maps.
[[nodiscard]] Result<BuildPlan> plan_of(const MapParts& map, PointsView trajectory,
                                        const BuildPlugins& plugins, const BuildParams& params,
                                        std::uint64_t memory, const Sight* whole = nullptr);

/// 0, 1, ..., count - 1.
[[nodiscard]] std::vector<std::uint32_t> every_region(std::size_t count);

/// Where the progress of the build begins.
[[nodiscard]] BuildProgress meter_start(const BuildPlan& plan) noexcept;

/// What finding the ground takes for each point, with the point itself [bytes].
inline constexpr std::uint64_t kBytesAGroundPoint = 56;

/// What a point of a block takes while visibility is decided, with the point itself [bytes].
inline constexpr std::uint64_t kBytesASeenPoint = 88;

/// What a region needs of the map while visibility is decided: what is around its viewpoints, or
/// with VisibilityScope::region itself; nothing without viewpoints.
/// @param reach  see reach_of
[[nodiscard]] Bounds2 needed_area(const BuildPlan& plan, std::uint32_t region,
                                  VisibilityScope scope, double reach);

/// How far around its viewpoints a region needs the map [m]. Infinite if it needs all of it.
[[nodiscard]] double reach_of(const BuildPlugins& plugins, const BuildParams& params,
                              const VisibilityLimits& limits);

}  // namespace vantage
