#pragma once

#include <cstddef>
#include <cstdint>
#include <stop_token>
#include <vector>

#include "place_index.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/relocalizer.hpp"

namespace vantage::voxel_search {

struct PlacesFound {
  /// That differ from each other, the greatest score first. They are upright, and accurate to about
  /// a voxel and half a step of the heading. The score is a contrast: the share of the scan's
  /// points that fall into an occupied voxel there, less the same share a few metres away. A scan
  /// falls into a thicket's voxels anywhere in the thicket; it fits its own place only there.
  std::vector<PoseCandidate> places;
  std::uint64_t words = 0;  ///< 128 blocks that were compared with a point: the work
};

/// What find_places takes [bytes], whatever the index.
inline constexpr std::size_t kBytesToFind = 2'000'000;

/// Finds the places that a scan fits best. It tries all translations by whole blocks, all headings
/// in steps of 5 degrees, and the heights that a sensor may have above the lowest points nearby,
/// and the voxels of the best blocks. It tests 128 blocks at once as bits. A bound excludes blocks
/// that cannot be among the best. The result does not depend on the number of threads.
/// @param scan  points on upright things, levelled frame, z up [m]
/// @param area  its heading is that of the levelled frame's x axis
/// @param most  how many places to return at most
/// @param stop  ends the search early; the answer is then worthless
[[nodiscard]] PlacesFound find_places(const PlaceIndex& index, PointsView scan,
                                      const PlaceArea& area, std::size_t most,
                                      const std::stop_token& stop = {});

}  // namespace vantage::voxel_search
