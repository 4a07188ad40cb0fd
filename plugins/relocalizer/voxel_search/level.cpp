#include "level.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "vantage/kit/evenly_picked.hpp"

namespace vantage::voxel_search {
namespace {

// The ground is looked for so near to the sensor [m]: a step of the tilt moves it by less than the
// slab's thickness there.
constexpr double kNearRange = 12.0, kSlab = 0.4;
constexpr std::size_t kMostPoints = 800;
constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kMostTilt = 33.0 * kDegree, kTiltStep = 2.5 * kDegree;
// Of the points, so many may be below the ground: ditches, reflections.
constexpr double kBelowGround = 0.05;
constexpr double kLeastGround = 0.1;  // share of the points that the ground has at least

/// A slab of space; `normal` points up.
struct Slab {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double height = 0.0;  // of its middle, along the normal [m]
  std::size_t points = 0;
};

/// Of the lowest slabs with a normal, the one with the most points.
Slab lowest_slab(const PointCloud& points, const Eigen::Vector3d& normal,
                 std::vector<double>& heights) {
  heights.clear();
  for (const Point& p : points) heights.push_back(normal.dot(p));
  std::sort(heights.begin(), heights.end());
  const auto below = static_cast<std::size_t>(kBelowGround * static_cast<double>(heights.size()));
  Slab best{.normal = normal};
  std::size_t end = 0;
  for (std::size_t begin = 0; begin <= below && begin < heights.size(); ++begin) {
    while (end < heights.size() && heights[end] <= heights[begin] + kSlab) ++end;
    if (end - begin <= best.points) continue;
    best.points = end - begin;
    best.height = heights[begin] + 0.5 * kSlab;
  }
  return best;
}

/// The plane of least squares through the points within `half` of a slab's middle.
Slab fitted(const PointCloud& points, const Slab& slab, double half) {
  constexpr std::size_t kFewest = 10;
  PointCloud inside;
  for (const Point& p : points) {
    if (std::abs(slab.normal.dot(p) - slab.height) <= half) inside.push_back(p);
  }
  if (inside.size() < kFewest) return slab;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Point& p : inside) centre += p;
  centre /= static_cast<double>(inside.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Point& p : inside) spread += (p - centre) * (p - centre).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  Eigen::Vector3d normal = solver.eigenvectors().col(0);
  if (normal.z() < 0.0) normal = -normal;
  return {.normal = normal, .height = normal.dot(centre), .points = inside.size()};
}

}  // namespace

Pose level_by_ground(PointsView scan) {
  PointCloud near;
  for (const Point& p : scan) {
    if (p.norm() < kNearRange) near.push_back(p);
  }
  near = evenly_picked(near, kMostPoints);
  Slab best;
  std::vector<double> heights;
  const int steps = static_cast<int>(kMostTilt / kTiltStep);
  for (int i = -steps; i <= steps; ++i) {
    for (int j = -steps; j <= steps; ++j) {
      const Eigen::Vector3d tilt = kTiltStep * Eigen::Vector3d(i, j, 0.0);
      if (tilt.norm() > kMostTilt) continue;
      const Eigen::Vector3d normal =
          rotation_from_vector(tilt).toRotationMatrix() * Eigen::Vector3d::UnitZ();
      const Slab slab = lowest_slab(near, normal, heights);
      if (slab.points > best.points) best = slab;
    }
  }
  if (static_cast<double>(best.points) < kLeastGround * static_cast<double>(near.size()) ||
      near.empty()) {
    return {};
  }
  for (const double half : {0.4, 0.3, 0.2, 0.2}) best = fitted(near, best, half);
  if (std::acos(std::min(1.0, best.normal.z())) > kMostTilt) return {};
  Pose T_level_sensor;
  T_level_sensor.rotation =
      Eigen::Quaterniond::FromTwoVectors(best.normal, Eigen::Vector3d::UnitZ());
  return T_level_sensor;
}

}  // namespace vantage::voxel_search
