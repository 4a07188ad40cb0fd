// Few, flat, coincident and extreme inputs: a stated answer or an error, silently and without
// crash.
#include <doctest/doctest.h>

#include <fcntl.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <cstdio>
#include <limits>
#include <numbers>
#include <string>

#include "convex_hull.hpp"
#include "scenes.hpp"
#include "support/plugins.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"

namespace vantage::test {
namespace {

const char* const kKernels[] = {"kernel = \"spherical_flip\"", "kernel = \"inversion\""};

// `count` points of a circle about the origin in the plane with that normal.
PointCloud circle(int count, double radius, const Eigen::Vector3d& normal) {
  const auto turn = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), normal);
  PointCloud cloud;
  for (int i = 0; i < count; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / count;
    cloud.push_back(turn * Point(radius * std::cos(angle), radius * std::sin(angle), 0.0));
  }
  return cloud;
}

// What a call writes to the two output streams of the process.
template <class F>
std::string output_of(const F& f) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "output").string();
  std::fflush(nullptr);
  const int file = open(path.c_str(), O_CREAT | O_WRONLY | O_APPEND, 0600);
  const int out = dup(1), err = dup(2);
  dup2(file, 1);
  dup2(file, 2);
  f();
  std::fflush(nullptr);
  dup2(out, 1);
  dup2(err, 2);
  close(file);
  close(out);
  close(err);
  return read_text(path);
}

TEST_CASE("hpr with few points") {
  const Point eye(0, 0, 0);
  for (const char* kernel : kKernels) {
    CAPTURE(kernel);
    CHECK(seen(PointCloud{{1, 2, 3}}, eye, kernel) == IndexList{0});
    CHECK(seen(PointCloud{{2, 0, 0}, {1, 0, 0}}, eye, kernel) == IndexList{1});
    CHECK(seen(PointCloud{{2, 0, 0}, {-1, 0, 0}}, eye, kernel) == IndexList{0, 1});
    CHECK(seen(PointCloud{{2, 0, 0}, {0, 1, 0}}, eye, kernel) == IndexList{0, 1});
    CHECK(seen(PointCloud{{2, 0, 0}, {0, 1, 0}, {0, 0, 3}}, eye, kernel) == IndexList{0, 1, 2});
    CHECK(seen(PointCloud{{2, 0, 0}, {0, 1, 0}, {0, 0, 3}, {4, 0, 0}}, eye, kernel) ==
          IndexList{0, 1, 2});
  }
}

TEST_CASE("a point at the viewpoint is not seen and does not occlude") {
  for (const char* kernel : kKernels) {
    CHECK(seen(PointCloud{{1, 1, 1}}, {1, 1, 1}, kernel).empty());
    PointCloud map = sphere(500, 5.0);
    map.emplace_back(1, 1, 1);
    const IndexList indices = seen(map, {1, 1, 1}, kernel);
    CHECK(indices.size() == 500);
    CHECK(indices.back() == 499);
  }
}

TEST_CASE("points in one direction: the nearest hides the others") {
  for (const char* kernel : kKernels) {
    PointCloud ray;
    for (int i = 9; i >= 1; --i) ray.push_back(i * Point(0.3, -0.2, 0.7));
    CHECK(seen(ray, Point::Zero(), kernel) == IndexList{8});
    ray.push_back(-2.0 * Point(0.3, -0.2, 0.7));
    CHECK(seen(ray, Point::Zero(), kernel) == IndexList{8, 9});
  }
}

TEST_CASE("points in one plane with the viewpoint: the hull is taken in that plane") {
  for (const Eigen::Vector3d& normal :
       {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(1, 2, 3)}) {
    for (const char* kernel : kKernels) {
      CAPTURE(normal);
      CAPTURE(kernel);
      const PointCloud map = joined(circle(90, 2.0, normal), circle(90, 4.0, normal));
      const IndexList indices = seen(map, Point::Zero(), kernel);
      CHECK(indices.size() == 90);
      CHECK(indices.back() == 89);
    }
  }
}

TEST_CASE("coincident points share the verdict") {
  const PointCloud once = ball(1, 300, 10.0);
  const PointCloud thrice = joined(joined(once, once), once);
  for (const char* kernel : kKernels) {
    const IndexList indices = seen(once, {1, 2, 0.5}, kernel);
    CHECK(indices.size() < once.size());
    IndexList expected;
    for (std::uint32_t copy = 0; copy < 3; ++copy) {
      for (const std::uint32_t i : indices) expected.push_back(300 * copy + i);
    }
    CHECK(seen(thrice, {1, 2, 0.5}, kernel) == expected);
    CHECK(seen(PointCloud(7, Point(1, 2, 3)), Point::Zero(), kernel).size() == 7);
    const PointCloud few = joined(PointCloud(3, Point(1, 0, 0)), PointCloud(2, Point(2, 0, 0)));
    CHECK(seen(few, Point::Zero(), kernel) == IndexList{0, 1, 2});
  }
}

