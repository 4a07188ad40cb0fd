#include <doctest/doctest.h>

#include "fakes.hpp"
#include "post_world.hpp"
#include "vantage/engine/localizer.hpp"

using namespace vantage;

namespace {

using World = test::PostWorld;
using test::at_x;

/// The correction of the second scan, 0.6 s and 1.9 m after a start. The matcher finds the truth
/// only from less than 0.6 m away.
double error_after_start(const std::optional<Pose>& before, const std::optional<Pose>& now) {
  World world;
  LocalizerParams params;
  params.recovery_radius = 0.0;
  world.truth->reach = 0.6;
  Localizer localizer = world.localizer(params);
  REQUIRE(localizer.start(at_x(1)));
  world.at(localizer, 0.0, 1.0, before);
  return std::abs(world.at(localizer, 0.6, 2.9, now).T_map_scan.translation.x() - 2.9);
}

}  // namespace

TEST_CASE("a sensor that moves when it starts is matched all around its first pose") {
  CHECK(error_after_start({}, {}) < 1e-4);
}

TEST_CASE("odometry says how far the sensor came: it is matched there alone") {
  const Pose wrong;  // says that the sensor stands still
  CHECK(error_after_start(wrong, wrong) == doctest::Approx(1.9));
  CHECK(error_after_start(wrong, at_x(1.9)) < 1e-9);
}

TEST_CASE("without odometry, the risk of a pose that no scan corrects grows with time") {
  World world;
  Localizer localizer = world.localizer();
  REQUIRE(localizer.start(at_x(1)));
  world.at(localizer, 0.0, 1.0);
  const double tracked = world.at(localizer, 0.1, 1.1).risk;
  world.truth->coverage = 0.05;
  double risk = tracked;
  for (int k = 2; k < 5; ++k) {
    const double next = world.at(localizer, 0.1 * k, 1.0 + 0.1 * k).risk;
    CHECK(next >= risk);
    risk = next;
  }
  CHECK(risk > 10.0 * tracked);
}
