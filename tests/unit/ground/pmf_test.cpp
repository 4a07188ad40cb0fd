// What pmf promises beyond what every ground filter does.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>

#include "scenes.hpp"
#include "support/process.hpp"

namespace vantage {
namespace {

using namespace test;

IndexList pmf(const PointCloud& cloud, const std::string& params = {}) {
  return ground_by("pmf", cloud, params);
}

TEST_CASE("a low box is no ground either if one small window spans it") {
  const Scene scene = box_on_ground(1.5, 0.8);
  const IndexList ground = pmf(scene.cloud);
  CHECK(share(ground, 0, scene.ground) == 1.0);
  CHECK(share(ground, scene.ground, scene.top) == 0.0);
}

TEST_CASE("a bridge over a road, seen or hidden, is no ground; what is below and beside it is") {
  for (const bool hides_the_road : {false, true}) {
    CAPTURE(hides_the_road);
    PointCloud cloud;
    for (const Point& p : sampled(40'000, {-50, -50}, {50, 50}, level)) {
      if (!hides_the_road || std::abs(p.y()) > 6.0) cloud.push_back(p);
    }
    const std::size_t road = cloud.size();
    append(cloud, sampled(
                      8'000, {-50, -6}, {50, 6}, [](double, double) { return 5.5; }, 2));
    const IndexList ground = pmf(cloud);
    CHECK(share(ground, 0, road) == 1.0);
    CHECK(share(ground, road, cloud.size()) == 0.0);
  }
}

TEST_CASE("a sparse cloud is ground: two cells of three are empty") {
  const auto slope = [](double x, double y) { return 0.2 * x - 0.1 * y; };
  const PointCloud sparse = sampled(5'000, {-60, -60}, {60, 60}, slope);
  CHECK(pmf(sparse).size() == sparse.size());
}

TEST_CASE("a turn changes what little the square windows and cells see otherwise") {
  const PointCloud cloud = landscape(150.0);
  const IndexList expected = pmf(cloud);
  for (const double angle : {M_PI / 2.0, 0.3, 0.785}) {
    const Eigen::AngleAxisd turn(angle, Point::UnitZ());
    PointCloud turned;
    for (const Point& p : cloud) turned.push_back(turn * p);
    const IndexList ground = pmf(turned);
    IndexList differ;
    std::set_symmetric_difference(ground.begin(), ground.end(), expected.begin(), expected.end(),
                                  std::back_inserter(differ));
    CHECK(static_cast<double>(differ.size()) < 0.06 * static_cast<double>(cloud.size()));
  }
}

TEST_CASE("both schedules end with the largest window that fits") {
  // 11 m wide and 5 m high: only windows of 13 cells and more remove it.
  const Scene scene = box_on_ground(5.5, 5.0);
  for (const std::string schedule : {"schedule = 'linear'\nbase = 3.0",
                                     "schedule = 'exponential'\nbase = 2.0", "base = 100.0"}) {
    CAPTURE(schedule);
    CHECK(share(pmf(scene.cloud, schedule + "\nmax_window = 17.0"), scene.ground, scene.top) ==
          0.0);
    CHECK(share(pmf(scene.cloud, schedule + "\nmax_window = 7.0"), scene.ground, scene.top) > 0.8);
  }
}

TEST_CASE("the plugin's code outlives the last filter: a worker thread may still be leaving it") {
  (void)pmf({{0, 0, 0}});
  const std::string mapped = test::read_text("/proc/self/maps");
  CHECK(mapped.find("vantage_ground_pmf.so") != std::string::npos);
}

}  // namespace
}  // namespace vantage
