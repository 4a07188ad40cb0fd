#include "point_tree.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <nanoflann.hpp>

#include "vantage/kit/kd_tree_points.hpp"

namespace vantage::matching {
namespace {

using Cloud = KdTreePoints<Point>;

/// The nearest point and the distance of the second nearest. Of equally near points, the one with
/// the lowest index counts.
// NOLINTBEGIN(readability-identifier-naming): nanoflann calls these.
struct NearestTwo {
  using DistanceType = double;
  double first, second;
  std::uint32_t index = kNone;

  explicit NearestTwo(double squared_radius) : first(squared_radius), second(squared_radius) {}
  [[nodiscard]] std::size_t size() const { return index == kNone ? 0 : 1; }
  [[nodiscard]] bool full() const { return true; }
  [[nodiscard]] double worstDist() const { return second; }
  bool addPoint(double squared_distance, std::uint32_t point) {
    if (squared_distance < first || (squared_distance == first && point < index)) {
      second = first;
      first = squared_distance;
      index = point;
    } else {
      second = std::min(second, squared_distance);
    }
    return true;
  }
  void sort() {}  // asked for since nanoflann 1.5
};

/// The k nearest. If all k coincide with the query, other equally near points are not looked at:
/// among many equal points, each search would otherwise visit all of them.
struct NearestK : nanoflann::KNNResultSet<double, std::uint32_t> {
  using KNNResultSet::KNNResultSet;
  [[nodiscard]] double worstDist() const {
    const double worst = KNNResultSet::worstDist();
    return worst > 0.0 ? worst : -1.0;
  }
};
/// All within a radius.
struct Within {
  using DistanceType = double;
  double squared_radius;
  const std::function<void(std::uint32_t)>& use;

  [[nodiscard]] std::size_t size() const { return 0; }
  [[nodiscard]] bool full() const { return true; }
  [[nodiscard]] double worstDist() const { return squared_radius; }
  bool addPoint(double squared_distance, std::uint32_t point) {
    if (squared_distance < squared_radius) use(point);
    return true;
  }
  void sort() {}
};
// NOLINTEND(readability-identifier-naming)

constexpr std::size_t kLeafSize = 16;
// Below a micrometre, the spread of neighbours is rounding of the coordinates, not shape.
constexpr double kLeastVariance = 1e-12;
// A second eigenvalue below this share of the largest means that the points lie on a line.
constexpr double kLineShare = 1e-6;

}  // namespace

struct PointTree::Index {
  using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Cloud>,
                                                   Cloud, 3, std::uint32_t>;
  explicit Index(PointsView points)
      : cloud{points},
        tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(kLeafSize)),
        bytes(sizeof(Index) + tree.usedMemory(tree)) {}

  Cloud cloud;
  Tree tree;
  std::size_t bytes;
};

PointTree::PointTree(PointsView points) : index_(std::make_unique<const Index>(points)) {}
PointTree::~PointTree() = default;
PointTree::PointTree(PointTree&&) noexcept = default;
PointTree& PointTree::operator=(PointTree&&) noexcept = default;

PointTree::Nearest PointTree::nearest(const Point& x, double radius) const {
  NearestTwo found(radius * radius);
  index_->tree.findNeighbors(found, x.data(), {});
  return {.index = found.index, .others = std::sqrt(found.second)};
}

void PointTree::for_each_within(const Point& x, double radius,
                                const std::function<void(std::uint32_t)>& use) const {
  Within all{radius * radius, use};
  index_->tree.findNeighbors(all, x.data(), {});
}

Eigen::Vector3d PointTree::normal_at(const Point& x, std::uint32_t k) const {
  std::array<std::uint32_t, kMostNeighbours> indices;
  std::array<double, kMostNeighbours> squared_distances;
  NearestK nearest(std::min(k, kMostNeighbours));
  nearest.init(indices.data(), squared_distances.data());
  index_->tree.findNeighbors(nearest, x.data(), {});
  const std::size_t found = nearest.size();
  if (found < 3) return Eigen::Vector3d::Zero();

  // Relative to x the sums are small and lose no digits to cancellation.
  const auto n = static_cast<double>(found);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < found; ++i) {
    const Eigen::Vector3d d = index_->cloud.points[indices[i]] - x;
    mean += d / n;
    squares += d * d.transpose() / n;
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(squares - mean * mean.transpose());
  const Eigen::Vector3d& spread = solver.eigenvalues();
  const bool plane = spread.z() > kLeastVariance && spread.y() > kLineShare * spread.z();
  const Eigen::Vector3d normal = solver.eigenvectors().col(0);
  return plane && normal.allFinite() ? normal : Eigen::Vector3d::Zero();
}

std::size_t PointTree::bytes() const noexcept { return index_->bytes; }

}  // namespace vantage::matching
