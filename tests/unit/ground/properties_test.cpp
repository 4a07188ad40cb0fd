// What every ground filter promises, through the loaded plugins.
#include <doctest/doctest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "scenes.hpp"
#include "support/plugins.hpp"
#include "vantage/ground_filter.hpp"

namespace vantage {
namespace {

using namespace test;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A ground filter and what it is held to.
struct Filter {
  std::string plugin;
  std::vector<double> slopes;                        ///< of a plane that is ground
  std::vector<std::size_t> sizes;                    ///< of that plane [points]
  std::vector<double> box_half_widths, box_heights;  ///< of boxes that are none [m]
  double may_rise = 0.0;  ///< a box that is lower than this times its half width may be terrain
  std::string window, wide_window, narrow_window;  ///< its largest window; for a box 24 m wide
  std::string huge_window;
  double hole_slope = 0.0;            ///< along x, of ground with holes
  std::vector<double> outliers;       ///< of a cell that it bears
  double share_without_rule = 1.0;    ///< more of the ground is lost to 0.2 outliers in a cell
  std::size_t shift_differences = 0;  ///< sums of heights far from 0 may round otherwise
  double widest = 0.0;                ///< object that its largest window removes [m]
  std::vector<std::string> effects;   ///< parameters, each of which changes something
  std::string defaults;
  std::vector<std::string> refused;
};

const std::vector<Filter>& filters() {
  static const std::vector<Filter> all{
      {.plugin = "pmf",
       .slopes = {0.1, 0.2, 0.29},
       .sizes = {600, 5'000, 50'000},
       .box_half_widths = {1.0, 2.0, 5.0, 12.0},
       .box_heights = {2.0, 3.0, 15.0},
       .window = "max_window",
       .wide_window = "max_window = 33.0",
       .narrow_window = "max_window = 15.0",
       .huge_window = "max_window = 19000.0",
       .hole_slope = 0.2,
       .outliers = {0.02, 0.2, 0.4},
       .share_without_rule = 0.9,
       .widest = 31.0,
       .effects = {"cell_size = 0.7", "max_window = 9.0", "schedule = 'exponential'", "base = 1.0",
                   "slope = 0.05", "initial_distance = 0.1", "max_distance = 0.5",
                   "outlier_ratio = 20.0"},
       .defaults =
           "cell_size = 1.0\nmax_window = 33.0\nschedule = 'linear'\nbase = 2.0\nslope = 0.3\n"
           "initial_distance = 0.4\nmax_distance = 2.5\noutlier_ratio = 3.0",
       .refused = {"cell_size = 0.0", "cell_size = -1.0", "max_window = 2.0", "max_window = 1e9",
                   "max_window = 1e30\nschedule = 'exponential'",
                   "max_window = 20002.0\nschedule = 'exponential'",
                   "max_window = 1e30\nbase = 1e28", "slope = -0.1", "initial_distance = 3.0",
                   "max_distance = 0.1", "schedule = 'cubic'", "base = 0.5",
                   "schedule = 'exponential'\nbase = 1.0", "outlier_ratio = 0.5", "window = 3.0"}},
      {.plugin = "smrf",
       .slopes = {0.0, 0.1, 0.19},
       .sizes = {5'000, 50'000},
       .box_half_widths = {1.0, 2.0, 5.0, 12.0, 16.0},
       .box_heights = {2.0, 4.5, 15.0},
       .may_rise = 0.25,  // slope times radius
       .window = "max_radius",
       .wide_window = "max_radius = 18.0",
       .narrow_window = "max_radius = 8.0",
       .huge_window = "max_radius = 9500.0",
       .hole_slope = 0.12,
       .outliers = {0.02, 0.2},
       .shift_differences = 2,
       .widest = 35.0,
       .effects = {"cell_size = 0.7", "max_radius = 4.0", "slope = 0.05",
                   "elevation_threshold = 0.1", "elevation_scale = 0.0", "outlier_ratio = 20.0"},
       .defaults = "cell_size = 1.0\nmax_radius = 18.0\nslope = 0.2\nelevation_threshold = 0.4\n"
                   "elevation_scale = 1.25\noutlier_ratio = 3.0",
       .refused = {"cell_size = 0.0", "max_radius = 0.5", "max_radius = 1e9", "slope = -0.1",
                   "elevation_threshold = -1.0", "elevation_scale = -1.0", "outlier_ratio = 0.5",
                   "window = 3.0"}}};
  return all;
}

/// `check(filter, ground_of)` for each; `ground_of(cloud, params)` is what the filter finds.
template <class Check>
void for_each_filter(Check check) {
  for (const Filter& filter : filters()) {
    CAPTURE(filter.plugin);
    check(filter, [&](const PointCloud& cloud, const std::string& params = {}) {
      return ground_by(filter.plugin, cloud, params);
    });
  }
}

IndexList difference(const IndexList& a, const IndexList& b) {
  IndexList differ;
  std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(differ));
  return differ;
}

TEST_CASE("a plane is all ground") {
  for_each_filter([](const Filter&, const auto& ground_of) {
    CHECK(ground_of(sampled(20'000, {-50, -30}, {50, 30}, level)).size() == 20'000);
  });
}

TEST_CASE("a tilted plane is all ground up to the slope, to its very border") {
  for_each_filter([](const Filter& filter, const auto& ground_of) {
    for (const double slope : filter.slopes) {
      for (const double direction : {0.0, 0.4, 0.785, 2.0}) {
        for (const std::size_t n : filter.sizes) {
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
  });
}

TEST_CASE("rolling terrain with the noise of a scanner is ground") {
  std::mt19937 random(6);
  std::normal_distribution<double> noise(0.0, 0.03);
  const auto hills = [&](double x, double y) {
    return 3.0 * std::sin(x / 15.0) + 2.0 * std::cos(y / 12.0) + noise(random);
  };
  const PointCloud terrain = sampled(40'000, {-60, -60}, {60, 60}, hills);
  for_each_filter([&](const Filter&, const auto& ground_of) {
    CHECK(share(ground_of(terrain), 0, terrain.size()) > 0.99);
  });
}

TEST_CASE("a box top is no ground, and the ground around it is") {
  for_each_filter([](const Filter& filter, const auto& ground_of) {
    for (const double half_width : filter.box_half_widths) {
      for (const double height : filter.box_heights) {
        if (height < filter.may_rise * half_width) continue;
        CAPTURE(half_width);
        CAPTURE(height);
        const Scene scene = box_on_ground(half_width, height);
        const IndexList ground = ground_of(scene.cloud);
        CHECK(share(ground, 0, scene.ground) == 1.0);
        CHECK(share(ground, scene.ground, scene.cloud.size()) == 0.0);
      }
    }
  });
}

TEST_CASE("a box wider than the largest window is terrain: a parameter decides") {
  const Scene scene = box_on_ground(12.0, 5.0);
  for_each_filter([&](const Filter& filter, const auto& ground_of) {
    const auto top = [&](const std::string& params) {
      return share(ground_of(scene.cloud, params), scene.ground, scene.top);
    };
    CHECK(top(filter.wide_window) == 0.0);
    CHECK(top(filter.narrow_window) > 0.9);
  });
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
  for_each_filter([&](const Filter& filter, const auto& ground_of) {
    const auto slope = [&](double x, double y) { return filter.hole_slope * x - 0.1 * y; };
    PointCloud cloud;
    for (const Point& p : sampled(40'000, {-60, -60}, {60, 60}, slope)) {
      if (!in_hole(p)) cloud.push_back(p);
    }
    REQUIRE(cloud.size() > 5'000);
    REQUIRE(cloud.size() < 35'000);
    CHECK(ground_of(cloud).size() == cloud.size());
  });
}

TEST_CASE("low outliers do not pull the ground down") {
  for_each_filter([](const Filter& filter, const auto& ground_of) {
    for (const double per_cell : filter.outliers) {
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
      // Without the rule this is what a minimum makes of it.
      const double without_rule = share(ground_of(cloud, "outlier_ratio = 100.0"), 0, terrain);
      CHECK(without_rule < share(ground, 0, terrain));
      if (per_cell == 0.2) CHECK(without_rule < filter.share_without_rule);
    }
  });
}

TEST_CASE("one point, one cell, one column") {
  for_each_filter([](const Filter&, const auto& ground_of) {
    CHECK(ground_of({{5e6, -5e6, 12}}) == IndexList{0});
    CHECK(ground_of({{0.5, 0.5, 1.0}, {0.6, 0.5, 1.2}, {0.5, 0.6, 3.0}}) == IndexList{0, 1});
    CHECK(ground_of({{0.5, 0.5, 3.0}, {0.5, 0.5, 1.0}, {0.5, 0.5, 1.0}}) == IndexList{1, 2});
    CHECK(ground_of({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 0, 8}}) == IndexList{0, 1, 2});
    CHECK(ground_of({{0, 0, 1e308}, {0, 0, -1e308}, {3, 3, 1e308}}).size() >= 1);
  });
}

TEST_CASE("clouds that are empty, not finite or beyond all reason are refused") {
  for_each_filter([](const Filter& filter, const auto&) {
    const auto plugin = test::plugin<GroundFilter>(filter.plugin);
    for (const PointCloud& bad :
         {PointCloud{}, PointCloud{{0, 0, 0}, {0, 0, std::nan("")}}, PointCloud{{kInfinity, 0, 0}},
          PointCloud{{0, -kInfinity, 0}, {1, 1, 1}}, PointCloud{{0, 0, 0}, {1e300, 0, 0}}}) {
      const auto ground = plugin->ground(bad);
      REQUIRE(!ground);
      CHECK(ground.error().code == ErrorCode::invalid_input);
    }
  });
}

TEST_CASE("the order of the points does not matter") {
  PointCloud cloud = landscape(150.0);
  // Many cells have several lowest points, and some points are there twice.
  for (Point& p : cloud) p.z() = std::round(p.z() * 4.0) / 4.0;
  append(cloud, PointCloud(cloud.begin(), cloud.begin() + 500));
  PointCloud shuffled = cloud;
  std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(9));
  for_each_filter([&](const Filter&, const auto& ground_of) {
    const auto places = [&](const PointCloud& points) {
      std::multiset<std::tuple<double, double, double>> set;
      for (const std::uint32_t k : ground_of(points, "cell_size = 4.0")) {
        set.emplace(points[k].x(), points[k].y(), points[k].z());
      }
      return set;
    };
    CHECK(places(shuffled) == places(cloud));
  });
}

TEST_CASE("a shift by whole cells does not matter") {
  const PointCloud cloud = landscape(150.0);
  for_each_filter([&](const Filter& filter, const auto& ground_of) {
    const IndexList expected = ground_of(cloud);
    CHECK(share(expected, 0, cloud.size()) > 0.5);
    CHECK(share(expected, 0, cloud.size()) < 0.9);
    for (const Point& shift : {Point(17, -230, 0), Point(1e6, 5e6, 256), Point(-5e6, 3, -64)}) {
      PointCloud shifted = cloud;
      for (Point& p : shifted) p += shift;
      CHECK(difference(ground_of(shifted), expected).size() <= filter.shift_differences);
    }
  });
}

TEST_CASE("a map of many tiles is answered as if it were one, by any number of threads" *
          doctest::test_suite("slow")) {
  for_each_filter([](const Filter& filter, const auto& ground_of) {
    PointCloud cloud = landscape(1300.0);
    for (Point& p : cloud) {  // as wide as the largest window can remove
      if (std::fmod(p.x(), 97.0) < filter.widest && p.y() > 5.0 && p.y() < 60.0) p.z() += 9.0;
    }
    const IndexList expected = ground_of(cloud);
    // A point far away moves the borders of the tiles, and has no other influence: they come to lie
    // anywhere, just inside a wide object's left edge, just before its right one.
    for (const double far :
         {-217.0, -400.0, -1000.0, 97.0 * 9 + 1 - 1024.0, 97.0 * 8 + filter.widest - 1 - 1024.0}) {
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
  });
}

TEST_CASE("a huge extent with few points takes neither memory nor time") {
  const PointCloud cloud = landscape(100.0);
  PointCloud more = cloud;
  for (int k = 1; k <= 20; ++k) more.emplace_back(1e8 * k, -3e9 * k, 5.0 * k);
  for_each_filter([&](const Filter&, const auto& ground_of) {
    const IndexList expected = ground_of(cloud), ground = ground_of(more);
    CHECK(ground.size() == expected.size() + 20);
    CHECK(std::equal(expected.begin(), expected.end(), ground.begin()));
  });
}

TEST_CASE("windows that need a raster beyond all memory are refused") {
  PointCloud cloud;
  for (int k = 0; k < 2000; ++k) cloud.emplace_back(20.0 * k, 20.0 * k, 0.0);
  for_each_filter([&](const Filter& filter, const auto&) {
    const auto ground =
        test::plugin<GroundFilter>(filter.plugin, filter.huge_window)->ground(cloud);
    REQUIRE(!ground);
    CHECK(ground.error().code == ErrorCode::invalid_input);
    CHECK(ground.error().message.find(filter.window) != std::string::npos);
  });
}

TEST_CASE("each parameter has an effect, and bad ones are refused") {
  const PointCloud cloud = landscape(150.0);
  for_each_filter([&](const Filter& filter, const auto& ground_of) {
    const IndexList by_default = ground_of(cloud);
    for (const std::string& params : filter.effects) {
      CAPTURE(params);
      CHECK(ground_of(cloud, params) != by_default);
    }
    CHECK(ground_of(cloud, filter.defaults) == by_default);
    for (const std::string& params : filter.refused) {
      CAPTURE(params);
      CHECK_THROWS((void)test::plugin<GroundFilter>(filter.plugin, params));
    }
  });
}

TEST_CASE("threads that share a filter agree") {
  const PointCloud cloud = landscape(150.0);
  for_each_filter([&](const Filter& filter, const auto& ground_of) {
    const auto plugin = test::plugin<GroundFilter>(filter.plugin);
    const IndexList expected = ground_of(cloud);
    std::vector<IndexList> got(4);
    std::vector<std::thread> threads;
    for (IndexList& out : got) {
      threads.emplace_back([&] { out = plugin->ground(cloud).value_or(IndexList{}); });
    }
    for (std::thread& thread : threads) thread.join();
    for (const IndexList& out : got) CHECK(out == expected);
  });
}

}  // namespace
}  // namespace vantage
