// hpr against its stated rule, p* a vertex of Conv(P* u {0}) in exact arithmetic, where everything
// is degenerate and where nothing is; by the function and through a scene of the plugin.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "exact_visibility.hpp"
#include "scenes.hpp"

namespace vantage::test {
namespace {

struct Place {
  PointCloud map, viewpoints;
  double range;  // [m], cuts the map
};

// The box of the map and all viewpoints: with it R reaches every point for alpha >= 1.
Bounds3 bounds_with_viewpoints(const Place& place) {
  Bounds3 bounds = vantage::bounds_of(place.map);
  for (const Point& viewpoint : place.viewpoints) bounds.extend(viewpoint);
  return bounds;
}

Place moved(Place place, const Eigen::Vector3d& by) {
  return {translated(std::move(place.map), by), translated(std::move(place.viewpoints), by),
          place.range};
}

Place exactly_movable(Place place) {
  return {snapped(std::move(place.map)), snapped(std::move(place.viewpoints)), place.range};
}

std::vector<Question> questions(double range) {
  std::vector<Question> all;
  for (const double max_range : {std::numeric_limits<double>::infinity(), range}) {
    for (const double alpha : {1.0, 100.0, 1e4}) {
      all.push_back({.alpha = alpha, .max_range = max_range});
    }
    all.push_back({.kernel = hpr::Kernel::inversion, .max_range = max_range});
  }
  return all;
}

std::vector<Question> few_questions(double range) {
  return {{.alpha = 100.0}, {.kernel = hpr::Kernel::inversion, .max_range = range}};
}

std::vector<IndexList> exact_answers(const Place& place, const Question& question) {
  std::vector<IndexList> answers;
  for (const Point& viewpoint : place.viewpoints) {
    auto seen =
        exactly_seen(place.map, viewpoint, question.settings(bounds_with_viewpoints(place)));
    REQUIRE_MESSAGE(seen, to_string(seen.error()));
    answers.push_back(*std::move(seen));
  }
  return answers;
}

std::size_t differences(const IndexList& a, const IndexList& b) {
  IndexList either;
  std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(either));
  return either.size();
}

// One check for all viewpoints, which names the first that is wrong.
void check(const std::string& what, const Answers& answers, const Place& place,
           const std::vector<IndexList>& expected) {
  std::size_t wrong_viewpoints = 0, wrong_points = 0;
  std::string first;
  for (std::size_t k = 0; k < place.viewpoints.size(); ++k) {
    const auto seen = answers(place.viewpoints[k]);
    if (seen && *seen == expected[k]) continue;
    ++wrong_viewpoints;
    wrong_points += seen ? differences(*seen, expected[k]) : expected[k].size();
    if (!first.empty()) continue;
    const Point& q = place.viewpoints[k];
    first = "viewpoint " + std::to_string(q.x()) + " " + std::to_string(q.y()) + " " +
            std::to_string(q.z()) + ": " +
            (seen ? std::to_string(seen->size()) + " seen, exactly " +
                        std::to_string(expected[k].size())
                  : to_string(seen.error()));
  }
  CHECK_MESSAGE(wrong_viewpoints == 0, what, ": ", wrong_viewpoints, " of ",
                place.viewpoints.size(), " viewpoints differ, in ", wrong_points, " points; first ",
                first);
}

void check_both(const std::string& where, const Place& place, const Question& question,
                const std::vector<IndexList>& expected) {
  const std::string what = where + ", " + to_string(question);
  const Bounds3 bounds = bounds_with_viewpoints(place);
  check(what + ", function", by_function(place.map, bounds, question), place, expected);
  check(what + ", scene", by_scene(scene_of(place.map, bounds, question)), place, expected);
}

// Near the origin with all questions; 5,000 km away with a few, by a shift that is exact and by one
// that rounds every coordinate.
void check_everywhere(const Place& place) {
  REQUIRE(place.viewpoints.size() >= 20);
  for (const Question& question : questions(place.range)) {
    check_both("here", place, question, exact_answers(place, question));
  }
  const Place here = exactly_movable(place);
  const Place there = moved(here, {5e6, -5e6, 1024.0});
  const Place rounded = moved(place, {5e6 + 1.0 / 3.0, 4.9e6 - 0.7, 100.1});
  for (const Question& question : few_questions(place.range)) {
    check_both("moved exactly", there, question, exact_answers(here, question));
    check_both("moved and rounded", rounded, question, exact_answers(rounded, question));
  }
}

PointCloud lattice_viewpoints() {
  return {
      {0, 0, 0},          {0.5, 0.5, 0.5},    {2, 2, 2},       {2, 0, 0},        // on points
      {1, 0.5, -1.5},     {2, -2, 0.5},                                          //
      {0.3, 0.1, 0},      {0.1, 0.3, 0.5},    {2, 0.2, 0.7},   {0.3, -1, 0.2},   // on planes
      {0.1, 0, 0},        {0.25, 0, 0.5},     {2, 2, 0.3},                       // on lines
      {0.25, 0.25, 0},    {0.25, 0.25, 0.25}, {0.2, 0.2, 0.2}, {0.3, -0.3, 0},   // symmetric
      {3, 0, 0},          {3, 0.25, 0.5},     {3, 3, 0},       {2.5, 2.5, 2.5},  // outside
      {0, 0, -2.5},       {2.1, 0.3, -0.4},                                      //
      {0.11, 0.07, 0.19}, {1.3, -0.7, 1.2},   {3, 2.6, 2.3},                     // generic
  };
}

TEST_CASE("exact: a cubic lattice") {
  check_everywhere({lattice(4, 0.5), lattice_viewpoints(), 1.5});
}

TEST_CASE("exact: a cubic lattice with a spacing that is no binary fraction") {
  Place place{lattice(4, 0.1), lattice_viewpoints(), 0.3};
  for (Point& viewpoint : place.viewpoints) viewpoint *= 0.2;
  check_everywhere(place);
}

TEST_CASE("exact: a sphere") {
  Place place{sphere(700, 10.0), {}, 9.0};
  place.viewpoints = {{0, 0, 0}, {3, -2, 1}, {9.9, 0, 0}, {0, 0, 10}, {12, 1, 2}, {0, 0, -11}};
  for (const std::size_t k : {0U, 17U, 350U, 699U}) place.viewpoints.push_back(place.map[k]);
  for (const Point& p : sphere(5, 10.0)) place.viewpoints.push_back(p);
  for (const Point& p : ball(21, 7, 10.0)) place.viewpoints.push_back(p);
  check_everywhere(place);
}

TEST_CASE("exact: points that are exactly on one sphere") {
  PointCloud map;  // whole numbers with x^2 + y^2 + z^2 = 65^2
  for (int x = -65; x <= 65; ++x) {
    for (int y = -65; y <= 65; ++y) {
      const int rest = 65 * 65 - x * x - y * y;
      const int z = rest < 0 ? -1 : static_cast<int>(std::lround(std::sqrt(rest)));
      if (z < 0 || z * z != rest) continue;
      map.emplace_back(x, y, z);
      if (z != 0) map.emplace_back(x, y, -z);
    }
  }
  REQUIRE(map.size() > 300);
  Place place{map, {{0, 0, 0}, {1, 0, 0}, {0, 8, 8}, {65, 0, 0}, {0, 0, -65}}, 70.0};
  for (std::size_t k = 0; k < 5; ++k) place.viewpoints.push_back(map[k * map.size() / 5]);
  for (const Point& p : lattice(1, 16.0)) {
    if (p.x() > 0) place.viewpoints.push_back(p);
  }
  place.viewpoints.emplace_back(12.3, 25.6, -18.9);
  check_everywhere(place);
}

TEST_CASE("exact: two parallel walls") {
  // x = 10 and x = 12, |y| <= 0.95, |z| <= 1, samples 10 cm apart; (x, 0, 0) is amid two of them.
  Place place{joined(wall(10.0, 10, 0.1), wall(12.0, 10, 0.1)), {}, 11.0};
  place.viewpoints = {{0, 0, 0},      {9, 0, 0},        {9.9, 0, 0},        {14, 0, 0},     // axis
                      {11, 0, 0},     {11, 0.05, 0.1},  {11, 0.3, 0},       {11, 0, 0.35},  // amid
                      {10, 0, 0},     {10, 0.05, 0},    {10, 0.02, 0.3},    {10, 2, 0},  // in one
                      {12, 0.1, 0.1}, {12, 0, -3},      {12, 0.95, 1},                   //
                      {9, 0.05, 0.1}, {8, 0, 0.05},     {10.5, 0.95, 1},                 // on edges
                      {3, 0.4, -0.3}, {11.3, 0.2, 0.6}, {10.1, -0.43, 0.71}};
  check_everywhere(place);
}

TEST_CASE("exact: a random ball") {
  Place place{ball(31, 900, 10.0), ball(32, 18, 9.0), 6.0};
  for (const Point& p : {Point(11, 0, 0), Point(-9, 9, 3), place.map[7], place.map[8]}) {
    place.viewpoints.push_back(p);
  }
  check_everywhere(place);
}

TEST_CASE("exact: every point twice, some thrice") {
  const PointCloud random = ball(33, 250, 10.0), grid = lattice(2, 2.0);
  PointCloud map = joined(joined(random, grid), joined(random, grid));
  map.insert(map.end(), random.begin(), random.begin() + 100);
  Place place{map, ball(34, 12, 9.0), 6.0};
  for (const Point& p : {Point(0, 0, 0), Point(1, 1, 1), Point(2, 2, 0), Point(0.5, 0, 0),
                         Point(4, 4, 4), Point(6, 0, 0), random[3], random[4], random[200]}) {
    place.viewpoints.push_back(p);
  }
  check_everywhere(place);
}

TEST_CASE("exact: all points in one plane, the viewpoint in it and beside it") {
  PointCloud flat;  // z = 0
  for (int x = -6; x <= 6; ++x) {
    for (int y = -6; y <= 6; ++y) flat.emplace_back(0.5 * x, 0.5 * y, 0.0);
  }
  const PointCloud in_plane{{0, 0, 0},      {0.5, 1, 0},     {3, 3, 0},     {3, 0, 0},
                            {0.25, 0, 0},   {0.25, 0.25, 0}, {0.1, 0.2, 0}, {0.1, 0.1, 0},
                            {3, 0.3, 0},    {4, 0, 0},       {4, 4, 0},     {5, 1.3, 0},
                            {2.1, -2.3, 0}, {0, 0, 1},       {0.25, 0, 2},  {0.5, 0.5, 0.5},
                            {0, 4, 1},      {0.3, 0.2, 3},   {1, 2, 1e-9},  {2.5, 2.5, -1}};
  SUBCASE("level, a lattice") { check_everywhere({flat, in_plane, 2.0}); }
  SUBCASE("level, random") {
    PointCloud map = ball(35, 200, 5.0);
    for (Point& p : map) p.z() = 0.0;
    check_everywhere({map, in_plane, 2.0});
  }
  SUBCASE("oblique, x, y, x + 2 y") {
    Place place{flat, in_plane, 4.0};
    for (PointCloud* points : {&place.map, &place.viewpoints}) {
      for (Point& p : *points) p.z() += p.x() + 2.0 * p.y();
    }
    check_everywhere(place);
  }
}

TEST_CASE("exact: all points on one line, the viewpoint on it and beside it") {
  for (const Eigen::Vector3d& along :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(1, -2, 3), Eigen::Vector3d(0.3, 0.1, -0.7)}) {
    Place place{{}, {}, 3.0};
    for (int k = -20; k <= 20; ++k) place.map.push_back(0.25 * k * along);
    place.map.push_back(place.map[3]);
    place.map.push_back(place.map[20]);
    for (const double s : {0.0, 0.25, 0.1, 1.0, 1.125, -3.0, -3.1, 5.0, -5.0, 5.5, -7.0, 0.125}) {
      place.viewpoints.push_back(s * along);
    }
    for (const double s : {0.0, 1.0, -2.0, 0.3, 5.0, 6.0, -5.1, 0.125}) {
      place.viewpoints.push_back(s * along + Point(0.5, 0.5, 0.5));
    }
    check_everywhere(place);
  }
}

