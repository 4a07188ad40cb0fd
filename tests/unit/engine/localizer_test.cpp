#include "vantage/engine/localizer.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <limits>
#include <thread>

#include "support/fakes.hpp"
#include "support/post_world.hpp"
#include "vantage/conformance/range_survey.hpp"
#include "vantage/kit/map_in_memory.hpp"

using namespace vantage;

namespace {

using World = test::PostWorld;
using test::at_x;

}  // namespace

TEST_CASE("Eq. 11: the map changes for the scan after the border was crossed") {
  const World world;
  LocalizerParams params;
  params.prefetch = false;
  params.recovery_radius = 0.0;  // a search would read every region
  Localizer localizer = world.localizer(params);
  REQUIRE(localizer.start(at_x(8)));
  CHECK(world.memory->gets == 1);
  const ScanReport first = world.at(localizer, 0.0, 8);
  CHECK(first.switched);
  CHECK_FALSE(first.blocked);  // the start made the first map ready
  CHECK_FALSE(world.at(localizer, 0.1, 9.9).switched);
  const ScanReport crossing = world.at(localizer, 0.2, 10.0);  // exactly on the border: next cell
  CHECK(crossing.region == RegionId{0});
  const ScanReport after = world.at(localizer, 0.3, 10.1);
  CHECK(after.switched);
  CHECK(after.blocked);
  CHECK(after.region == RegionId{1});
  CHECK(after.map_points == world.posts_of_map.size());
  CHECK(after.lcp == doctest::Approx(2.0 / static_cast<double>(world.posts_of_map.size())));
  CHECK_FALSE(world.at(localizer, 0.4, 10.2).switched);
  CHECK(world.memory->gets == 2);
}

TEST_CASE("switch_margin keeps a map until the border is that far behind") {
  const World world;
  LocalizerParams params;
  params.switch_margin = 1.0;
  Localizer localizer = world.localizer(params);
  REQUIRE(localizer.start(at_x(9)));
  const double path[] = {9.0, 10.5, 9.5, 10.9, 11.2, 10.5, 9.5, 8.8, 8.7};
  const std::uint32_t region[] = {0, 0, 0, 0, 0, 1, 1, 1, 0};
  for (std::size_t i = 0; i < std::size(path); ++i) {
    CHECK(world.at(localizer, 0.1 * static_cast<double>(i), path[i]).region.value == region[i]);
  }
}

TEST_CASE("constant velocity predicts straight drives, turns and uneven stamps") {
  const World world;
  Localizer localizer = world.localizer();
  REQUIRE(localizer.start(at_x(1)));
  CHECK(world.at(localizer, 0.0, 1.0).T_map_scan_predicted.translation.x() == 1.0);
  CHECK(world.at(localizer, 0.1, 1.5).T_map_scan_predicted.translation.x() == 1.0);
  CHECK(std::abs(world.at(localizer, 0.2, 2.0).T_map_scan_predicted.translation.x() - 2.0) < 1e-3);
  CHECK(std::abs(world.at(localizer, 0.4, 3.0).T_map_scan_predicted.translation.x() - 3.0) < 1e-3);

  // A quarter turn a second at one metre a second: the step repeats in the sensor's frame.
  const Pose step = pose_from_xyz_rpy({1, 0, 0}, {0, 0, M_PI / 2});
  Localizer turning = world.localizer();
  Pose pose;
  REQUIRE(turning.start(pose));
  for (int i = 0; i < 6; ++i) {
    world.truth->T_map_scan = pose;
    const auto report = turning.localize({1.0 * i, world.scan});
    REQUIRE(report);
    if (i == 5) {  // the sensor was taken to stand at first
      CHECK((report->T_map_scan_predicted.translation - pose.translation).norm() < 0.05);
      CHECK(rotation_between(report->T_map_scan_predicted, pose) < 0.01);
    }
    pose = pose * step;
  }
}

