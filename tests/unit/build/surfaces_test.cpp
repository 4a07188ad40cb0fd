#include "build/surfaces.hpp"

#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <utility>

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
  const PointCloud scan = Surfaces(map).hits(kSensor, {});
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
    const PointCloud scan = Surfaces(map).hits({0.2, 0.1, z + 1.5}, {});
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
  for (const Point& p : both.hits(kSensor, {})) CHECK(p.x() == doctest::Approx(8.0).epsilon(1e-6));
  CHECK(both.hits(kSensor, {.max_range = 5.0}).empty());
  const PointCloud up = both.hits(kSensor, {.lowest = 5.0, .highest = 10.0});
  REQUIRE(!up.empty());
  for (const Point& p : up) CHECK(p.z() > kSensor.z());
}

/// Points on a lattice, of a wall across the x axis.
void add_piece(PointCloud& map, double x, double from, double to, double height) {
  for (double y = from; y < to; y += 0.1) {
    for (double z = 0.0; z < height; z += 0.1) map.emplace_back(x, y, z);
  }
}

/// The range along each ray that hits something, by azimuth and elevation.
std::map<std::pair<long, long>, double> ranges(const PointCloud& map) {
  const Rays rays{.lowest = -20.0, .highest = 18.0, .max_range = 60.0};
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  std::map<std::pair<long, long>, double> ranges;
  for (const Point& p : Surfaces(map).hits(kSensor, rays)) {
    const Point to = p - kSensor;
    const long azimuth = std::lround(std::atan2(to.y(), to.x()) * kDegrees);
    const double elevation = std::asin(to.z() / to.norm()) * kDegrees;
    ranges[{azimuth, std::lround((elevation - rays.lowest) / 2.0)}] = to.norm();
  }
  return ranges;
}

TEST_CASE("virtual scans: what is skipped behind surfaces would have hidden nothing") {
  std::mt19937 random(11);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int world = 0; world < 5; ++world) {
    PointCloud near, far, both;
    for (int k = 0; k < 12; ++k) {
      PointCloud& map = k % 2 == 0 ? near : far;
      const double x = k % 2 == 0 ? between(3.0, 12.0) : between(12.0, 50.0);
      const double y = between(-15.0, 15.0);
      add_piece(map, x, y, y + between(0.5, 8.0), between(0.3, 6.0));
    }
    both = near;
    both.insert(both.end(), far.begin(), far.end());
    const auto of_both = ranges(both);
    std::size_t behind = 0;
    for (const PointCloud* const part : {&near, &far}) {
      for (const auto& [ray, range] : ranges(*part)) {
        const auto hit = of_both.find(ray);
        REQUIRE(hit != of_both.end());
        CHECK(hit->second < range + 0.4);
        if (hit->second < range - 0.4) ++behind;
      }
    }
    CHECK(behind > 20);
  }
}

TEST_CASE("virtual scans: a scan has the mean of each disc's hits") {
  PointCloud map;
  add_wall(map, 8.0, 0.0, 1);
  const Surfaces wall(map);
  const PointCloud hits = wall.hits(kSensor, {}), scan = wall.scan(kSensor, {});
  REQUIRE(scan.size() > 200);
  CHECK(scan.size() < hits.size());
  for (const Point& p : scan) {
    CHECK(p.x() == doctest::Approx(8.0).epsilon(1e-6));
    // A disc is one of a voxel of 0.4 m.
    CHECK(std::ranges::count_if(scan, [&](const Point& q) { return (p - q).norm() < 0.1; }) == 1);
  }
  for (const Point& p : hits) {
    CHECK(std::ranges::any_of(scan, [&](const Point& q) { return (p - q).norm() < 0.6; }));
  }
}

TEST_CASE("virtual scans: the order of the points and what is out of range do not matter") {
  PointCloud map;
  add_wall(map, 8.0, 0.02, 1);
  add_wall(map, -12.0, 0.05, 2);
  // A lattice, whose discs are equally near to many rays, across the end of the range.
  const auto add_ground = [&](double from, double to) {
    for (double x = from; x < to; x += 0.1) {
      for (double y = -3.0; y < 3.0; y += 0.1) map.emplace_back(x, y, 0.0);
    }
  };
  add_ground(9.0, 21.5);
  const PointCloud scan = Surfaces(map).scan(kSensor, {.max_range = 20.0});
  std::mt19937 random(3);
  add_ground(21.5, 40.0);
  add_wall(map, 60.0, 0.02, 4);
  std::ranges::shuffle(map, random);
  const PointCloud other = Surfaces(map).scan(kSensor, {.max_range = 20.0});
  REQUIRE(scan.size() == other.size());
  for (std::size_t i = 0; i < scan.size(); ++i) CHECK(scan[i] == other[i]);
  CHECK(Surfaces(PointCloud{}).scan(kSensor, {}).empty());
}

