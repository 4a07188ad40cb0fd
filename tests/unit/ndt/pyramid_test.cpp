// The coarse levels: what they are made of, and from how far off they lead to the pose.
#include "pyramid.hpp"

#include <doctest/doctest.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "matchers.hpp"
#include "support/plugins.hpp"

namespace vantage {
namespace {

using ndt::kNoGaussian, ndt::VoxelMap, test::aligned, test::kYardPose, test::yard_scene;

constexpr double kPi = std::numbers::pi;

/// Every voxel of 0.5 m that has a point has many: none is lost before voxels are merged.
PointCloud dense(const Point& corner) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(0.0, 0.5);
  PointCloud cloud;
  for (int x = 0; x < 9; ++x) {
    for (int y = 0; y < 7; ++y) {
      const Point at = corner + 0.5 * Point(x, y, (x * y) % 5);
      for (int i = 0; i < 60; ++i) {
        cloud.push_back(at + Point(unit(random), unit(random), 0.3 * unit(random)));
      }
    }
  }
  return cloud;
}

Eigen::Matrix3d precision_of(const ndt::Cell& cell) {
  const ndt::Gaussian g = ndt::gaussian_of(cell);
  Eigen::Matrix3d c;
  c << g.xx, g.xy, g.xz, g.xy, g.yy, g.yz, g.xz, g.yz, g.zz;
  return c;
}

/// The voxel's lower corner in the map frame, in its edges.
Eigen::Vector3d lower_corner(const VoxelMap& map, std::size_t i) {
  return map.origin_voxel() + VoxelMap::corner_of(map.keys()[i]);
}

std::vector<Pose> off_by(double metres, double degrees, int directions) {
  std::vector<Pose> guesses;
  for (int k = 0; k < directions; ++k) {
    const double direction = 2.0 * kPi * k / directions;
    const double yaw = (k % 2 == 0 ? 1.0 : -1.0) * degrees * kPi / 180.0;
    Pose guess = kYardPose;
    guess.rotation = rotation_from_vector({0.0, 0.0, yaw}) * kYardPose.rotation;
    guess.translation += metres * Point(std::cos(direction), std::sin(direction), 0.0);
    guesses.push_back(guess);
  }
  return guesses;
}

int arrived(const MatchTarget& target, const std::vector<Pose>& guesses) {
  int count = 0;
  for (const Pose& guess : guesses) {
    const Alignment alignment = aligned(target, yard_scene().scan, guess);
    if (test::metres_off(alignment, kYardPose) < 0.02 &&
        test::degrees_off(alignment, kYardPose) < 0.1) {
      ++count;
    }
  }
  return count;
}

bool same_answer(const Alignment& a, const Alignment& b) {
  return a.T_map_scan.translation == b.T_map_scan.translation &&
         a.T_map_scan.rotation.coeffs() == b.T_map_scan.rotation.coeffs() &&
         a.hessian == b.hessian && a.iterations == b.iterations && a.termination == b.termination;
}

}  // namespace

TEST_CASE("merged voxels have the Gaussians of their points") {
  // Corners on both sides of zero, and with even and odd origins.
  for (const Point& at : {Point(0.0, 0.0, 0.0), Point(-7.5, -3.0, -1.5), Point(1e6, -5e6, 100.5)}) {
    CAPTURE(at.x());
    const PointCloud cloud = dense(at);
    VoxelMap merged = VoxelMap::build(cloud, {.resolution = 0.5, .eigenvalue_floor = 1e-6}).value();
    for (const double edge : {1.0, 2.0, 4.0}) {
      CAPTURE(edge);
      merged = merged.merged();
      const auto built = VoxelMap::build(cloud, {.resolution = edge, .eigenvalue_floor = 1e-6});
      REQUIRE(built);
      CHECK(merged.options() == built->options());
      REQUIRE(merged.cells().size() == built->cells().size());
      for (std::size_t i = 0; i < merged.cells().size(); ++i) {
        const Point centre = (lower_corner(merged, i).array() + 0.5) * edge;
        const std::uint32_t other = built->find(built->key_of(centre));
        REQUIRE(other != kNoGaussian);
        const ndt::Cell &a = merged.cells()[i], &b = built->cells()[other];
        CHECK(a.points == b.points);
        CHECK((ndt::gaussian_of(a).mean - ndt::gaussian_of(b).mean).norm() < 5e-5);
        CHECK((precision_of(a) * precision_of(b).inverse()).isIdentity(5e-3));
      }
    }
  }
}

TEST_CASE("merging keeps every Gaussian's points, also as many as fit in no cell") {
  const VoxelMap map = VoxelMap::build(test::yard(1), {}).value();
  const VoxelMap coarse = map.merged();
  std::size_t points = 0, merged = 0;
  for (const ndt::Cell& cell : map.cells()) points += cell.points;
  for (const ndt::Cell& cell : coarse.cells()) merged += cell.points;
  CHECK(points == merged);
  CHECK(coarse.cells().size() < map.cells().size() / 2);

  PageVector<ndt::Cell> full(map.cells().begin(), map.cells().end());
  for (ndt::Cell& cell : full) cell.points = ~std::uint32_t{0};
  const VoxelMap fullest =
      VoxelMap(map.options(), map.origin_voxel(), {map.keys().begin(), map.keys().end()}, full)
          .merged();
  CHECK(fullest.cells().size() == coarse.cells().size());
  for (const ndt::Cell& cell : fullest.cells()) CHECK(cell.points == ~std::uint32_t{0});
}