TEST_CASE("exact: larger maps" * doctest::test_suite("slow")) {
  const auto check_here = [](const Place& place, const std::vector<Question>& asked) {
    for (const Question& question : asked) {
      check_both("here", place, question, exact_answers(place, question));
    }
  };
  SUBCASE("31^3 lattice") {
    const Question flip{}, inversion{.kernel = hpr::Kernel::inversion};
    check_here({lattice(15, 0.5), {{0, 0, 0}, {7.5, 0.2, 0.7}, {0.11, 0.07, 0.19}}, 4.0},
               {flip, inversion});
  }
  SUBCASE("ball of 20,000") {
    check_here({ball(36, 20'000, 10.0), ball(37, 2, 10.0), 5.0}, few_questions(5.0));
  }
}

TEST_CASE("what is hidden can go: the rest is seen as before") {
  const auto check_removal = [](const Place& place) {
    const Bounds3 bounds = bounds_with_viewpoints(place);
    for (const Question& question : questions(place.range)) {
      for (const Point& viewpoint : place.viewpoints) {
        const auto seen = by_function(place.map, bounds, question)(viewpoint);
        REQUIRE(seen);
        std::mt19937 random(1);
        IndexList kept;  // the seen and every other of the hidden
        for (std::uint32_t i = 0; i < place.map.size(); ++i) {
          if (std::binary_search(seen->begin(), seen->end(), i) || random() % 2 == 0) {
            kept.push_back(i);
          }
        }
        const PointCloud rest = select(place.map, kept);
        auto again = by_function(rest, bounds, question)(viewpoint);
        REQUIRE(again);
        for (std::uint32_t& i : *again) i = kept[i];
        CHECK_MESSAGE(*again == *seen, to_string(question));
      }
    }
  };
  SUBCASE("random") { check_removal({ball(41, 2000, 10.0), ball(42, 4, 8.0), 6.0}); }
  SUBCASE("lattice") {
    check_removal({lattice(4, 0.5), {{0, 0, 0}, {0.25, 0, 0}, {0.11, 0.07, 0.19}}, 1.5});
  }
}

// A quarter turn about z. Coordinates are multiples of 2^-10, so that squared distances are exact
// in any order of summation and p* turns with p.
TEST_CASE("a quarter turn and a permutation of the map turn and permute what is seen") {
  const auto turn = [](const Point& p) { return Point(-p.y(), p.x(), p.z()); };
  const auto check_turned = [&](PointCloud map, PointCloud viewpoints) {
    for (PointCloud* points : {&map, &viewpoints}) {
      for (Point& p : *points) p = (p * 0x1p10).array().round() * 0x1p-10;
    }
    IndexList order(map.size());
    std::iota(order.begin(), order.end(), 0U);
    std::shuffle(order.begin(), order.end(), std::mt19937(2));
    PointCloud turned;
    for (const std::uint32_t i : order) turned.push_back(turn(map[i]));
    for (const Question& question : questions(3.0)) {
      const hpr::Settings settings = question.settings({{-16, -16, -16}, {16, 16, 16}});
      for (const Point& viewpoint : viewpoints) {
        const auto seen = hpr::hidden_point_removal(map, viewpoint, settings);
        auto after = hpr::hidden_point_removal(turned, turn(viewpoint), settings);
        REQUIRE(seen);
        REQUIRE(after);
        for (std::uint32_t& i : *after) i = order[i];
        std::sort(after->begin(), after->end());
        CHECK_MESSAGE(*after == *seen, to_string(question));
      }
    }
  };
  SUBCASE("random") { check_turned(ball(43, 2000, 10.0), ball(44, 4, 8.0)); }
  SUBCASE("lattice") {
    check_turned(lattice(4, 0.5), {{0, 0, 0}, {0.25, 0, 0}, {0.25, 0.5, 0.125}, {2, 0.5, 0.25}});
  }
  SUBCASE("walls") { check_turned(joined(wall(5, 8, 0.125), wall(6, 8, 0.125)), {{0, 0, 0}}); }
}

}  // namespace
}  // namespace vantage::test
