// hpr on large maps: beside Qhull's hull of all points, where every point that the two disagree on
// is judged exactly; and against the exact rule on a part of them.
#include <doctest/doctest.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <string>
#include <vector>

#include "exact_visibility.hpp"
#include "scenes.hpp"
#include "simulate/map_sampler.hpp"
#include "simulate/world.hpp"

namespace vantage::test {
namespace {

struct Outcome {
  std::string error;  // empty: none
  Comparison comparison{};
};

Outcome outcome_at(PointsView map, const Point& viewpoint, const hpr::Settings& settings,
                   const VisibilityScene& scene, bool ask_function_too) {
  const auto seen = scene.visible(viewpoint);
  if (!seen) return {.error = to_string(seen.error())};
  if (ask_function_too) {
    const auto by_function = hpr::hidden_point_removal(map, viewpoint, settings);
    if (!by_function) return {.error = to_string(by_function.error())};
    if (*by_function != *seen) return {.error = "scene and function differ"};
  }
  const auto comparison = compare_with_qhull(*seen, map, viewpoint, settings);
  if (!comparison) return {.error = to_string(comparison.error())};
  return {.error = {}, .comparison = *comparison};
}

void check_beside_qhull(const PointCloud& map, const PointCloud& viewpoints,
                        const Question& question) {
  Bounds3 bounds = bounds_of(map);
  for (const Point& viewpoint : viewpoints) bounds.extend(viewpoint);
  const auto scene = scene_of(map, bounds, question);
  std::vector<Outcome> outcomes(viewpoints.size());
  tbb::parallel_for(std::size_t{0}, viewpoints.size(), [&](std::size_t k) {
    outcomes[k] = outcome_at(map, viewpoints[k], question.settings(bounds), *scene, k % 4 == 0);
  });
  Comparison all;
  for (std::size_t k = 0; k < viewpoints.size(); ++k) {
    const auto& [error, comparison] = outcomes[k];
    CAPTURE(viewpoints[k].transpose());
    CHECK_MESSAGE(error.empty(), error);
    CHECK(comparison.seen > 0);
    CHECK_MESSAGE(comparison.for_qhull == 0, to_string(question), ": of ", comparison.differences,
                  " points that Qhull says otherwise of, exactly right are only ",
                  comparison.for_us);
    all.seen += comparison.seen;
    all.differences += comparison.differences;
    all.for_us += comparison.for_us;
    all.for_qhull += comparison.for_qhull;
  }
  MESSAGE(map.size(), " points, ", viewpoints.size(), " viewpoints, ", to_string(question), ": ",
          all.seen, " seen, ", all.differences, " differences to Qhull, ", all.for_us,
          " judged for hpr, ", all.for_qhull, " for Qhull");
}

void check_exactly(const PointCloud& map, const PointCloud& viewpoints, const Question& question) {
  Bounds3 bounds = bounds_of(map);
  for (const Point& viewpoint : viewpoints) bounds.extend(viewpoint);
  const auto scene = scene_of(map, bounds, question);
  for (const Point& viewpoint : viewpoints) {
    const auto expected = exactly_seen(map, viewpoint, question.settings(bounds));
    const auto seen = scene->visible(viewpoint);
    REQUIRE(expected);
    REQUIRE_MESSAGE(seen, to_string(seen.error()));
    CHECK_MESSAGE(*seen == *expected, to_string(question));
  }
}

// Where the scans were taken, and some places where no scanner stands.
PointCloud street_viewpoints(const PointCloud& map) {
  PointCloud viewpoints;
  const Point corners[] = {
      {0.34, 0.01, 0.0}, {15.0, 1.0, 0.0}, {30.0, 2.0, -0.7}, {63.97, 9.27, -0.53}};
  for (std::size_t k = 0; k < 15; ++k) {
    const double s = static_cast<double>(k % 5) / 5.0;
    viewpoints.emplace_back((1.0 - s) * corners[k / 5] + s * corners[k / 5 + 1]);
  }
  viewpoints.push_back(corners[3]);
  viewpoints.push_back(map[map.size() / 2]);
  viewpoints.emplace_back(30.0, 2.0, 40.0);
  viewpoints.emplace_back(15.0, 1.0, -1.5);
  viewpoints.emplace_back(bounds_of(map).max + Point(5, 5, 5));
  return viewpoints;
}

TEST_CASE("exact: the recorded street") {
  const auto& map = street();
  if (!map) return;
  const PointCloud viewpoints = street_viewpoints(*map);
  REQUIRE(viewpoints.size() == 20);
  const PointCloud few{viewpoints[7], viewpoints[16]};
  SUBCASE("the flip, at 20 viewpoints") {
    PointCloud far, near;  // two ranges: Qhull takes a second for all points
    for (std::size_t k = 0; k < viewpoints.size(); ++k) {
      (k < 15 && k % 5 != 0 ? near : far).push_back(viewpoints[k]);
    }
    check_beside_qhull(*map, far, {.alpha = 100.0, .max_range = 100.0});
    check_beside_qhull(*map, near, {.alpha = 100.0, .max_range = 25.0});
  }
  SUBCASE("the inversion, at 20 viewpoints") {
    check_beside_qhull(*map, viewpoints, {.kernel = hpr::Kernel::inversion});
  }
  SUBCASE("other radii and a short range") {
    check_beside_qhull(*map, few, {.alpha = 1.0});
    check_beside_qhull(*map, few, {.alpha = 1e4, .max_range = 25.0});
  }
  SUBCASE("5,000 km away, every coordinate rounded to a nanometre") {
    const Eigen::Vector3d far(5e6 + 1.0 / 3.0, -4.9e6 + 0.1, 100.7);
    check_beside_qhull(translated(*map, far), translated(few, far), {.max_range = 25.0});
    check_beside_qhull(translated(*map, far), translated(few, far),
                       {.kernel = hpr::Kernel::inversion});
  }
  SUBCASE("what is wrong in an answer is found: every 5,000th point the other way round") {
    const auto settings = Question{}.settings(bounds_of(*map));
    const auto seen = hpr::hidden_point_removal(*map, viewpoints[7], settings);
    REQUIRE(seen);
    IndexList flipped, wrong;
    for (std::uint32_t i = 0; i < map->size(); i += 5'000) flipped.push_back(i);
    std::set_symmetric_difference(seen->begin(), seen->end(), flipped.begin(), flipped.end(),
                                  std::back_inserter(wrong));
    const auto comparison = compare_with_qhull(wrong, *map, viewpoints[7], settings);
    REQUIRE(comparison);
    CHECK(comparison->differences == flipped.size());
    CHECK(comparison->for_qhull == flipped.size());
  }
  SUBCASE("20,000 of its points, every one judged") {
    const PointCloud thin = thinned(*map, 20'000);
    check_exactly(thin, few, {});
    check_exactly(thin, viewpoints, {.kernel = hpr::Kernel::inversion});
  }
}

TEST_CASE("exact: a simulated campus") {
  simulation::WorldParams params;
  params.seed = 5;
  params.campus.size_x = 100.0;
  params.campus.size_y = 100.0;
  const auto world = simulation::World::create(params);
  REQUIRE_MESSAGE(world, to_string(world.error()));
  const PointCloud map = simulation::sample_map(*world, params.map, params.seed);
  REQUIRE(map.size() > 800'000);
  PointCloud viewpoints;
  for (int x = -2; x <= 2; ++x) {
    for (int y = -2; y <= 1; ++y) {
      const Eigen::Vector2d place(17.0 * x + 0.3, 17.0 * y + 8.2);
      viewpoints.emplace_back(place.x(), place.y(), world->terrain().height(place) + 1.0);
    }
  }
  REQUIRE(viewpoints.size() == 20);
  SUBCASE("the flip") { check_beside_qhull(map, viewpoints, {.max_range = 25.0}); }
  SUBCASE("the inversion") {
    check_beside_qhull(map, viewpoints, {.kernel = hpr::Kernel::inversion, .max_range = 25.0});
  }
}

}  // namespace
}  // namespace vantage::test
