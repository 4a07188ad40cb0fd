#include "reach_grid.hpp"

#include <algorithm>
#include <cmath>

namespace vantage::hpr {

ReachGrid::ReachGrid() {
  for (int level = kCoarsest; level <= kFinest; ++level) {
    const std::size_t line = (std::size_t{1} << level) + 1;
    corners_[level - kCoarsest].resize(6 * line * line, {0.0, 0});
  }
}

double ReachGrid::reach_at(int level, int face, int column, int row, StarHull& hull) {
  const int n = 1 << level, line = n + 1;
  Corner& corner =
      corners_[level - kCoarsest][static_cast<std::size_t>((face * line + row) * line + column)];
  if (corner.stamp != stamp_) {
    const int axis = face / 2;
    Eigen::Vector3d direction;
    direction[axis] = face % 2 == 0 ? 1.0 : -1.0;
    direction[(axis + 1) % 3] = 2.0 * column / n - 1.0;
    direction[(axis + 2) % 3] = 2.0 * row / n - 1.0;
    corner = {hull.reach(direction.normalized()), stamp_};
  }
  return corner.reach;
}

// The bins that the cone touches, and their corners: a bin's cone up to a length, less what the
// chord between the corners leaves out, is inside if its corners at that length are.
bool ReachGrid::surely_holds(const StarHull::Cone& cone, StarHull& hull) {
  Eigen::Index axis = 0;
  cone.axis.cwiseAbs().maxCoeff(&axis);
  const double toward = std::abs(cone.axis[axis]);
  const double v = cone.axis[(axis + 1) % 3] / toward, w = cone.axis[(axis + 2) % 3] / toward;
  const double tangent = cone.sine / cone.cosine;
  const double stretch = 1.0 + v * v + w * w;
  const double room = 1.0 - tangent * std::sqrt(stretch - 1.0);
  if (room <= 0.0) return false;
  const double half = 1.000001 * tangent * stretch / room;  // of the square about the cone
  if (std::max(std::abs(v), std::abs(w)) + half >= 1.0 - 1e-12) {
    return hull.surely_holds(cone);  // it reaches round the edge of the cube
  }
  const int level = std::min(kFinest, std::ilogb(2.0 / half));
  if (level < kCoarsest) return false;
  const double n = 1 << level;
  const auto bin = [&](double x) { return static_cast<int>(0.5 * n * (1.0 + x)); };
  const int face = static_cast<int>(2 * axis + (cone.axis[axis] < 0.0 ? 1 : 0));
  const double near_v = std::max(0.0, std::abs(v) - half - 2.0 / n);
  const double near_w = std::max(0.0, std::abs(w) - half - 2.0 / n);
  const double shrink = 1.0 - 1.000001 / (n * n * (1.0 + near_v * near_v + near_w * near_w));
  const double needed = cone.length / shrink;
  const int last_column = bin(v + half) + 1, last_row = bin(w + half) + 1;
  for (int row = bin(w - half); row <= last_row; ++row) {
    for (int column = bin(v - half); column <= last_column; ++column) {
      if (!(reach_at(level, face, column, row, hull) > needed)) return false;
    }
  }
  return true;
}

}  // namespace vantage::hpr
