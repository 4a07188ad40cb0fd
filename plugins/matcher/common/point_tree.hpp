#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "vantage/point_cloud.hpp"

namespace vantage::matching {

inline constexpr std::uint32_t kNone = ~std::uint32_t{0};

/// A kd-tree over borrowed points. The points must stay in place while the tree exists.
/// Thread safety: immutable once built.
class PointTree {
 public:
  static constexpr std::uint32_t kMostNeighbours = 64;

  explicit PointTree(PointsView points);
  ~PointTree();
  PointTree(PointTree&&) noexcept;
  PointTree& operator=(PointTree&&) noexcept;

  struct Nearest {
    std::uint32_t index = kNone;  ///< of the nearest point; kNone if no point is within the radius
    double others = 0.0;          ///< no other point is nearer than this [m]
  };
  /// @param radius  only points nearer than this count [m]
  [[nodiscard]] Nearest nearest(const Point& x, double radius) const;

  /// Calls use(index) for each point that is nearer than `radius` [m], in any order.
  void for_each_within(const Point& x, double radius,
                       const std::function<void(std::uint32_t)>& use) const;

  /// The unit normal of the plane through the `k` points nearest to `x` (at most kMostNeighbours):
  /// the direction of their least spread, with either sign. Zero if the points show no plane: fewer
  /// than three points, all on one line, or all in one place.
  [[nodiscard]] Eigen::Vector3d normal_at(const Point& x, std::uint32_t k) const;

  /// Memory of the tree, without the points [bytes].
  [[nodiscard]] std::size_t bytes() const noexcept;

 private:
  struct Index;
  std::unique_ptr<const Index> index_;
};

}  // namespace vantage::matching
