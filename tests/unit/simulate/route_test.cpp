#include "simulate/route.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "small_world.hpp"

namespace vantage::simulation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

double angle_between(const Vector2d& a, const Vector2d& b) {
  return std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
}

double largest_curvature(const Route& route) {
  constexpr double kStep = 0.25;
  double largest = 0.0;
  for (double s = 0; s < route.length(); s += kStep) {
    const double turned = angle_between(route.direction(s), route.direction(s + kStep));
    largest = std::max(largest, std::abs(turned) / kStep);
  }
  return largest;
}

/// 4 by 3 streets, so that all routes exist.
WorldParams wide_world(std::uint64_t seed, int route) {
  WorldParams params = test::small_world(seed);
  params.campus.size_x = 170.0;
  params.campus.size_y = 130.0;
  params.campus.ground_relief = 5.0;
  params.drive.route = route;
  return params;
}

TEST_CASE("a route around a square") {
  const std::vector<Vector2d> square{{0, 0}, {50, 0}, {50, 50}, {0, 50}};
  const Route route(square, 0.0, 4.0);

  SUBCASE("starts in the middle of the first edge") {
    CHECK((route.position(0) - Vector2d(25, 0)).norm() < 0.1);
    CHECK(route.direction(0).x() == doctest::Approx(1.0));
  }
  SUBCASE("is closed, and goes on after a lap") {
    CHECK((route.position(0) - route.position(route.length() - 1e-6)).norm() < 1e-3);
    CHECK((route.position(7) - route.position(7 + 2 * route.length())).norm() < 1e-6);
  }
  SUBCASE("turns as tightly as it was told, cutting the corner by 0.6 radii") {
    CHECK(1.0 / largest_curvature(route) == doctest::Approx(4.0).epsilon(0.05));
    double nearest = 1e9;
    for (double s = 0; s < route.length(); s += 0.1) {
      nearest = std::min(nearest, (route.position(s) - square[1]).norm());
    }
    CHECK(nearest == doctest::Approx(0.6 * 4.0).epsilon(0.1));
  }
  SUBCASE("is measured in metres driven") {
    for (double s = 0; s < route.length(); s += 1.7) {
      const Vector2d step = route.position(s + 0.5) - route.position(s);
      CHECK(step.norm() <= 0.5 + 1e-9);
      CHECK(step.norm() > 0.495);
      CHECK(std::abs(angle_between(step, route.direction(s + 0.25))) < 0.01);
    }
  }
  SUBCASE("moved to the right, it is longer: it turns left") {
    const Route outer(square, -2.0, 4.0);
    CHECK((outer.position(0) - Vector2d(25, -2)).norm() < 0.1);
    CHECK(outer.length() == doctest::Approx(route.length() + 16.0).epsilon(0.001));
  }
}

