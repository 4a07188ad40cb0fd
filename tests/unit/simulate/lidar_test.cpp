#include "simulate/lidar.hpp"

#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include "small_world.hpp"

namespace vantage::simulation {
namespace {

using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180.0;

struct Ray {
  int firing, ring;
  auto operator<=>(const Ray&) const = default;
};

/// Which ray of a VLP-16 a point was made by.
Ray ray_of(const Point& p) {
  const double azimuth = std::atan2(p.y(), p.x()) / kDegree;
  const double elevation = std::asin(p.z() / p.norm()) / kDegree;
  return {static_cast<int>(std::lround((180.0 - azimuth) / 0.2)) % 1800,
          static_cast<int>(std::lround((elevation + 15.0) / 2.0))};
}

/// The range of each ray of a scan that returns.
std::map<Ray, double> ranges_of(const PointCloud& scan) {
  std::map<Ray, double> ranges;
  for (const Point& p : scan) ranges[ray_of(p)] = p.norm();
  return ranges;
}

WorldParams exact_world() {
  WorldParams params = test::small_world();
  params.campus.leaf_area_density = 0.0;  // distance_to_surface knows no leaves
  params.lidar.range_noise = 0.0;
  params.lidar.dropout = 0.0;
  params.lidar.grazing_angle = 0.0;
  return params;
}

TEST_CASE("a scan has the rays of a VLP-16") {
  const WorldParams params = test::small_world();
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  const PointCloud scan = Lidar(params.lidar, params.seed).scan(world, drive, 5);
  REQUIRE(scan.size() > 5000);
  CHECK(scan.size() <= 28'800);

  std::array<int, 16> points_of_ring{};
  Ray previous{-1, 0};
  for (const Point& p : scan) {
    const double elevation = std::asin(p.z() / p.norm()) / kDegree;
    const double azimuth = std::atan2(p.y(), p.x()) / kDegree;
    const Ray ray = ray_of(p);
    REQUIRE(ray.ring >= 0);
    REQUIRE(ray.ring < 16);
    ++points_of_ring[static_cast<std::size_t>(ray.ring)];
    CHECK(elevation == doctest::Approx(-15.0 + 2.0 * ray.ring).epsilon(1e-9));
    CHECK(std::abs(std::remainder(azimuth, 0.2)) < 1e-9);
    CHECK(p.norm() >= params.lidar.min_range);
    CHECK(p.norm() <= params.lidar.max_range);
    CHECK(previous < ray);  // firing by firing, rings upwards, no ray twice
    previous = ray;
  }
  CHECK(std::all_of(points_of_ring.begin(), points_of_ring.end(), [](int n) { return n > 50; }));
}

TEST_CASE("every point of a scan without noise lies on a surface") {
  for (const bool motion_distortion : {false, true}) {
    CAPTURE(motion_distortion);
    WorldParams params = exact_world();
    params.lidar.motion_distortion = motion_distortion;
    params.drive.speed = 10.0;
    const World world = test::make_world(params);
    const Drive drive = test::make_drive(world, params);
    const Lidar lidar(params.lidar, params.seed);
    // In a turn, where both position and heading change within the scan.
    const std::size_t index = drive.scans() / 8;
    double worst = 0.0, worst_from_first_pose = 0.0;
    for (const Point& p : lidar.scan(world, drive, index)) {
      const double fired = motion_distortion ? ray_of(p).firing / 1800.0 * 0.1 : 0.0;
      worst = std::max(
          worst, test::distance_to_surface(world, drive.pose(drive.stamp(index) + fired) * p, 1.0));
      worst_from_first_pose =
          std::max(worst_from_first_pose,
                   test::distance_to_surface(world, drive.pose(drive.stamp(index)) * p, 1.0));
    }
    CHECK(worst < 1e-3);
    CHECK((worst_from_first_pose > 0.1) == motion_distortion);
  }
}

TEST_CASE("range noise and dropouts are as large as asked") {
  WorldParams params = exact_world();
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  const auto truth = ranges_of(Lidar(params.lidar, 1).scan(world, drive, 0));

  SUBCASE("noise") {
    params.lidar.range_noise = 0.03;
    double sum = 0.0, squares = 0.0, count = 0.0;
    for (const Point& p : Lidar(params.lidar, 1).scan(world, drive, 0)) {
      const auto exact = truth.find(ray_of(p));
      if (exact == truth.end()) continue;
      sum += p.norm() - exact->second;
      squares += (p.norm() - exact->second) * (p.norm() - exact->second);
      count += 1.0;
    }
    REQUIRE(count > 0.99 * static_cast<double>(truth.size()));
    CHECK(std::abs(sum / count) < 0.001);
    CHECK(std::sqrt(squares / count) == doctest::Approx(0.03).epsilon(0.03));
  }
  SUBCASE("dropouts") {
    params.lidar.dropout = 0.2;
    const PointCloud scan = Lidar(params.lidar, 1).scan(world, drive, 0);
    CHECK(static_cast<double>(scan.size()) / static_cast<double>(truth.size()) ==
          doctest::Approx(0.8).epsilon(0.02));
  }
  SUBCASE("grazing rays are lost more often than steep ones") {
    params.lidar.grazing_angle = 6.0;
    std::map<int, int> kept, all;
    const auto is_ground = [&](const Ray& ray, double range) {
      const Point p = drive.pose(drive.stamp(0)) *
                      (range * Lidar(params.lidar, 1).direction(ray.firing, ray.ring));
      return std::abs(p.z() - world.terrain().height(p.x(), p.y())) < 1e-3;
    };
    for (const auto& [ray, range] : truth) all[ray.ring] += is_ground(ray, range) ? 1 : 0;
    for (const Point& p : Lidar(params.lidar, 1).scan(world, drive, 0)) {
      kept[ray_of(p).ring] += is_ground(ray_of(p), p.norm()) ? 1 : 0;
    }
    REQUIRE(all[0] > 500);
    REQUIRE(all[6] > 100);     // at -3 degrees
    CHECK(kept[0] == all[0]);  // at -15 degrees
    CHECK(kept[6] < 0.8 * all[6]);
    CHECK(kept[6] > 0.2 * all[6]);
  }
}

TEST_CASE("noise belongs to the scan and the ray, not to the order of work") {
  const WorldParams params = test::small_world();
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  const Lidar lidar(params.lidar, params.seed);
  const PointCloud late = lidar.scan(world, drive, 9);
  const PointCloud early = lidar.scan(world, drive, 8);
  CHECK(lidar.scan(world, drive, 9) == late);
  CHECK(early != late);
  CHECK(Lidar(params.lidar, params.seed + 1).scan(world, drive, 9) != late);
}

TEST_CASE("a world where every return is lost gives empty scans") {
  WorldParams params = test::small_world();
  params.lidar.dropout = 1.0;
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  CHECK(Lidar(params.lidar, params.seed).scan(world, drive, 0).empty());
}

TEST_CASE("nothing returns from a covered sector, and the other rays are as they were") {
  WorldParams params = test::small_world();
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  const PointCloud open = Lidar(params.lidar, params.seed).scan(world, drive, 5);
  struct Sector {
    double from, to;
  };
  for (const Sector& sector : {Sector{-30.0, 90.0}, Sector{100.0, -100.0}, Sector{-180.0, 0.0}}) {
    CAPTURE(sector.from);
    params.lidar.covered_from = sector.from;
    params.lidar.covered_to = sector.to;
    const PointCloud covered = Lidar(params.lidar, params.seed).scan(world, drive, 5);
    PointCloud expected;
    for (const Point& p : open) {
      const double azimuth = 180.0 - 0.2 * ray_of(p).firing;  // (-180, 180]
      const bool between = azimuth >= sector.from - 1e-6 && azimuth <= sector.to + 1e-6;
      const bool round = azimuth >= sector.from - 1e-6 || azimuth <= sector.to + 1e-6;
      const bool is_behind = std::abs(azimuth - 180.0) < 1e-6 && sector.from == -180.0;
      if (!(sector.from < sector.to ? between || is_behind : round)) expected.push_back(p);
    }
    CHECK(covered.size() > open.size() / 5);
    CHECK(covered.size() < open.size() * 4 / 5);
    CHECK((covered == expected));
  }
}

TEST_CASE("clutter returns its share of the rays before their surfaces, and no other ray differs") {
  WorldParams params = exact_world();
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  const auto clear = ranges_of(Lidar(params.lidar, 1).scan(world, drive, 0));
  params.lidar.clutter = 0.1;
  std::size_t early = 0, in_the_sky = 0, rays = 0;
  for (const Point& p : Lidar(params.lidar, 1).scan(world, drive, 0)) {
    ++rays;
    const auto surface = clear.find(ray_of(p));
    if (surface == clear.end()) {
      ++in_the_sky;
    } else if (p.norm() < surface->second - 1e-9) {
      ++early;
    } else {
      CHECK(p.norm() == surface->second);
      continue;
    }
    CHECK(p.norm() >= params.lidar.min_range);
    CHECK(p.norm() <= 15.0);
  }
  CHECK(static_cast<double>(early) / static_cast<double>(clear.size()) ==
        doctest::Approx(0.1).epsilon(0.1));
  CHECK(in_the_sky > 100);
  CHECK(rays == clear.size() + in_the_sky);
}

TEST_CASE("people stand around the sensor, before the surfaces, and no other ray differs") {
  WorldParams params = exact_world();
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  const auto clear = ranges_of(Lidar(params.lidar, 1).scan(world, drive, 0));
  params.lidar.people = 8;
  std::size_t on_people = 0;
  for (const Point& p : Lidar(params.lidar, 1).scan(world, drive, 0)) {
    const auto surface = clear.find(ray_of(p));
    if (surface != clear.end() && p.norm() == surface->second) continue;
    ++on_people;
    CHECK((surface == clear.end() || p.norm() < surface->second));
    CHECK(p.head<2>().norm() > 0.4);
    CHECK(p.head<2>().norm() < 5.6);
  }
  CHECK(on_people > 500);
}

TEST_CASE("a person is as wide and as high as a cylinder, wherever the ray comes from") {
  LidarParams params;
  params.people = 1;
  const Crowd crowd(params, 5);
  double low = 10.0, high = -10.0, nearest = 10.0, widest = 0.0;
  std::vector<Eigen::Vector2d> seen;
  for (int a = 0; a < 3600; ++a) {
    for (int e = -80; e <= 80; ++e) {
      const double azimuth = 0.1 * a * kDegree, elevation = 0.5 * e * kDegree;
      const Vector3d ray(std::cos(elevation) * std::cos(azimuth),
                         std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const auto hit = crowd.before(std::nullopt, ray, 3.0);
      if (!hit) continue;
      const Point p = hit->range * ray;
      low = std::min(low, p.z());
      high = std::max(high, p.z());
      nearest = std::min(nearest, p.head<2>().norm());
      seen.emplace_back(p.head<2>());
      CHECK(crowd
                .before(Hit{.range = hit->range - 0.01, .cos_incidence = 1.0, .surface = {}}, ray,
                        3.0)
                ->range == hit->range - 0.01);
    }
  }
  for (const auto& a : seen) widest = std::max(widest, (a - seen.front()).norm());
  CHECK(low >= -params.height);
  CHECK(high <= 1.75 - params.height);
  CHECK(high > 1.75 - params.height - 0.1);
  CHECK(nearest > 0.4);
  CHECK(widest <= 0.5);
  CHECK(widest > 0.4);
}

TEST_CASE("a sensor may be disturbed for a part of the drive only") {
  WorldParams params = test::small_world();
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  const Lidar clear(params.lidar, params.seed);
  params.lidar.clutter = 0.05;
  params.lidar.covered_from = 0.0;
  params.lidar.covered_to = 60.0;
  params.lidar.disturbed_from = 0.25;
  params.lidar.disturbed_to = 0.5;
  const Lidar disturbed(params.lidar, params.seed);
  for (const double at : {0.0, 0.24, 0.26, 0.49, 0.51, 0.99}) {
    CAPTURE(at);
    const auto index = static_cast<std::size_t>(at * static_cast<double>(drive.scans()));
    const bool same = disturbed.scan(world, drive, index) == clear.scan(world, drive, index);
    CHECK(same == (at < 0.25 || at > 0.5));
  }
}

}  // namespace
}  // namespace vantage::simulation
