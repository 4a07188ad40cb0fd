#include "simulate/layouts.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "simulate/lidar.hpp"
#include "small_world.hpp"

namespace vantage::simulation {
namespace {

/// A level campus with a long straight street, and a sensor without noise that does not see its
/// ends.
WorldParams long_street(Layout layout) {
  WorldParams params = test::small_world();
  params.campus.layout = layout;
  params.campus.size_x = 80.0;
  params.campus.size_y = 240.0;
  params.campus.street_spacing = 120.0;
  params.campus.street_jitter = 0.0;
  params.campus.ground_relief = 0.0;
  params.lidar.range_noise = params.lidar.dropout = params.lidar.grazing_angle = 0.0;
  params.lidar.azimuth_step = 1.0;
  params.lidar.max_range = 20.0;
  return params;
}

/// A sensor on the long street, looking along it.
struct OnLongStreet {
  explicit OnLongStreet(Layout layout) : params(long_street(layout)) {}

  /// 1 m above the ground.
  [[nodiscard]] Point above(const Eigen::Vector2d& place) const {
    return {place.x(), place.y(), world.terrain().height(place) + 1.0};
  }
  /// What the sensor sees from a place, ray by ray.
  [[nodiscard]] std::vector<double> ranges_from(const Eigen::Vector2d& place) const {
    std::vector<double> ranges;
    for (int firing = 0; firing < 360; ++firing) {
      for (int ring = 0; ring < 16; ++ring) {
        const auto hit = world.cast(above(place), lidar.direction(firing, ring), 20.0);
        ranges.push_back(hit ? hit->range : -1.0);
      }
    }
    return ranges;
  }

  WorldParams params;
  World world = test::make_world(params);
  Lidar lidar{params.lidar, params.seed};
  Eigen::Vector2d from = tunnel_street(world.streets()).from;
  Eigen::Vector2d to = tunnel_street(world.streets()).to;
  Eigen::Vector2d along = (to - from).normalized(), middle = (from + to) / 2.0;
};

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) largest = std::max(largest, std::abs(a[k] - b[k]));
  return largest;
}

TEST_CASE("places a house apart in a row look alike, others do not") {
  const OnLongStreet street(Layout::rows);
  const auto seen = street.ranges_from(street.middle);
  const auto& things = street.world.campus().things;
  CHECK(std::any_of(things.begin(), things.end(),
                    [](const Thing& thing) { return thing.kind == Surface::car; }));
  for (const int houses : {-2, -1, 1, 2}) {
    CAPTURE(houses);
    const auto there = street.ranges_from(street.middle + houses * kRowPitch * street.along);
    CHECK(largest_difference(seen, there) < 1e-3);
  }
  CHECK(largest_difference(seen, street.ranges_from(street.middle + 4.0 * street.along)) > 0.5);
  // The ends of the street are like no other place.
  CHECK(largest_difference(street.ranges_from(street.from), street.ranges_from(street.to)) > 0.5);
}

TEST_CASE("a tunnel has no features, and the street outside has") {
  const OnLongStreet street(Layout::tunnel);
  const World& world = street.world;
  const Eigen::Vector2d& along = street.along;
  const auto seen = street.ranges_from(street.middle);
  for (const double metres : {-9.0, -3.3, 0.1, 5.0, 9.9}) {  // 20 m from the mouths
    CAPTURE(metres);
    const auto there = street.ranges_from(street.middle + metres * along);
    CHECK(largest_difference(seen, there) < 1e-3);
  }
  CHECK(largest_difference(seen, street.ranges_from(street.middle + 35.0 * along)) > 0.5);
  // A ceiling, and a wall on either side.
  const Point inside = street.above(street.middle);
  const auto ceiling = world.cast(inside, Eigen::Vector3d::UnitZ(), 20.0);
  REQUIRE(ceiling);
  CHECK(ceiling->range ==
        doctest::Approx(street.params.campus.overpass_clearance - 1.0).epsilon(1e-3));
  for (const double side : {-1.0, 1.0}) {
    const auto wall = world.cast(inside, {-side * along.y(), side * along.x(), 0.0}, 20.0);
    REQUIRE(wall);
    CHECK(wall->surface == Surface::wall);
    CHECK(wall->range == doctest::Approx(street.params.campus.street_width / 2.0).epsilon(1e-3));
  }
  test::check_refused(
      "schema = 1\n[campus]\nlayout = \"tunnel\"\nsize_x = 80.0\nsize_y = 240.0\n"
      "street_spacing = 120.0\nstreet_jitter = 0.0\ntunnel_length = 95.0\n",
      "w.toml:8:17: error: campus.tunnel_length (95.0 m) does not fit its street: at most 90.0 m");
}

TEST_CASE("a square is empty and level") {
  WorldParams params = test::small_world();
  params.campus.layout = Layout::square;
  params.campus.size_x = params.campus.size_y = 120.0;
  params.campus.square_radius = 35.0;
  const World world = test::make_world(params);
  CHECK(world.campus().things.size() > 20);
  for (const Solid& solid : world.campus().solids) {
    for (const Face& face : solid.faces) {
      for (const Point& corner : face.corners) CHECK(corner.head<2>().norm() >= 35.0);
    }
  }
  for (const Leaf& leaf : world.campus().leaves) {
    for (const Point& corner : leaf) CHECK(corner.head<2>().norm() >= 35.0);
  }
  double low = 1.0, high = -1.0;
  for (double x = -24.0; x <= 24.0; x += 3.0) {
    for (double y = -24.0; y <= 24.0; y += 3.0) {
      low = std::min(low, world.terrain().height(x, y));
      high = std::max(high, world.terrain().height(x, y));
    }
  }
  CHECK(low == 0.0);
  CHECK(high == 0.0);
}

}  // namespace
}  // namespace vantage::simulation
