// What icp and gicp promise beyond what every matcher does, through the loaded plugins.
#include <doctest/doctest.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "matchers.hpp"
#include "support/plugins.hpp"

namespace vantage {
namespace {

using test::aligned, test::kYardPose, test::metres_off, test::prepared_by, test::yard_scene;

constexpr std::array kMatchers{"icp", "gicp"};

PluginPtr<MatchTarget> restored_from(const std::string& name, const std::vector<std::byte>& bytes,
                                     const std::string& voxel) {
  const auto matcher = test::plugin<ScanMatcher>(name, "map_voxel = " + voxel);
  return in_library_of(matcher, matcher->restore(bytes).value());
}

}  // namespace

TEST_CASE("a distance that shrinks has reached its end before an alignment has") {
  for (const std::string matcher : kMatchers) {
    CAPTURE(matcher);
    const auto target = prepared_by(matcher, yard_scene().map);
    std::mt19937 random(2);
    const Pose guess = test::disturbed(kYardPose, 0.4, 2.0, random);
    const Pose found = aligned(*target, yard_scene().scan, guess).T_map_scan;
    const auto shrinking =
        prepared_by(matcher, yard_scene().map, "max_distance = 3.2\nfinal_distance = 0.1");
    CHECK(aligned(*shrinking, yard_scene().scan, found).iterations >= 6);
    CHECK(aligned(*target, yard_scene().scan, found).iterations <= 2);
  }
}

TEST_CASE("a guess that is far off leads to the pose in maps of any density") {
  for (const std::string matcher : kMatchers) {
    for (const std::string voxel : {"0.0", "0.25", "0.5", "0.7", "1.0"}) {
      CAPTURE(matcher);
      CAPTURE(voxel);
      const auto target = prepared_by(matcher, yard_scene().map, "map_voxel = " + voxel);
      const auto restored =
          restored_from(matcher, target->excerpt(yard_scene().map).value().bytes, voxel);
      for (const double yaw : {0.3, 2.0, 4.5}) {
        CAPTURE(yaw);
        Pose guess = kYardPose * pose_from_xyz_rpy({}, {0.0, 0.0, std::numbers::pi / 36.0});
        guess.translation += Eigen::Vector3d(2.0 * std::cos(yaw), 2.0 * std::sin(yaw), 0.0);
        CHECK(metres_off(aligned(*target, yard_scene().scan, guess), kYardPose) < 0.1);
        CHECK(metres_off(aligned(*restored, yard_scene().scan, guess), kYardPose) < 0.1);
      }
    }
  }
}

TEST_CASE("the Hessian grows with the precision that sigma states") {
  for (const std::string matcher : kMatchers) {
    CAPTURE(matcher);
    const auto hessian = [&](const std::string& sigma) {
      // Without a loss that turns at a number of sigmas the pose is the same.
      return aligned(*prepared_by(matcher, yard_scene().map, "kernel = \"none\"\nsigma = " + sigma),
                     yard_scene().scan, kYardPose)
          .hessian;
    };
    const Alignment::Hessian coarse = hessian("0.1"), fine = hessian("0.05");
    CHECK((fine - 4.0 * coarse).norm() < 1e-6 * fine.norm());
  }
}

TEST_CASE("a robust loss keeps what has moved from pulling the pose") {
  PointCloud map = yard_scene().map;
  for (Point& p : map) {
    if (p.y() > 11.5 && p.z() > 1.0 && p.x() < -4.0) p.y() += 0.4;  // a part of a wall
  }
  for (const std::string matcher : kMatchers) {
    CAPTURE(matcher);
    const auto error = [&](const std::string& toml) {
      return metres_off(aligned(*prepared_by(matcher, map, toml), yard_scene().scan, kYardPose),
                        kYardPose);
    };
    const double plain = error("kernel = \"none\"");
    CHECK(plain > 0.05);
    CHECK(error("kernel = \"huber\"\nkernel_scale = 1.0") < 0.8 * plain);
    CHECK(error("") < 0.25 * plain);
  }
}

TEST_CASE("a map that is too wide, and one without a surface, are errors") {
  for (const std::string matcher : kMatchers) {
    CAPTURE(matcher);
    CHECK(test::refusal_of_map(matcher, PointCloud{{0.0, 0.0, 0.0}, {1e7, 0.0, 0.0}}).code ==
          ErrorCode::invalid_input);
  }
  PointCloud line;
  for (int i = 0; i < 500; ++i) line.emplace_back(0.1 * i, 0.2 * i, 0.0);
  for (const PointCloud& map : {line, PointCloud(100, Point(1.0, 1.0, 1.0))}) {
    const Error error = test::refusal_of_map("icp", map);
    CHECK(error.code == ErrorCode::too_few_matches);
    CHECK(error.message.find("no surface") != std::string::npos);
  }
}

TEST_CASE("degenerate worlds end with a valid pose or an error") {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> unit(-10.0, 10.0);
  PointCloud plane, line;
  for (int i = 0; i < 20000; ++i) {
    plane.emplace_back(unit(random), unit(random), 0.5);
    line.emplace_back(unit(random), 0.3, 0.5);
  }
  const Pose guess = pose_from_xyz_rpy({0.1, 0.2, 0.1}, {0.01, -0.01, 0.05});
  for (const std::string matcher : kMatchers) {
    CAPTURE(matcher);
    const Alignment on_plane = aligned(*prepared_by(matcher, plane), plane, guess);
    // What the plane tells is found, what it does not stays near the guess.
    CHECK(std::abs((on_plane.T_map_scan * Point(0.0, 0.3, 0.5)).z() - 0.5) < 0.01);
    CHECK(metres_off(on_plane, guess) < 1.0);
  }
  const Alignment on_line = aligned(*prepared_by("gicp", line), line, guess);
  CHECK(is_valid(on_line.T_map_scan));
  const Point middle = on_line.T_map_scan * Point(0.0, 0.3, 0.5);
  CHECK((middle.tail<2>() - Eigen::Vector2d(0.3, 0.5)).norm() < 0.01);
  const auto on_dot = prepared_by("gicp", PointCloud(100, Point(0.3, 0.3, 0.5)))
                          ->align(PointCloud(100, Point(0.3, 0.3, 0.6)), Pose{});
  REQUIRE(on_dot);
  CHECK(is_valid(on_dot->T_map_scan));
}

TEST_CASE("a target says what it holds") {
  const auto thinned = test::thinned(yard_scene().map, 0.25).size();
  for (const std::string matcher : kMatchers) {
    CAPTURE(matcher);
    const auto coarse = prepared_by(matcher, yard_scene().map);
    const auto fine = prepared_by(matcher, yard_scene().map, "map_voxel = 0.0");
    CHECK(coarse->elements() == thinned);
    CHECK(fine->elements() == yard_scene().map.size());
    for (const auto* target : {coarse.get(), fine.get()}) {
      CHECK(target->bytes() > 48 * target->elements());
      CHECK(target->bytes() < 100 * target->elements());
    }
  }
}

}  // namespace vantage
