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
        // 8 voxels meet at the origin: together they hold everything, and no voxel size gives
        // fewer.
        optional("budget", &ThinningParams::budget, "",
                 "instead of voxel_size: a region map keeps at most so many points, one in each "
                 "voxel of the smallest size that leaves no more",
                 at_least(8)),
    };
  }
  [[nodiscard]] VANTAGE_API Result<void> validate() const;
};

/// Thins points evenly. Of the points in a voxel, the one nearest to their mean stays; of equally
/// near points, the first by x, then y, then z. Voxels are anchored at the origin of the frame, so
/// that the maps of neighbouring regions share them. The result depends neither on the order of the
/// points nor on the number of threads.
/// @param map         finite [m]
/// @param candidates  indices into `map`, strictly ascending
/// @return            the candidates that stay, strictly ascending
/// Precondition: `params` is valid.
[[nodiscard]] VANTAGE_API IndexList thinned(PointsView map, IndexList candidates,
                                            const ThinningParams& params);

/// The voxel of each candidate, as a hash of 64 bits that is never 0. It is next to impossible that
/// two voxels of one map share a hash; if they did, one point would be lost. Arguments as above.
[[nodiscard]] VANTAGE_API std::vector<std::uint64_t> voxels_of(
    PointsView map, std::span<const std::uint32_t> candidates, double voxel_size);

/// Two voxel sizes that differ by at most about 1 %. The number of voxels falls with their size,
/// though not quite monotonically: `few` is some size that suffices, and `enough`, just below it,
/// does not.
struct VoxelSizes {
  double enough;  ///< the candidates are in `count` voxels or more, or not even at 1 micrometre
  double few;     ///< they are in fewer, or not even if all are around the origin
};
/// Arguments as above. Precondition: count > 0.
[[nodiscard]] VANTAGE_API VoxelSizes voxel_sizes_around(PointsView map,
                                                        std::span<const std::uint32_t> candidates,
                                                        std::size_t count);

}  // namespace vantage
