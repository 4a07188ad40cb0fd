#include <doctest/doctest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <vector>

#include "scenes.hpp"
#include "support/plugins.hpp"
#include "vantage/ground_filter.hpp"

namespace vantage {
namespace {

using namespace test;

constexpr double kNothing = std::numeric_limits<double>::infinity();

IndexList ground_of(const PointCloud& cloud, const std::string& params = {}) {
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
      CHECK(ground_of(cloud, "max_radius = 5.0\noutlier_ratio = 26.0") == expected);
    }
  }
}

TEST_CASE("smrf: a plane is all ground, a tilted one too, to its very border") {
  for (const double slope : {0.0, 0.1, 0.19}) {
    for (const double direction : {0.0, 0.4, 0.785, 2.0}) {
      for (const std::size_t n : {5'000U, 50'000U}) {
        CAPTURE(slope);
        CAPTURE(direction);
        CAPTURE(n);
        const auto z = [&](double x, double y) {
          return slope * (x * std::cos(direction) + y * std::sin(direction));
        };
        CHECK(ground_of(sampled(n, {-40, -40}, {40, 40}, z)).size() == n);
      }
    }
  }
}

TEST_CASE("smrf: rolling terrain with the noise of a scanner is ground") {
  std::mt19937 random(6);
  std::normal_distribution<double> noise(0.0, 0.03);
  const auto hills = [&](double x, double y) {
    return 3.0 * std::sin(x / 15.0) + 2.0 * std::cos(y / 12.0) + noise(random);
  };
  const IndexList ground = ground_of(sampled(40'000, {-60, -60}, {60, 60}, hills));
  CHECK(share(ground, 0, 40'000) > 0.99);
}

TEST_CASE("smrf: a box top is no ground, and the ground around it is") {
  for (const double half_width : {1.0, 2.0, 5.0, 12.0, 16.0}) {
    for (const double height : {2.0, 4.5, 15.0}) {
      if (height < 0.25 * half_width) continue;  // may be terrain: it rises by slope times radius
      CAPTURE(half_width);
      CAPTURE(height);
      const Scene scene = box_on_ground(half_width, height);
      const IndexList ground = ground_of(scene.cloud);
      CHECK(share(ground, 0, scene.ground) == 1.0);
      CHECK(share(ground, scene.ground, scene.cloud.size()) == 0.0);
    }
  }
}

TEST_CASE("smrf: a box wider than the largest window is terrain: max_radius decides") {
  const Scene scene = box_on_ground(12.0, 5.0);
  CHECK(share(ground_of(scene.cloud, "max_radius = 18.0"), scene.ground, scene.top) == 0.0);
  CHECK(share(ground_of(scene.cloud, "max_radius = 8.0"), scene.ground, scene.top) > 0.9);
}

TEST_CASE("smrf: a kerb is ground on both of its sides") {
  const auto kerb = [](double x, double) { return x < 0.3 ? 0.0 : 0.15; };
  CHECK(ground_of(sampled(40'000, {-30, -30}, {30, 30}, kerb)).size() == 40'000);
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

TEST_CASE("smrf: holes in the data neither make ground nor take it") {
  std::mt19937 random(12);
  std::uniform_real_distribution<double> place(-45.0, 45.0), size(2.0, 12.0);
  std::vector<Eigen::Vector3d> holes;
  for (int k = 0; k < 40; ++k) holes.emplace_back(place(random), place(random), size(random));
  const auto slope = [](double x, double y) { return 0.12 * x - 0.1 * y; };
  PointCloud cloud;
  for (const Point& p : sampled(40'000, {-60, -60}, {60, 60}, slope)) {
    if (std::none_of(holes.begin(), holes.end(), [&](const Eigen::Vector3d& hole) {
          return (p.head<2>() - hole.head<2>()).norm() < hole.z();
        })) {
      cloud.push_back(p);
    }
  }
  const std::size_t terrain = cloud.size();
  REQUIRE(terrain > 5'000);
  REQUIRE(terrain < 35'000);
  CHECK(ground_of(cloud).size() == terrain);
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
  const IndexList ground = ground_of(cloud);
  CHECK(share(ground, 0, terrain) > 0.99);
  CHECK(share(ground, terrain, cloud.size()) == 0.0);
}

TEST_CASE("smrf: low outliers do not pull the ground down") {
  for (const double per_cell : {0.02, 0.2}) {
    CAPTURE(per_cell);
    PointCloud cloud =
        sampled(100'000, {-50, -50}, {50, 50}, [](double x, double) { return 0.1 * x; });
    const std::size_t terrain = cloud.size();
    std::mt19937 random(4);
    std::uniform_real_distribution<double> depth(0.8, 4.0);
    append(cloud, sampled(
                      static_cast<std::size_t>(1e4 * per_cell), {-50, -50}, {50, 50},
                      [&](double x, double) { return 0.1 * x - depth(random); }, 5));
    const IndexList ground = ground_of(cloud);
    CHECK(share(ground, 0, terrain) > 0.99);
    CHECK(share(ground, terrain, cloud.size()) < 0.01);
    CHECK(share(ground_of(cloud, "outlier_ratio = 100.0"), 0, terrain) < share(ground, 0, terrain));
  }
}

TEST_CASE("smrf: one point, one cell, one column") {
  CHECK(ground_of({{5e6, -5e6, 12}}) == IndexList{0});
  CHECK(ground_of({{0.5, 0.5, 1.0}, {0.6, 0.5, 1.2}, {0.5, 0.6, 3.0}}) == IndexList{0, 1});
  CHECK(ground_of({{0.5, 0.5, 3.0}, {0.5, 0.5, 1.0}, {0.5, 0.5, 1.0}}) == IndexList{1, 2});
  CHECK(ground_of({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 0, 8}}) == IndexList{0, 1, 2});
  CHECK(ground_of({{0, 0, 1e308}, {0, 0, -1e308}, {3, 3, 1e308}}).size() >= 1);
}

TEST_CASE("smrf: bad clouds are refused") {
  const auto filter = test::plugin<GroundFilter>("smrf");
  for (const PointCloud& bad :
       {PointCloud{}, PointCloud{{0, 0, 0}, {0, 0, std::nan("")}}, PointCloud{{kNothing, 0, 0}},
        PointCloud{{0, 0, 0}, {1e300, 0, 0}}}) {
    const auto ground = filter->ground(bad);
    REQUIRE(!ground);
    CHECK(ground.error().code == ErrorCode::invalid_input);
  }
}

TEST_CASE("smrf: the order of the points does not matter") {
  PointCloud cloud = landscape(150.0);
  // Many cells have several lowest points, and some points are there twice.
  for (Point& p : cloud) p.z() = std::round(p.z() * 4.0) / 4.0;
  append(cloud, PointCloud(cloud.begin(), cloud.begin() + 500));
  const auto places = [](const PointCloud& points) {
    std::multiset<std::tuple<double, double, double>> set;
    for (const std::uint32_t k : ground_of(points, "cell_size = 4.0")) {
      set.emplace(points[k].x(), points[k].y(), points[k].z());
    }
    return set;
  };
  const auto before = places(cloud);
  std::shuffle(cloud.begin(), cloud.end(), std::mt19937(9));
  CHECK(places(cloud) == before);
}

TEST_CASE("smrf: a shift by whole cells does not matter") {
  const PointCloud cloud = landscape(150.0);
  const IndexList expected = ground_of(cloud);
  CHECK(share(expected, 0, cloud.size()) > 0.5);
  CHECK(share(expected, 0, cloud.size()) < 0.9);
  for (const Point& shift : {Point(17, -230, 0), Point(1e6, 5e6, 256), Point(-5e6, 3, -64)}) {
    PointCloud shifted = cloud;
    for (Point& p : shifted) p += shift;
    const IndexList ground = ground_of(shifted);
    IndexList differ;  // sums of heights far from 0 round otherwise
    std::set_symmetric_difference(ground.begin(), ground.end(), expected.begin(), expected.end(),
                                  std::back_inserter(differ));
    CHECK(differ.size() <= 2);
  }
}

TEST_CASE("smrf: a map of many tiles is answered as if it were one, by any number of threads") {
  PointCloud cloud = landscape(1300.0);
  for (Point& p : cloud) {  // as wide as the largest window can remove
    if (std::fmod(p.x(), 97.0) < 35.0 && p.y() > 5.0 && p.y() < 60.0) p.z() += 9.0;
  }
  const IndexList expected = ground_of(cloud);
  // A point far away moves the borders of the tiles, and has no other influence.
  for (const double far :
       {-217.0, -400.0, -1000.0, 97.0 * 9 + 1 - 1024.0, 97.0 * 8 + 34 - 1024.0}) {
    CAPTURE(far);
    PointCloud more = cloud;
    more.emplace_back(far, far, 0.0);
    IndexList ground = ground_of(more);
    REQUIRE(ground.back() == cloud.size());
    ground.pop_back();
    CHECK(ground == expected);
  }
  for (const std::size_t threads : {1U, 2U, 5U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    CHECK(ground_of(cloud) == expected);
  }
}

TEST_CASE("smrf: a huge extent with few points takes neither memory nor time") {
  const PointCloud cloud = landscape(100.0);
  const IndexList expected = ground_of(cloud);
  PointCloud more = cloud;
  for (int k = 1; k <= 20; ++k) more.emplace_back(1e8 * k, -3e9 * k, 5.0 * k);
  const IndexList ground = ground_of(more);
  CHECK(ground.size() == expected.size() + 20);
  CHECK(std::equal(expected.begin(), expected.end(), ground.begin()));
}

TEST_CASE("smrf: windows that need a raster beyond all memory are refused") {
  PointCloud cloud;
  for (int k = 0; k < 2000; ++k) cloud.emplace_back(20.0 * k, 20.0 * k, 0.0);
  const auto ground = test::plugin<GroundFilter>("smrf", "max_radius = 9500.0")->ground(cloud);
  REQUIRE(!ground);
  CHECK(ground.error().code == ErrorCode::invalid_input);
  CHECK(ground.error().message.find("max_radius") != std::string::npos);
}

TEST_CASE("smrf: each parameter has an effect, and bad ones are refused") {
  const PointCloud cloud = landscape(150.0);
  const IndexList by_default = ground_of(cloud);
  for (const std::string params :
       {"cell_size = 0.7", "max_radius = 4.0", "slope = 0.05", "elevation_threshold = 0.1",
        "elevation_scale = 0.0", "outlier_ratio = 20.0"}) {
    CAPTURE(params);
    CHECK(ground_of(cloud, params) != by_default);
  }
  CHECK(ground_of(cloud,
                  "cell_size = 1.0\nmax_radius = 18.0\nslope = 0.2\nelevation_threshold = 0.4\n"
                  "elevation_scale = 1.25\noutlier_ratio = 3.0") == by_default);
  for (const std::string params :
       {"cell_size = 0.0", "max_radius = 0.5", "max_radius = 1e9", "slope = -0.1",
        "elevation_threshold = -1.0", "elevation_scale = -1.0", "outlier_ratio = 0.5",
        "window = 3.0"}) {
    CAPTURE(params);
    CHECK_THROWS((void)test::plugin<GroundFilter>("smrf", params));
  }
}

}  // namespace
}  // namespace vantage
