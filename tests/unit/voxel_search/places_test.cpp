#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <numbers>
#include <random>
#include <span>

#include "place_index.hpp"
#include "place_search.hpp"
#include "support/plugins.hpp"
#include "vantage/kit/map_in_memory.hpp"

using namespace vantage;
using namespace vantage::voxel_search;

namespace {

/// Posts and walls at random on flat ground, 120 x 120 m; no two places are alike.
PointCloud town(std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto number = [&](double from, double to) {
    return from + (to - from) * double(random() % 100000) / 1e5;
  };
  PointCloud points;
  for (int i = 0; i < 120; ++i) {
    const Point foot(number(-60, 60), number(-60, 60), 0);
    const double angle = number(0, 3.14), length = number(0, 12), height = number(1, 8);
    for (double along = 0.0; along <= length; along += 0.4) {
      for (double z = 0.2; z < height; z += 0.4) {
        points.push_back(foot + Point(along * std::cos(angle), along * std::sin(angle), z));
      }
    }
  }
  for (double x = -60; x < 60; x += 1.0) {
    for (double y = -60; y < 60; y += 1.0) points.emplace_back(x, y, 0.0);
  }
  return points;
}

/// What stands up within 40 m, in the sensor's frame.
PointCloud seen(const PointCloud& map, const Pose& T_map_scan) {
  PointCloud scan;
  const Pose inverse = T_map_scan.inverse();
  for (const Point& p : map) {
    if (p.z() > 0.5 && (p - T_map_scan.translation).norm() < 40.0) scan.push_back(inverse * p);
  }
  return scan;
}

bool is_at(const PoseCandidate& place, const Pose& truth) {
  return (place.T_map_scan.translation - truth.translation).norm() < 3.0 &&
         rotation_between(place.T_map_scan, truth) < 0.15;
}

std::size_t occupied_of(const PlaceIndex& index) {
  std::size_t occupied = 0;
  for (int z = 0; z < index.size().z(); ++z) {
    for (int y = 0; y < index.size().y(); ++y) {
      for (int x = 0; x < index.size().x(); ++x) occupied += index.occupied({x, y, z}) ? 1 : 0;
    }
  }
  return occupied;
}

bool is_same(const PlaceIndex& a, const PlaceIndex& b) {
  if (a.origin() != b.origin() || a.size() != b.size()) return false;
  for (int z = 0; z < a.size().z(); ++z) {
    for (int y = 0; y < a.size().y(); ++y) {
      if (!std::equal(a.row(y, z), a.row(y, z) + a.words_in_row(), b.row(y, z))) return false;
    }
  }
  return true;
}

}  // namespace

TEST_CASE("an index of places holds the voxels of the points, and keeps them as bytes") {
  const PointCloud map{{100.1, -7.3, 2.2}, {100.2, -7.2, 2.3}, {-31.0, 40.0, 9.0}};
  const PlaceIndex index = PlaceIndex::of(map).value();
  CHECK(occupied_of(index) == 2);
  for (const Point& p : map) {
    const Eigen::Array3d at = ((p - index.origin()) / PlaceIndex::kVoxel).array().floor();
    CHECK(index.occupied(at.cast<int>()));
  }
  const auto bytes = index.encode();
  const auto again = PlaceIndex::decode(bytes);
  REQUIRE(again);
  CHECK(again->encode() == bytes);
  CHECK(again->origin() == index.origin());
  CHECK(again->lowest(PlaceIndex::kMargin, PlaceIndex::kMargin) ==
        index.lowest(PlaceIndex::kMargin, PlaceIndex::kMargin));
}

TEST_CASE("an index of any width comes back from its bytes voxel by voxel") {
  std::mt19937 random(11);
  for (const int width : {1, 63, 64, 65, 200}) {
    CAPTURE(width);
    PointCloud map;
    for (int i = 0; i < 20 * width; ++i) {
      map.emplace_back(PlaceIndex::kVoxel * double(int(random() % std::uint32_t(width))),
                       random() % 50, random() % 9);
    }
    const PlaceIndex index = PlaceIndex::of(map).value();
    const auto again = PlaceIndex::decode(index.encode());
    REQUIRE(again);
    CHECK(is_same(*again, index));
  }
}

