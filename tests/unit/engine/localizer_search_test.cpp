#include <doctest/doctest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <future>
#include <memory>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "support/fakes.hpp"
#include "support/post_world.hpp"
#include "vantage/engine/localizer.hpp"

using namespace vantage;

namespace {

using Posts = test::PostWorld;

/// Lets only the thread that made it read while it is closed.
struct Gate {
  std::atomic<bool> open = false;
  std::atomic<int> waiting = 0;
  std::thread::id always = std::this_thread::get_id();

  void pass() {
    if (std::this_thread::get_id() == always) return;
    ++waiting;
    waiting.notify_all();
    open.wait(false);
  }
  void unlock() {
    open = true;
    open.notify_all();
  }
};

class GatedReader final : public MapReader {
 public:
  GatedReader(std::shared_ptr<test::Memory> memory, Gate& gate)
      : inner_(std::move(memory)), gate_(gate) {}
  [[nodiscard]] Result<MapIndex> index() const noexcept override { return inner_.index(); }
  [[nodiscard]] Result<std::unique_ptr<const RegionDirectory>> directory() const noexcept override {
    return inner_.directory();
  }
  [[nodiscard]] Result<RegionMap> get(RegionId region) const noexcept override {
    gate_.pass();
    return inner_.get(region);
  }

 private:
  test::MemoryReader inner_;
  Gate& gate_;
};

LocalizerParams live_params() {
  LocalizerParams params;
  params.prefetch = false;  // its thread would wait at the gate as well
  params.live = true;
  params.search_budget = 1.0;
  return params;
}

/// A localizer whose searches wait at a gate.
Localizer gated(const Posts& world, Gate& gate) {
  return Localizer::open(
             Bundle::of(test::in_process<GatedReader, const MapReader>(world.memory, gate),
                        "memory")
                 .value(),
             test::in_process<test::TruthMatcher, ScanMatcher>(world.truth),
             test::plugin<Relocalizer>("voxel_search"), live_params())
      .value();
}

const Pose kHere = pose_from_xyz_rpy({17.3, 0.2, 1.1}, {0, 0, -2.0});

/// A drive along x that starts anywhere, with odometry or without.
std::vector<ScanReport> drive_from_anywhere(LocalizerParams params, double step, bool odometry) {
  params.prefetch = false;  // its thread would read the truth while it moves
  Posts world;
  world.truth->reach = 3.0;
  Localizer localizer = world.localizer(params);
  localizer.start_anywhere();
  std::vector<ScanReport> reports;
  for (int i = 0; i < 6; ++i) {
    const Pose pose = pose_from_xyz_rpy({2.0 + step * i, 0.2, 1.1}, {0, 0, 0});
    reports.push_back(world.look(localizer, 0.1 * i, pose,
                                 odometry ? std::optional(test::at_x(step * i)) : std::nullopt));
  }
  return reports;
}

bool is_found(const ScanReport& report, double x) {
  return report.tracking == Tracking::tracked &&
         std::abs(report.T_map_scan.translation.x() - x) < 1e-4;
}

}  // namespace

TEST_CASE("with a search budget, finds arrive later, moved by odometry") {
  LocalizerParams params;
  const auto at_once = drive_from_anywhere(params, 4.0, true);
  CHECK(is_found(at_once.front(), 2.0));

  params.search_budget = 0.0;
  const auto later = drive_from_anywhere(params, 4.0, true);
  CHECK_FALSE(later[0].has_pose);
  CHECK(later[0].seconds_search > 0.0);
  const auto found =
      std::ranges::find_if(later, [](const ScanReport& report) { return report.has_pose; });
  REQUIRE(found != later.end());
  const auto scan = static_cast<double>(found - later.begin());
  CHECK(is_found(*found, 2.0 + 4.0 * scan));
  CHECK(is_found(later.back(), 22.0));

  // Nobody knows how the sensor moved: 4 m away, the find is out of the matcher's reach.
  const auto without = drive_from_anywhere(params, 4.0, false);
  CHECK_FALSE(is_found(without[static_cast<std::size_t>(found - later.begin())], 2.0 + 4.0 * scan));
  // A sensor that stands needs no odometry.
  CHECK(is_found(drive_from_anywhere(params, 0.0, false).back(), 2.0));
}

TEST_CASE("with a search budget, a recording gives the same result with any number of threads") {
  LocalizerParams params;
  for (const double budget : {0.0, 1.0, 1000.0}) {
    params.search_budget = budget;
    const auto first = drive_from_anywhere(params, 0.5, true);
    const auto again = drive_from_anywhere(params, 0.5, true);
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const auto alone = drive_from_anywhere(params, 0.5, true);
    for (std::size_t i = 0; i < first.size(); ++i) {
      for (const auto* other : {&again[i], &alone[i]}) {
        CHECK(first[i].tracking == other->tracking);
        CHECK(first[i].has_pose == other->has_pose);
        CHECK(first[i].risk == other->risk);
        CHECK(first[i].T_map_scan.translation == other->T_map_scan.translation);
        CHECK(first[i].T_map_scan.rotation.coeffs() == other->T_map_scan.rotation.coeffs());
      }
    }
  }
}

