#include <doctest/doctest.h>
#include <algorithm>
#include <random>
#include <string>

#include "matchers.hpp"

namespace vantage {

TEST_CASE("random offsets of a recorded scan pair are recovered to 2 cm and 0.1 degrees" *
          doctest::test_suite("slow")) {
  const auto pair = test::recorded_pair();
  if (!pair) return;
  struct Way {
    std::string matcher, toml;
    int offsets;
  };
  for (const auto& [matcher, toml, offsets] :
       {Way{"icp", "", 30}, Way{"gicp", "", 30}, Way{"ndt", "neighbours = \"direct7\"", 100},
        Way{"ndt", "neighbours = \"direct26\"", 100}, Way{"ndt", "neighbours = \"kdtree\"", 100}}) {
    CAPTURE(matcher);
    CAPTURE(toml);
    const auto target = test::prepared_by(matcher, pair->map, toml);
    const Alignment unperturbed = test::aligned(*target, pair->scan, pair->T_map_scan);
    CHECK(test::metres_off(unperturbed, pair->T_map_scan) < 0.1);
    std::mt19937 random(2026);
    double worst_metres = 0.0, worst_degrees = 0.0;
    for (int i = 0; i < offsets; ++i) {
      const Alignment found =
          test::aligned(*target, pair->scan, test::disturbed(pair->T_map_scan, 0.5, 3.0, random));
      worst_metres = std::max(worst_metres, test::metres_off(found, unperturbed.T_map_scan));
      worst_degrees = std::max(worst_degrees, test::degrees_off(found, unperturbed.T_map_scan));
    }
    MESSAGE(matcher, " ", toml, ": worst ", worst_metres, " m, ", worst_degrees, " degrees");
    CHECK(worst_metres < 0.02);
    CHECK(worst_degrees < 0.1);
  }
}

TEST_CASE("the localizer's limit on nvtl tells a recorded scan's pose from one a metre off") {
  const auto pair = test::recorded_pair();
  if (!pair) return;
  constexpr double kMinNvtl = 0.5;  // LocalizerParams::min_nvtl
  const Eigen::Vector3d direction = Eigen::Vector3d(0.7, -0.5, 0.3).normalized();
  for (const std::string matcher : {"ndt", "icp", "gicp"}) {
    CAPTURE(matcher);
    const auto target = test::prepared_by(matcher, pair->map);
    const ScanScore best = target->score(pair->scan, pair->T_map_scan).value();
    MESSAGE(matcher, ": fitness ", best.fitness, ", nvtl ", best.nvtl, ", coverage ",
            best.coverage);
    CHECK(best.nvtl > 1.5 * kMinNvtl);
    CHECK(best.coverage > 0.8);
    for (const double metres : {1.0, 2.0, 5.0}) {
      Pose pose = pair->T_map_scan;
      pose.translation += metres * direction;
      const ScanScore score = target->score(pair->scan, pose).value();
      MESSAGE(metres, " m off: fitness ", score.fitness, ", nvtl ", score.nvtl, ", coverage ",
              score.coverage);
      CHECK(score.nvtl < 0.8 * kMinNvtl);
    }
  }
}

}  // namespace vantage