TEST_CASE("the drive") {
  for (const std::uint64_t seed : {1, 2, 3}) {
    for (const int number : {0, 1, 2}) {
      CAPTURE(seed);
      CAPTURE(number);
      const WorldParams params = wide_world(seed, number);
      const World world = test::make_world(params);
      const Drive drive = test::make_drive(world, params);
      const Route& route = drive.route();

      // Smooth: crossings are a little off right angles, which tightens some turns.
      CHECK(largest_curvature(route) * params.drive.turn_radius < 1.5);
      CHECK(drive.scans() ==
            static_cast<std::size_t>(std::ceil(route.length() / (1.5 / params.lidar.rate))));

      bool is_under_overpass = false;
      std::size_t obstacles = 0, not_one_metre = 0, not_upright = 0;
      for (std::size_t k = 0; k < drive.scans(); k += 3) {
        const Pose pose = drive.pose(drive.stamp(k));
        const auto down = world.cast(pose.translation, -Vector3d::UnitZ(), 100.0);
        if (!down || down->surface != Surface::ground || std::abs(down->range - 1.0) > 1e-4) {
          ++not_one_metre;
        }
        const Vector3d up = pose.rotation * Vector3d::UnitZ();
        if (up.dot(world.terrain().normal(pose.translation.head<2>())) < 1.0 - 1e-9) ++not_upright;
        if ((pose.rotation * Vector3d::UnitX())
                .head<2>()
                .normalized()
                .dot(route.direction(drive.distance(drive.stamp(k)))) < 0.999) {
          ++not_upright;
        }
        // A vehicle 1.6 m wide and up to 2 m high gets through.
        for (int a = 0; a < 24; ++a) {
          const double angle = 2.0 * std::numbers::pi * a / 24.0;
          const Vector3d ray(std::cos(angle), std::sin(angle), 0.0);
          for (const double height : {-0.7, 0.0, 1.0}) {
            const Point from = pose.translation + height * Vector3d::UnitZ();
            if (world.solids().is_inside(from + 0.8 * ray)) ++obstacles;
            if (height >= 0.0 && world.cast(from, ray, 0.8)) ++obstacles;
          }
        }
        const auto overhead = world.cast(pose.translation, Vector3d::UnitZ(), 100.0);
        if (overhead && overhead->surface == Surface::overpass) {
          is_under_overpass = true;
          CHECK(overhead->range + params.lidar.height >= params.campus.overpass_clearance);
        }
      }
      CHECK(is_under_overpass);
      CHECK(obstacles == 0);
      CHECK(not_one_metre == 0);
      CHECK(not_upright == 0);
    }
  }
}

TEST_CASE("the drive stops after the length that was asked for") {
  WorldParams params = test::small_world();
  params.drive.length = 30.0;
  params.drive.scan_every = 4;
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  CHECK(drive.scans() == 50);  // 0.6 m apart
  CHECK(drive.distance(drive.stamp(49)) == doctest::Approx(29.4));
  CHECK(drive.stamp(1) - drive.stamp(0) == doctest::Approx(0.4));

  SUBCASE("also after more than a lap") {
    params.drive.length = 2.5 * drive.route().length();
    const Drive laps = test::make_drive(world, params);
    const double period = drive.route().length() / params.drive.speed;
    const Pose first = laps.pose(10.0), again = laps.pose(10.0 + 2.0 * period);
    CHECK((first.translation - again.translation).norm() < 1e-6);
    CHECK(laps.distance(laps.stamp(laps.scans() - 1)) > 2.4 * drive.route().length());
  }
}

TEST_CASE("routes differ, and the figure of eight needs three streets each way") {
  const WorldParams wide = wide_world(1, 0);
  const StreetGrid streets(wide.campus, wide.seed);
  CHECK(streets.routes().size() == 3);
  const auto route = [&](int number) {
    return Route(*streets.route(number), 0.0, wide.drive.turn_radius);
  };
  CHECK(route(1).length() > 1.1 * route(0).length());
  const auto farthest_from = [&](const Route& a, const Route& b) {  // of the points of b
    double farthest = 0.0;
    for (double s = 0; s < b.length(); s += 5.0) {
      double nearest = 1e9;
      for (double t = 0; t < a.length(); t += 1.0) {
        nearest = std::min(nearest, (a.position(t) - b.position(s)).norm());
      }
      farthest = std::max(farthest, nearest);
    }
    return farthest;
  };
  CHECK(farthest_from(route(0), route(1)) > 15.0);
  CHECK(farthest_from(route(0), route(2)) > 15.0);
  CHECK(farthest_from(route(1), route(2)) > 15.0);

  const StreetGrid narrow(test::small_world().campus, 1);
  CHECK(narrow.streets_x() == 2);
  CHECK(narrow.routes().size() == 2);
  const auto missing = narrow.route(2);
  REQUIRE_FALSE(missing);
  CHECK(missing.error().code == ErrorCode::invalid_config);
}

}  // namespace
}  // namespace vantage::simulation
