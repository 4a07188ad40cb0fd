#include "view/camera.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace vantage::view {
namespace {

constexpr std::size_t kSample = 200'000;
constexpr double kMargin = 1.04;

PointCloud sample_of(PointsView points) {
  const std::size_t step = points.size() / kSample + 1;
  PointCloud sample;
  for (std::size_t i = 0; i < points.size(); i += step) sample.push_back(points[i]);
  return sample;
}

Bounds3 bounds_without_strays(const PointCloud& points) {
  Bounds3 bounds;
  std::vector<double> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < points.size(); ++i) values[i] = points[i][axis];
    const auto quantile = [&](double share) {
      const auto at = values.begin() +
                      static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
      std::nth_element(values.begin(), at, values.end());
      return *at;
    };
    bounds.min[axis] = quantile(0.002);
    bounds.max[axis] = quantile(0.998);
  }
  return bounds;
}

/// The elevation of the eye: steep enough to see streets behind houses.
constexpr double kElevation = 42.0 * std::numbers::pi / 180.0;
/// Turned slightly, so that walls along the axes show both sides.
constexpr double kTurn = 24.0 * std::numbers::pi / 180.0;

}  // namespace

Camera oblique_view(PointsView points, double vertical_fov, double aspect) {
  Camera camera;
  if (points.empty()) return camera;
  const PointCloud sample = sample_of(points);
  const Bounds3 bounds = bounds_without_strays(sample);
  const Eigen::Vector3d size = bounds.max - bounds.min;
  const double azimuth = (size.x() >= size.y() ? -0.5 : 0.0) * std::numbers::pi - kTurn;
  camera.front = {std::cos(kElevation) * std::cos(azimuth),
                  std::cos(kElevation) * std::sin(azimuth), std::sin(kElevation)};
  const Eigen::Vector3d right = Eigen::Vector3d::UnitZ().cross(camera.front).normalized();
  const Eigen::Vector3d up = camera.front.cross(right);
  const double tan_y = std::tan(0.5 * vertical_fov) / kMargin, tan_x = tan_y * aspect;

  camera.lookat = 0.5 * (bounds.min + bounds.max);
  // A point is in the picture if |x| <= tan_x (distance - depth), and likewise for |y|. Near points
  // take more of the picture than far ones, so the camera is centred again after each fit.
  for (int round = 0; round < 4; ++round) {
    double distance = 0.0;
    for (const Point& p : sample) {
      if (((p - bounds.min).array() < 0.0).any() || ((bounds.max - p).array() < 0.0).any())
        continue;
      const Eigen::Vector3d d = p - camera.lookat;
      const double depth = d.dot(camera.front);
      distance = std::max(
          {distance, std::abs(d.dot(right)) / tan_x + depth, std::abs(d.dot(up)) / tan_y + depth});
    }
    camera.distance = std::max(distance, 1.0);
    if (round == 3) break;
    double left = 1e300, rightmost = -1e300, low = 1e300, high = -1e300;
    for (const Point& p : sample) {
      if (((p - bounds.min).array() < 0.0).any() || ((bounds.max - p).array() < 0.0).any())
        continue;
      const Eigen::Vector3d d = p - camera.lookat;
      const double depth = camera.distance - d.dot(camera.front);
      if (depth <= 0.0) continue;
      left = std::min(left, d.dot(right) / depth);
      rightmost = std::max(rightmost, d.dot(right) / depth);
      low = std::min(low, d.dot(up) / depth);
      high = std::max(high, d.dot(up) / depth);
    }
    if (left > rightmost) break;
    camera.lookat += 0.5 * camera.distance * ((left + rightmost) * right + (low + high) * up);
  }
  return camera;
}

}  // namespace vantage::view