TEST_CASE("a block is occupied if one of its eight voxels is") {
  std::mt19937 random(12);
  PointCloud map;
  for (int i = 0; i < 300; ++i) map.emplace_back(random() % 200, random() % 60, random() % 20);
  const PlaceIndex index = PlaceIndex::of(map).value();
  std::size_t occupied = 0;
  for (int z = 0; z < index.size().z(); ++z) {
    for (int y = 0; y < index.size().y(); ++y) {
      for (int x = 0; x < index.size().x(); ++x) {
        bool any = false;
        for (int k = 0; k < 8; ++k)
          any = any || index.occupied({x + k % 2, y + k / 2 % 2, z + k / 4});
        const bool bit = (index.blocks(x % 2, y, z)[x / 128] >> (x / 2 % 64) & 1U) != 0;
        if (bit != any) FAIL_CHECK("at voxel " << x << ", " << y << ", " << z);
        occupied += bit ? 1 : 0;
      }
    }
  }
  CHECK(occupied > 1000);
}

TEST_CASE("an index takes less than two bits for each voxel") {
  const PlaceIndex index = PlaceIndex::of(town(2)).value();
  CHECK(8 * index.encode().size() < 2 * occupied_of(index));
}

TEST_CASE("the bytes of an older version are refused as such") {
  auto bytes = PlaceIndex::of(PointCloud{{0, 0, 0}, {9, 9, 9}})->encode();
  bytes[7] = std::byte{'2'};
  const auto read = PlaceIndex::decode(bytes);
  REQUIRE_FALSE(read);
  CHECK(read.error().message.find("is of another version") != std::string::npos);
}

TEST_CASE("bytes that are no index of places are refused, wherever they are cut or changed") {
  const auto bytes = PlaceIndex::of(PointCloud{{0, 0, 0}, {9, 9, 9}})->encode();
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    const auto cut = PlaceIndex::decode(std::span(bytes).first(n));
    REQUIRE_FALSE(cut);
    CHECK(cut.error().code == ErrorCode::corrupt_data);
  }
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    auto changed = bytes;
    changed[bit / 8] ^= std::byte{1} << (bit % 8);
    const auto decoded = PlaceIndex::decode(changed);
    REQUIRE_FALSE(decoded);
    CHECK(decoded.error().code == ErrorCode::corrupt_data);
  }
  CHECK_FALSE(PlaceIndex::of({}));
  CHECK_FALSE(PlaceIndex::of(PointCloud{{0, 0, 0}, {1e6, 0, 0}}));
}

