#include <doctest/doctest.h>

#include <cmath>
#include <iomanip>
#include <iostream>
#include <sstream>
#include <string>

#include "ground_samples.hpp"
#include "support/plugins.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "vantage/ground_filter.hpp"

namespace vantage {
namespace {

TEST_CASE("the ISPRS filter test: one parameter set, the mean error within its bound") {
  const auto folder = test::real_data("isprs_ground");
  if (!folder) return;
  std::string plugin;
  double most_total = 0.0, least_kappa = 0.0;
  SUBCASE("pmf") {
    plugin = "pmf";
    most_total = 6.0;
    least_kappa = 77.0;
  }
  SUBCASE("smrf") {
    plugin = "smrf";
    most_total = 5.0;
    least_kappa = 81.0;
  }
  const auto filter = test::plugin<GroundFilter>(plugin);
  double total = 0.0, kappa = 0.0;
  std::cout << std::setw(8) << plugin << "   type I  type II  total   kappa  [%]\n"
            << std::fixed << std::setprecision(1);
  for (const std::string& sample : benchmarks::kGroundSamples) {
    const auto cloud = benchmarks::read_labelled(*folder / ("samp" + sample + ".pcd"));
    const auto ground = filter->ground(cloud.points);
    REQUIRE_MESSAGE(ground, to_string(ground.error()));
    const auto errors = benchmarks::errors_of(cloud, *ground);
    std::cout << "  samp" << sample << std::setw(9) << errors.type_1 << std::setw(8)
              << errors.type_2 << std::setw(8) << errors.total << std::setw(8) << errors.kappa
              << '\n';
    CHECK(errors.total < 15.0);
    total += errors.total / static_cast<double>(benchmarks::kGroundSamples.size());
    kappa += errors.kappa / static_cast<double>(benchmarks::kGroundSamples.size());
  }
  std::cout << "    mean" << std::setw(25) << total << std::setw(8) << kappa << '\n';
  CHECK(total < most_total);
  CHECK(kappa > least_kappa);
}

TEST_CASE("on a recorded street the ground is found where the car drove, and nothing above it") {
  const auto folder = test::real_data("kitti_street");
  if (!folder) return;
  std::string plugin;
  SUBCASE("pmf") { plugin = "pmf"; }
  SUBCASE("smrf") { plugin = "smrf"; }
  CAPTURE(plugin);
  constexpr double kSensorHeight = 1.73;
  const PointCloud map = benchmarks::read_labelled(*folder / "map.pcd").points;
  PointCloud path;
  std::istringstream poses(test::read_text(*folder / "ref_poses_tum.txt"));
  for (std::string line; std::getline(poses, line);) {
    std::istringstream numbers(line);
    double t = 0, x = 0, y = 0, z = 0;
    REQUIRE((numbers >> t >> x >> y >> z));
    path.emplace_back(x, y, z);
  }
  REQUIRE(path.size() > 50);

  const auto ground = test::plugin<GroundFilter>(plugin)->ground(map);
  REQUIRE_MESSAGE(ground, to_string(ground.error()));
  std::vector<bool> found(map.size());
  for (const std::uint32_t k : *ground) found[k] = true;

  int road = 0, road_found = 0, near = 0, above = 0;
  std::vector<int> below_pose(path.size());
  for (std::size_t k = 0; k < map.size(); ++k) {
    double least = 2.0;
    std::size_t pose = path.size();
    for (std::size_t i = 0; i < path.size(); ++i) {
      const double d = (path[i] - map[k]).head<2>().norm();
      if (d < least) {
        least = d;
        pose = i;
      }
    }
    if (pose == path.size()) continue;
    const double height = map[k].z() - (path[pose].z() - kSensorHeight);
    if (std::abs(height) < 0.15) {
      ++road;
      road_found += found[k] ? 1 : 0;
    }
    if (!found[k]) continue;
    ++near;
    above += std::abs(height) > 0.5 ? 1 : 0;
    ++below_pose[pose];
  }
  std::cout << "kitti_street, " << plugin << ": " << ground->size() << " of " << map.size()
            << " points are ground; within 2 m of the path " << road_found << " of " << road
            << " road points found, " << above << " of " << near << " more than 0.5 m off\n";
  CHECK(road > 10'000);
  CHECK(road_found > 0.95 * road);
  CHECK(above < 0.002 * near);
  for (const int points : below_pose) CHECK(points > 0);
}

}  // namespace
}  // namespace vantage
