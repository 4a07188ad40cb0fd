#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace vantage::visibility_clusters {

/// What can be seen: numbers of voxels, strictly ascending.
using Voxels = std::vector<std::uint32_t>;

/// The Jaccard index |a ∩ b| / |a ∪ b|; 1 for two empty sets.
[[nodiscard]] double overlap(const Voxels& a, const Voxels& b);

/// Two viewpoints that lie side by side, the lower one first.
using Neighbours = std::pair<std::uint32_t, std::uint32_t>;

/// Every viewpoint with its `count` nearest in plan view and whoever is as near as the last of
/// them; sorted, each pair once.
[[nodiscard]] std::vector<Neighbours> neighbours_of(std::span<const Eigen::Vector2d> places,
                                                    std::size_t count);

struct GroupLimits {
  double min_overlap;  ///< in (0, 1)
  double max_width;    ///< of a group's viewpoints in x and in y [m]
};

/// Which group each viewpoint belongs to: 0, 1, ... by the lowest viewpoint in them.
struct Groups {
  std::vector<std::uint32_t> of_viewpoint;
  std::uint32_t count = 0;
};

/// Agglomerative clustering with average linkage (Sokal and Michener 1958), among neighbours only:
/// joins, again and again, the two neighbouring groups with the greatest mean overlap of a
/// viewpoint of one and a viewpoint of the other (ties: the lowest viewpoints in them), as long as
/// it is not below min_overlap and the joined group is not wider than max_width.
/// @param seen  of each viewpoint
[[nodiscard]] Groups group(std::span<const Eigen::Vector2d> places, std::span<const Voxels> seen,
                           std::span<const Neighbours> neighbours, const GroupLimits& limits);

}  // namespace vantage::visibility_clusters