TEST_CASE("odometry shows at once that a sensor accelerates, and where it ends, velocity goes on") {
  const auto errors = [](double interval) {  // of the predictions; 0: without odometry
    const World world;
    Localizer localizer = world.localizer();
    REQUIRE(localizer.start(at_x(1)));
    const auto x = [](double t) {
      return 1.0 + 4.0 * t + 2.0 * std::max(0.0, t - 0.5) * std::max(0.0, t - 0.5);
    };
    double next = 0.0;
    std::vector<double> all;
    for (int i = 0; i <= 14; ++i) {
      const double now = 0.1 * i;
      for (; interval > 0.0 && next <= std::min(now, 1.2) + 1e-9; next += interval) {
        REQUIRE(localizer.add(
            OdometrySample{next, pose_from_xyz_rpy({50 + x(next), 3, 0}, {0, 0, 0})}));
      }
      all.push_back(world.at(localizer, now, x(now)).T_map_scan_predicted.translation.x() - x(now));
    }
    return all;
  };
  const auto without = errors(0.0), with = errors(0.02);
  CHECK(std::abs(without[1]) == doctest::Approx(0.4));  // 4 m/s that nothing told of
  CHECK(std::abs(with[1]) < 0.001);
  for (std::size_t i = 6; i <= 12; ++i) {
    CAPTURE(i);
    CHECK(std::abs(with[i]) < 0.65 * std::abs(without[i]));
  }
  CHECK(with[14] == doctest::Approx(without[14]).epsilon(0.02));
}

TEST_CASE("a scan without overlap or coverage is lost, keeps its prediction, and the run goes on") {
  const World world;
  Localizer localizer = world.localizer();
  REQUIRE(localizer.start(at_x(1)));
  world.at(localizer, 0.0, 1.0);
  world.at(localizer, 0.1, 1.5);
  world.truth->overlap = false;
  const ScanReport blind = world.at(localizer, 0.2, 99.0);
  CHECK(blind.tracking == Tracking::lost);
  CHECK(blind.reason == "nothing overlaps");
  CHECK_FALSE(blind.alignment.has_value());
  CHECK(blind.T_map_scan.translation.x() == doctest::Approx(2.0).epsilon(0.001));

  world.truth->overlap = true;
  world.truth->coverage = 0.01;
  const ScanReport thin = world.at(localizer, 0.3, 3.0);
  CHECK(thin.tracking == Tracking::uncertain);
  CHECK(thin.reason == "the scan does not fit the map here");
  CHECK(thin.T_map_scan.translation.x() == doctest::Approx(2.5).epsilon(0.001));
  CHECK(thin.risk > 0.01);

  world.truth->coverage = 1.0;
  const ScanReport found = world.at(localizer, 0.4, 3.0);
  CHECK(found.T_map_scan_predicted.translation.x() == doctest::Approx(3.0).epsilon(0.001));
  CHECK(found.T_map_scan.translation.x() == doctest::Approx(3.0).epsilon(1e-4));
  CHECK(found.tracking == Tracking::tracked);
  CHECK(found.recovered);
  CHECK(found.risk < 0.01);
  CHECK_FALSE(world.at(localizer, 0.6, 4.0).recovered);
}

TEST_CASE("one scan that does not fit is uncertain, and its pose is where the motion led") {
  const World world;
  Localizer localizer = world.localizer();
  REQUIRE(localizer.start(at_x(1)));
  for (int i = 0; i < 4; ++i) {
    CHECK(world.at(localizer, 0.1 * i, 1.0 + 0.5 * i).tracking == Tracking::tracked);
  }
  world.truth->coverage = 0.01;  // a lorry beside the sensor
  const ScanReport covered = world.at(localizer, 0.4, 3.2);
  CHECK(covered.tracking == Tracking::uncertain);
  CHECK(covered.T_map_scan.translation.x() == doctest::Approx(3.0));
  world.truth->coverage = 1.0;
  CHECK(world.at(localizer, 0.5, 3.5).tracking == Tracking::tracked);
}

