// What smrf promises beyond what every ground filter does.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "scenes.hpp"

namespace vantage {
namespace {

using namespace test;

constexpr double kNothing = std::numeric_limits<double>::infinity();

IndexList smrf(const PointCloud& cloud, const std::string& params = {}) {
  return ground_by("smrf", cloud, params);
}

/// The filter as its README says it, with the defaults but for the largest radius, in the plainest
/// way; without the rule for outliers.
class Reference {
 public:
  Reference(const PointCloud& cloud, int width, int height, int radius)
      : width_(width), height_(height), radius_(radius) {
    lowest_.assign(static_cast<std::size_t>(width * height), Point::Constant(kNothing));
    for (const Point& p : cloud) {
      Point& lowest = lowest_[cell_of(p)];
      if (std::tuple(p.z(), p.x(), p.y()) < std::tuple(lowest.z(), lowest.x(), lowest.y())) {
        lowest = p;
      }
    }
    open();
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) surface_.push_back(filled(x, y));
    }
    for (std::uint32_t k = 0; k < cloud.size(); ++k) {
      if (is_ground(cloud[k])) ground.push_back(k);
    }
  }

  IndexList ground;

 private:
  [[nodiscard]] std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y * width_ + x);
  }
  [[nodiscard]] std::size_t cell_of(const Point& p) const {
    return at(static_cast<int>(p.x()), static_cast<int>(p.y()));
  }
  [[nodiscard]] bool inside(int x, int y) const {
    return x >= 0 && x < width_ && y >= 0 && y < height_;
  }

  void open() {
    ground_.resize(lowest_.size());
    for (std::size_t c = 0; c < lowest_.size(); ++c) ground_[c] = lowest_[c].z();
    std::vector<double> surface = ground_;
    for (int r = 1; r <= radius_; ++r) {
      std::vector<double> opened(surface.size(), -kNothing);
      for (int cy = -r; cy < height_ + r; ++cy) {
        for (int cx = -r; cx < width_ + r; ++cx) {
          double least = kNothing;
          for_square(cx, cy, r, [&](std::size_t c) { least = std::min(least, surface[c]); });
          for_square(cx, cy, r, [&](std::size_t c) { opened[c] = std::max(opened[c], least); });
        }
      }
      for (std::size_t c = 0; c < surface.size(); ++c) {
        if (ground_[c] != kNothing && surface[c] - opened[c] > 0.2 * r) ground_[c] = kNothing;
      }
      surface = opened;
    }
  }
  template <class Visit>
  void for_square(int cx, int cy, int r, const Visit& visit) const {
    for (int y = cy - r; y <= cy + r; ++y) {
      for (int x = cx - r; x <= cx + r; ++x) {
        if (inside(x, y)) visit(at(x, y));
      }
    }
  }

  [[nodiscard]] double filled(int x, int y) const {
    if (ground_[at(x, y)] != kNothing) return ground_[at(x, y)];
    double heights = 0.0, weights = 0.0;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if (dx == 0 && dy == 0) continue;
        for (int k = 1; k <= 2 * radius_ + 1; ++k) {
          if (!inside(x + k * dx, y + k * dy)) break;
          const double z = ground_[at(x + k * dx, y + k * dy)];
          if (z == kNothing) continue;
          const double weight = 1.0 / (k * std::hypot(dx, dy));
          heights += weight * z;
          weights += weight;
          break;
        }
      }
    }
    return weights > 0.0 ? heights / weights : kNothing;
  }

  [[nodiscard]] double slope(int x, int y, int dx, int dy) const {
    const double here = surface_[at(x, y)];
    double low = here, high = here, run = 0.0;
    const auto known = [&](int i, int j) { return inside(i, j) && surface_[at(i, j)] != kNothing; };
    if (known(x - dx, y - dy)) {
      low = surface_[at(x - dx, y - dy)];
      run += 1.0;
    }
    if (known(x + dx, y + dy)) {
      high = surface_[at(x + dx, y + dy)];
      run += 1.0;
    }
    return run > 0.0 ? (high - low) / run : 0.0;
  }

  [[nodiscard]] bool is_ground(const Point& p) const {
    const std::size_t c = cell_of(p);
    if (surface_[c] == kNothing) return false;
    const int x = static_cast<int>(p.x()), y = static_cast<int>(p.y());
    const Eigen::Vector2d gradient(slope(x, y, 1, 0), slope(x, y, 0, 1));
    const Eigen::Vector2d through = ground_[c] == kNothing ? Eigen::Vector2d(x + 0.5, y + 0.5)
                                                           : Eigen::Vector2d(lowest_[c].head<2>());
    const double above = p.z() - surface_[c] - gradient.dot(p.head<2>() - through);
    return std::abs(above) <= 0.4 + 1.25 * gradient.norm();
  }

  int width_, height_, radius_;
  std::vector<Point> lowest_;
  std::vector<double> ground_, surface_;
};