/// The most memory that this process has held since the last call of forget_peak [MiB].
double peak() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    double kilobytes = 0.0;
    if (word == "VmHWM:" && status >> kilobytes) return kilobytes / 1024.0;
  }
  return 0.0;
}
void forget_peak() { std::ofstream("/proc/self/clear_refs") << '5'; }

TEST_CASE("virtual scans: a stray point far away takes no memory and changes nothing") {
  PointCloud map;
  add_wall(map, 8.0, 0.02, 1);
  add_wall(map, 30.0, 0.02, 2);
  const PointCloud scan = Surfaces(map).scan(kSensor, {});
  REQUIRE(scan.size() > 200);
  for (const Point& stray : {Point(65'000.0, 65'000.0, 0.0), Point(-380'000.0, 300'000.0, 1.0)}) {
    PointCloud with = map;
    with.push_back(stray);
    forget_peak();
    const double before = peak();
    const PointCloud same = Surfaces(with).scan(kSensor, {});
    CHECK(peak() - before < 50.0);
    REQUIRE(same.size() == scan.size());
    for (std::size_t i = 0; i < scan.size(); ++i) CHECK(same[i] == scan[i]);
  }
}

/// One voxel with points on a plane through its middle: a disc of 0.3 m.
struct Patch {
  Point middle, normal;

  [[nodiscard]] PointCloud points() const {
    const Point u = normal.unitOrthogonal(), v = normal.cross(u);
    PointCloud points;
    for (int x = -3; x <= 3; ++x) {
      for (int y = -3; y <= 3; ++y) points.emplace_back(middle + 0.03 * x * u + 0.03 * y * v);
    }
    return points;
  }
  /// How far from the middle a ray meets the plane, if it does [m].
  [[nodiscard]] double off(const Point& sensor, const Point& direction) const {
    const double towards = normal.dot(direction), at = normal.dot(middle - sensor) / towards;
    if (!(std::abs(towards) > 0.02 && at > 1.0 && at < 80.0)) return 1e9;
    return (sensor + at * direction - middle).norm();
  }
};

/// How many of a scan's rays meet the disc less than so far from its middle.
std::size_t rays_through(const Patch& patch, const Point& sensor, const Rays& rays, double radius) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  std::size_t count = 0;
  for (int ring = 0; ring < 20; ++ring) {
    const double up = (rays.lowest + ring * (rays.highest - rays.lowest) / 19.0) * kDegree;
    for (int column = 0; column < 360; ++column) {
      const double left = column * kDegree;
      const Point direction(std::cos(up) * std::cos(left), std::cos(up) * std::sin(left),
                            std::sin(up));
      if (patch.off(sensor, direction) < radius) ++count;
    }
  }
  return count;
}

TEST_CASE("virtual scans: all rays that meet a disc hit it, wherever it is and however it lies") {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto somewhere = [&] { return Point(normal(random), normal(random), normal(random)); };
  std::size_t met = 0;
  for (int k = 0; k < 1000; ++k) {
    const Point away = somewhere() * std::exp(normal(random)) * 2.0;
    const Point middle = 0.4 * (away / 0.4).array().floor() + 0.2;
    const Patch patch{.middle = middle, .normal = somewhere().normalized()};
    const Point sensor = 0.2 * somewhere();
    const Point to = (middle - sensor).normalized();
    const double elevation = std::asin(to.z()) * 180.0 / std::numbers::pi;
    const double half = 25.0 / (middle - sensor).norm();
    const Rays rays{.lowest = std::max(elevation - half, -89.9),
                    .highest = std::min(elevation + half, 89.9)};
    const std::size_t hits = Surfaces(patch.points()).hits(sensor, rays).size();
    CAPTURE(k);
    CHECK(hits >= rays_through(patch, sensor, rays, 0.2999));
    CHECK(hits <= rays_through(patch, sensor, rays, 0.3001));
    met += hits;
  }
  CHECK(met > 50000);
}

}  // namespace
}  // namespace surfaces_test
