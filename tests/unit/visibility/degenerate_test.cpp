// Few, flat, coincident and extreme inputs: a stated answer or an error, silently and without
// crash.
#include <doctest/doctest.h>

#include <fcntl.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <numeric>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "exact_visibility.hpp"
#include "scenes.hpp"
#include "support/plugins.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"

namespace vantage::test {
namespace {

const char* const kKernels[] = {"kernel = \"spherical_flip\"", "kernel = \"inversion\""};

// `count` points of a circle about the origin in the plane of two vectors; with coordinates 0 and 1
// every turned point is exactly in that plane.
PointCloud circle(int count, double radius, const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
  PointCloud cloud;
  for (int i = 0; i < count; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / count;
    cloud.emplace_back(radius * std::cos(angle) * u + radius * std::sin(angle) * v);
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

TEST_CASE("points exactly in one direction: the nearest hides the others") {
  SUBCASE("along an axis") {
    for (const char* kernel : kKernels) {
      for (const Eigen::Vector3d& along : {Eigen::Vector3d(0.3, 0, 0), Eigen::Vector3d(0, 0, -7)}) {
        PointCloud ray;
        for (int i = 9; i >= 1; --i) ray.emplace_back(i * along);
        CHECK(seen(ray, Point::Zero(), kernel) == IndexList{8});
        ray.emplace_back(-2.0 * along);
        CHECK(seen(ray, Point::Zero(), kernel) == IndexList{8, 9});
      }
    }
  }
  SUBCASE("along (3, 4, 0), with distances and R that are 5 times powers of two") {
    PointCloud ray;
    for (int i = 6; i >= 0; --i) ray.emplace_back(std::ldexp(1.0, i) * Point(3, 4, 0));
    for (const hpr::Settings& settings : {hpr::Settings{.radius = 5.0 * 1024}, inversion()}) {
      PointCloud map = ray;
      CHECK(hpr::hidden_point_removal(map, Point::Zero(), settings).value() == IndexList{6});
      map.emplace_back(-2.0 * Point(3, 4, 0));
      CHECK(hpr::hidden_point_removal(map, Point::Zero(), settings).value() == IndexList{6, 7});
    }
  }
}

// p* of a generic direction are on a line but for their rounding; with samples all around the
// nearest one that makes no difference.
TEST_CASE("points at one place are seen with any radius, also half their distance") {
  const PointCloud map(3, Point(3, 0, 4));  // 5 m from the viewpoint
  const PointCloud eyes{Point::Zero()};
  for (const double radius : {0.0, 1.0, 2.5, 4.0, 5.0, 500.0}) {
    CAPTURE(radius);
    const hpr::HiddenPointRemoval removal(map, {.radius = radius});
    CHECK(removal.visible(eyes[0]).value() == IndexList{0, 1, 2});
    CHECK(removal.visible_from_any(eyes, nullptr).value() == IndexList{0, 1, 2});
  }
}

TEST_CASE("amid a dense surface every direction hides what is behind it") {
  const PointCloud shell = sphere(2000, 5.0);
  IndexList all(shell.size());
  std::iota(all.begin(), all.end(), 0U);
  for (const char* params :
       {"kernel = \"spherical_flip\"", "alpha = 1.0", "kernel = \"inversion\""}) {
    for (const Point& direction : ball(5, 8, 1.0, 0.1)) {
      PointCloud map = shell, behind_sample = shell;
      for (int i = 1; i <= 9; ++i) {
        map.emplace_back((5.0 + i) * direction.normalized());
        behind_sample.emplace_back((1.0 + 0.3 * i) * shell[77]);
      }
      CHECK(seen(behind_sample, Point::Zero(), params) == all);
      if (params == std::string("kernel = \"spherical_flip\"")) continue;  // R delta^2 is 10 m
      CHECK(seen(map, Point::Zero(), params) == all);
    }
  }
}

TEST_CASE("points exactly in one plane with the viewpoint: the hull is taken in that plane") {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(),
                        z = Eigen::Vector3d::UnitZ();
  for (const auto& [u, v] : {std::pair(x, y), std::pair(y, z), std::pair((x + y).eval(), z),
                             std::pair((x - z).eval(), y)}) {
    for (const char* kernel : kKernels) {
      CAPTURE(u.transpose());
      CAPTURE(v.transpose());
      CAPTURE(kernel);
      const PointCloud map = joined(circle(90, 2.0, u, v), circle(90, 4.0, u, v));
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

TEST_CASE("extreme distances are judged as exactly as others, and nothing is printed") {
  std::vector<std::string> wrong;
  const std::string printed = output_of([&] {
    const auto check = [&](const PointCloud& map, const hpr::Settings& settings, double extreme) {
      const auto indices = hpr::hidden_point_removal(map, Point::Zero(), settings);
      if (indices && *indices == exactly_seen(map, Point::Zero(), settings).value()) return;
      std::ostringstream what;
      what << extreme << " m, R " << settings.radius << ": "
           << (indices ? std::to_string(indices->size()) + " seen" : to_string(indices.error()));
      wrong.push_back(what.str());
    };
    for (const double tiny : {1e-9, 1e-29, 1e-30, 1e-31, 1e-100, 1e-153, 1e-170, 1e-300}) {
      PointCloud map = sphere(200, 5.0);
      map.emplace_back(tiny, 0.0, 0.0);
      for (const auto& settings : {flip(map, 100.0), inversion()}) check(map, settings, tiny);
      const auto seen = hpr::hidden_point_removal(map, Point::Zero(), flip(map, 100.0));
      if (seen->size() != (tiny > 1e-30 ? 201U : 200U)) wrong.push_back("not all of the sphere");
    }
    for (const double thick : {1e-13, 1e-17}) {
      PointCloud slab;
      for (const Point& p : ball(3, 400, 10.0)) slab.emplace_back(p.x(), p.y(), thick * p.z());
      for (const auto& settings : {flip(slab, 1.0), flip(slab, 100.0), inversion()}) {
        check(slab, settings, thick);
      }
    }
    const PointCloud tilted = circle(40, 2.0, {1, 2, 3}, {3, 0, -1});
    for (const auto& settings : {flip(tilted, 100.0), inversion()}) check(tilted, settings, 0.0);
  });
  CHECK(printed == "");
  for (const std::string& what : wrong) FAIL_CHECK(what);
}

}  // namespace
}  // namespace vantage::test
