// What a Sight sees from a viewpoint depends on nothing that it looked at before.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "exact_visibility.hpp"
#include "hidden_point_removal.hpp"
#include "scenes.hpp"
#include "sight.hpp"

namespace vantage::test {
namespace {

using hpr::PointOctree, hpr::Settings, hpr::Sight, hpr::UnknownPoints;
using Positions = std::vector<PointOctree::Index>;

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

Positions sorted(Positions positions) {
  std::sort(positions.begin(), positions.end());
  return positions;
}

Positions union_of(const std::vector<Positions>& all) {
  Positions either;
  for (const Positions& one : all) either.insert(either.end(), one.begin(), one.end());
  either = sorted(std::move(either));
  either.erase(std::unique(either.begin(), either.end()), either.end());
  return either;
}

// What a Sight sees that has seen nothing else.
std::vector<Positions> seen_at_first_sight(const PointOctree& octree, const PointCloud& stops,
                                           const Settings& settings) {
  std::vector<Positions> all;
  for (const Point& q : stops) {
    all.push_back(sorted(Sight(octree, settings).visible_from(q)));
  }
  return all;
}

enum class By : std::uint8_t { visible_from, mark_visible, mark_all_visible, turns };

// One Sight at all stops, one after the other; counts the stops where it sees something else.
std::size_t differences(const PointOctree& octree, const PointCloud& stops,
                        const Settings& settings, const std::vector<Positions>& expected, By by) {
  Sight sight(octree, settings);
  std::size_t differ = 0;
  for (std::size_t k = 0; k < stops.size(); ++k) {
    const By way = by != By::turns ? by : static_cast<By>((k * k + k / 3) % 3);
    UnknownPoints unknown(octree);
    if (way == By::mark_visible) sight.mark_visible(stops[k], unknown);
    if (way == By::mark_all_visible) sight.mark_all_visible(stops[k], unknown);
    const Positions seen =
        way == By::visible_from ? sorted(sight.visible_from(stops[k])) : unknown.seen();
    if (seen != expected[k]) ++differ;
  }
  return differ;
}

// R that reaches every point from every stop.
double reaching_radius(const PointCloud& map, const PointCloud& stops, double alpha) {
  Bounds3 bounds = bounds_of(map);
  for (const Point& q : stops) bounds.extend(q);
  return alpha * bounds.diagonal();
}

std::vector<Settings> settings_for(const PointCloud& map, const PointCloud& stops, double range) {
  std::vector<Settings> all;
  for (const double max_range : {kUnlimited, range}) {
    for (const double alpha : {1.0, 100.0}) {
      all.push_back({.radius = reaching_radius(map, stops, alpha), .max_range = max_range});
    }
    all.push_back({.kernel = hpr::Kernel::inversion, .max_range = max_range});
  }
  return all;
}

enum class Judged : bool { no, exactly };

void check_tour(const PointCloud& map, const PointCloud& stops, const Settings& settings,
                Judged judged = Judged::no) {
  CAPTURE(static_cast<int>(settings.kernel));
  CAPTURE(settings.radius);
  CAPTURE(settings.max_range);
  const PointOctree octree(map);
  const auto expected = seen_at_first_sight(octree, stops, settings);
  for (const By by : {By::visible_from, By::mark_visible, By::mark_all_visible, By::turns}) {
    CAPTURE(static_cast<int>(by));
    CHECK(differences(octree, stops, settings, expected, by) == 0);
  }
  const Positions any = union_of(expected);
  PointCloud order = stops;
  std::mt19937 random(1);
  for (int run = 0; run < 4; ++run) {
    UnknownPoints unknown(octree);
    Sight sight(octree, settings);
    for (const Point& q : order) sight.mark_visible(q, unknown);
    CHECK(unknown.seen() == any);
    std::shuffle(order.begin(), order.end(), random);
  }
  if (judged == Judged::no) return;
  std::size_t wrong = 0;
  for (std::size_t k = 0; k < stops.size(); ++k) {
    IndexList indices;
    for (const auto position : expected[k]) indices.push_back(octree.map_index(position));
    std::sort(indices.begin(), indices.end());
    if (exactly_seen(map, stops[k], settings).value() != indices) ++wrong;
  }
  CHECK(wrong == 0);
}

void check_tours(const PointCloud& map, const PointCloud& stops, double range,
                 Judged judged = Judged::no) {
  for (const Settings& settings : settings_for(map, stops, range)) {
    check_tour(map, stops, settings, judged);
  }
}

TEST_CASE("a Sight sees the same wherever it was before") {
  SUBCASE("ball") {
    check_tours(ball(1, 4000, 10.0), joined(ball(2, 12, 10.0), ball(3, 3, 30.0, 11.0)), 6.0);
  }
  SUBCASE("lattice, at its points, amid them and anywhere") {
    const PointCloud stops{{0, 0, 0},       {0.5, 0, 0},      {0.25, 0.25, 0.25}, {2, 2, 2},
                           {2, 0.25, -0.5}, {0.3, 0.2, 0.11}, {2, 0, 0},          {4, 0.5, 0.5},
                           {0, 0, 0},       {0.25, 0, 0},     {-2, 1, 0.5}};
    check_tours(lattice(4, 0.5), stops, 1.2, Judged::exactly);
  }
  SUBCASE("every point twice") {
    const PointCloud once = ball(4, 300, 10.0);
    check_tours(joined(once, once), joined(ball(5, 8, 10.0), thinned(once, 4)), 6.0,
                Judged::exactly);
  }
  SUBCASE("two parallel walls, from all sides") {
    const PointCloud stops{{0, 0, 0},     {11, 0, 0},     {11, 0.05, 0.1}, {10, 0, 0},
                           {10, 0.05, 0}, {14, 0, 0},     {8, 0, 0.05},    {0, 0, 0},
                           {10, 2, 0},    {11, 0.3, 0.2}, {12, 0, 0},      {10.5, 9, 0.1}};
    check_tours(joined(wall(10.0, 12, 0.1), wall(12.0, 12, 0.1)), stops, 2.0, Judged::exactly);
  }
  SUBCASE("5,000 km away") {
    const Eigen::Vector3d far(5e6 + 1.0 / 3.0, -4.9e6, 100.1);
    check_tours(translated(ball(6, 2000, 10.0), far), translated(ball(7, 8, 10.0), far), 6.0);
  }
}

TEST_CASE("a Sight sees the same after tiny steps and after huge ones") {
  const PointCloud map = joined(ball(8, 1500, 10.0, 0.5), lattice(2, 1.0));
  PointCloud stops;
  for (const Point& q : {Point(0.1, 0.2, 0.3), Point(1, 1, 1), Point(5, 5, 2)}) {
    stops.push_back(q);
    for (const double step : {1e-15, 1e-12, 1e-9, 1e-6, 1e-3}) {
      stops.emplace_back(q + step * Point(1, -1, 0.5));
    }
    stops.push_back(q);
  }
  SUBCASE("tiny") { check_tours(map, stops, 5.0); }
  SUBCASE("huge") {
    PointCloud jumps;
    for (std::size_t k = 0; k < 6; ++k) {
      jumps.push_back(stops[3 * k]);
      jumps.emplace_back(std::pow(10.0, static_cast<double>(k)) * Point(11, -3, 2));
    }
    check_tours(map, jumps, 5.0);
    check_tours(map, jumps, 50.0);
  }
}

// A ball, and far from it and from one another: one point, two, three on a line, a plane.
TEST_CASE("a Sight sees the same after places with few points in reach, or flat ones") {
  PointCloud map = ball(9, 800, 8.0);
  map.emplace_back(100, 0, 0);
  map.insert(map.end(), {{0, 100, 0}, {0, 101, 0}});
  map.insert(map.end(), {{0, 0, 100}, {0, 0, 101}, {0, 0, 102}, {0, 0, 102}});
  for (const Point& p : ball(10, 60, 4.0)) map.emplace_back(-100, p.y(), p.z());
  const PointCloud ball_stops = ball(11, 8, 8.0);
  const PointCloud sparse{{200, 0, 0},    {100, 1, 0},   {100, 0, 0},   {1, 100, 0.5},
                          {0, 99, 0},     {0, 0, 99},    {1, 0, 101},   {0, 0, 101.5},
                          {-100, 0.1, 0}, {-98, 0.3, 0}, {-100, 50, 0}, {-100, 4.5, 1}};
  PointCloud stops;
  for (std::size_t k = 0; k < sparse.size(); ++k) {
    stops.push_back(sparse[k]);
    stops.push_back(sparse[(5 * k + 3) % sparse.size()]);
    stops.push_back(ball_stops[k % ball_stops.size()]);
  }
  for (const double range : {6.0, 3.0}) {
    check_tour(map, stops, {.kernel = hpr::Kernel::inversion, .max_range = range}, Judged::exactly);
    check_tour(map, stops, {.radius = 1e4, .max_range = range}, Judged::exactly);
  }
}

TEST_CASE("a Sight sees the same where more points occlude than it takes along") {
  const PointCloud map = joined(sphere(45'000, 10.0), ball(12, 5'000, 14.0, 12.0));
  const PointCloud stops{{0, 0, 0}, {1, 2, -0.5}, {7, 0, 0}, {0.01, 0, 0}};
  const PointOctree octree(map);
  for (const Settings& settings : {flip(map, 100.0), flip(map, 1.0)}) {
    const auto expected = seen_at_first_sight(octree, stops, settings);
    CHECK(expected[0].size() > 33'000);
    CHECK(differences(octree, stops, settings, expected, By::turns) == 0);
  }
}

TEST_CASE("a Sight with nothing unknown left looks no further") {
  const PointCloud map = sphere(300, 5.0);
  const PointOctree octree(map);
  Sight sight(octree, inversion());
  UnknownPoints unknown(octree);
  sight.mark_visible(Point::Zero(), unknown);
  CHECK(!unknown.any_in(0));
  sight.mark_visible({1, 2, 3}, unknown);
  CHECK(unknown.seen().size() == map.size());
}

TEST_CASE("a Sight on the recorded street sees the same wherever it was before") {
  const auto& street_map = street();
  if (!street_map) return;
  const PointCloud map = thinned(*street_map, 60'000);
  const PointCloud stops{{0.34, 0.01, 0.0}, {1.0, 0.1, 0.0},   {30.0, 2.0, -0.7},
                         {30.0, 2.0, 40.0}, {30.0, 2.2, -0.7}, {63.97, 9.27, -0.53}};
  for (const double range : {kUnlimited, 25.0}) {
    const Settings of_flip{.radius = flip(map, 100.0).radius, .max_range = range};
    const Settings of_inversion{.kernel = hpr::Kernel::inversion, .max_range = range};
    for (const Settings& settings : {of_flip, of_inversion}) check_tour(map, stops, settings);
  }
}

}  // namespace
}  // namespace vantage::test
