#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "block_table.hpp"
#include "cell.hpp"
#include "kernel.hpp"
#include "vantage/kit/page_vector.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::ndt {

/// The key of a voxel; keys of neighbours are close together (see key_of_shifted).
using VoxelKey = std::uint64_t;
inline constexpr VoxelKey kNoVoxel = ~VoxelKey{0};

/// The options that decide which Gaussians a map has.
struct VoxelOptions {
  double resolution = 1.0;         ///< edge of a voxel [m], > 0
  std::uint32_t min_points = 6;    ///< a voxel with fewer has no Gaussian; >= 2
  double eigenvalue_floor = 0.01;  ///< smallest share of the largest eigenvalue, in (0, 1]

  friend bool operator==(const VoxelOptions&, const VoxelOptions&) = default;
};

/// The map as one Gaussian per voxel.
///
/// Voxels are anchored at the world's zero: a point belongs to voxel floor(p / resolution) in every
/// map that contains it. Voxels are counted from an origin in the middle of those with a Gaussian,
/// and a Gaussian's mean lies in its voxel, so nothing is lost at UTM coordinates.
/// Thread safety: immutable once built.
class VoxelMap {
 public:
  /// Gaussians are in the order of their voxels' keys, whatever the order of the points.
  /// Errors: `invalid_input` for no points, a non-finite coordinate, or an extent of more than
  /// about two million voxels along an axis; `too_few_matches` if no voxel holds enough points.
  [[nodiscard]] static Result<VoxelMap> build(PointsView map, const VoxelOptions& options);

  /// Makes a map from parts that were checked before.
  /// @param keys   ascending, one for each cell
  /// @param bare   voxels that are occupied and whose Gaussian was not kept; ascending, none of
  ///               `keys`
  VoxelMap(const VoxelOptions& options, const Eigen::Vector3d& origin_voxel,
           PageVector<VoxelKey> keys, PageVector<Cell> cells, PageVector<VoxelKey> bare = {});

  /// The same map in voxels of twice the edge, each the sum of the Gaussians in its eight voxels:
  /// mean and covariance are those of all their points, up to the rounding of cells and raised
  /// eigenvalues. A restored map therefore has the coarse voxels of the map that was stored. In a
  /// map with bare voxels, each of its voxels counts the same, and a bare one as evenly filled.
  [[nodiscard]] VoxelMap merged() const;

  [[nodiscard]] const VoxelOptions& options() const noexcept { return options_; }
  /// The voxel from which keys count, in whole numbers.
  [[nodiscard]] const Eigen::Vector3d& origin_voxel() const noexcept { return origin_voxel_; }
  /// The lower corner of that voxel [m].
  [[nodiscard]] Point origin() const noexcept { return origin_voxel_ * options_.resolution; }
  [[nodiscard]] std::span<const VoxelKey> keys() const noexcept { return keys_; }
  [[nodiscard]] std::span<const Cell> cells() const noexcept { return cells_; }
  /// The mean of a Gaussian, map frame [m].
  [[nodiscard]] Point mean_of(std::uint32_t gaussian) const noexcept;
  [[nodiscard]] std::span<const VoxelKey> bare() const noexcept { return bare_; }
  /// Memory that the map holds.
  [[nodiscard]] std::size_t bytes() const noexcept;

  /// The voxel of a point in the map frame [m]; kNoVoxel if the map cannot reach there.
  [[nodiscard]] VoxelKey key_of(const Point& p) const noexcept;
  /// Index of a voxel's Gaussian; kNoGaussian for a voxel without one.
  [[nodiscard]] std::uint32_t find(VoxelKey key) const noexcept {
    return gaussian_in(block_at(table(), key >> 6U), key & 63U);
  }
  /// Some Gaussians as a map would hold them that has only these: their voxels count from an origin
  /// in their own middle, and come in the order of those keys. So what is kept of a map does not
  /// depend on how far the map extends.
  struct Part {
    Eigen::Vector3d origin_voxel;
    std::vector<std::pair<VoxelKey, std::uint32_t>> keys;  ///< and indices; ascending
  };
  /// @param which  indices of Gaussians
  [[nodiscard]] Part part(std::span<const std::uint32_t> which) const;
  /// The lower corner of a voxel relative to origin(), in voxels.
  [[nodiscard]] static Eigen::Vector3d corner_of(VoxelKey key) noexcept;

  [[nodiscard]] kernel::Map view() const noexcept;

 private:
  void find_surroundings();
  [[nodiscard]] BlockTable table() const noexcept {
    return {.slots = blocks_.data(), .mask = blocks_.size() - 1, .shift = shift_};
  }

  VoxelOptions options_;
  Eigen::Vector3d origin_voxel_;
  PageVector<VoxelKey> keys_;
  PageVector<Cell> cells_;
  PageVector<VoxelKey> bare_;
  // The same Gaussians in the form that the kernel reads.
  PageVector<Block> blocks_;
  PageVector<kernel::Surroundings> surroundings_;  // of each block; empty without bare voxels
  std::uint32_t shift_ = 0;
  PageVector<kernel::Row> rows_;
  PageVector<float> zz_;
};

}  // namespace vantage::ndt
