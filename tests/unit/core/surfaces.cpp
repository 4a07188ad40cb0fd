#include "build/surfaces.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

using namespace vantage;

namespace surfaces_test {
namespace {

/// A wall at x, 20 m wide, 4 m high, a point in each 10 x 10 cm, with noise.
void add_wall(PointCloud& map, double x, double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> off(0.0, noise);
  for (int row = 0; row < 40; ++row) {
    for (int column = 0; column < 200; ++column) {
      map.emplace_back(x + off(random), -10.0 + 0.1 * column + 0.05, 0.1 * row + 0.05);
    }
  }
}

const Point kSensor(0.1, 0.2, 2.0);

TEST_CASE("virtual scans: a noisy wall is hit where the wall is") {
  PointCloud map;
  add_wall(map, 8.0, 0.03, 1);
  const PointCloud scan = Surfaces(map).scan(kSensor, {});
  REQUIRE(scan.size() > 500);
  double sum = 0.0, squares = 0.0;
  for (const Point& p : scan) {
    sum += p.x() - 8.0;
    squares += (p.x() - 8.0) * (p.x() - 8.0);
    CHECK(std::abs(p.y()) < 10.5);
  }
  const auto n = static_cast<double>(scan.size());
  CHECK(std::abs(sum / n) < 0.002);
  CHECK(std::sqrt(squares / n) < 0.012);  // of 0.03 in the map
}

TEST_CASE("virtual scans: noisy ground is hit where it is, whatever its height") {
  for (const double z : {0.0, 0.39, -0.01, 250.0}) {
    CAPTURE(z);
    std::mt19937 random(1);
    std::normal_distribution<double> off(0.0, 0.03);
    PointCloud map;
    for (int x = -100; x < 100; ++x) {
      for (int y = -100; y < 100; ++y) map.emplace_back(0.1 * x, 0.1 * y, z + off(random));
    }
    const PointCloud scan = Surfaces(map).scan({0.2, 0.1, z + 1.5}, {});
    REQUIRE(scan.size() > 500);
    double sum = 0.0, squares = 0.0;
    for (const Point& p : scan) {
      sum += p.z() - z;
      squares += (p.z() - z) * (p.z() - z);
    }
    const auto n = static_cast<double>(scan.size());
    CHECK(std::abs(sum / n) < 0.002);
    CHECK(std::sqrt(squares / n) < 0.012);
  }
}

TEST_CASE("virtual scans: a wall hides what is behind it, and rays end at the range") {
  PointCloud map;
  add_wall(map, 8.0, 0.0, 1);
  add_wall(map, 30.0, 0.0, 2);
  const Surfaces both(map);
  for (const Point& p : both.scan(kSensor, {})) CHECK(p.x() == doctest::Approx(8.0).epsilon(1e-6));
  CHECK(both.scan(kSensor, {.max_range = 5.0}).empty());
  const PointCloud up = both.scan(kSensor, {.lowest = 5.0, .highest = 10.0});
  REQUIRE(!up.empty());
  for (const Point& p : up) CHECK(p.z() > kSensor.z());
}

TEST_CASE("virtual scans: the order of the points and what is out of range do not matter") {
  PointCloud map;
  add_wall(map, 8.0, 0.02, 1);
  add_wall(map, -12.0, 0.05, 2);
  const PointCloud scan = Surfaces(map).scan(kSensor, {.max_range = 20.0});
  std::mt19937 random(3);
  add_wall(map, 60.0, 0.02, 4);
  std::ranges::shuffle(map, random);
  const PointCloud other = Surfaces(map).scan(kSensor, {.max_range = 20.0});
  REQUIRE(scan.size() == other.size());
  for (std::size_t i = 0; i < scan.size(); ++i) CHECK(scan[i] == other[i]);
  CHECK(Surfaces(PointCloud{}).scan(kSensor, {}).empty());
}

}  // namespace
}  // namespace surfaces_test
