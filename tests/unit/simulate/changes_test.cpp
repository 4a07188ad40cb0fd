#include "simulate/changes.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "simulate/lidar.hpp"
#include "simulate/map_sampler.hpp"
#include "simulate/objects.hpp"
#include "simulate/simulation.hpp"
#include "small_world.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"

namespace vantage::simulation {
namespace {

using vantage::test::read_text;
using vantage::test::TemporaryFolder;

/// With room for new buildings.
WorldParams roomy_world() {
  WorldParams params = test::small_world();
  params.campus.size_x = params.campus.size_y = 100.0;
  params.campus.street_spacing = 50.0;
  params.campus.building_density = 0.15;
  params.map.point_spacing = 0.5;
  params.lidar.azimuth_step = 1.0;
  return params;
}

using Key = std::tuple<Surface, double, double>;

/// What stands where.
std::multiset<Key> things_of(const World& world, Surface kind) {
  std::multiset<Key> keys;
  for (const Thing& thing : world.campus().things) {
    if (thing.kind == kind) keys.emplace(kind, thing.plot.centre.x(), thing.plot.centre.y());
  }
  return keys;
}

struct Difference {
  std::multiset<Key> gone, come;
};
Difference difference(const World& before, const World& after, Surface kind) {
  const auto a = things_of(before, kind), b = things_of(after, kind);
  Difference result;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(),
                      std::inserter(result.gone, result.gone.end()));
  std::set_difference(b.begin(), b.end(), a.begin(), a.end(),
                      std::inserter(result.come, result.come.end()));
  return result;
}

constexpr Surface kKinds[] = {Surface::building, Surface::wall, Surface::vegetation,
                              Surface::pole,     Surface::car,  Surface::overpass};

void check_same(const World& before, const World& after, std::set<Surface> but) {
  for (const Surface kind : kKinds) {
    if (!but.contains(kind)) CHECK((things_of(before, kind) == things_of(after, kind)));
  }
}

TEST_CASE("every solid and leaf of a campus belongs to one thing") {
  const World world = test::make_world(test::small_world());
  std::size_t solids = 0, leaves = 0;
  for (const Thing& thing : world.campus().things) {
    CHECK(thing.first_solid == solids);
    CHECK(thing.first_leaf == leaves);
    solids = thing.end_solid;
    leaves = thing.end_leaf;
  }
  CHECK(solids == world.campus().solids.size());
  CHECK(leaves == world.campus().leaves.size());
}

TEST_CASE("the map is that of the day before the changes") {
  const WorldParams params = roomy_world();
  const PointCloud map = sample_map(test::make_world(params), params.map, params.seed);
  WorldParams other = params;
  other.changes = {.moved_cars = 1.0,
                   .buildings_gone = 1,
                   .buildings_new = 1,
                   .leaves_gone = 0.5,
                   .fences_new = 2};
  CHECK((sample_map(test::make_world(other), other.map, other.seed) == map));
  CHECK((sample_map(test::make_world(other, Day::drive), other.map, other.seed) != map));
}

TEST_CASE("changes of the campus") {
  WorldParams params = roomy_world();
  const World before = test::make_world(params);
  SUBCASE("none") {
    const World after = test::make_world(params, Day::drive);
    check_same(before, after, {});
    CHECK((after.campus().leaves == before.campus().leaves));
  }
  SUBCASE("cars leave, and as many arrive elsewhere, if there are places") {
    const auto cars = things_of(before, Surface::car).size();
    REQUIRE(cars >= 10);
    for (const double share : {0.3, 1.0}) {
      params.changes.moved_cars = share;
      const World after = test::make_world(params, Day::drive);
      const auto moved = static_cast<std::size_t>(std::lround(share * static_cast<double>(cars)));
      const Difference cars_moved = difference(before, after, Surface::car);
      CHECK(cars_moved.gone.size() == moved);
      CHECK(cars_moved.come.size() == std::min(moved, before.campus().free_parking.size()));
      check_same(before, after, {Surface::car});
    }
  }
  SUBCASE("buildings go") {
    params.changes.buildings_gone = 2;
    const World after = test::make_world(params, Day::drive);
    const Difference buildings = difference(before, after, Surface::building);
    CHECK(buildings.gone.size() == 2);
    CHECK(buildings.come.empty());
    check_same(before, after, {Surface::building});
    params.changes.buildings_gone = 1000;
    const auto refused = World::create(params, Day::drive);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().message.find("the campus has only") != std::string::npos);
  }
  SUBCASE("buildings come, clear of the others and of the streets; only plants make way") {
    params.changes.buildings_new = 2;
    const World after = test::make_world(params, Day::drive);
    const Difference buildings = difference(before, after, Surface::building);
    CHECK(buildings.gone.empty());
    CHECK(buildings.come.size() == 2);
    CHECK(difference(before, after, Surface::vegetation).come.empty());
    check_same(before, after, {Surface::building, Surface::vegetation});
    const auto& things = after.campus().things;
    for (const Thing& a : things) {
      if (a.kind != Surface::building) continue;
      for (const double u : {-1.0, 1.0}) {
        for (const double v : {-1.0, 1.0}) {
          const Eigen::Vector2d corner = a.plot.at(u * a.plot.half.x(), v * a.plot.half.y());
          CHECK(after.streets().distance_to_street(corner) > params.campus.street_width / 2.0);
        }
      }
      for (const Thing& b : things) {
        if (&a != &b && b.kind != Surface::vegetation) CHECK_FALSE(overlap(a.plot, b.plot));
      }
    }
  }
  SUBCASE("half of the campus is rebuilt, and the other half stays") {
    params.changes.rebuilt_half = true;
    const World after = test::make_world(params, Day::drive);
    const Difference buildings = difference(before, after, Surface::building);
    const auto all = things_of(before, Surface::building);
    const auto is_there = [](const Key& key) { return std::get<1>(key) > 0.0; };
    CHECK(static_cast<std::ptrdiff_t>(buildings.gone.size()) ==
          std::ranges::count_if(all, is_there));
    CHECK(buildings.gone.size() >= 2);
    CHECK(std::ranges::all_of(buildings.gone, is_there));
    CHECK_FALSE(buildings.come.empty());
    CHECK(buildings.come.size() <= buildings.gone.size());
    CHECK(std::ranges::all_of(buildings.come, is_there));
    CHECK(difference(before, after, Surface::vegetation).come.empty());
    check_same(before, after, {Surface::building, Surface::vegetation});
  }
  SUBCASE("leaves fall") {
    params.changes.leaves_gone = 0.25;
    const World after = test::make_world(params, Day::drive);
    CHECK(static_cast<double>(after.campus().leaves.size()) /
              static_cast<double>(before.campus().leaves.size()) ==
          doctest::Approx(0.75).epsilon(0.02));
    check_same(before, after, {});
    CHECK(after.campus().solids.size() == before.campus().solids.size());
    params.changes.leaves_gone = 1.0;
    CHECK(test::make_world(params, Day::drive).campus().leaves.empty());
  }
  SUBCASE("fences come, beside the streets") {
    params.changes.fences_new = 5;
    const World after = test::make_world(params, Day::drive);
    CHECK(difference(before, after, Surface::wall).gone.empty());
    CHECK(difference(before, after, Surface::wall).come.size() == 5);
    check_same(before, after, {Surface::wall});
    for (const Thing& thing : after.campus().things) {
      const double half_width = params.campus.street_width / 2.0;
      if (thing.kind != Surface::wall) continue;
      for (const double u : {-1.0, 0.0, 1.0}) {
        CHECK(after.streets().distance_to_street(thing.plot.at(u * thing.plot.half.x(), 0.0)) >
              half_width + 1.0);
      }
    }
  }
  SUBCASE("one kind of change alters nothing of another") {
    params.changes.moved_cars = 0.5;
    params.changes.buildings_gone = 1;
    const World some = test::make_world(params, Day::drive);
    params.changes.buildings_new = 1;
    params.changes.fences_new = 2;
    params.changes.leaves_gone = 0.5;
    const World more = test::make_world(params, Day::drive);
    CHECK((things_of(some, Surface::car) == things_of(more, Surface::car)));
    CHECK(difference(some, more, Surface::building).gone.empty());
    CHECK(difference(some, more, Surface::building).come.size() == 1);
  }
}

