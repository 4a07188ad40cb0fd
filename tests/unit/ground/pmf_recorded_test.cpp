#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <sstream>

#include "support/plugins.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"

namespace vantage {
namespace {

struct Labelled {
  PointCloud points;
  std::vector<bool> is_ground;  // if the file has labels
};

/// Binary PCD with float x y z and perhaps a 32-bit label.
Labelled read_binary_pcd(const std::filesystem::path& path) {
  const std::string content = test::read_text(path);
  const auto field = [&](const std::string& name) {
    const std::size_t at = content.find("\n" + name + " ") + name.size() + 2;
    return content.substr(at, content.find('\n', at) - at);
  };
  const std::string fields = field("FIELDS"), mark = "DATA binary\n";
  REQUIRE((fields == "x y z" || fields == "x y z label"));
  const bool labels = fields == "x y z label";
  const std::size_t step = labels ? 16 : 12, n = std::stoul(field("POINTS"));
  const std::size_t data = content.find(mark) + mark.size();
  REQUIRE(data + n * step <= content.size());
  Labelled cloud;
  for (std::size_t k = 0; k < n; ++k) {
    std::array<float, 3> xyz{};
    std::uint32_t label = 0;
    std::memcpy(xyz.data(), content.data() + data + k * step, 12);
    if (labels) std::memcpy(&label, content.data() + data + k * step + 12, 4);
    cloud.points.emplace_back(xyz[0], xyz[1], xyz[2]);
    cloud.is_ground.push_back(label == 1);
  }
  return cloud;
}

TEST_CASE("the ISPRS filter test: one parameter set, mean total error below 6 %") {
  const auto folder = test::real_data("isprs_ground");
  if (!folder) return;
  const auto filter = test::plugin<GroundFilter>("pmf");
  double sum = 0.0, sum_kappa = 0.0;
  int samples = 0;
  std::cout << "sample   type I  type II  total   kappa  [%]\n"
            << std::fixed << std::setprecision(1);
  for (const std::string sample : {"11", "21", "23", "31", "42", "52", "53", "61"}) {
    const Labelled cloud = read_binary_pcd(*folder / ("samp" + sample + ".pcd"));
    const auto ground = filter->ground(cloud.points);
    REQUIRE_MESSAGE(ground, to_string(ground.error()));
    std::vector<bool> found(cloud.points.size());
    for (const std::uint32_t k : *ground) found[k] = true;
    double a = 0, b = 0, c = 0, d = 0;  // ground kept and lost, objects kept and removed
    for (std::size_t k = 0; k < found.size(); ++k) {
      (cloud.is_ground[k] ? (found[k] ? a : b) : (found[k] ? c : d)) += 1.0;
    }
    const double n = a + b + c + d, agreement = (a + d) / n;
    const double chance = ((a + b) * (a + c) + (c + d) * (b + d)) / (n * n);
    const double total = 100.0 * (1.0 - agreement),
                 kappa = 100.0 * (agreement - chance) / (1.0 - chance);
    std::cout << "samp" << sample << std::setw(9) << 100.0 * b / (a + b) << std::setw(8)
              << 100.0 * c / (c + d) << std::setw(8) << total << std::setw(8) << kappa << '\n';
    CHECK(total < 15.0);
    sum += total;
    sum_kappa += kappa;
    ++samples;
  }
  std::cout << "mean" << std::setw(27) << sum / samples << std::setw(8) << sum_kappa / samples
            << '\n';
  CHECK(sum / samples < 6.0);
  CHECK(sum_kappa / samples > 77.0);
}

TEST_CASE("on a recorded street the ground is found where the car drove, and nothing above it") {
  const auto folder = test::real_data("kitti_street");
  if (!folder) return;
  constexpr double kSensorHeight = 1.73;
  const PointCloud map = read_binary_pcd(*folder / "map.pcd").points;
  PointCloud path;
  std::istringstream poses(test::read_text(*folder / "ref_poses_tum.txt"));
  for (std::string line; std::getline(poses, line);) {
    std::istringstream numbers(line);
    double t = 0, x = 0, y = 0, z = 0;
    REQUIRE((numbers >> t >> x >> y >> z));
    path.emplace_back(x, y, z);
  }
  REQUIRE(path.size() > 50);

  const auto ground = test::plugin<GroundFilter>("pmf")->ground(map);
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
  std::cout << "kitti_street: " << ground->size() << " of " << map.size()
            << " points are ground; within 2 m of the path " << road_found << " of " << road
            << " road points found, " << above << " of " << near << " more than 0.5 m off\n";
  CHECK(road > 10'000);
  CHECK(road_found > 0.95 * road);
  CHECK(above < 0.002 * near);
  for (const int points : below_pose) CHECK(points > 0);
}

}  // namespace
}  // namespace vantage
