#pragma once

#include <Eigen/Core>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::ndt {

/// Names one voxel: three 21-bit indices counted from VoxelMap::origin(), x highest. Neighbours
/// differ by the constants below, so that a step in any direction is one addition.
using VoxelKey = std::uint64_t;
inline constexpr VoxelKey kNoVoxel = ~VoxelKey{0};
inline constexpr VoxelKey kStepX = VoxelKey{1} << 42U;
inline constexpr VoxelKey kStepY = VoxelKey{1} << 21U;
inline constexpr VoxelKey kStepZ = 1;

/// The normal distribution of the map points in one voxel (Magnusson 2009, Eqs. 6.2-6.3).
struct Gaussian {
  Eigen::Vector3d mean;           ///< relative to VoxelMap::origin() [m]
  double xx, xy, xz, yy, yz, zz;  ///< inverse covariance [1/m^2]
};

/// The map as one Gaussian a voxel, found through a flat hash table.
///
/// Voxels are anchored at the world's zero: a point belongs to voxel floor(p / resolution) in every
/// map that holds it. Gaussians are kept relative to an origin near the map's centre, a multiple of
/// the resolution, so that doubles lose nothing at UTM coordinates.
/// Thread safety: immutable once built.
class VoxelMap {
 public:
  struct Options {
    double resolution = 1.0;         ///< edge of a voxel [m], > 0
    std::uint32_t min_points = 6;    ///< a voxel with fewer has no Gaussian; >= 2
    double eigenvalue_floor = 0.01;  ///< smallest share of the largest eigenvalue, in (0, 1]
  };

  /// Gaussians come in the order of their voxels, whatever the order of the points.
  /// Errors: `invalid_input` for no points, a non-finite coordinate, or an extent of more than
  /// about two million voxels along an axis; `too_few_matches` if no voxel holds enough points.
  [[nodiscard]] static Result<VoxelMap> build(PointsView map, const Options& options);

  [[nodiscard]] const Point& origin() const noexcept { return origin_; }
  [[nodiscard]] double resolution() const noexcept { return resolution_; }
  [[nodiscard]] std::span<const Gaussian> gaussians() const noexcept { return gaussians_; }
  /// How many map points each Gaussian stands for.
  [[nodiscard]] std::span<const std::uint32_t> counts() const noexcept { return counts_; }
  /// Memory that it holds.
  [[nodiscard]] std::size_t bytes() const noexcept {
    return slots_.capacity() * sizeof(Slot) + gaussians_.capacity() * sizeof(Gaussian) +
           counts_.capacity() * sizeof(std::uint32_t);
  }

  /// The voxel of a position relative to origin(); kNoVoxel where the map cannot reach.
  [[nodiscard]] VoxelKey key_of(const Eigen::Vector3d& local) const noexcept {
    // The shift makes every index positive, where truncation is floor. NaN fails the comparisons.
    const Eigen::Vector3d index = (local * inverse_resolution_).array() + kHalfRange;
    const bool inside = index.x() >= 1.0 && index.x() < kIndexEnd && index.y() >= 1.0 &&
                        index.y() < kIndexEnd && index.z() >= 1.0 && index.z() < kIndexEnd;
    return inside ? pack(index) : kNoVoxel;
  }

  static constexpr std::uint32_t kNoGaussian = ~std::uint32_t{0};
  /// Index of a voxel's Gaussian; kNoGaussian for a voxel without one.
  [[nodiscard]] std::uint32_t find(VoxelKey key) const noexcept {
    const std::size_t mask = slots_.size() - 1;
    for (std::size_t slot = hash(key) >> shift_;; slot = (slot + 1) & mask) {
      if (slots_[slot].key == key) return slots_[slot].gaussian;
      if (slots_[slot].key == kNoVoxel) return kNoGaussian;
    }
  }

 private:
  struct Slot {
    VoxelKey key = kNoVoxel;
    std::uint32_t gaussian = kNoGaussian;
  };
  // Indices run over [1, kIndexEnd): a neighbour's index never leaves its 21 bits.
  static constexpr double kHalfRange = 1 << 20;
  static constexpr double kIndexEnd = (1 << 21) - 1;

  VoxelMap() = default;
  [[nodiscard]] static VoxelKey pack(const Eigen::Vector3d& index) noexcept {
    return static_cast<VoxelKey>(static_cast<std::int64_t>(index.x())) * kStepX +
           static_cast<VoxelKey>(static_cast<std::int64_t>(index.y())) * kStepY +
           static_cast<VoxelKey>(static_cast<std::int64_t>(index.z()));
  }
  [[nodiscard]] static std::uint64_t hash(VoxelKey key) noexcept {
    return key * 0x9E3779B97F4A7C15U;  // Fibonacci hashing: the high bits are the good ones
  }

  Point origin_ = Point::Zero();
  double resolution_ = 1.0, inverse_resolution_ = 1.0;
  unsigned shift_ = 0;
  std::vector<Slot> slots_;
  std::vector<Gaussian> gaussians_;
  std::vector<std::uint32_t> counts_;

  friend class VoxelMapBuilder;
};

}  // namespace vantage::ndt
