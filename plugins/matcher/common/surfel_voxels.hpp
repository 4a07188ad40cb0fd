#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

#include "common/surfel_map.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage::matching {

/// The surfels of a map by the voxels that they were thinned to. This order is made when it is
/// first needed: only a build needs it.
/// Thread safety: const functions may run on one object from many threads at once.
class SurfelVoxels {
 public:
  explicit SurfelVoxels(const SurfelMap::Options& options) : options_(options) {}

  /// The surfels that at least one of the points belongs to, ascending. A point belongs to the
  /// surfel of its voxel; in a map that is not thinned, to the one in its own place.
  /// @param map   the same one in each call
  /// @param seen  map frame [m], finite
  [[nodiscard]] std::vector<std::uint32_t> surfels_at(const SurfelMap& map, PointsView seen) const;

  /// Memory that the order holds; 0 before it is needed.
  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }

 private:
  void make(const SurfelMap& map) const;

  SurfelMap::Options options_;
  mutable std::once_flag made_;
  mutable std::vector<std::pair<std::uint64_t, std::uint32_t>>
      order_;  // voxels, surfels; ascending
  mutable std::atomic<std::size_t> bytes_ = 0;
};

}  // namespace vantage::matching
