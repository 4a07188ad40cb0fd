#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "voxel_map.hpp"

namespace vantage::ndt {

/// The Gaussians whose mean lies within a radius of a point.
class VoxelTree {
 public:
  /// A mean lies in its voxel, so at most the 27 voxels around a point have one within an edge.
  static constexpr std::size_t kMost = 27;
  struct Found {
    std::array<std::uint32_t, kMost> gaussians;
    std::size_t size = 0;
  };

  /// @param gaussians  borrowed: they stay where they are for as long as the tree lives
  /// @param radius     [m]; at most the voxels' edge
  VoxelTree(std::span<const Gaussian> gaussians, double radius);
  ~VoxelTree();
  VoxelTree(VoxelTree&&) noexcept;
  VoxelTree& operator=(VoxelTree&&) noexcept;

  [[nodiscard]] Found near(const Eigen::Vector3d& local) const;

 private:
  struct Index;
  std::unique_ptr<const Index> index_;
};

}  // namespace vantage::ndt
