#include <doctest/doctest.h>
#include <algorithm>
#include <random>
#include <string>

#include "scenes.hpp"

namespace vantage {

TEST_CASE("100 random offsets of a recorded scan pair are recovered to 2 cm and 0.1 degrees") {
  const auto pair = test::recorded_pair();
  if (!pair) return;
  for (const std::string mode : {"direct7", "direct26", "kdtree"}) {
    CAPTURE(mode);
    const auto target = test::prepared(pair->map, "neighbours = \"" + mode + "\"");
    const auto unperturbed = target->align(pair->scan, pair->T_map_scan);
    REQUIRE(unperturbed);
    CHECK((unperturbed->T_map_scan.translation - pair->T_map_scan.translation).norm() < 0.1);
    std::mt19937 random(2026);
    double worst_metres = 0.0, worst_degrees = 0.0;
    for (int i = 0; i < 100; ++i) {
      const auto found =
          target->align(pair->scan, test::disturbed(pair->T_map_scan, 0.5, 3.0, random));
      REQUIRE(found);
      worst_metres =
          std::max(worst_metres,
                   (found->T_map_scan.translation - unperturbed->T_map_scan.translation).norm());
      worst_degrees =
          std::max(worst_degrees,
                   test::degrees(rotation_between(found->T_map_scan, unperturbed->T_map_scan)));
    }
    MESSAGE(mode, ": worst ", worst_metres, " m, ", worst_degrees, " degrees");
    CHECK(worst_metres < 0.02);
    CHECK(worst_degrees < 0.1);
  }
}

}  // namespace vantage
