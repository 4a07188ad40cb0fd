#include "voxel_tree.hpp"

#include <nanoflann.hpp>

namespace vantage::ndt {
namespace {

/// The names are nanoflann's.
struct Means {
  std::span<const Gaussian> gaussians;

  [[nodiscard]] std::size_t kdtree_get_point_count() const { return gaussians.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return gaussians[i].mean[static_cast<Eigen::Index>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box& /*unused*/) const {
    return false;
  }
};

/// Collects into a fixed array: nanoflann's own result set would allocate.
// NOLINTBEGIN(readability-identifier-naming): nanoflann calls these.
struct WithinRadius {
  using DistanceType = double;
  VoxelTree::Found& found;
  double squared_radius;

  [[nodiscard]] std::size_t size() const { return found.size; }
  [[nodiscard]] bool full() const { return true; }
  [[nodiscard]] double worstDist() const { return squared_radius; }
  bool addPoint(double squared_distance, std::uint32_t gaussian) {
    if (squared_distance < squared_radius && found.size < VoxelTree::kMost) {
      found.gaussians[found.size++] = gaussian;
    }
    return true;
  }
};
// NOLINTEND(readability-identifier-naming)

}  // namespace

struct VoxelTree::Index {
  using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Means>,
                                                   Means, 3, std::uint32_t>;
  Index(std::span<const Gaussian> gaussians, double r)
      : means{gaussians}, tree(3, means), squared_radius(r * r) {}

  Means means;
  Tree tree;
  double squared_radius;
};

VoxelTree::VoxelTree(std::span<const Gaussian> gaussians, double radius)
    : index_(std::make_unique<const Index>(gaussians, radius)) {}
VoxelTree::~VoxelTree() = default;
VoxelTree::VoxelTree(VoxelTree&&) noexcept = default;
VoxelTree& VoxelTree::operator=(VoxelTree&&) noexcept = default;

VoxelTree::Found VoxelTree::near(const Eigen::Vector3d& local) const {
  Found found;
  WithinRadius result{found, index_->squared_radius};
  index_->tree.findNeighbors(result, local.data(), nanoflann::SearchParams());
  return found;
}

}  // namespace vantage::ndt
