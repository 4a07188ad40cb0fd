#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "vantage/engine/build.hpp"
#include "vantage/map_parts.hpp"
#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"
#include "vantage/visibility.hpp"

namespace vantage {

/// What a build decides before it looks at visibility.
struct BuildPlan {
  Partition partition;
  std::vector<PointCloud> viewpoints;  ///< by RegionId (Eqs. 4-5)
  std::vector<std::uint64_t> owned;    ///< by RegionId: points of P_ij; only of a map in parts
  VisibilityLimits limits;
  std::uint64_t map_points = 0;
  std::uint64_t ground_points = 0;
  std::uint64_t unreachable_viewpoints = 0;
  std::uint64_t places_outside = 0;
  std::vector<std::byte> place_index;  ///< of the relocalizer; none for a map that it cannot index
};

/// Plans the build of a map that does not fit into memory: cuts it, and finds the ground and the
/// viewpoints block by block. The plan is that of the same points in memory.
/// @param memory  for points and what is made of them [bytes]
/// Errors: `unsupported` for a plugin or an option that needs the whole map at once; it says which
/// and why. `invalid_input` for a region that does not fit into the memory, now or when its
/// visibility is decided: those that may need most are planned first. Those of build_region_maps.
[[nodiscard]] Result<BuildPlan> plan_of(const MapParts& map, PointsView trajectory,
                                        const BuildPlugins& plugins, const BuildParams& params,
                                        std::uint64_t memory);

/// The relocalizer's index of the map; no bytes if there is no relocalizer, or if it cannot index
/// the map. Errors: those of the relocalizer, except `unsupported`.
[[nodiscard]] Result<std::vector<std::byte>> place_index_of(const MapPasses& map,
                                                            const BuildPlugins& plugins);

/// Where the progress of the build begins.
[[nodiscard]] BuildProgress meter_start(const BuildPlan& plan) noexcept;

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