TEST_CASE("smrf equals its definition on small scenes") {
  for (const unsigned seed : {1U, 2U, 3U, 4U}) {
    for (const int points : {60, 400, 3000}) {
      CAPTURE(seed);
      CAPTURE(points);
      std::mt19937 random(seed);
      std::uniform_real_distribution<double> x(0.0, 24.0), y(0.0, 17.0), any(0.0, 1.0);
      PointCloud cloud{{0.1, 0.1, 0.0}, {23.9, 16.9, 0.0}};
      for (int k = 0; k < points; ++k) {
        Point p(x(random), y(random), 0.0);
        p.z() = 0.1 * p.x() + std::sin(p.y() / 3.0);
        if (std::abs(p.x() - 8.0) < 3.0 && std::abs(p.y() - 9.0) < 2.0) p.z() += 4.0;
        if (any(random) < 0.2) p.z() += 3.0 * any(random);
        cloud.push_back(p);
      }
      const IndexList expected = Reference(cloud, 24, 17, 5).ground;
      CHECK(expected.size() > cloud.size() / 4);
      CHECK(expected.size() < cloud.size());
      // A support is at most 25 cells: no cell has 26 times that of another.
      CHECK(smrf(cloud, "max_radius = 5.0\noutlier_ratio = 26.0") == expected);
    }
  }
}

TEST_CASE("smrf: a kerb is ground on both of its sides") {
  const auto kerb = [](double x, double) { return x < 0.3 ? 0.0 : 0.15; };
  CHECK(smrf(sampled(40'000, {-30, -30}, {30, 30}, kerb)).size() == 40'000);
}

/// A road in a cut, slopes beside it, and a deck that leads over it from bank to bank.
struct Overpass {
  PointCloud cloud;
  std::size_t terrain = 0;  // then the deck
  explicit Overpass(bool road_is_seen_below) {
    const auto cut = [](double x, double) {
      return std::clamp(std::abs(x) - 10.0, 0.0, 36.0) / 6.0;
    };
    for (const Point& p : sampled(120'000, {-70, -50}, {70, 50}, cut)) {
      const bool below = std::abs(p.y()) < 5.0 && std::abs(p.x()) < 46.0;
      if (!below || (road_is_seen_below && std::abs(p.x()) < 10.0)) cloud.push_back(p);
    }
    terrain = cloud.size();
    append(cloud, sampled(
                      8'000, {-40, -5}, {40, 5}, [](double, double) { return 6.0; }, 2));
  }
};

TEST_CASE("an overpass is no ground above its road, and the road is; pmf says the same") {
  for (const std::string plugin : {"smrf", "pmf"}) {
    for (const bool seen : {false, true}) {
      CAPTURE(plugin);
      CAPTURE(seen);
      const Overpass scene(seen);
      const IndexList ground = ground_by(plugin, scene.cloud);
      CHECK(share(ground, 0, scene.terrain) > 0.995);
      std::size_t over_road = 0, kept = 0;
      for (std::size_t k = scene.terrain; k < scene.cloud.size(); ++k) {
        if (std::abs(scene.cloud[k].x()) > 10.0) continue;
        ++over_road;
        kept += std::binary_search(ground.begin(), ground.end(), static_cast<std::uint32_t>(k));
      }
      REQUIRE(over_road > 1000);
      CHECK(kept == 0);
    }
  }
}

TEST_CASE("smrf: ground is found below crowns that hide some of it, on a slope") {
  const auto slope = [](double x, double y) { return 0.15 * x + 0.05 * y; };
  PointCloud cloud;
  for (const Point& p : sampled(60'000, {-40, -40}, {40, 40}, slope)) {
    const bool in_wood = p.head<2>().norm() < 15.0;
    if (!in_wood || cloud.size() % 10 == 0) cloud.push_back(p);
  }
  const std::size_t terrain = cloud.size();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> up(3.0, 9.0);
  append(cloud, sampled(
                    2'000, {-10, -10}, {10, 10},
                    [&](double x, double y) { return slope(x, y) + up(random); }, 2));
  const IndexList ground = smrf(cloud);
  CHECK(share(ground, 0, terrain) > 0.99);
  CHECK(share(ground, terrain, cloud.size()) == 0.0);
}

}  // namespace
}  // namespace vantage
