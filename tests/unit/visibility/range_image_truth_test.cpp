// range_image against what a recorded sensor did see; prints the table of its README.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <unordered_map>
#include <vector>

#include "scenes.hpp"
#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "vantage/kit/hash.hpp"

namespace vantage::test {
namespace {

constexpr double kClose = 0.05;     // [m]
constexpr std::size_t kEvery = 11;  // scans of the recording

/// Points by cubes of kClose, to find those within kClose of a place.
class Nearby {
 public:
  explicit Nearby(const PointCloud& points) {
    for (const Point& p : points) cells_[key(cell_of(p))].push_back(p);
  }
  [[nodiscard]] bool any(const Point& place) const {
    const Eigen::Array3d cell = cell_of(place);
    for (const double x : {-1.0, 0.0, 1.0}) {
      for (const double y : {-1.0, 0.0, 1.0}) {
        for (const double z : {-1.0, 0.0, 1.0}) {
          const auto found = cells_.find(key(cell + Eigen::Array3d(x, y, z)));
          if (found == cells_.end()) continue;
          for (const Point& p : found->second) {
            if ((p - place).norm() < kClose) return true;
          }
        }
      }
    }
    return false;
  }

 private:
  static Eigen::Array3d cell_of(const Point& p) { return (p / kClose).array().floor(); }
  static std::uint64_t key(const Eigen::Array3d& cell) {  // unique within 52 km
    std::uint64_t key = 0;
    for (const double x : cell) key = key << 21U | static_cast<std::uint64_t>(x + 0x1p20);
    return scatter(key);
  }
  std::unordered_map<std::uint64_t, std::vector<Point>> cells_;
};

/// A place where the sensor was.
struct View {
  Point viewpoint;
  std::vector<bool> was_seen;  // of each point of the map
  std::size_t count = 0;
};

std::vector<View> views(const PointCloud& map) {
  const auto poses = io::read_trajectory(*real_data("kitti_street/ref_poses.txt"));
  REQUIRE(poses);
  std::vector<View> all;
  for (std::size_t k = kEvery / 2; k < poses->size(); k += kEvery) {
    std::array<char, 64> file{};
    std::snprintf(file.data(), file.size(), "kitti_street/scans/%06d.pcd",
                  static_cast<int>(std::lround(10.0 * (*poses)[k].stamp)));
    const auto scan = io::read_point_cloud(*real_data(file.data()));
    REQUIRE(scan);
    PointCloud points;
    for (const Point& p : scan->points) points.push_back((*poses)[k].pose * p);
    const Nearby nearby(points);
    View view{.viewpoint = (*poses)[k].pose.translation, .was_seen = {}};
    for (const Point& p : map) {
      view.was_seen.push_back(nearby.any(p));
      view.count += view.was_seen.back() ? 1 : 0;
    }
    all.push_back(std::move(view));
  }
  return all;
}

struct Found {
  double share = 0.0;   // of the map that is seen
  double recall = 0.0;  // of what the sensor saw
};

Found found(const std::string& name, const std::string& params, const PointCloud& map,
            const std::vector<View>& views) {
  const auto visibility = plugin<VisibilityOperator>(name, params);
  const auto scene = visibility->prepare(map, {.map_bounds = bounds_of(map)});
  REQUIRE(scene);
  Found mean;
  for (const View& view : views) {
    const auto seen = (*scene)->visible(view.viewpoint);
    REQUIRE(seen);
    std::size_t rightly = 0;
    for (const std::uint32_t i : *seen) rightly += view.was_seen[i] ? 1 : 0;
    const auto n = static_cast<double>(views.size());
    mean.share += static_cast<double>(seen->size()) / static_cast<double>(map.size()) / n;
    mean.recall += static_cast<double>(rightly) / static_cast<double>(view.count) / n;
  }
  std::printf("%-12s %-24s %5.1f %% of the map, %5.1f %% of what the scans saw\n", name.c_str(),
              params.c_str(), 100.0 * mean.share, 100.0 * mean.recall);
  return mean;
}

TEST_CASE("range_image on the recorded street" * doctest::test_suite("slow")) {
  if (!street()) return;
  const std::vector<View> all = views(*street());
  REQUIRE(all.size() == 7);

  // Points taken at random would hold as much of what was seen as of the map.
  const Found defaults = found("range_image", "", *street(), all);
  CHECK(defaults.recall > 2.5 * defaults.share);
  CHECK(defaults.recall > 0.4);
  const Found finer = found("range_image", "rings = 256", *street(), all);
  CHECK(finer.recall > defaults.recall);
  const Found tolerant = found("range_image", "tolerance = 1.0", *street(), all);
  CHECK(tolerant.recall > defaults.recall);
  const Found smaller = found("range_image", "point_spacing = 0.05", *street(), all);
  CHECK(smaller.recall > defaults.recall);
  const Found points = found("range_image", "point_spacing = 0.0", *street(), all);
  CHECK(points.recall > smaller.recall);
}

}  // namespace
}  // namespace vantage::test