TEST_CASE("limits on a score are for those who set them") {
  const World world;
  world.truth->coverage = 0.6;
  LocalizerParams params;
  for (const auto& [coverage, nvtl, called] : {std::tuple{0.0, 0.0, Tracking::tracked},
                                               {0.7, 0.0, Tracking::lost},
                                               {0.0, 3.5, Tracking::lost}}) {
    if (coverage > 0.0) params.min_coverage = coverage;
    if (nvtl > 0.0) params.min_nvtl = nvtl;
    Localizer localizer = world.localizer(params);
    REQUIRE(localizer.start(at_x(1)));
    const ScanReport report = world.at(localizer, 0.0, 1.0);
    CHECK(report.tracking == called);
    CHECK(report.reason.empty() == (called == Tracking::tracked));
    params = {};
  }
}

TEST_CASE("a scan that matching moves too far from its prediction is lost") {
  const World world;
  LocalizerParams params;
  params.max_correction = 0.5;
  params.recovery_radius = 0.0;
  Localizer localizer = world.localizer(params);
  REQUIRE(localizer.start(at_x(1)));
  world.at(localizer, 0.0, 1.0);
  CHECK(world.at(localizer, 0.1, 2.0).tracking == Tracking::tracked);  // no motion known before
  const ScanReport jump = world.at(localizer, 0.2, 3.6);
  CHECK(jump.tracking == Tracking::lost);
  CHECK(jump.reason.ends_with("more than max_correction"));
  CHECK(jump.T_map_scan.translation.x() == doctest::Approx(3.0).epsilon(0.001));
}

TEST_CASE("a sensor that was carried away is found again") {
  World world;
  world.truth->reach = 3.0;
  Localizer localizer = world.localizer();
  const auto at = [](double x, double yaw) {
    return pose_from_xyz_rpy({x, 0.1, 1.0}, {0, 0, yaw});
  };
  REQUIRE(localizer.start(at(1.0, 0.0)));
  for (int i = 0; i < 4; ++i) world.look(localizer, 0.1 * i, at(1.0 + 0.2 * i, 0.0));

  // 24 m away and turned: in another region, with another heading.
  const auto carried = [&](int i) {
    return world.look(localizer, 1.0 + 0.1 * i, at(25.4 - 0.2 * i, M_PI));
  };
  int scans = 0;
  ScanReport report = carried(scans++);
  while (report.tracking != Tracking::tracked && scans < 10) report = carried(scans++);
  CHECK(report.tracking == Tracking::tracked);
  CHECK(scans <= 3);
  CHECK(report.region == RegionId{2});
  CHECK((report.T_map_scan.translation - world.truth->T_map_scan.translation).norm() < 1e-9);
  // It goes on as it did, 0.2 m a scan forward.
  report = carried(scans++);
  CHECK(report.tracking == Tracking::tracked);
  CHECK((report.T_map_scan_predicted.translation - world.truth->T_map_scan.translation).norm() <
        1e-6);
}

TEST_CASE("a scan that switches maps and is found by the search in the new one has switched") {
  World world;
  world.truth->reach = 3.0;
  Localizer localizer = world.localizer();
  REQUIRE(localizer.start(pose_from_xyz_rpy({9, 0, 1}, {0, 0, 0})));
  const auto at = [&](double stamp, double x) {
    return world.look(localizer, stamp, pose_from_xyz_rpy({x, 0, 1}, {0, 0, 0}));
  };
  CHECK(at(0.0, 9.0).region == RegionId{0});
  CHECK(at(0.1, 9.6).region == RegionId{0});
  CHECK(at(0.2, 10.2).region == RegionId{0});
  // Beyond the border, and farther than the matcher reaches from the prediction at 10.8.
  const ScanReport found = at(0.3, 18.0);
  CHECK(found.seconds_search > 0.0);
  CHECK(found.seconds_verdict > 0.0);
  REQUIRE(found.T_map_scan.translation.x() == doctest::Approx(18.0));
  CHECK(found.region == RegionId{1});
  CHECK(found.switched);
}

