#include "scenes.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "support/plugins.hpp"
#include "vantage/ground_filter.hpp"

namespace vantage::test {

IndexList ground_by(const std::string& plugin, const PointCloud& cloud, const std::string& params) {
  auto ground = test::plugin<GroundFilter>(plugin, params)->ground(cloud);
  REQUIRE_MESSAGE(ground, to_string(ground.error()));
  // Not an assertion for each of the millions of indices.
  REQUIRE(std::ranges::adjacent_find(*ground, std::ranges::greater_equal{}) == ground->end());
  if (!ground->empty()) REQUIRE(ground->back() < cloud.size());
  return *std::move(ground);
}

PointCloud sampled(std::size_t n, const Eigen::Vector2d& min, const Eigen::Vector2d& max,
                   const Surface& z, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> x(min.x(), max.x()), y(min.y(), max.y());
  PointCloud cloud;
  for (std::size_t k = 0; k < n; ++k) {
    const double px = x(random), py = y(random);
    cloud.emplace_back(px, py, z(px, py));
  }
  return cloud;
}

double level(double, double) { return 0.0; }

void append(PointCloud& cloud, const PointCloud& more) {
  cloud.insert(cloud.end(), more.begin(), more.end());
}

double share(const IndexList& ground, std::size_t begin, std::size_t end) {
  const auto inside = std::count_if(ground.begin(), ground.end(),
                                    [&](std::uint32_t k) { return begin <= k && k < end; });
  return static_cast<double>(inside) / static_cast<double>(end - begin);
}

Scene box_on_ground(double half_width, double height, double density) {
  Scene scene;
  for (const Point& p :
       sampled(static_cast<std::size_t>(6400 * density), {-40, -40}, {40, 40}, level)) {
    if (p.head<2>().cwiseAbs().maxCoeff() >= half_width) scene.cloud.push_back(p);
  }
  scene.ground = scene.cloud.size();
  const double area = 4.0 * half_width * half_width;
  append(scene.cloud, sampled(
                          static_cast<std::size_t>(area * density), {-half_width, -half_width},
                          {half_width, half_width}, [&](double, double) { return height; }, 2));
  scene.top = scene.cloud.size();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> along(-half_width, half_width), up(0.5, height);
  for (int k = 0; k < 400; ++k) scene.cloud.emplace_back(half_width, along(random), up(random));
  return scene;
}

PointCloud landscape(double length) {
  std::mt19937 random(21);
  std::uniform_real_distribution<double> x(0.0, length), y(0.0, 90.0), up(0.0, 9.0), any(0.0, 1.0);
  PointCloud cloud;
  for (int k = 0; k < static_cast<int>(length * 90.0); ++k) {
    Point p(x(random), y(random), 0.0);
    p.z() = 4.0 * std::sin(p.x() / 40.0) + 0.05 * p.y();
    if (std::fmod(p.x(), 61.0) < 17.0 && std::fmod(p.y(), 37.0) < 14.0) p.z() += 6.0;
    if (any(random) < 0.1) p.z() += up(random);
    if (any(random) < 0.01) p.z() -= up(random);
    cloud.push_back((p * 1024.0).array().round() / 1024.0);
  }
  return cloud;
}

}  // namespace vantage::test
