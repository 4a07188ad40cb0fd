#include "simulate/map_sampler.hpp"

#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <vector>

#include "simulate/lidar.hpp"
#include "simulate/random.hpp"
#include "small_world.hpp"

namespace vantage::simulation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Nearest neighbours within one cell, by brute force over the cells around.
class Neighbours {
 public:
  Neighbours(const PointCloud& points, double cell) : points_(points), cell_(cell) {
    for (std::uint32_t k = 0; k < points.size(); ++k) cells_[key(points[k], 0, 0, 0)].push_back(k);
  }
  /// Infinite if farther than a cell; a point at distance 0 does not count.
  [[nodiscard]] double distance(const Point& p) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (int i = -1; i <= 1; ++i) {
      for (int j = -1; j <= 1; ++j) {
        for (int k = -1; k <= 1; ++k) {
          const auto found = cells_.find(key(p, i, j, k));
          if (found == cells_.end()) continue;
          for (const std::uint32_t index : found->second) {
            const double d = (points_[index] - p).norm();
            if (d > 0.0) nearest = std::min(nearest, d);
          }
        }
      }
    }
    return nearest <= cell_ ? nearest : std::numeric_limits<double>::infinity();
  }

 private:
  [[nodiscard]] std::uint64_t key(const Point& p, int i, int j, int k) const {
    const Eigen::Array3d cell = (p.array() / cell_).floor() + Eigen::Array3d(i, j, k);
    return hash(0, static_cast<std::int64_t>(cell.x()), static_cast<std::int64_t>(cell.y()),
                static_cast<std::int64_t>(cell.z()));
  }

  const PointCloud& points_;
  double cell_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

double area_of(const Face& face) {
  Vector3d twice = Vector3d::Zero();
  for (std::size_t k = 2; k < face.corners.size(); ++k) {
    twice += (face.corners[k - 1] - face.corners[0]).cross(face.corners[k] - face.corners[0]);
  }
  return twice.norm() / 2.0;
}

bool is_on(const Face& face, const Point& p) {
  if (std::abs(face.normal.dot(p - face.corners[0])) > 1e-9) return false;
  for (std::size_t k = 0; k < face.corners.size(); ++k) {
    const Point& a = face.corners[k];
    const Vector3d edge = face.corners[(k + 1) % face.corners.size()] - a;
    if (face.normal.dot(edge.cross(p - a)) < 0.0) return false;
  }
  return true;
}

TEST_CASE("a bare plane is covered evenly") {
  WorldParams params = test::bare_world();
  params.map.noise = 0.0;
  const double spacing = params.map.point_spacing;
  const World world = test::make_world(params);
  const PointCloud map = sample_map(world, params.map, params.seed);

  PointCloud ground;
  std::copy_if(map.begin(), map.end(), std::back_inserter(ground),
               [](const Point& p) { return p.z() == 0.0; });
  double covered = 0.0;  // by the ramps of the overpass
  constexpr double kProbe = 0.1;
  for (double x = -32 + kProbe / 2; x < 32; x += kProbe) {
    for (double y = -35 + kProbe / 2; y < 35; y += kProbe) {
      if (world.solids().is_inside({x, y, 0.0})) covered += kProbe * kProbe;
    }
  }
  CHECK(covered > 10.0);
  CHECK(static_cast<double>(ground.size()) ==
        doctest::Approx((64.0 * 70.0 - covered) / (spacing * spacing)).epsilon(0.01));

  const Neighbours neighbours(ground, 2.0 * spacing);
  double mean = 0.0;
  for (const Point& p : ground) mean += neighbours.distance(p) / static_cast<double>(ground.size());
  // A regular grid has 1, independent points have 0.5; jittered cells lie between.
  CHECK(mean / spacing > 0.52);
  CHECK(mean / spacing < 0.75);

  double widest = 0.0;  // hole
  for (double x = -30; x < 30; x += 0.31) {
    for (double y = -34; y < -30; y += 0.31) {
      if (!world.solids().is_inside({x, y, 0.0}, SolidIndex::kNone, -0.5)) {
        widest = std::max(widest, neighbours.distance({x, y, 0.0}));
      }
    }
  }
  CHECK(widest < 1.6 * spacing);
}

TEST_CASE("every free face has a point per spacing^2") {
  WorldParams params = test::small_world();
  params.map.point_spacing = 0.15;
  params.map.noise = 0.0;
  const World world = test::make_world(params);
  const PointCloud map = sample_map(world, params.map, params.seed);
  const double spacing = params.map.point_spacing;
  Random random(1);
  double expected_in_all = 0.0, found_in_all = 0.0;
  int checked = 0;
  const auto& solids = world.campus().solids;
  for (std::uint32_t s = 0; s < solids.size(); ++s) {
    for (const Face& face : solids[s].faces) {
      const double expected = area_of(face) / (spacing * spacing);
      if (expected < 60.0) continue;
      bool is_free = true;
      for (int k = 0; k < 500 && is_free; ++k) {
        const std::size_t n =
            2 + static_cast<std::size_t>(random.uniform() *
                                         static_cast<double>(face.corners.size() - 2));
        double u = random.uniform(), v = random.uniform();
        if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
        const Point p = face.corners[0] + u * (face.corners[n - 1] - face.corners[0]) +
                        v * (face.corners[n] - face.corners[0]);
        is_free = p.z() > world.terrain().height(p.head<2>()) && !world.solids().is_inside(p, s);
      }
      if (!is_free) continue;
      const auto found =
          std::count_if(map.begin(), map.end(), [&](const Point& p) { return is_on(face, p); });
      CHECK(static_cast<double>(found) == doctest::Approx(expected).epsilon(0.15));
      expected_in_all += expected;
      found_in_all += static_cast<double>(found);
      ++checked;
    }
  }
  CHECK(checked >= 10);
  CHECK(found_in_all == doctest::Approx(expected_in_all).epsilon(0.02));
}