TEST_CASE("recovery_radius bounds the search, 0 is none; search_pause spaces it out") {
  struct Case {
    double radius;
    std::uint32_t pause;
    int searches;  // of twelve scans
  };
  for (const Case& one : {Case{0.0, 4, 0}, {12.0, 4, 5}, {12.0, 1, 12}}) {
    World world;
    world.truth->reach = 1.0;
    LocalizerParams params;
    params.recovery_radius = one.radius;
    params.search_pause = one.pause;
    Localizer localizer = world.localizer(params);
    const auto at = [](double x) { return pose_from_xyz_rpy({x, 0, 1}, {0, 0, 0}); };
    REQUIRE(localizer.start(at(1.0)));
    for (int i = 0; i < 3; ++i) world.look(localizer, 0.1 * i, at(1.0));
    int searches = 0;
    for (int i = 0; i < 12; ++i) {
      const ScanReport report = world.look(localizer, 1.0 + 0.1 * i, at(40.0));
      CHECK(report.tracking != Tracking::tracked);
      searches += report.seconds_search > 0.0 ? 1 : 0;
    }
    CHECK(searches == one.searches);
  }
}

TEST_CASE("start_anywhere looks in all regions and says so until it has found the sensor") {
  World world;
  world.truth->reach = 3.0;
  world.truth->overlap = false;
  Localizer localizer = world.localizer();
  localizer.start_anywhere();
  const ScanReport nowhere = world.at(localizer, 0.0, 17.3);
  CHECK(nowhere.tracking == Tracking::lost);
  CHECK_FALSE(nowhere.has_pose);
  world.truth->overlap = true;
  const Pose truth = pose_from_xyz_rpy({17.3, 0.2, 1.1}, {0, 0, -2.0});
  ScanReport found = world.look(localizer, 0.1, truth);
  CHECK(found.has_pose);
  CHECK((found.T_map_scan.translation - truth.translation).norm() < 1e-9);
  CHECK(found.region == RegionId{1});
  CHECK(found.tracking == Tracking::tracked);
  CHECK(found.recovered);

  // Once more, in the region whose map is held.
  localizer.start_anywhere();
  const ScanReport again = world.look(localizer, 0.2, truth);
  CHECK(again.region == RegionId{1});
  CHECK(again.map_points == found.map_points);
  CHECK(again.map_points > 0);
  CHECK(again.switched);
}

TEST_CASE("a search that fails is reported, and localization goes on") {
  World world;
  world.truth->reach = 3.0;
  Localizer localizer = world.localizer();
  world.memory->unreadable = {2};  // the first search reads all regions
  REQUIRE(localizer.start(at_x(8)));
  const ScanReport alone = world.look(localizer, 0.0, at_x(8));
  CHECK(alone.tracking == Tracking::uncertain);
  CHECK(alone.T_map_scan.translation.x() == doctest::Approx(8.0));
  CHECK(alone.reason.find("not compared with the rest of the map yet: the search failed: error: "
                          "the file has 7 bytes") == 0);
  localizer.start_anywhere();
  const ScanReport nowhere = world.look(localizer, 0.1, at_x(8));
  CHECK_FALSE(nowhere.has_pose);
  CHECK(nowhere.reason.find("the search failed: error: the file has 7 bytes") != std::string::npos);

  world.memory->unreadable = {};
  const ScanReport found = world.look(localizer, 0.2, at_x(8));
  CHECK(found.tracking == Tracking::tracked);
  CHECK(found.search_failure.empty());

  // The places of a region whose map cannot be read are left out. (That of region 1 is ready.)
  world.memory->unreadable = {2};
  localizer.start_anywhere();
  const ScanReport left_out = world.look(localizer, 0.3, at_x(25.0));
  CHECK(left_out.tracking != Tracking::tracked);
  CHECK(left_out.search_failure.find("cannot be used: error: the file has 7 bytes") !=
        std::string::npos);
}

