#include "simulate/trails.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "simulate/random.hpp"
#include "simulate/route.hpp"

namespace vantage::simulation {
namespace {

constexpr double kLength = 4.5, kWidth = 1.8, kHeight = 1.5;  // of a vehicle [m]
constexpr double kClearance = 0.3;                            // below it [m]
constexpr double kLane = 1.7;                                 // from the middle of the street [m]
constexpr double kTurnRadius = 4.0;                           // [m]
constexpr double kSweepSeconds = 0.1;
constexpr double kSeenShare = 0.1;  // of the surface in one sweep; the rest faces away
constexpr double kLongest = 60.0;   // [m]
constexpr double kNoise = 0.02;     // [m]

/// A face of the vehicle: a corner and two edges in its own frame, x forward, on the ground [m].
struct Side {
  Eigen::Vector3d corner, u, v;
};

std::vector<Side> sides() {
  const double x = kLength / 2, y = kWidth / 2, h = kHeight - kClearance;
  const Eigen::Vector3d along(kLength, 0, 0), across(0, kWidth, 0), up(0, 0, h);
  return {{{-x, -y, kClearance}, along, up},
          {{-x, y, kClearance}, along, up},
          {{-x, -y, kClearance}, across, up},
          {{x, -y, kClearance}, across, up},
          {{-x, -y, kHeight}, along, across}};
}

}  // namespace

PointCloud trail_of_vehicle(const World& world, double point_spacing, std::uint64_t seed) {
  Random random(seed);
  const auto routes = world.streets().routes();
  const auto& crossings =
      routes[static_cast<std::size_t>(random.uniform() * static_cast<double>(routes.size()))];
  const Route route(crossings, random.chance(0.5) ? kLane : -kLane, kTurnRadius);
  const double start = random.uniform() * route.length();
  const double step = kSweepSeconds * random.uniform(5.0, 12.0);
  const double driven = std::min(kLongest, route.length());

  PointCloud points;
  for (double distance = 0.0; distance < driven; distance += step) {
    const Eigen::Vector2d centre = route.position(start + distance);
    const Eigen::Vector2d forward = route.direction(start + distance);
    const Eigen::Vector2d left(-forward.y(), forward.x());
    for (const Side& side : sides()) {
      const double area = side.u.cross(side.v).norm();
      const double expected = kSeenShare * area / (point_spacing * point_spacing);
      for (long n = std::lround(expected); n > 0; --n) {
        const double along_v = random.uniform(), along_u = random.uniform();
        const Eigen::Vector3d p = side.corner + along_u * side.u + along_v * side.v;
        const Eigen::Vector2d at = centre + p.x() * forward + p.y() * left;
        if ((at.cwiseAbs().array() > world.terrain().half_size().array()).any()) continue;
        const Eigen::Vector3d noise = kNoise * random.vector<3>(&Random::normal);
        points.emplace_back(Point(at.x(), at.y(), world.terrain().height(at.x(), at.y()) + p.z()) +
                            noise + world.map_origin());
      }
    }
  }
  return points;
}

}  // namespace vantage::simulation
