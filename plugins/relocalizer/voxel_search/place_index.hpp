#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::voxel_search {

/// The voxels of a map that hold points. A search needs no more than these to tell places apart.
/// In a bundle, they take less than two bits each. Voxels are anchored to the world.
/// Immutable.
class PlaceIndex {
 public:
  /// Edge of a voxel [m].
  static constexpr double kVoxel = 1.5;

  /// @param map  N points, map frame [m]; finite
  /// Errors: `unsupported` for a map that is too large for the index: more than 32768 voxels along
  /// an edge, or more memory than `most_memory`.
  [[nodiscard]] static Result<PlaceIndex> of(PointsView map);
  /// Makes the index of a map that comes part by part.
  class Builder;
  /// The memory that so many voxels may take [bytes]: 1 GiB, which is a city of 10 x 10 km, and
  /// less for a few voxels that lie far apart. Blocks take as much again.
  [[nodiscard]] static std::uint64_t most_memory(std::uint64_t voxels) noexcept;
  /// Takes no more memory than `most_memory` of the voxels that the bytes hold.
  /// Errors: `corrupt_data` for bytes that no `encode` makes.
  [[nodiscard]] static Result<PlaceIndex> decode(std::span<const std::byte> bytes);
  [[nodiscard]] std::vector<std::byte> encode() const;

  /// The lower corner of voxel (0, 0, 0), map frame [m].
  [[nodiscard]] Eigen::Vector3d origin() const { return kVoxel * first_.cast<double>(); }
  /// Number of voxels along each axis. Along x and y, the outer `kMargin` are empty.
  [[nodiscard]] const Eigen::Vector3i& size() const noexcept { return size_; }
  static constexpr int kMargin = 46;

  /// A row of voxels along x, one bit each. At least one word beyond its end may be read.
  [[nodiscard]] const std::uint64_t* row(int y, int z) const noexcept {
    return bits_.data() + (std::size_t(z) * std::size_t(size_.y()) + std::size_t(y)) * words_;
  }
  [[nodiscard]] std::size_t words_in_row() const noexcept { return words_; }
  [[nodiscard]] std::size_t words_in_layer() const noexcept {
    return words_ * std::size_t(size_.y());
  }
  /// A row of blocks of 2 x 2 x 2 voxels, one bit each: bit i tells whether any voxel of the block
  /// is occupied whose lowest corner is the voxel (2 i + odd, y, z). Blocks overlap along y and z.
  /// At least one word beyond its end may be read.
  [[nodiscard]] const std::uint64_t* blocks(int odd, int y, int z) const noexcept {
    return blocks_.data() + first_of_blocks(odd, y, z);
  }
  /// Where that row begins, in words from the first row of blocks.
  [[nodiscard]] std::size_t first_of_blocks(int odd, int y, int z) const noexcept {
    return ((std::size_t(z) * 2 + std::size_t(odd)) * std::size_t(size_.y()) + std::size_t(y)) *
           words_in_blocks();
  }
  [[nodiscard]] std::size_t words_in_blocks() const noexcept { return words_ / 2 + 3; }
  /// Memory that the index holds.
  [[nodiscard]] std::size_t bytes() const noexcept {
    return sizeof(std::uint64_t) * (bits_.capacity() + blocks_.capacity()) +
           sizeof(std::int16_t) * lowest_.capacity();
  }
  [[nodiscard]] bool occupied(const Eigen::Vector3i& voxel) const noexcept {
    if ((voxel.array() < 0).any() || (voxel.array() >= size_.array()).any()) return false;
    return (row(voxel.y(), voxel.z())[voxel.x() / 64] >> (voxel.x() % 64) & 1U) != 0;
  }
  static constexpr std::int16_t kNothing = 32767;
  /// The lowest occupied layer within 8 m of a voxel's column; kNothing if there is none.
  [[nodiscard]] std::int16_t lowest(int x, int y) const noexcept {
    return lowest_[std::size_t(y) * std::size_t(size_.x()) + std::size_t(x)];
  }

 private:
  static constexpr int kMostVoxels = 32768;             // along an edge
  static constexpr int kFarthestVoxel = 1'000'000'000;  // from the world's origin

  /// An empty index. @param extent  without the margin, at least 1 each
  PlaceIndex(const Eigen::Vector3i& first, const Eigen::Vector3i& extent);
  /// @param keys  the voxels, as numbers of a box of `extent` whose order is z, y, x
  [[nodiscard]] static PlaceIndex from(const std::vector<std::uint64_t>& keys,
                                       const Eigen::Vector3i& first, const Eigen::Vector3i& extent);
  [[nodiscard]] std::uint64_t memory() const noexcept;  // [bytes] of `bits_` and `lowest_`
  void find_lowest();
  void find_blocks();

  Eigen::Vector3i first_ = Eigen::Vector3i::Zero();  // voxel (0, 0, 0), in voxels from the world's
  Eigen::Vector3i size_ = Eigen::Vector3i::Zero();
  std::size_t words_ = 0;
  std::vector<std::uint64_t> bits_, blocks_;
  std::vector<std::int16_t> lowest_;
};

class PlaceIndex::Builder {
 public:
  /// @param bounds  of the map [m]; not empty, finite
  /// Errors: `unsupported` for a map with too many voxels along an edge.
  [[nodiscard]] static Result<Builder> over(const Bounds3& bounds);

  /// @param points  within the bounds; the order does not matter
  void add(PointsView points);
  void add(const Point& p);
  /// Errors: `unsupported` for an index that would take more memory than `most_memory`.
  [[nodiscard]] Result<PlaceIndex> finish() &&;

 private:
  Builder(const Eigen::Vector3i& first, const Eigen::Vector3i& extent)
      : first_(first), extent_(extent) {}
  void tidy();

  Eigen::Vector3i first_, extent_;  // in voxels
  std::vector<std::uint64_t> keys_;
  std::size_t limit_ = std::size_t{1} << 20U;  // of keys, before they are tidied
};

}  // namespace vantage::voxel_search