TEST_CASE("no map point is below the ground, inside a solid or off the campus") {
  const WorldParams params = test::small_world();
  const World world = test::make_world(params);
  const PointCloud map = sample_map(world, params.map, params.seed);
  REQUIRE(map.size() > 60'000);
  const double tolerance = 3.0 * params.map.noise + 1e-6;
  std::size_t below = 0, inside = 0, off = 0, noisy = 0;
  for (const Point& p : map) {
    const double above = p.z() - world.terrain().height(p.x(), p.y());
    if (above < -tolerance * 1.05) ++below;
    if (above < 0.0) ++noisy;
    if (world.solids().is_inside(p, SolidIndex::kNone, tolerance)) ++inside;
    if (std::abs(p.x()) > 32.0 + tolerance || std::abs(p.y()) > 35.0 + tolerance) ++off;
  }
  CHECK(below == 0);
  CHECK(inside == 0);
  CHECK(off == 0);
  CHECK(noisy > map.size() / 10);  // there is noise, on both sides
}

TEST_CASE("the noise of the map has the standard deviation that was asked for") {
  WorldParams params = test::bare_world();
  params.map.noise = 0.05;
  const World world = test::make_world(params);
  double squares = 0.0, count = 0.0;
  for (const Point& p : sample_map(world, params.map, params.seed)) {
    if (std::abs(p.z()) > 0.2) continue;
    squares += p.z() * p.z();
    count += 1.0;
  }
  // Cut off at three standard deviations, that of a normal shrinks by 1.3 %.
  CHECK(std::sqrt(squares / count) == doctest::Approx(0.05).epsilon(0.02));
}

TEST_CASE("what the sensor sees is in the map") {
  const WorldParams params = test::small_world();
  const World world = test::make_world(params);
  const Drive drive = test::make_drive(world, params);
  const PointCloud map = sample_map(world, params.map, params.seed);
  const double reach = 3.0 * params.lidar.range_noise + params.map.point_spacing;
  const Neighbours neighbours(map, reach);
  const Lidar lidar(params.lidar, params.seed);
  const auto share_in_map = [&](const PointCloud& scan, const Pose& T_map_scan) {
    const auto near = std::count_if(scan.begin(), scan.end(), [&](const Point& p) {
      return neighbours.distance(T_map_scan * p) <= reach;
    });
    return static_cast<double>(near) / static_cast<double>(scan.size());
  };
  for (std::size_t k = 0; k < drive.scans(); k += drive.scans() / 6) {
    const PointCloud scan = lidar.scan(world, drive, k);
    const Pose pose = drive.pose(drive.stamp(k));
    CHECK(share_in_map(scan, pose) > 0.95);
    Pose wrong = pose;
    wrong.translation += Point(0.7, 0.7, 0.7);
    CHECK(share_in_map(scan, wrong) < 0.7);
  }
}

TEST_CASE("the map is the same for any number of threads") {
  const WorldParams params = test::small_world();
  const World world = test::make_world(params);
  std::size_t last = 0, total = 0;
  const PointCloud many =
      sample_map(world, params.map, params.seed, [&](std::size_t done, std::size_t of) {
        CHECK(done == last + 1);
        last = done;
        total = of;
      });
  CHECK(last == total);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  CHECK(sample_map(world, params.map, params.seed) == many);
  CHECK(sample_map(world, params.map, params.seed + 1) != many);
  PointCloud streamed;
  REQUIRE(stream_map(world, params.map, params.seed, [&](PointCloud&& piece) -> Result<void> {
    streamed.insert(streamed.end(), piece.begin(), piece.end());
    return {};
  }));
  CHECK(streamed == many);
  std::size_t pieces = 0;
  const auto stopped =
      stream_map(world, params.map, params.seed, [&](PointCloud&&) -> Result<void> {
        ++pieces;
        return fail(ErrorCode::io_failure, "full");
      });
  REQUIRE_FALSE(stopped);
  CHECK(stopped.error().message == "full");
  CHECK(pieces == 1);
}

TEST_CASE("a map far from the origin has the same shape") {
  WorldParams params = test::small_world();
  const PointCloud near = sample_map(test::make_world(params), params.map, params.seed);
  params.campus.origin_x = -1234.5;
  params.campus.origin_y = 5e6;
  params.campus.origin_z = 100.0;
  const PointCloud far = sample_map(test::make_world(params), params.map, params.seed);
  REQUIRE(far.size() == near.size());
  const Point offset(-1234.5, 5e6, 100.0);
  double worst = 0.0;
  for (std::size_t k = 0; k < near.size(); ++k) {
    worst = std::max(worst, (far[k] - offset - near[k]).norm());
  }
  CHECK(worst < 2e-9);
}

}  // namespace
}  // namespace vantage::simulation
