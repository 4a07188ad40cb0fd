// visible_from_any is the union of visible, whatever work it shares between viewpoints.
#include <doctest/doctest.h>

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <random>
#include <vector>

#include "exact_visibility.hpp"
#include "scenes.hpp"
#include "support/reports.hpp"

namespace vantage::test {
namespace {

// 8 x 8 viewpoints in a level grid about a centre.
PointCloud grid(const Point& centre, double spacing) {
  PointCloud viewpoints;
  for (int x = -4; x < 4; ++x) {
    for (int y = -4; y < 4; ++y) viewpoints.emplace_back(centre + spacing * Point(x, y, 0));
  }
  return viewpoints;
}

IndexList union_of_visible(const VisibilityScene& scene, const PointCloud& viewpoints) {
  IndexList all;
  for (const Point& viewpoint : viewpoints) {
    const auto seen = scene.visible(viewpoint);
    CHECK_MESSAGE(seen, to_string(seen.error()));
    if (!seen) continue;
    all.insert(all.end(), seen->begin(), seen->end());
  }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

enum class Judged : bool { no, exactly };

void check_union(const PointCloud& map, const PointCloud& viewpoints, double range,
                 Judged judged = Judged::exactly) {
  Bounds3 bounds = bounds_of(map);
  for (const Point& viewpoint : viewpoints) bounds.extend(viewpoint);
  PointCloud shuffled = viewpoints;
  std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(1));
  PointCloud repeated = joined(viewpoints, shuffled);
  repeated.insert(repeated.begin(), 3, viewpoints.back());
  for (const Question& question :
       {Question{}, Question{.alpha = 1.0, .max_range = range},
        Question{.kernel = hpr::Kernel::inversion},
        Question{.kernel = hpr::Kernel::inversion, .max_range = range}}) {
    CAPTURE(to_string(question));
    const auto scene = scene_of(map, bounds, question);
    const IndexList expected = union_of_visible(*scene, viewpoints);
    for (const std::size_t threads : {1U, 2U}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      for (const PointCloud& asked : {viewpoints, shuffled, repeated}) {
        CAPTURE(threads);
        CAPTURE(asked.size());
        const Reports reports;
        const auto seen = scene->visible_from_any(asked, &reports);
        CHECK_MESSAGE(seen, to_string(seen.error()));
        CHECK(reports.viewpoints() == asked.size());
        CHECK(seen.value_or(IndexList{}) == expected);
      }
    }
    const auto fresh = scene_of(map, bounds, question)->visible_from_any(shuffled);
    CHECK(fresh.value_or(IndexList{}) == expected);
    if (judged == Judged::exactly) {
      CHECK(exactly_seen_from_any(map, viewpoints, question.settings(bounds)) == expected);
    }
  }
}

TEST_CASE("visible_from_any is the union of visible" * doctest::test_suite("slow")) {
  SUBCASE("lattice, viewpoints on its points") {
    check_union(lattice(3, 0.5), grid({0, 0, 0}, 0.5), 1.2);
  }
  SUBCASE("lattice, viewpoints amid its points") {
    check_union(lattice(3, 0.5), grid({0.25, 0.25, 0.25}, 0.5), 1.2);
  }
  SUBCASE("lattice, viewpoints anywhere") {
    check_union(lattice(3, 0.5), grid({0.03, 0.04, 0.11}, 0.37), 1.2);
  }
  SUBCASE("sphere, in and out") { check_union(sphere(400, 10.0), grid({0.5, 0.3, 0.1}, 3.1), 9.0); }
  SUBCASE("two parallel walls, about and between them") {
    check_union(joined(wall(10.0, 8, 0.1), wall(12.0, 8, 0.1)), grid({11, 0, 0}, 0.5), 2.0);
  }
  SUBCASE("ball") { check_union(ball(51, 500, 10.0), grid({0, 0, 0}, 2.0), 6.0); }
  SUBCASE("every point twice") {
    const PointCloud once = ball(52, 200, 10.0);
    check_union(joined(once, once), grid({0, 0, 0}, 2.0), 6.0);
  }
  SUBCASE("one plane, viewpoints in it") {
    PointCloud map = ball(53, 200, 5.0);
    for (Point& p : map) p.z() = 0.0;
    check_union(map, grid({0, 0, 0}, 1.3), 3.0);
  }
  SUBCASE("5,000 km away") {
    const Eigen::Vector3d far(5e6 + 1.0 / 3.0, -4.9e6, 100.1);
    check_union(translated(ball(54, 300, 10.0), far), translated(grid({0, 0, 0}, 2.0), far), 6.0);
  }
  SUBCASE("far fewer points than viewpoints") {
    check_union({{1, 0, 0}, {0, 1, 0}, {2, 0, 0}}, grid({0, 0, 0}, 0.5), 1.5);
  }
}

TEST_CASE("visible_from_any is the union of visible on the recorded street") {
  const auto& map = street();
  if (!map) return;
  check_union(thinned(*map, 4'000), grid({30.0, 2.0, -0.7}, 1.0), 30.0, Judged::no);
}

TEST_CASE("calls before, and calls at the same time, change nothing" *
          doctest::test_suite("slow")) {
  const PointCloud map = joined(lattice(6, 0.8), ball(3, 4000, 30.0, 6.0));
  std::vector<PointCloud> regions;
  for (const Point& centre :
       {Point(0, 0, 0.1), Point(20, 3, 0.2), Point(-9, 8, 0), Point(1, 1, 0)}) {
    regions.push_back(grid(centre, 0.4));
  }
  PointCloud many;  // more than a call leaves anything of
  for (const Point& centre : ball(5, 10, 8.0)) many = joined(many, grid(centre, 0.7));
  regions.push_back(many);
  regions.push_back(grid({0, 0, 0.1}, 0.2));

  Bounds3 bounds = bounds_of(map);
  for (const PointCloud& region : regions) {
    for (const Point& viewpoint : region) bounds.extend(viewpoint);
  }
  const Question question{.alpha = 2.0, .max_range = 25.0};
  std::vector<IndexList> expected;
  for (const PointCloud& region : regions) {
    expected.push_back(scene_of(map, bounds, question)->visible_from_any(region).value());
  }
  const auto scene = scene_of(map, bounds, question);
  for (int round = 0; round < 2; ++round) {
    for (std::size_t k = 0; k < regions.size(); ++k) {
      CHECK(scene->visible_from_any(regions[k]).value() == expected[k]);
    }
  }
  std::vector<IndexList> at_once(3 * regions.size());
  tbb::parallel_for(std::size_t{0}, at_once.size(), [&](std::size_t k) {
    at_once[k] = scene->visible_from_any(regions[k % regions.size()]).value();
  });
  for (std::size_t k = 0; k < at_once.size(); ++k) {
    CHECK(at_once[k] == expected[k % regions.size()]);
  }
}

TEST_CASE("hpr reports each viewpoint when it is done, and repeated ones in the end") {
  const PointCloud map = ball(57, 200, 10.0);
  const PointCloud viewpoints = ball(58, 3000, 5.0);
  Bounds3 bounds = bounds_of(map);
  for (const Point& viewpoint : viewpoints) bounds.extend(viewpoint);
  const auto scene = scene_of(map, bounds, {});
  const IndexList expected = scene->visible_from_any(viewpoints).value();
  for (const std::size_t threads : {1U, 2U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const Reports once, repeated;
    CHECK(scene->visible_from_any(viewpoints, &once).value() == expected);
    CHECK(once.calls() == 3000);
    CHECK(once.viewpoints() == 3000);
    CHECK(scene->visible_from_any(joined(viewpoints, viewpoints), &repeated).value() == expected);
    CHECK(repeated.calls() == 3001);
    CHECK(repeated.viewpoints() == 6000);
  }
}

TEST_CASE("visible_from_any of nothing, and of what is no viewpoint") {
  const PointCloud map = ball(55, 200, 10.0);
  const auto scene = scene_of(map, bounds_of(map), {});
  CHECK(scene->visible_from_any({}).value().empty());
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    PointCloud viewpoints = ball(56, 64, 5.0);
    viewpoints[40].y() = bad;
    const auto seen = scene->visible_from_any(viewpoints);
    REQUIRE(!seen);
    CHECK(seen.error().code == ErrorCode::invalid_input);
  }
}

}  // namespace
}  // namespace vantage::test