TEST_CASE("a prior starts a sensor, and refutes a pose that it contradicts") {
  World world;
  world.truth->reach = 3.0;
  Localizer localizer = world.localizer();
  localizer.start_anywhere();
  const Pose truth = pose_from_xyz_rpy({17.3, 0.2, 1.1}, {0, 0, -2.0});
  const PosePrior prior{.T_map_sensor = pose_from_xyz_rpy({14.0, 2.0, 1.0}, {0, 0, -1.8}),
                        .sigma_translation = {4.0, 4.0, 1.0},
                        .sigma_heading = 0.2};
  world.truth->T_map_scan = truth;
  world.scan.clear();
  for (const Point& p : world.posts_of_map) world.scan.push_back(truth.inverse() * p);
  world.truth->scan = world.scan;
  const auto report =
      localizer.localize({.stamp = 0.0, .points = world.scan, .prior = prior}).value();
  CHECK(report.tracking == Tracking::tracked);
  CHECK((report.T_map_scan.translation - truth.translation).norm() < 1e-9);

  // The same place, but the prior says that the sensor is 25 m away.
  Localizer other = world.localizer();
  other.start_anywhere();
  const PosePrior away{.T_map_sensor = pose_from_xyz_rpy({-8.0, 2.0, 1.0}, {0, 0, -1.8}),
                       .sigma_translation = {1.0, 1.0, 1.0},
                       .sigma_heading = 0.2};
  CHECK(other.localize({.stamp = 0.0, .points = world.scan, .prior = away})->tracking !=
        Tracking::tracked);
}

TEST_CASE("parameters that a file could not set are refused") {
  const World world;
  LocalizerParams params;
  params.search_pause = 0;
  const auto opened =
      Localizer::open(test::bundle_in(world.memory).value(),
                      test::in_process<test::TruthMatcher, ScanMatcher>(world.truth), {}, params);
  REQUIRE_FALSE(opened);
  CHECK(opened.error().code == ErrorCode::invalid_config);
  CHECK(opened.error().message.find("search_pause") != std::string::npos);
}

