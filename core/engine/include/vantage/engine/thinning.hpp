#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/params.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// [thinning]: how region maps are made smaller after visibility has chosen their points.
struct ThinningParams {
  std::optional<double> voxel_size;     // [m]
  std::optional<std::uint32_t> budget;  // points per region

  static constexpr auto schema() {
    return std::tuple{
        optional("voxel_size", &ThinningParams::voxel_size, "m",
                 "instead of budget: a region map keeps one of its points in each voxel of this "
                 "size",
                 positive),
        // 8 voxels meet at the origin: if they are large, they hold all points, and no larger size
        // gives fewer voxels.
        optional("budget", &ThinningParams::budget, "",
                 "instead of voxel_size: a region map keeps at most this many points, one per "
                 "voxel of the smallest sufficient size",
                 at_least(8)),
    };
  }
  [[nodiscard]] VANTAGE_API Result<void> validate() const;
};

/// Thins points evenly. Each voxel keeps the point nearest to the mean of its points; of equally
/// near points, the first by x, then y, then z. Voxels are anchored at the origin of the frame, so
/// that the maps of neighbouring regions share them. The result depends neither on the order of the
/// points nor on the number of threads.
/// @param map         finite points [m]
/// @param candidates  indices into `map`, strictly ascending
/// @return            the candidates that stay, strictly ascending
/// Precondition: `params` is valid.
[[nodiscard]] VANTAGE_API IndexList thinned(PointsView map, IndexList candidates,
                                            const ThinningParams& params);

/// The voxel of each candidate, as a 64-bit hash that is never 0. Two voxels of one map almost
/// certainly have different hashes; with equal hashes, one point would be lost. Arguments as above.
[[nodiscard]] VANTAGE_API std::vector<std::uint64_t> voxels_of(
    PointsView map, std::span<const std::uint32_t> candidates, double voxel_size);

/// Two voxel sizes [m] that enclose a wanted number of voxels, `count`: enough <= few, with a
/// difference of at most about 1 %. The number of voxels falls as the size grows, but not quite
/// monotonically, so that other such pairs may exist.
struct VoxelSizes {
  double enough;  ///< gives `count` voxels or more, unless even 1 micrometre gives fewer
  double few;     ///< gives fewer voxels, unless even the 8 at the origin are `count` or more
};
/// Finds two sizes around `count` voxels. Arguments as above. Precondition: count > 0.
[[nodiscard]] VANTAGE_API VoxelSizes voxel_sizes_around(PointsView map,
                                                        std::span<const std::uint32_t> candidates,
                                                        std::size_t count);

}  // namespace vantage
