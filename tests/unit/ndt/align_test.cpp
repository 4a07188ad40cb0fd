// What ndt promises beyond what every matcher does, through the loaded plugin.
#include <doctest/doctest.h>
#include <array>
#include <cmath>
#include <random>
#include <string>

#include "common/ndt_coefficients.hpp"
#include "matchers.hpp"
#include "support/plugins.hpp"

namespace vantage {
namespace {

using test::aligned, test::kYardPose, test::metres_off, test::yard_scene;

constexpr std::array kModes{"direct7", "direct1", "direct26", "kdtree"};

std::string mode_toml(const std::string& mode) { return "neighbours = \"" + mode + "\""; }

}  // namespace

TEST_CASE("aligning again from the answer changes nothing to speak of") {
  const auto target = test::prepared(yard_scene().map);
  const Alignment once = aligned(*target, yard_scene().scan, kYardPose);
  const Alignment twice = aligned(*target, yard_scene().scan, once.T_map_scan);
  CHECK((once.T_map_scan.translation - twice.T_map_scan.translation).norm() < 1e-3);
  CHECK(rotation_between(once.T_map_scan, twice.T_map_scan) < 1e-4);
}

TEST_CASE("a map without a voxel of enough points is an error") {
  for (const PointCloud& map :
       {PointCloud{{0.0, 0.0, 0.0}, {5.0, 0.0, 0.0}}, PointCloud(100, Point(1.0, 1.0, 1.0))}) {
    CHECK(test::refusal_of_map("ndt", map).code == ErrorCode::too_few_matches);
  }
}

TEST_CASE("degenerate worlds end with a valid pose or an error") {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> unit(-10.0, 10.0);
  const auto cloud = [&](bool x, bool y) {
    PointCloud points;
    for (int i = 0; i < 20000; ++i) {
      points.emplace_back(x ? unit(random) : 0.3, y ? unit(random) : 0.3, 0.5);
    }
    return points;
  };
  const Pose guess = pose_from_xyz_rpy({0.1, 0.2, 0.1}, {0.01, -0.01, 0.05});
  for (const std::string mode : kModes) {
    CAPTURE(mode);
    for (const bool plane : {true, false}) {
      CAPTURE(plane);
      const PointCloud scan = cloud(true, plane);
      const auto alignment =
          test::prepared(cloud(true, plane), mode_toml(mode))->align(scan, guess);
      REQUIRE(alignment);
      CHECK(is_valid(alignment->T_map_scan));
      CHECK(alignment->hessian.allFinite());
      CHECK(std::isfinite(alignment->score.fitness));
      // What the plane or line tells is found, what it does not stays near the guess.
      CHECK(std::abs((alignment->T_map_scan * Point(0.0, 0.3, 0.5)).z() - 0.5) < 0.01);
      CHECK(metres_off(*alignment, guess) < 1.0);
    }
    PointCloud dot;
    for (int i = 0; i < 100; ++i) dot.emplace_back(0.3 + 1e-4 * unit(random), 0.3, 0.5);
    const auto alignment =
        test::prepared(dot, mode_toml(mode))->align(PointCloud(100, Point(0.3, 0.3, 0.5)), Pose{});
    REQUIRE(alignment);
    CHECK(is_valid(alignment->T_map_scan));
  }
}

TEST_CASE("coefficients are derived or given") {
  const auto fitness = [&](const std::string& toml) {
    return test::prepared(yard_scene().map, toml)
        ->score(yard_scene().scan, kYardPose)
        .value()
        .fitness;
  };
  const auto d = matching::NdtCoefficients::derive(0.3, 1.0).value();
  const auto given = [](double d1, double d2, double d3) {
    return "d1 = " + std::to_string(d1) + "\nd2 = " + std::to_string(d2) +
           "\nd3 = " + std::to_string(d3);
  };
  CHECK(fitness("outlier_ratio = 0.3") ==
        doctest::Approx(fitness(given(d.d1, d.d2, d.d3))).epsilon(1e-5));
  CHECK(fitness("outlier_ratio = 0.3") != doctest::Approx(fitness("")));
  // d1, d2, d3 as the paper prints them bound the score of matched points.
  const double printed = fitness(given(0.00354, 0.432, -2.74));
  CHECK(printed > 2.7365 * 0.8);
  CHECK(printed < 2.74);

  // d1 scales the objective, and its sign does not turn it round.
  std::mt19937 random(9);
  const Pose guess = test::disturbed(kYardPose, 0.2, 1.0, random);
  for (const double d1 : {0.00354, -5.0}) {
    const auto target = test::prepared(yard_scene().map, given(d1, 0.432, -2.74));
    const Alignment alignment = aligned(*target, yard_scene().scan, guess);
    CHECK(metres_off(alignment, kYardPose) < 0.01);
  }
}

}  // namespace vantage
