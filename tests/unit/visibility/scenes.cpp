#include "scenes.hpp"

#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "vantage/io/point_cloud_io.hpp"

namespace vantage::test {

PointCloud ball(std::uint32_t seed, std::size_t size, double radius, double hollow,
                const Point& centre) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> coordinate(-radius, radius);
  PointCloud cloud;
  while (cloud.size() < size) {
    const Point p(coordinate(random), coordinate(random), coordinate(random));
    if (p.norm() <= radius && p.norm() >= hollow) cloud.push_back(centre + p);
  }
  return cloud;
}

PointCloud sphere(std::size_t size, double radius) {
  PointCloud cloud;
  for (std::size_t i = 0; i < size; ++i) {
    const double z = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / static_cast<double>(size);
    const double azimuth = static_cast<double>(i) * std::numbers::pi * (3.0 - std::sqrt(5.0));
    const double r = std::sqrt(1.0 - z * z);
    cloud.emplace_back(radius * r * std::cos(azimuth), radius * r * std::sin(azimuth), radius * z);
  }
  return cloud;
}

PointCloud lattice(int half, double spacing) {
  PointCloud cloud;
  for (int x = -half; x <= half; ++x) {
    for (int y = -half; y <= half; ++y) {
      for (int z = -half; z <= half; ++z) {
        cloud.emplace_back(x * spacing, y * spacing, z * spacing);
      }
    }
  }
  return cloud;
}

PointCloud wall(double distance, int half, double spacing) {
  PointCloud cloud;
  for (int y = -half; y < half; ++y) {
    for (int z = -half; z <= half; ++z) {
      cloud.emplace_back(distance, (y + 0.5) * spacing, z * spacing);
    }
  }
  return cloud;
}

PointCloud joined(PointCloud a, const PointCloud& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

PointCloud translated(PointCloud cloud, const Eigen::Vector3d& by) {
  for (Point& p : cloud) p += by;
  return cloud;
}

PointCloud snapped(PointCloud cloud) {
  for (Point& p : cloud) p = (p * 0x1p20).array().round() * 0x1p-20;
  return cloud;
}

const std::optional<PointCloud>& street() {
  static const std::optional<PointCloud> map = []() -> std::optional<PointCloud> {
    const auto path = real_data("kitti_street/map.pcd");
    if (!path) return std::nullopt;
    auto loaded = io::read_point_cloud(*path);
    if (!loaded) throw std::runtime_error(to_string(loaded.error()));
    return std::move(loaded->points);
  }();
  return map;
}

PointCloud thinned(const PointCloud& cloud, std::size_t size) {
  PointCloud kept;
  for (std::size_t i = 0; i < size; ++i) kept.push_back(cloud[i * cloud.size() / size]);
  return kept;
}

hpr::Settings flip(PointsView map, double alpha) {
  return {.kernel = hpr::Kernel::spherical_flip, .radius = alpha * bounds_of(map).diagonal()};
}

hpr::Settings inversion() { return {.kernel = hpr::Kernel::inversion}; }

IndexList seen(PointsView map, const Point& viewpoint, const std::string& params,
               double max_range) {
  const auto hpr = plugin<VisibilityOperator>("hpr", params);
  const auto prepared = hpr->prepare(map, {.map_bounds = bounds_of(map), .max_range = max_range});
  if (!prepared) throw std::runtime_error(to_string(prepared.error()));
  auto indices = (*prepared)->visible(viewpoint);
  if (!indices) throw std::runtime_error(to_string(indices.error()));
  return *std::move(indices);
}

}  // namespace vantage::test