TEST_CASE("hpr refuses what is no input, with one clear error") {
  const auto hpr = plugin<VisibilityOperator>("hpr");
  const PointCloud map = ball(1, 100, 10.0);
  const Bounds3 bounds = bounds_of(map);
  const auto refused = [&](PointsView points, const VisibilityLimits& limits) {
    const auto prepared = hpr->prepare(points, limits);
    return !prepared && prepared.error().code == ErrorCode::invalid_input &&
           !prepared.error().message.empty();
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  CHECK(refused({}, {.map_bounds = bounds}));
  CHECK(refused(PointCloud{{0, 0, 0}, {kNan, 0, 0}}, {.map_bounds = bounds}));
  CHECK(refused(PointCloud{{0, kInf, 0}}, {.map_bounds = bounds}));
  CHECK(refused(map, {}));
  CHECK(refused(map, {.map_bounds = {Point::Zero(), Point::Ones()}}));
  CHECK(refused(map, {.map_bounds = bounds, .max_range = 0.0}));
  CHECK(refused(map, {.map_bounds = bounds, .max_range = -1.0}));
  CHECK(refused(map, {.map_bounds = bounds, .max_range = kNan}));
  const PointCloud huge{{1e150, 0, 0}, {0, 1e150, 0}};
  CHECK(refused(huge, {.map_bounds = bounds_of(huge)}));

  const auto scene = hpr->prepare(map, {.map_bounds = bounds});
  REQUIRE(scene);
  for (const double bad : {kNan, kInf}) {
    const auto indices = (*scene)->visible({bad, 0, 0});
    REQUIRE(!indices);
    CHECK(indices.error().code == ErrorCode::invalid_input);
  }
}

TEST_CASE("the radius must reach the farthest point") {
  const PointCloud map = ball(2, 100, 10.0);
  const VisibilityLimits limits{.map_bounds = bounds_of(map)};
  SUBCASE("never a matter within the map: alpha is at least 1") {
    const auto hpr = plugin<VisibilityOperator>("hpr", "alpha = 1.0");
    const auto scene = hpr->prepare(map, limits);
    REQUIRE(scene);
    for (const Point& corner : {limits.map_bounds.min, limits.map_bounds.max}) {
      CHECK((*scene)->visible(corner).has_value());
    }
    const PointCloud two{{0, 0, 0}, {3, 4, 5}};
    CHECK(seen(two, two.front(), "alpha = 1.0") == IndexList{1});
  }
  SUBCASE("a viewpoint far outside the map is an error") {
    const auto hpr = plugin<VisibilityOperator>("hpr", "alpha = 1.0");
    const auto scene = hpr->prepare(map, limits);
    REQUIRE(scene);
    const auto indices = (*scene)->visible({1000, 0, 0});
    REQUIRE(!indices);
    CHECK(indices.error().code == ErrorCode::invalid_input);
    CHECK(indices.error().message.find("R") != std::string::npos);
  }
  SUBCASE("a gap that gives a smaller radius than the sensor's reach is an error of prepare") {
    const auto hpr = plugin<VisibilityOperator>("hpr", "gap = 0.01\nangular_spacing = 5.0");
    const auto scene = hpr->prepare(map, limits);
    REQUIRE(!scene);
    CHECK(scene.error().code == ErrorCode::invalid_input);
    CHECK(hpr->prepare(map, {.map_bounds = limits.map_bounds, .max_range = 5.0}).has_value());
  }
}

TEST_CASE("extreme distances end in an answer or an error, and nothing is printed") {
  const std::string printed = output_of([] {
    for (const double tiny : {1e-9, 1e-30, 1e-100, 1e-153, 1e-170, 1e-300}) {
      PointCloud map = sphere(200, 5.0);
      map.emplace_back(tiny, 0.0, 0.0);
      for (const auto& settings : {flip(map, 100.0), inversion()}) {
        const auto indices = hpr::hidden_point_removal(map, Point::Zero(), settings);
        if (indices) {
          CHECK(indices->size() <= map.size());
        } else {
          CHECK(!indices.error().message.empty());
        }
      }
    }
    const double thick = 1e-13;  // about what Qhull takes for flat
    PointCloud slab;
    for (const Point& p : ball(3, 400, 10.0)) slab.emplace_back(p.x(), p.y(), thick * p.z());
    for (const auto& settings : {flip(slab, 1.0), flip(slab, 100.0), inversion()}) {
      const auto indices = hpr::hidden_point_removal(slab, Point::Zero(), settings);
      if (!indices) CHECK(!indices.error().message.empty());
    }
    for (const char* kernel : kKernels) {
      CHECK(!seen(circle(40, 2.0, {1, 2, 3}), Point::Zero(), kernel).empty());
    }
  });
  CHECK(printed.empty());
}

TEST_CASE("convex_hull_vertices") {
  const std::vector<double> cube{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0,   1,   1,  1,
                                 0, 1, 0, 1, 0, 1, 1, 1, 1, 1, 0.5, 0.5, 0.5};
  CHECK(hpr::convex_hull_vertices(cube, 3) == std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5, 6, 7});
  CHECK(hpr::convex_hull_vertices(std::vector<double>{0, 0, 2, 0, 1, 0.5, 0, 2}, 2) ==
        std::vector<std::uint32_t>{0, 1, 3});
  std::string printed = output_of([] {
    const std::vector<double> flat{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0.5, 0.3, 0};
    for (const auto& coordinates : {flat, std::vector<double>{1, 2, 3}, std::vector<double>{}}) {
      const auto vertices = hpr::convex_hull_vertices(coordinates, 3);
      REQUIRE(!vertices);
      CHECK(vertices.error().code == ErrorCode::invalid_input);
    }
  });
  CHECK(printed.empty());
}

}  // namespace
}  // namespace vantage::test
