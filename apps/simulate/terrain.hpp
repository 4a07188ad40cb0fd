#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "simulate/params.hpp"

namespace vantage::simulation {

/// The ground: smooth hills (octaves of value noise) as a triangulated height field.
/// Campus frame: z up, origin at the centre of the campus [m].
class Terrain {
 public:
  Terrain(const CampusParams& params, std::uint64_t seed);

  /// Height of the triangulated surface [m]; outside the campus, that of the nearest edge.
  [[nodiscard]] double height(double x, double y) const noexcept;
  [[nodiscard]] double height(const Eigen::Vector2d& p) const noexcept {
    return height(p.x(), p.y());
  }
  /// Unit normal of the surface, averaged over the footprint of a small vehicle (1.2 m).
  [[nodiscard]] Eigen::Vector3d normal(const Eigen::Vector2d& p) const noexcept;

  /// Half of the extent along x and y [m].
  [[nodiscard]] const Eigen::Vector2d& half_size() const noexcept { return half_size_; }

  /// Vertices along x and y; vertex (i, j) comes at i + j * columns().
  [[nodiscard]] int columns() const noexcept { return columns_; }
  [[nodiscard]] int rows() const noexcept { return rows_; }
  [[nodiscard]] Eigen::Vector3d vertex(int i, int j) const noexcept;

 private:
  /// Makes a plane at half of the relief, around the centre.
  void flatten(double radius);

  Eigen::Vector2d half_size_, cell_;
  int columns_, rows_;
  std::vector<double> heights_;
};

}  // namespace vantage::simulation