TEST_CASE("the next region is ready before the border, and the same poses come out without") {
  const auto drive = [](bool prefetch) {
    const World world;
    LocalizerParams params;
    params.prefetch = prefetch;
    Localizer localizer = world.localizer(params);
    REQUIRE(localizer.start(at_x(2)));
    std::vector<ScanReport> reports;
    for (int i = 0; i < 50; ++i) {
      reports.push_back(world.at(localizer, 0.1 * i, 2.0 + 0.5 * i));
      // Ten times as fast as it is stamped: the next region is expected ten scans and more ahead.
      if (prefetch) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return reports;
  };
  const auto with = drive(true), without = drive(false);
  std::size_t blocked = 0;
  for (std::size_t i = 0; i < with.size(); ++i) {
    CHECK_FALSE(with[i].blocked);
    CHECK(with[i].region == without[i].region);
    CHECK(with[i].T_map_scan.translation == without[i].T_map_scan.translation);
    blocked += without[i].blocked ? 1 : 0;
  }
  CHECK(blocked == 2);
}

TEST_CASE("an empty scan and one of NaNs are uncertain, and the NaNs are counted") {
  World world;
  Localizer localizer = world.localizer();
  REQUIRE(localizer.start(at_x(1)));
  world.scan.clear();
  CHECK(world.at(localizer, 0.0, 1.0).tracking == Tracking::uncertain);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  world.scan.assign(5, Point(nan, 0, 0));
  const ScanReport report = world.at(localizer, 0.1, 1.0);
  CHECK(report.tracking == Tracking::uncertain);
  CHECK(report.dropped_points == 5);
  CHECK(report.scan_points == 0);
}

TEST_CASE("points that no LiDAR measures are dropped and counted, and the scan is matched") {
  World world;
  Localizer localizer = world.localizer();
  REQUIRE(localizer.start(at_x(1)));
  const PointCloud sound = world.scan;
  for (const double far : {4e6, double{std::numeric_limits<float>::max()}, 1e300}) {
    world.scan = sound;
    world.scan.emplace_back(far, -far, 1.0);
    const ScanReport report = world.at(localizer, far, 1.0);
    CHECK(report.dropped_points == 1);
    CHECK(report.scan_points == sound.size());
    CHECK(report.alignment.has_value());
  }
}

TEST_CASE("a prior that is no measurement is an error that says so, and changes nothing") {
  const World world;
  Localizer localizer = world.localizer();
  REQUIRE(localizer.start(at_x(1)));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [&](const PosePrior& prior, const std::string& why) {
    const auto report = localizer.localize({.stamp = 1.0, .points = world.scan, .prior = prior});
    REQUIRE_FALSE(report);
    CHECK(report.error().code == ErrorCode::invalid_input);
    CHECK(report.error().message.find(why) != std::string::npos);
  };
  refused({.T_map_sensor = pose_from_xyz_rpy({nan, 0, 0}, {0, 0, 0})}, "not a rigid transform");
  refused({.T_map_sensor = {}, .sigma_translation = {1.0, -1.0, 1.0}}, "-1.000000");
  refused({.T_map_sensor = {}, .sigma_translation = {1.0, nan, 1.0}}, "positive");
  refused({.T_map_sensor = {}, .sigma_heading = 0.0}, "positive");
  CHECK(world.at(localizer, 1.0, 1.0).tracking == Tracking::tracked);
}

TEST_CASE("outside every region, or in one without a map, the last map is kept and that is said") {
  const World world(true);
  Localizer localizer = world.localizer();
  REQUIRE(localizer.start(at_x(9)));
  world.at(localizer, 0.0, 12.0);
  const ScanReport in_gap = world.at(localizer, 0.1, 15.0);
  CHECK(in_gap.outside);
  CHECK(in_gap.region == RegionId{0});
  CHECK_FALSE(in_gap.switched);
  world.at(localizer, 0.2, 21.0);
  CHECK(world.at(localizer, 0.3, 35.0).region == RegionId{2});
  const ScanReport beyond = world.at(localizer, 0.4, 36.0);
  CHECK(beyond.outside);
  CHECK(beyond.region == RegionId{2});

  Localizer far = world.localizer();
  REQUIRE(far.start(at_x(-50)));
  const ScanReport first = world.at(far, 0.0, -50.0);
  CHECK(first.outside);
  CHECK(first.region == RegionId{0});
}

TEST_CASE("a region whose map cannot be read costs its own scans, and no others") {
  World world;
  LocalizerParams params;
  params.prefetch = false;
  params.recovery_radius = 0.0;
  Localizer localizer = world.localizer(params);
  REQUIRE(localizer.start(at_x(8)));
  world.look(localizer, 0.0, at_x(8));
  world.look(localizer, 0.1, at_x(9));
  world.memory->unreadable = {1};
  world.look(localizer, 0.2, at_x(10));  // matched to the region before
  for (int i = 1; i <= 10; ++i) {
    const ScanReport report = world.look(localizer, 0.2 + 0.1 * i, at_x(10 + i));
    CAPTURE(report.T_map_scan.translation.x());
    CHECK(report.tracking == Tracking::lost);
    CHECK(report.region == RegionId{1});
    CHECK(report.map_points == 0);
    CHECK(report.reason.find("cannot be used: error: the file has 7 bytes") != std::string::npos);
    CHECK(report.T_map_scan.translation.x() == doctest::Approx(10 + i).epsilon(0.01));
  }
  world.look(localizer, 1.3, at_x(21));  // the border is crossed; the next scan changes the map
  const ScanReport beyond = world.look(localizer, 1.4, at_x(22));
  CHECK(beyond.region == RegionId{2});
  CHECK(beyond.tracking != Tracking::lost);
  ScanReport last = beyond;
  for (int i = 0; i < 4; ++i) last = world.look(localizer, 1.5 + 0.1 * i, at_x(23 + i));
  CHECK(last.tracking == Tracking::tracked);
  CHECK(last.T_map_scan.translation.x() == doctest::Approx(26.0));
}

TEST_CASE("the motion at the very stamp of a scan has the rates that are measured there") {
  World world;
  Localizer localizer = world.localizer();
  REQUIRE(localizer.start(at_x(1)));
  for (int i = -2; i <= 30; ++i) {
    REQUIRE(localizer.add(ImuSample{.stamp = 0.01 * i,
                                    .angular_velocity = {0.0, 0.0, 0.5},
                                    .specific_force = {0.0, 0.0, 9.81}}));
  }
  for (int i = 0; i <= 2; ++i) {
    const double turned = 0.5 * 0.1 * i;
    const ScanReport report =
        world.look(localizer, 0.1 * i, pose_from_xyz_rpy({1, 0, 0}, {0, 0, turned}));
    REQUIRE(report.tracking == Tracking::tracked);
    const auto motion = localizer.motion_at(report.stamp);
    REQUIRE(motion);
    CHECK(motion->covariance.isApprox(report.confidence->covariance, 1e-6));
  }
  // A scan that comes twice is refused, and the motion goes on.
  CHECK_FALSE(localizer.localize({.stamp = 0.2, .points = world.scan}));
  for (const double stamp : {0.2, 0.2, 0.25}) {
    const auto motion = localizer.motion_at(stamp);
    REQUIRE(motion);
    CHECK(motion->twist.angular.z() == doctest::Approx(0.5).epsilon(0.05));
  }
  // Nanoseconds that are taken for seconds, and no moment at all.
  CHECK_FALSE(localizer.motion_at(1.7e18));
  CHECK_FALSE(localizer.motion_at(std::numeric_limits<double>::infinity()));
}

TEST_CASE("a prior without heading is moved by the motion from the stamp to the middle") {
  World world;
  LocalizerParams params;
  params.scan_min_range = 0.0;
  Localizer localizer = world.localizer(params);
  REQUIRE(localizer.start(at_x(1)));
  const std::vector<float> seconds(world.posts_of_map.size(), 0.4F);  // the middle: 0.4 s later
  for (int i = 0; i < 8; ++i) {
    const double at_stamp = 1.0 + i, at_middle = at_stamp + 4.0;  // 10 m/s
    world.stand_at(at_x(at_middle));
    PosePrior prior{.T_map_sensor = pose_from_xyz_rpy({at_stamp, 0, 0}, {0, 0, 3.0}),
                    .sigma_translation = {0.3, 0.3, 0.3},
                    .sigma_heading = std::numeric_limits<double>::infinity()};
    const auto report = localizer.localize(
        {.stamp = 0.1 * i, .points = world.scan, .seconds = seconds, .prior = prior});
    REQUIRE_MESSAGE(report, to_string(report.error()));
    CAPTURE(i);
    // The first scan shows how fast the sensor is. A prior that was moved back is 8 m off.
    if (i > 2) CHECK(report->seconds_search == 0.0);
  }
}

TEST_CASE("a prior that is off the map does not stand for a comparison with the map") {
  World world;
  world.truth->reach = 3.0;
  Localizer localizer = world.localizer();
  REQUIRE(localizer.start(at_x(5)));
  const PosePrior away{
      .T_map_sensor = at_x(10'000.0), .sigma_translation = {1.0, 1.0, 1.0}, .sigma_heading = 0.2};
  world.stand_at(at_x(5));
  bool tracked = false;
  for (int i = 0; i < 8; ++i) {
    const auto report =
        localizer.localize({.stamp = 0.1 * i, .points = world.scan, .prior = away}).value();
    if (i == 0) CHECK_FALSE(report.compared);
    tracked = report.tracking == Tracking::tracked;
    if (tracked) CHECK(report.compared);
  }
  CHECK(tracked);  // once it was compared, the prior does not hold it back
}

TEST_CASE("priors are searched again after some that were wrong") {
  World world;
  world.truth->reach = 3.0;
  LocalizerParams params;
  params.recovery_radius = 1.0;  // without a prior, nothing is found
  Localizer localizer = world.localizer(params);
  REQUIRE(localizer.start(at_x(5)));
  const Pose truth = pose_from_xyz_rpy({17.3, 0.2, 1.1}, {0, 0, -2.0});
  world.stand_at(truth);
  PosePrior prior{
      .T_map_sensor = at_x(10'000.0), .sigma_translation = {1.0, 1.0, 1.0}, .sigma_heading = 0.2};
  ScanReport report;
  for (int i = 0; i < 8; ++i) {
    if (i == 4) prior.T_map_sensor = truth;
    report = localizer.localize({.stamp = 0.1 * i, .points = world.scan, .prior = prior}).value();
  }
  CHECK((report.T_map_scan.translation - truth.translation).norm() < 1e-6);
}

TEST_CASE("misuse is an error: no start, stamps that do not increase, an invalid pose") {
  const World world;
  Localizer localizer = world.localizer();
  CHECK(localizer.localize({0.0, world.scan}).error().message ==
        "localization has no first pose: call start");
  Pose bad;
  bad.translation.x() = std::numeric_limits<double>::infinity();
  CHECK(localizer.start(bad).error().code == ErrorCode::invalid_input);
  REQUIRE(localizer.start(at_x(1)));
  world.at(localizer, 1.0, 1.0);
  CHECK(localizer.localize({1.0, world.scan}).error().code == ErrorCode::invalid_input);
  CHECK(localizer.localize({std::nan(""), world.scan}).error().code == ErrorCode::invalid_input);
}

TEST_CASE("a bundle whose regions are all empty is refused") {
  const auto memory = std::make_shared<test::Memory>();
  memory->index.partition =
      test::Strips(2).partition(MapInMemory({}), {}, conformance::RangeSurvey({}, 1.0)).value();
  memory->index.regions.resize(2);
  const auto opened = Localizer::open(
      test::bundle_in(memory).value(),
      test::in_process<test::TruthMatcher, ScanMatcher>(std::make_shared<test::Truth>()), {},
      LocalizerParams{});
  CHECK(opened.error().message == "no region of the bundle holds any point");
}

TEST_CASE("scan preparation: range limits, thinning, NaN counted") {
  LocalizerParams params;
  params.scan_voxel_size = 1.0;
  params.scan_min_range = 1.0;
  params.scan_max_range = 10.0;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const PointCloud raw{{0.1, 0, 0}, {5.2, 0.2, 0}, {5.4, 0.4, 0}, {20, 0, 0}, {nan, 1, 1}};
  const auto prepared = prepare_scan({.points = raw}, nullptr, params);
  REQUIRE(prepared);
  CHECK(prepared->dropped == 1);
  REQUIRE(prepared->points.size() == 1);
  CHECK((prepared->points[0] - Point(5.3, 0.3, 0)).norm() < 1e-12);
  params.scan_voxel_size = 0.0;
  CHECK(prepare_scan({.points = raw}, nullptr, params)->points.size() == 2);
}

TEST_CASE("a bundle of prepared maps without an index of places is tracked in, not searched") {
  World world;
  for (auto& [region, map] : world.memory->maps) {
    map.prepared = {.bytes = {std::byte{1}}, .elements = map.points.size()};
    map.points.clear();
  }
  for (RegionSummary& region : world.memory->index.regions) {
    region.elements = region.points;
    region.points = 0;
  }
  world.truth->restorable = true;
  Localizer localizer = world.localizer();
  REQUIRE(localizer.start(at_x(1)));
  CHECK(world.at(localizer, 0.0, 1.0).tracking == Tracking::tracked);
  const ScanReport report = world.at(localizer, 0.1, 1.0);
  CHECK(report.tracking == Tracking::tracked);
  CHECK(report.seconds_search == 0.0);  // the first has tried
}
