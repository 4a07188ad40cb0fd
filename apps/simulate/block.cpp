#include "simulate/block.hpp"

#include <Eigen/LU>
#include <algorithm>

namespace vantage::simulation {
namespace {

using Eigen::Vector2d;

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

}  // namespace

Vector2d Block::along(std::size_t k) const { return (corner(k + 1) - corner(k)).normalized(); }

Vector2d Block::inward(std::size_t k) const {
  const Vector2d a = along(k);
  return {-a.y(), a.x()};
}

double Block::length(std::size_t k) const { return (corner(k + 1) - corner(k)).norm(); }

double Block::area() const {
  return 0.5 * (cross(corners[1] - corners[0], corners[2] - corners[0]) +
                cross(corners[2] - corners[0], corners[3] - corners[0]));
}

bool Block::contains(const Vector2d& p, double margin) const {
  for (std::size_t k = 0; k < 4; ++k) {
    if (inward(k).dot(p - corners[k]) < margin) return false;
  }
  return true;
}

bool Block::contains(const Plot& plot, double margin) const {
  for (const double u : {-1.0, 1.0}) {
    for (const double v : {-1.0, 1.0}) {
      if (!contains(plot.at(u * plot.half.x(), v * plot.half.y()), margin)) return false;
    }
  }
  return true;
}

std::optional<Block> block_between(const StreetGrid& streets, double street_width, int i, int j) {
  const std::array nodes{streets.node(i - 1, j - 1), streets.node(i, j - 1), streets.node(i, j),
                         streets.node(i - 1, j)};
  Block block{nodes,
              {!streets.is_border_y(j - 1), !streets.is_border_x(i), !streets.is_border_y(j),
               !streets.is_border_x(i - 1)}};
  std::array<Vector2d, 4> corners;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto inset = [&](std::size_t side) {
      return block.has_street[side] ? street_width / 2.0 + kVerge : kBorder;
    };
    // Where the sides before and after the corner meet after both move inwards.
    const std::size_t before = (k + 3) % 4;
    Eigen::Matrix2d normals;
    normals << block.inward(before).transpose(), block.inward(k).transpose();
    corners[k] = block.corners[k] + normals.inverse() * Vector2d(inset(before), inset(k));
  }
  block.corners = corners;
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector2d side = nodes[(k + 1) % 4] - nodes[k];
    if ((block.corner(k + 1) - block.corner(k)).dot(side.normalized()) < 3.0) return std::nullopt;
  }
  return block;
}

bool is_free(const Plot& plot, const std::vector<Plot>& taken) {
  return std::none_of(taken.begin(), taken.end(),
                      [&](const Plot& other) { return overlap(plot, other); });
}

}  // namespace vantage::simulation
