#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <set>
#include <thread>

#include "scenes.hpp"
#include "support/plugins.hpp"
#include "support/process.hpp"

namespace vantage {
namespace {

using namespace test;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

PluginPtr<GroundFilter> pmf(const std::string& params = {}) {
  return test::plugin<GroundFilter>("pmf", params);
}

IndexList ground_of(const PointCloud& cloud, const std::string& params = {}) {
  return ground_by("pmf", cloud, params);
}

TEST_CASE("a plane is all ground") {
  CHECK(ground_of(sampled(20'000, {-50, -30}, {50, 30}, level)).size() == 20'000);
}

TEST_CASE("a tilted plane is all ground up to the slope, to its very border") {
  for (const double slope : {0.1, 0.2, 0.29}) {
    for (const double direction : {0.0, 0.4, 0.785, 2.0}) {
      for (const std::size_t n : {600U, 5'000U, 50'000U}) {
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

TEST_CASE("rolling terrain with the noise of a scanner is ground") {
  std::mt19937 random(6);
  std::normal_distribution<double> noise(0.0, 0.03);
  const auto hills = [&](double x, double y) {
    return 3.0 * std::sin(x / 15.0) + 2.0 * std::cos(y / 12.0) + noise(random);
  };
  const IndexList ground = ground_of(sampled(40'000, {-60, -60}, {60, 60}, hills));
  CHECK(share(ground, 0, 40'000) > 0.99);
}

TEST_CASE("a box top is no ground, and the ground around it is") {
  for (const double half_width : {1.0, 2.0, 5.0, 12.0}) {
    for (const double height : {2.0, 3.0, 15.0}) {
      CAPTURE(half_width);
      CAPTURE(height);
      const Scene scene = box_on_ground(half_width, height);
      const IndexList ground = ground_of(scene.cloud);
      CHECK(share(ground, 0, scene.ground) == 1.0);
      CHECK(share(ground, scene.ground, scene.cloud.size()) == 0.0);
    }
  }
}

TEST_CASE("a low box is no ground either if one small window spans it") {
  const Scene scene = box_on_ground(1.5, 0.8);
  const IndexList ground = ground_of(scene.cloud);
  CHECK(share(ground, 0, scene.ground) == 1.0);
  CHECK(share(ground, scene.ground, scene.top) == 0.0);
}

TEST_CASE("a box wider than the largest window is terrain: max_window decides") {
  const Scene scene = box_on_ground(12.0, 5.0);
  CHECK(share(ground_of(scene.cloud, "max_window = 33.0"), scene.ground, scene.top) == 0.0);
  CHECK(share(ground_of(scene.cloud, "max_window = 15.0"), scene.ground, scene.top) > 0.9);
}

TEST_CASE("a bridge over a road is no ground, the road below it and beside it is") {
  PointCloud cloud = sampled(40'000, {-50, -50}, {50, 50}, level);
  const std::size_t road = cloud.size();
  append(cloud, sampled(
                    8'000, {-50, -6}, {50, 6}, [](double, double) { return 5.5; }, 2));
  const IndexList ground = ground_of(cloud);
  CHECK(share(ground, 0, road) == 1.0);
  CHECK(share(ground, road, cloud.size()) == 0.0);
}

TEST_CASE("a bridge that hides the road below it is no ground") {
  PointCloud cloud;
  for (const Point& p : sampled(40'000, {-50, -50}, {50, 50}, level)) {
    if (std::abs(p.y()) > 6.0) cloud.push_back(p);
  }
  const std::size_t road = cloud.size();
  append(cloud, sampled(
                    8'000, {-50, -6}, {50, 6}, [](double, double) { return 5.5; }, 2));
  const IndexList ground = ground_of(cloud);
  CHECK(share(ground, 0, road) == 1.0);
  CHECK(share(ground, road, cloud.size()) == 0.0);
}

TEST_CASE("holes in the data neither make ground nor take it") {
  std::mt19937 random(12);
  std::uniform_real_distribution<double> place(-45.0, 45.0), size(2.0, 12.0);
  std::vector<Eigen::Vector3d> holes;
  for (int k = 0; k < 40; ++k) holes.emplace_back(place(random), place(random), size(random));
  const auto in_hole = [&](const Point& p) {
    return std::any_of(holes.begin(), holes.end(), [&](const Eigen::Vector3d& hole) {
      return (p.head<2>() - hole.head<2>()).norm() < hole.z();
    });
  };
  const auto slope = [](double x, double y) { return 0.2 * x - 0.1 * y; };
  PointCloud cloud;
  for (const Point& p : sampled(40'000, {-60, -60}, {60, 60}, slope)) {
    if (!in_hole(p)) cloud.push_back(p);
  }
  const std::size_t terrain = cloud.size();
  REQUIRE(terrain > 5'000);
  REQUIRE(terrain < 35'000);
  CHECK(ground_of(cloud).size() == terrain);

  // Sparse: two cells of three are empty.
  const PointCloud sparse = sampled(5'000, {-60, -60}, {60, 60}, slope);
  CHECK(ground_of(sparse).size() == sparse.size());
}

TEST_CASE("low outliers do not pull the ground down") {
  for (const double per_cell : {0.02, 0.2, 0.4}) {
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
    if (per_cell == 0.2) {  // without the rule this is what a minimum makes of it
      CHECK(share(ground_of(cloud, "outlier_ratio = 100.0"), 0, terrain) < 0.9);
    }
  }
}

TEST_CASE("one point, one cell, one column") {
  CHECK(ground_of({{5e6, -5e6, 12}}) == IndexList{0});
  CHECK(ground_of({{0.5, 0.5, 1.0}, {0.6, 0.5, 1.2}, {0.5, 0.6, 3.0}}) == IndexList{0, 1});
  CHECK(ground_of({{0.5, 0.5, 3.0}, {0.5, 0.5, 1.0}, {0.5, 0.5, 1.0}}) == IndexList{1, 2});
  CHECK(ground_of({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 0, 8}}) == IndexList{0, 1, 2});
}

TEST_CASE("empty and non-finite clouds are refused") {
  const auto filter = pmf();
  for (const PointCloud& bad :
       {PointCloud{}, PointCloud{{0, 0, 0}, {0, 0, std::nan("")}}, PointCloud{{kInfinity, 0, 0}},
        PointCloud{{0, -kInfinity, 0}, {1, 1, 1}}}) {
    const auto ground = filter->ground(bad);
    REQUIRE(!ground);
    CHECK(ground.error().code == ErrorCode::invalid_input);
  }
}

TEST_CASE("coordinates beyond all reason are refused or answered, never a crash") {
  const PointCloud far{{0, 0, 0}, {1e300, 0, 0}};
  CHECK(pmf()->ground(far).error().code == ErrorCode::invalid_input);
  CHECK(ground_of({{0, 0, 1e308}, {0, 0, -1e308}, {3, 3, 1e308}}).size() >= 1);
}

TEST_CASE("the order of the points does not matter") {
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

TEST_CASE("a shift by whole cells does not matter") {
  const PointCloud cloud = landscape(150.0);
  const IndexList expected = ground_of(cloud);
  CHECK(share(expected, 0, cloud.size()) > 0.5);
  CHECK(share(expected, 0, cloud.size()) < 0.9);
  for (const Point& shift : {Point(17, -230, 0), Point(1e6, 5e6, 256), Point(-5e6, 3, -64)}) {
    PointCloud shifted = cloud;
    for (Point& p : shifted) p += shift;
    CHECK(ground_of(shifted) == expected);
  }
}

TEST_CASE("a turn changes what little the square windows and cells see otherwise") {
  const PointCloud cloud = landscape(150.0);
  const IndexList expected = ground_of(cloud);
  for (const double angle : {M_PI / 2.0, 0.3, 0.785}) {
    const Eigen::AngleAxisd turn(angle, Point::UnitZ());
    PointCloud turned;
    for (const Point& p : cloud) turned.push_back(turn * p);
    const IndexList ground = ground_of(turned);
    IndexList differ;
    std::set_symmetric_difference(ground.begin(), ground.end(), expected.begin(), expected.end(),
                                  std::back_inserter(differ));
    CHECK(static_cast<double>(differ.size()) < 0.06 * static_cast<double>(cloud.size()));
  }
}

TEST_CASE("a map of many tiles is answered as if it were one") {
  PointCloud cloud = landscape(1300.0);
  for (Point& p : cloud) {  // as wide as the largest window can remove
    if (std::fmod(p.x(), 97.0) < 31.0 && p.y() > 5.0 && p.y() < 60.0) p.z() += 9.0;
  }
  const IndexList expected = ground_of(cloud);
  // A point far away moves the borders of the tiles, and has no other influence: they come to lie
  // anywhere, just inside a wide object's left edge, just before its right one.
  for (const double far :
       {-217.0, -400.0, -1000.0, 97.0 * 9 + 1 - 1024.0, 97.0 * 8 + 30 - 1024.0}) {
    CAPTURE(far);
    PointCloud more = cloud;
    more.emplace_back(far, far, 0.0);
    IndexList ground = ground_of(more);
    REQUIRE(ground.back() == cloud.size());
    ground.pop_back();
    CHECK(ground == expected);
  }
}

TEST_CASE("a huge extent with few points takes neither memory nor time") {
  const PointCloud cloud = landscape(100.0);
  const IndexList expected = ground_of(cloud);
  PointCloud more = cloud;
  for (int k = 1; k <= 20; ++k) more.emplace_back(1e8 * k, -3e9 * k, 5.0 * k);
  const IndexList ground = ground_of(more);
  CHECK(ground.size() == expected.size() + 20);
  CHECK(std::equal(expected.begin(), expected.end(), ground.begin()));
}

TEST_CASE("windows that need a raster beyond all memory are refused") {
  PointCloud cloud;
  for (int k = 0; k < 2000; ++k) cloud.emplace_back(20.0 * k, 20.0 * k, 0.0);
  const auto ground = pmf("max_window = 19000.0")->ground(cloud);
  REQUIRE(!ground);
  CHECK(ground.error().code == ErrorCode::invalid_input);
  CHECK(ground.error().message.find("max_window") != std::string::npos);
}

TEST_CASE("each parameter has an effect") {
  const PointCloud cloud = landscape(150.0);
  const IndexList by_default = ground_of(cloud);
  for (const std::string params :
       {"cell_size = 0.7", "max_window = 9.0", "schedule = 'exponential'", "base = 1.0",
        "slope = 0.05", "initial_distance = 0.1", "max_distance = 0.5", "outlier_ratio = 20.0"}) {
    CAPTURE(params);
    CHECK(ground_of(cloud, params) != by_default);
  }
  CHECK(
      ground_of(cloud,
                "cell_size = 1.0\nmax_window = 33.0\nschedule = 'linear'\nbase = 2.0\nslope = 0.3\n"
                "initial_distance = 0.4\nmax_distance = 2.5\noutlier_ratio = 3.0") == by_default);
}

TEST_CASE("both schedules end with the largest window that fits") {
  // 11 m wide and 5 m high: only windows of 13 cells and more remove it.
  const Scene scene = box_on_ground(5.5, 5.0);
  for (const std::string schedule : {"schedule = 'linear'\nbase = 3.0",
                                     "schedule = 'exponential'\nbase = 2.0", "base = 100.0"}) {
    CAPTURE(schedule);
    CHECK(share(ground_of(scene.cloud, schedule + "\nmax_window = 17.0"), scene.ground,
                scene.top) == 0.0);
    CHECK(share(ground_of(scene.cloud, schedule + "\nmax_window = 7.0"), scene.ground, scene.top) >
          0.8);
  }
}

TEST_CASE("bad parameters are refused") {
  for (const std::string params :
       {"cell_size = 0.0", "cell_size = -1.0", "max_window = 2.0", "max_window = 1e9",
        "slope = -0.1", "initial_distance = 3.0", "max_distance = 0.1", "schedule = 'cubic'",
        "base = 0.5", "schedule = 'exponential'\nbase = 1.0", "outlier_ratio = 0.5",
        "window = 3.0"}) {
    CAPTURE(params);
    CHECK_THROWS((void)pmf(params));
  }
}

TEST_CASE("the plugin's code outlives the last filter: a worker thread may still be leaving it") {
  (void)ground_of({{0, 0, 0}});
  const std::string mapped = test::read_text("/proc/self/maps");
  CHECK(mapped.find("vantage_ground_pmf.so") != std::string::npos);
}

TEST_CASE("threads that share a filter agree") {
  const PointCloud cloud = landscape(150.0);
  const auto filter = pmf();
  const IndexList expected = ground_of(cloud);
  std::vector<IndexList> got(4);
  std::vector<std::thread> threads;
  for (IndexList& out : got) {
    threads.emplace_back([&] { out = filter->ground(cloud).value_or(IndexList{}); });
  }
  for (std::thread& thread : threads) thread.join();
  for (const IndexList& out : got) CHECK(out == expected);
}

}  // namespace
}  // namespace vantage