TEST_CASE("guesses 3 m and 10 degrees off arrive; with one level they do not") {
  const std::vector<Pose> guesses = off_by(3.0, 10.0, 24);
  for (const std::string toml :
       {"", "neighbours = \"direct1\"", "optimizer = \"gauss_newton\"",
        "d1 = -2.0\nd2 = 0.4\nd3 = 0.6", "resolution = 0.5", "min_points_per_voxel = 3"}) {
    CAPTURE(toml);
    CHECK(arrived(*test::prepared(yard_scene().map, toml), guesses) == 24);
  }
  CHECK(arrived(*test::prepared(yard_scene().map, "levels = 1"), guesses) < 12);
}

TEST_CASE("near guesses need no coarse levels, and end as without them") {
  const auto with = test::prepared(yard_scene().map);
  const auto without = test::prepared(yard_scene().map, "levels = 1");
  const std::size_t bytes = with->bytes();
  for (const Pose& guess : off_by(0.05, 0.1, 8)) {
    CHECK(same_answer(aligned(*with, yard_scene().scan, guess),
                      aligned(*without, yard_scene().scan, guess)));
  }
  CHECK(with->bytes() == bytes);
  (void)aligned(*with, yard_scene().scan, off_by(3.0, 10.0, 1).front());
  CHECK(with->bytes() > bytes + bytes / 10);
  CHECK(with->bytes() < 2 * bytes);
}

TEST_CASE("a restored map has the coarse levels of the map that was stored") {
  const auto matcher = test::plugin<ScanMatcher>("ndt");
  const auto whole = test::prepared(yard_scene().map);
  const auto excerpt = whole->excerpt(yard_scene().map);
  REQUIRE(excerpt);
  REQUIRE(excerpt->elements == whole->elements());
  auto restored = matcher->restore(excerpt->bytes);
  REQUIRE(restored);
  const auto again = in_library_of(matcher, *std::move(restored));
  for (const Pose& guess : off_by(3.0, 10.0, 8)) {
    CHECK(same_answer(aligned(*again, yard_scene().scan, guess),
                      aligned(*whole, yard_scene().scan, guess)));
  }
  CHECK(again->bytes() == whole->bytes());
}

TEST_CASE("far guesses end in the same bits for any number of threads, also the first ones") {
  const std::vector<Pose> guesses = off_by(3.0, 10.0, 16);
  const auto plain = test::prepared(yard_scene().map);
  std::vector<Alignment> expected;
  for (const Pose& guess : guesses) expected.push_back(aligned(*plain, yard_scene().scan, guess));
  for (const std::size_t threads : {1, 2, 4}) {
    CAPTURE(threads);
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    for (int repeat = 0; repeat < 5; ++repeat) {
      const auto target = test::prepared(yard_scene().map);  // all want its levels at once
      std::vector<Alignment> ended(guesses.size());
      tbb::parallel_for(std::size_t{0}, guesses.size(), [&](std::size_t i) {
        ended[i] = aligned(*target, yard_scene().scan, guesses[i]);
      });
      for (std::size_t i = 0; i < guesses.size(); ++i) CHECK(same_answer(ended[i], expected[i]));
    }
  }
}

TEST_CASE("steps through coarse levels keep the limit of iterations") {
  const Pose guess = off_by(3.0, 10.0, 1).front();
  for (const std::uint32_t most : {1U, 2U, 5U, 12U}) {
    CAPTURE(most);
    const auto target =
        test::prepared(yard_scene().map, "max_iterations = " + std::to_string(most));
    CHECK(aligned(*target, yard_scene().scan, guess).iterations <= most);
  }
}

TEST_CASE("a wall alone or a scan of a few points leads nowhere that the guess is not") {
  std::mt19937 random(12);
  std::uniform_real_distribution<double> unit(-15.0, 15.0);
  PointCloud wall;
  for (int i = 0; i < 30000; ++i) wall.emplace_back(unit(random), 4.0, 0.2 * unit(random));
  const auto target = test::prepared(wall);
  Pose guess;
  guess.translation = Point(0.5, 1.5, 0.0);
  const Alignment alignment = aligned(*target, wall, guess);
  CHECK(is_valid(alignment.T_map_scan));
  CHECK(std::abs(alignment.T_map_scan.translation.y()) < 0.02);
  CHECK(std::abs(alignment.T_map_scan.translation.x() - 0.5) < 1.0);

  const auto yard = test::prepared(yard_scene().map, "min_matches = 3");
  const PointsView few = PointsView(yard_scene().scan).first(6);
  const auto ended = yard->align(few, kYardPose);
  if (ended) CHECK(is_valid(ended->T_map_scan));
  CHECK(test::prepared(yard_scene().map)->align(few, kYardPose).error().code ==
        ErrorCode::too_few_matches);
}

}  // namespace vantage
