#include <doctest/doctest.h>

#include "support/fakes.hpp"
#include "support/post_world.hpp"
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
  CHECK(error_after_start(wrong, at_x(1.9)) < 1e-4);
}

TEST_CASE("odometry that jumps does not carry the prediction away, and the report says so") {
  World world;
  Localizer localizer = world.localizer();
  REQUIRE(localizer.start(at_x(1)));
  const auto x = [](int scan) { return 1.0 + 0.15 * scan; };
  for (int i = 0; i < 12; ++i) {
    CHECK(world.at(localizer, 0.1 * i, x(i), at_x(x(i))).seconds_doubted == 0.0);
  }
  const ScanReport jumped = world.at(localizer, 1.2, x(12), at_x(x(12) + 3.0));
  CHECK(jumped.seconds_doubted == doctest::Approx(0.1));
  CHECK(std::abs(jumped.T_map_scan_predicted.translation.x() - x(12)) < 0.1);
  CHECK(world.at(localizer, 1.3, x(13), at_x(x(13) + 3.0)).tracking == Tracking::tracked);
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

TEST_CASE(
    "a pause of an hour does not carry the pose away, and what it predicts is no longer sure") {
  World world;
  LocalizerParams params;
  params.recovery_radius = 0.0;
  Localizer localizer = world.localizer(params);
  REQUIRE(localizer.start(at_x(1)));
  for (int i = 0; i < 5; ++i) world.at(localizer, 0.1 * i, 1.0 + 0.15 * i);  // 1.5 m/s
  world.truth->overlap = false;
  const ScanReport blind = world.at(localizer, 3600.0, 1.6);
  CHECK(std::abs(blind.T_map_scan_predicted.translation.x() - 1.6) < 20.0);  // it was 5.4 km
  CHECK(blind.risk > 0.5);
}

TEST_CASE("samples that come after their scan are counted, and damaged ones are errors") {
  World world;
  Localizer localizer = world.localizer();
  REQUIRE(localizer.start(at_x(1)));
  CHECK(world.at(localizer, 1.0, 1.0, at_x(1)).dropped_samples == 0);
  REQUIRE(localizer.add(OdometrySample{0.9, at_x(0.9)}));
  REQUIRE(localizer.add(ImuSample{0.95, {}, {0, 0, 9.8}}));
  ImuSample damaged{1.05, {}, {0, 0, 9.8}};
  damaged.angular_velocity.x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(localizer.add(damaged).error().code == ErrorCode::invalid_input);
  CHECK(world.at(localizer, 1.1, 1.1, at_x(1.1)).dropped_samples == 2);
  localizer.start_anywhere();  // what was dropped before still counts
  CHECK(world.at(localizer, 1.2, 1.2).dropped_samples == 2);
}

TEST_CASE("times of points that make no sweep are an error; points without a time are dropped") {
  World world;
  Localizer localizer = world.localizer();
  REQUIRE(localizer.start(at_x(1)));
  const auto localize = [&](double stamp, std::vector<float> seconds) {
    world.truth->T_map_scan = at_x(1);
    return localizer.localize({.stamp = stamp, .points = world.scan, .seconds = seconds});
  };
  CHECK(localize(0.0, {0.0F, 0.1F}).error().code == ErrorCode::invalid_input);
  CHECK(localize(0.0, {0.0F, 0.1F, 1e9F}).error().code == ErrorCode::invalid_input);
  const auto some = localize(0.0, {0.0F, std::numeric_limits<float>::infinity(), 0.1F});
  REQUIRE(some);
  CHECK(some->dropped_points == 1);
  CHECK(some->passes == 1);
  CHECK(localize(0.2, {-0.1F, -0.05F, 0.0F})->tracking == Tracking::tracked);
  // Of another clock.
  const auto far = localize(0.3, {-101.0F, -100.95F, -100.9F});
  CHECK(far.error().code == ErrorCode::invalid_input);
  CHECK(far.error().message.find("-101.0") != std::string::npos);
  // A point that is dropped may have any time.
  world.scan.emplace_back(std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0);
  const auto dropped = localize(0.4, {0.0F, 0.05F, 0.1F, -1.7e9F});
  REQUIRE_MESSAGE(dropped, to_string(dropped.error()));
  CHECK(dropped->dropped_points == 1);
}

TEST_CASE("planar: a wheeled robot's height follows a scan that is off more slowly") {
  const auto height_after_bump = [](MotionModel motion) {
    World world;
    LocalizerParams params;
    params.motion = motion;
    Localizer localizer = world.localizer(params);
    REQUIRE(localizer.start(at_x(1)));
    for (int k = 0; k < 10; ++k) world.at(localizer, 0.1 * k, 1.0 + 0.15 * k);
    world.truth->T_map_scan.translation = {2.5, 0.0, 0.01};
    const auto report = localizer.localize({.stamp = 1.0, .points = world.scan});
    REQUIRE(report);
    CHECK(report->tracking == Tracking::tracked);
    CHECK(std::abs(report->T_map_scan.translation.x() - 2.5) < 0.003);
    return report->T_map_scan.translation.z();
  };
  const double free = height_after_bump(MotionModel::free);
  const double planar = height_after_bump(MotionModel::planar);
  CHECK(free > 0.008);
  CHECK(planar > 0.0);
  CHECK(planar < 0.85 * free);
}
