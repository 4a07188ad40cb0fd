#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace vantage::visibility_clusters {

/// What can be seen: voxel numbers, strictly ascending.
using Voxels = std::vector<std::uint32_t>;

/// The Jaccard index |a ∩ b| / |a ∪ b|; 1 for two empty sets.
[[nodiscard]] double overlap(const Voxels& a, const Voxels& b);

/// Two viewpoints that lie side by side, the one with the lower number first.
using Neighbours = std::pair<std::uint32_t, std::uint32_t>;

/// Pairs every viewpoint with all others in its place in plan view, with those in the `count`
/// nearest other places, and with all that are as near as the last of them. The result is sorted;
/// each pair occurs once.
/// @param viewpoints  in plan view; those that lie one above the other are in one place
[[nodiscard]] std::vector<Neighbours> neighbours_of(std::span<const Eigen::Vector2d> viewpoints,
                                                    std::size_t count);

struct GroupLimits {
  double min_overlap;  ///< in (0, 1)
  double max_width;    ///< of a group's viewpoints in x and in y [m]
};

/// The group of each viewpoint: 0, 1, ... in the order of the groups' lowest viewpoints.
struct Groups {
  std::vector<std::uint32_t> of_viewpoint;
  std::uint32_t count = 0;
};

/// Agglomerative clustering with average linkage (Sokal and Michener 1958), among neighbours only.
/// It repeatedly joins the two neighbouring groups with the greatest mean overlap between a
/// viewpoint of one and a viewpoint of the other (ties: the lowest viewpoints in them). It ends
/// when that overlap is below min_overlap or every joined group would be wider than max_width.
/// @param seen  what each viewpoint sees
[[nodiscard]] Groups group(std::span<const Eigen::Vector2d> places, std::span<const Voxels> seen,
                           std::span<const Neighbours> neighbours, const GroupLimits& limits);

}  // namespace vantage::visibility_clusters