TEST_CASE("a budget that is never used up changes nothing") {
  LocalizerParams params;
  const auto without = drive_from_anywhere(params, 0.5, true);
  params.search_budget = 1e9;
  const auto with = drive_from_anywhere(params, 0.5, true);
  for (std::size_t i = 0; i < with.size(); ++i) {
    CHECK(with[i].tracking == without[i].tracking);
    CHECK(with[i].risk == without[i].risk);
    CHECK(with[i].T_map_scan.translation == without[i].T_map_scan.translation);
  }
}

TEST_CASE("live, scans go on while a search hangs, and then the sensor is found") {
  Posts world;
  Gate gate;
  world.truth->reach = 3.0;
  world.stand_at(kHere);  // once: the search reads the truth
  Localizer first = gated(world, gate);
  first.start_anywhere();
  double stamp = 0.0;
  const auto look = [&](Localizer& localizer) {
    return localizer.localize({stamp += 0.1, world.scan}).value();
  };
  CHECK_FALSE(look(first).has_pose);
  gate.waiting.wait(0);  // the search needs the regions' points
  for (int i = 0; i < 5; ++i) CHECK_FALSE(look(first).has_pose);
  CHECK(gate.waiting == 1);

  Localizer localizer = std::move(first);  // the search does not mind
  CHECK_FALSE(look(localizer).has_pose);
  gate.unlock();
  ScanReport report = look(localizer);
  while (report.tracking != Tracking::tracked) report = look(localizer);
  CHECK((report.T_map_scan.translation - kHere.translation).norm() < 1e-9);
  CHECK(report.recovered);
}

TEST_CASE("live, a localizer may be destroyed while it searches") {
  Posts world;
  Gate gate;
  world.stand_at(kHere);
  auto localizer = std::make_unique<Localizer>(gated(world, gate));
  localizer->start_anywhere();
  CHECK_FALSE(localizer->localize({0.0, world.scan})->has_pose);
  gate.waiting.wait(0);
  auto destroyed = std::async(std::launch::async, [&] { localizer.reset(); });
  gate.unlock();
  destroyed.wait();
  CHECK_FALSE(localizer);
}

TEST_CASE("live, a start ends the search that is under way: its finds are not delivered") {
  Posts world;
  Gate gate;
  world.truth->reach = 3.0;
  world.stand_at(kHere);
  Localizer localizer = gated(world, gate);
  localizer.start_anywhere();
  CHECK_FALSE(localizer.localize({0.0, world.scan})->has_pose);
  gate.waiting.wait(0);
  REQUIRE(localizer.start(kHere));
  CHECK(localizer.localize({0.1, world.scan})->has_pose);
  gate.unlock();
  for (int i = 2; i < 50; ++i) {
    const auto report = localizer.localize({0.1 * i, world.scan});
    REQUIRE(report);
    CHECK((report->T_map_scan.translation - kHere.translation).norm() < 1e-9);
  }
}

TEST_CASE("a sensor that is held at a tilt is found if gravity is unknown") {
  for (const auto& [roll, pitch] :
       {std::pair{0.0, 0.0}, {25.0, 0.0}, {0.0, -25.0}, {15.0, 18.0}, {-10.0, 12.0}}) {
    const double degree = std::acos(-1.0) / 180.0;
    const Pose tilted = pose_from_xyz_rpy({14.3, 0.2, 1.1}, {roll * degree, pitch * degree, -2.0});
    const auto found = [&](Gravity gravity) {
      Posts world;
      for (double x = -5.0; x < 35.0; x += 0.5) {
        for (double y = -15.0; y < 15.0; y += 0.5) world.posts_of_map.emplace_back(x, y, 0.0);
      }
      for (auto& [region, map] : world.memory->maps) map.points = world.posts_of_map;
      world.truth->reach = 2.0;  // 0.2 rad
      LocalizerParams params;
      params.gravity = gravity;
      Localizer localizer = world.localizer(params);
      localizer.start_anywhere();
      return is_found(world.look(localizer, 0.0, tilted), 14.3);
    };
    CHECK(found(Gravity::unknown));
    if (std::hypot(roll, pitch) > 20.0) CHECK_FALSE(found(Gravity::sensor_z));
  }
}

TEST_CASE("on a large site, a search that answers late does not unsettle a pose that is right") {
  for (const std::optional<double> budget : {std::optional<double>(), std::optional(0.0)}) {
    Posts world;
    world.memory->index.map_bounds = {{-400, -400, 0}, {400, 400, 5}};  // the circle grows to it
    world.truth->reach = 3.0;
    LocalizerParams params;
    params.prefetch = false;
    params.search_budget = budget;
    Localizer localizer = world.localizer(params);
    const auto at = [](int i) { return pose_from_xyz_rpy({2.0 + 0.1 * i, 0.2, 1.1}, {0, 0, 0}); };
    REQUIRE(localizer.start(at(0)));
    int searches = 0, tracked = 0;
    for (int i = 0; i < 60; ++i) {
      const ScanReport report = world.look(localizer, 0.1 * i, at(i), test::at_x(0.1 * i));
      CHECK(report.tracking != Tracking::lost);
      CHECK((report.T_map_scan.translation - at(i).translation).norm() < 0.01);
      searches += report.seconds_search > 0.0 ? 1 : 0;
      if (i >= 10) tracked += report.tracking == Tracking::tracked ? 1 : 0;
    }
    CHECK(searches > 2);
    CHECK(tracked == 50);
  }
}