TEST_CASE(
    "a few bytes cannot ask for much memory, and a map of a few points far apart is refused") {
  CHECK(PlaceIndex::most_memory(0) == std::uint64_t{64} << 20U);
  CHECK(PlaceIndex::most_memory(1'000'000'000) == std::uint64_t{1} << 30U);
  CHECK(PlaceIndex::most_memory(~std::uint64_t{0}) == std::uint64_t{1} << 30U);
  // 32768 voxels along each edge: 4 TiB of bits.
  auto bytes = PlaceIndex::of(PointCloud{{0, 0, 0}, {9, 9, 9}})->encode();
  const std::int32_t edge = 32768;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::memcpy(bytes.data() + 20 + 4 * axis, &edge, sizeof(edge));
  }
  const auto forged = PlaceIndex::decode(bytes);
  REQUIRE_FALSE(forged);
  CHECK(forged.error().code == ErrorCode::corrupt_data);
  CHECK(forged.error().message ==
        "the bundle's index of places claims a size that its voxels do not need");

  const auto sparse = PlaceIndex::of(PointCloud{{0, 0, 0}, {30e3, 30e3, 30e3}});
  REQUIRE_FALSE(sparse);
  CHECK(sparse.error().code == ErrorCode::unsupported);
  CHECK(sparse.error().message.find("too large for one index of places") != std::string::npos);
  CHECK(PlaceIndex::of(PointCloud{{0, 0, 0}, {30e3, 0, 0}}));  // a long road is none of that

  auto longer = PlaceIndex::of(PointCloud{{0, 0, 0}, {9, 9, 9}})->encode();
  longer.push_back(std::byte{1});
  CHECK_FALSE(PlaceIndex::decode(longer));
}

TEST_CASE("a search counts its work, the same each time, and more in a larger area") {
  const PlaceIndex index = PlaceIndex::of(town(5)).value();
  const PointCloud scan = seen(town(5), pose_from_xyz_rpy({3, 4, 1.5}, {0, 0, 1}));
  const auto all = find_places(index, scan, {}, 5), again = find_places(index, scan, {}, 5);
  CHECK(all.words > 0);
  CHECK(all.words == again.words);
  CHECK(find_places(index, scan, {.centre = {3, 4}, .radius = 9.0}, 5).words < all.words);
}

TEST_CASE("a scan is found among all places and headings, and within an area") {
  const PointCloud map = town(3);
  const PlaceIndex index = PlaceIndex::of(map).value();
  for (const auto& [x, y, yaw] :
       {std::array{10.0, -20.0, 1.0}, {-30.0, 5.0, -2.5}, {0.0, 33.0, 3.1}}) {
    const Pose truth = pose_from_xyz_rpy({x, y, 1.5}, {0, 0, yaw});
    const PointCloud scan = seen(map, truth);
    const auto places = find_places(index, scan, {}, 5).places;
    REQUIRE_FALSE(places.empty());
    CHECK(is_at(places.front(), truth));
    CHECK(places.front().score > 0.2);
    for (std::size_t k = 1; k < places.size(); ++k) {
      CHECK(places[k].score <= places[k - 1].score);
      const Pose &best = places[0].T_map_scan, &other = places[k].T_map_scan;
      const double apart = (best.translation - other.translation).norm();
      CHECK((apart >= 3.0 || rotation_between(best, other) >= 0.2));
    }
    const auto near =
        find_places(index, scan,
                    {.centre = {x + 4.0, y}, .radius = 9.0, .heading = yaw, .heading_within = 0.3},
                    5)
            .places;
    REQUIRE_FALSE(near.empty());
    CHECK(is_at(near.front(), truth));
    for (const PoseCandidate& place :
         find_places(index, scan, {.centre = {x + 30.0, y}, .radius = 9.0}, 5).places) {
      CHECK((place.T_map_scan.translation.head<2>() - Eigen::Vector2d(x + 30.0, y)).norm() < 15.0);
    }
  }
}

TEST_CASE("a limit of the heading is one of the sensor's x axis, however the sensor is mounted") {
  constexpr double kHalfTurn = std::numbers::pi;
  const PointCloud map = town(3);
  const auto relocalizer = test::plugin<Relocalizer>("voxel_search");
  const auto bytes = relocalizer->index(MapInMemory(map)).value();
  const auto index = relocalizer->open(bytes).value();
  for (const auto& [roll, pitch] : {std::array{0.0, 0.0},
                                    {kHalfTurn, 0.0},
                                    {kHalfTurn - 0.05, 0.03},
                                    {0.0, kHalfTurn},
                                    {0.5 * kHalfTurn, 0.0},
                                    {2.2, 0.6},
                                    {0.0, 0.5 * kHalfTurn}}) {
    CAPTURE(roll);
    CAPTURE(pitch);
    for (const double yaw : {1.0, -2.5, 0.1}) {
      const Pose truth = pose_from_xyz_rpy({10.0, -20.0, 1.5}, {roll, pitch, yaw});
      const Eigen::Vector3d x_axis = truth.rotation * Eigen::Vector3d::UnitX();
      const PlaceQuery query{.area = {.centre = {14.0, -20.0},
                                      .radius = 9.0,
                                      .heading = std::atan2(x_axis.y(), x_axis.x()),
                                      .heading_within = 0.3},
                             .up = truth.rotation.inverse() * Eigen::Vector3d::UnitZ()};
      const auto places = index->find(seen(map, truth), query).value().poses;
      REQUIRE_FALSE(places.empty());
      CHECK(is_at(places.front(), truth));
    }
  }
}

TEST_CASE("the bits count what a point by point search counts") {
  const PointCloud map = town(7);
  const PlaceIndex index = PlaceIndex::of(map).value();
  const Pose truth = pose_from_xyz_rpy({-12.0, 8.0, 1.5}, {0, 0, 0.0});
  const auto places = find_places(index, seen(map, truth), {}, 1).places;
  REQUIRE(places.size() == 1);
  CHECK(is_at(places.front(), truth));
}

TEST_CASE("an area off the map has no places, and one at its edge only its own") {
  const PointCloud map = town(7);
  const PlaceIndex index = PlaceIndex::of(map).value();
  const Pose truth = pose_from_xyz_rpy({-50.0, 8.0, 1.5}, {0, 0, 0.5});
  const PointCloud scan = seen(map, truth);
  const Point low = index.origin() + Point::Constant(PlaceIndex::kMargin * PlaceIndex::kVoxel);
  for (const Eigen::Vector2d& away : {Eigen::Vector2d(-200, 0), {0, 200}, {0, -200}, {9e9, 9e9}}) {
    const Eigen::Vector2d centre = Eigen::Vector2d(-50.0, 8.0) + away;
    CHECK(find_places(index, scan, {.centre = centre, .radius = 60.0}, 5).places.empty());
  }
  const auto places =
      find_places(index, scan, {.centre = {low.x() - 30.0, 8.0}, .radius = 45.0}, 5).places;
  REQUIRE_FALSE(places.empty());
  for (const PoseCandidate& place : places) {
    CHECK(place.T_map_scan.translation.x() < low.x() + 15.0 + PlaceIndex::kVoxel);
  }
}

TEST_CASE("nothing is found for an empty scan") {
  const PlaceIndex index = PlaceIndex::of(town(1)).value();
  CHECK(find_places(index, {}, {}, 5).places.empty());
}