TEST_CASE("scans differ only where something changed") {
  WorldParams params = roomy_world();
  params.changes.moved_cars = 1.0;
  const World before = test::make_world(params), after = test::make_world(params, Day::drive);
  const Drive drive = test::make_drive(before, params);
  const Lidar lidar(params.lidar, params.seed);
  const auto is_near_a_moved_car = [&](const Point& p) {
    for (const World* world : {&before, &after}) {
      const World& other = world == &before ? after : before;
      const auto stays = things_of(other, Surface::car);
      for (const Thing& car : world->campus().things) {
        if (car.kind != Surface::car ||
            stays.contains({car.kind, car.plot.centre.x(), car.plot.centre.y()})) {
          continue;
        }
        if ((p.head<2>() - car.plot.centre).norm() < 3.0) return true;
      }
    }
    return false;
  };
  const Pose T_campus_sensor = drive.pose(drive.stamp(7));
  std::set<std::tuple<double, double, double>> seen;
  for (const Point& p : lidar.scan(before, drive, 7)) seen.emplace(p.x(), p.y(), p.z());
  std::size_t different = 0;
  for (const Point& p : lidar.scan(after, drive, 7)) {
    if (seen.contains({p.x(), p.y(), p.z()})) continue;
    ++different;
    // On a car that came, or behind one that left.
    const Point end = T_campus_sensor * p, start = T_campus_sensor.translation;
    bool passes = false;
    for (double t = 0.0; t <= 1.0; t += 0.5 / (end - start).norm()) {
      passes = passes || is_near_a_moved_car(start + t * (end - start));
    }
    CHECK((passes || is_near_a_moved_car(end)));
  }
  CHECK(different > 50);
  CHECK(different < seen.size() / 2);
}

TEST_CASE("a simulation with changes writes the same map and other scans") {
  const TemporaryFolder scratch;
  WorldParams params = roomy_world();
  params.drive.length = 6.0;
  params.drive.scan_every = 10;
  REQUIRE(simulate(params, scratch.path() / "a"));
  params.changes.moved_cars = 1.0;
  params.changes.leaves_gone = 1.0;
  REQUIRE(simulate(params, scratch.path() / "b"));
  const auto same = [&](const char* file) {
    return read_text(scratch.path() / "a" / file) == read_text(scratch.path() / "b" / file);
  };
  CHECK(same("map.pcd"));
  CHECK(same("reference.tum"));
  CHECK(same("odometry.tum"));
  CHECK_FALSE(same("scans/000000.pcd"));
  CHECK_FALSE(same("world.toml"));
}

}  // namespace
}  // namespace vantage::simulation
