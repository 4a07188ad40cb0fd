#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/point_tree.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage::matching {

/// Voxels that are anchored at the world's zero: a point belongs to voxel floor(p / edge) in every
/// map that contains it.
class SurfelGrid {
 public:
  /// @param origin  of a map: voxels are counted from about there [m]
  SurfelGrid(const Point& origin, double edge)
      : first_((origin / edge).array().round()), edge_(edge) {}

  /// The number of a point's voxel, in Morton order: points near in space are near in memory. None
  /// if it lies more than a million voxels from the origin.
  [[nodiscard]] std::optional<std::uint64_t> voxel_of(const Point& p) const noexcept;

 private:
  Eigen::Vector3d first_;
  double edge_;
};

/// A map as points with surface normals.
///
/// Points are kept relative to an origin near the map's centre, so that UTM coordinates lose no
/// precision. Their order depends only on their positions, so that results do not depend on the
/// order of the map's points.
/// Thread safety: immutable once built.
class SurfelMap {
 public:
  struct Options {
    double voxel = 0.25;            ///< one point per voxel, the centroid [m]; 0: every point
    std::uint32_t neighbours = 10;  ///< points from which a normal is computed, including the point
    bool planes_only = false;       ///< leaves out points whose neighbours show no plane

    friend bool operator==(const Options&, const Options&) = default;
    /// The edge of the voxels that points are sorted by [m].
    [[nodiscard]] double edge() const noexcept { return voxel > 0.0 ? voxel : kSortingVoxel; }

   private:
    static constexpr double kSortingVoxel = 0.25;
  };

  /// A map of surfels that were stored.
  /// @param origin   map frame [m]
  /// @param points   relative to it; at least one
  /// @param normals  as many; of unit length, or zero
  SurfelMap(const Point& origin, PointCloud points, std::vector<Eigen::Vector3d> normals);

  /// Errors: `invalid_input` for no points, a non-finite coordinate, or an extent of more than
  /// about two million voxels along an axis; `too_few_matches` if no point is left.
  [[nodiscard]] static Result<SurfelMap> build(PointsView map, const Options& options);

  /// Relative to the origin [m].
  [[nodiscard]] PointsView points() const noexcept { return points_; }
  /// Of unit length, or zero if the neighbours show no plane.
  [[nodiscard]] std::span<const Eigen::Vector3d> normals() const noexcept { return normals_; }
  /// How many points of the map a surfel stands for; 1 if that was not stored.
  [[nodiscard]] std::uint32_t count(std::uint32_t surfel) const noexcept {
    return counts_.empty() ? 1 : counts_[surfel];
  }
  /// The voxel of the points that a surfel stands for, in the grid of the map's options. If that
  /// was not stored, it is where the surfel lies, which is another one if it was rounded across the
  /// border.
  [[nodiscard]] std::optional<std::uint64_t> voxel(std::uint32_t surfel,
                                                   const SurfelGrid& grid) const noexcept {
    if (!voxels_.empty()) return voxels_[surfel];
    return grid.voxel_of(points_[surfel] + origin_);
  }
  [[nodiscard]] const PointTree& tree() const noexcept { return *tree_; }
  [[nodiscard]] const Point& origin() const noexcept { return origin_; }

  /// Whether any point may be within `distance` [m] of a position; false for a position that is not
  /// finite.
  [[nodiscard]] bool reaches(const Eigen::Vector3d& local, double distance) const noexcept {
    return ((local - bounds_.min).array() >= -distance).all() &&
           ((local - bounds_.max).array() <= distance).all();
  }

  [[nodiscard]] Pose to_local(Pose T_map_scan) const noexcept;
  [[nodiscard]] Pose to_map(Pose T_local_scan) const noexcept;
  [[nodiscard]] std::size_t bytes() const noexcept;

 private:
  SurfelMap() = default;

  Point origin_ = Point::Zero();
  PointCloud points_;
  std::vector<Eigen::Vector3d> normals_;
  std::vector<std::uint32_t> counts_;
  std::vector<std::uint64_t> voxels_;
  Bounds3 bounds_;
  std::optional<PointTree> tree_;
};

/// Computes the normal at each of a tree's points, see PointTree::normal_at. The result is the same
/// for any number of threads.
/// @param normals  as many as `points`
void compute_normals(const PointTree& tree, PointsView points, std::uint32_t neighbours,
                     std::span<Eigen::Vector3d> normals);

}  // namespace vantage::matching
