// V: the contract of a VisibilityOperator.
#include "vantage/visibility.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "clauses.hpp"
#include "indices.hpp"
#include "scenes.hpp"

namespace vantage::conformance {
namespace {

// Share of what is seen, see V5: coordinates so far away are rounded to a nanometre.
constexpr double kFew = 0.01;
// Share of the front wall, see V2.
constexpr double kMostly = 0.9;

VisibilityLimits limits_of(PointsView map, double max_range = kInfinity) {
  return {.map_bounds = bounds_of(map), .max_range = max_range};
}

std::unique_ptr<VisibilityScene> prepare(const VisibilityOperator& visibility, PointsView map,
                                         const VisibilityLimits& limits) {
  auto scene = visibility.prepare(map, limits);
  if (!scene) FAIL("the map is not prepared: " << to_string(scene.error()));
  return *std::move(scene);
}

/// What a scene sees from one viewpoint.
Labels seen_in(const VisibilityScene& scene, std::size_t points, const Point& viewpoint) {
  const auto indices = scene.visible(viewpoint);
  if (!indices) FAIL("nothing can be said of a viewpoint: " << to_string(indices.error()));
  return labels_of(*indices, points);
}

/// The answer of a newly made operator and scene.
Labels seen_from(const Subject& subject, PointsView map, const Point& viewpoint,
                 const VisibilityLimits& limits) {
  const auto visibility = subject.make<VisibilityOperator>();
  return seen_in(*prepare(*visibility, map, limits), map.size(), viewpoint);
}
Labels seen_from(const Subject& subject, PointsView map, const Point& viewpoint) {
  return seen_from(subject, map, viewpoint, limits_of(map));
}

/// A map that is thin in the middle, where its viewpoints are.
PointCloud some_map(const Subject& subject, std::uint32_t variant = 0) {
  Random random(subject.seed() + variant);
  return random_cloud(random, 2000, {-20, -20, -5}, {20, 20, 5});
}

PointCloud some_viewpoints(const Subject& subject, std::size_t n) {
  Random random(subject.seed() + 100);
  return random_cloud(random, n, {-10, -10, -2}, {10, 10, 2});
}

/// A wall across the x axis, `half` to each side of the axis, sampled every 10 cm.
PointCloud wall(double x, double half) {
  const int n = static_cast<int>(std::round(half / 0.1));
  PointCloud points;
  for (int i = -n; i <= n; ++i) {
    for (int j = -n; j <= n; ++j) points.push_back({x, 0.1 * i, 0.1 * j});
  }
  return points;
}

/// Directions spread evenly, all different.
PointCloud directions(std::size_t n) {
  const double golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
  PointCloud points;
  for (std::size_t i = 0; i < n; ++i) {
    const double z = 1.0 - 2.0 * (static_cast<double>(i) + 0.5) / static_cast<double>(n);
    const double r = std::sqrt(1.0 - z * z), angle = golden * static_cast<double>(i);
    points.push_back({r * std::cos(angle), r * std::sin(angle), z});
  }
  return points;
}

PointCloud ellipsoid(const Point& axes, std::size_t n) {
  PointCloud points = directions(n);
  for (Point& p : points) p = p.cwiseProduct(axes);
  return points;
}

void check_same(const Labels& expected, const Labels& got) {
  const std::size_t differ = differing(expected, got);
  CHECK_MESSAGE(differ == 0, differ << " points differ in whether they are seen; "
                                    << count(expected) << " of " << expected.size()
                                    << " should be");
}

void ascending(const Subject& subject) {
  const auto visibility = subject.make<VisibilityOperator>();
  for (const auto& map :
       {some_map(subject), lattice(0.5, 40, {-10, -10, 3}), ellipsoid({10, 10, 10}, 1000)}) {
    for (const double max_range : {kInfinity, 8.0}) {
      const auto scene = prepare(*visibility, map, limits_of(map, max_range));
      const PointCloud viewpoints = some_viewpoints(subject, 3);
      for (const Point& viewpoint : viewpoints) {
        const auto seen = scene->visible(viewpoint);
        REQUIRE_MESSAGE(seen, to_string(seen.error()));
        check_ascending(*seen, map.size());
      }
      const auto seen = scene->visible_from_any(viewpoints);
      REQUIRE_MESSAGE(seen, to_string(seen.error()));
      check_ascending(*seen, map.size());
    }
  }
}

void wall_behind_wall(const Subject& subject) {
  if (!subject.claims<VisibilityClaims>().occlusion) does_not_apply("it claims occlusion = false");
  const double gap = subject.claims<VisibilityClaims>().gap;
  Random random(subject.seed());
  for (int round = 0; round < 5; ++round) {
    PointCloud map = wall(5.0, 3.0);
    const std::size_t front = map.size();
    for (const Point& p : wall(5.0 + gap, 1.5)) map.push_back(p);
    const double angle = random.uniform(0.0, 2.0 * std::numbers::pi);
    for (Point& p : map) p = Eigen::AngleAxisd(angle, Point::UnitZ()) * p;
    const Point viewpoint = random.in({-0.1, -0.1, -0.1}, {0.1, 0.1, 0.1});

    const Labels seen = seen_from(subject, map, viewpoint);
    const std::size_t of_front =
        count({seen.begin(), seen.begin() + static_cast<std::ptrdiff_t>(front)});
    const std::size_t of_back = count(seen) - of_front;
    CHECK_MESSAGE(of_back == 0, of_back << " points of the wall behind are seen");
    CHECK_MESSAGE(static_cast<double>(of_front) >= kMostly * static_cast<double>(front),
                  "of the wall in front " << of_front << " of " << front << " points are seen");
  }
}

void convex_shell(const Subject& subject) {
  const auto check = [&](const char* which, const PointCloud& shell, const Point& viewpoint) {
    CAPTURE(which);
    const Labels seen = seen_from(subject, shell, viewpoint);
    const std::size_t hidden = seen.size() - count(seen);
    CHECK_MESSAGE(hidden == 0, hidden << " of " << seen.size() << " points are hidden");
  };
  check("a sphere from its centre", ellipsoid({10, 10, 10}, 5000), {0, 0, 0});
  check("a sphere from beside its centre", ellipsoid({10, 10, 10}, 5000), {2, -3, 1});
  check("an ellipsoid from its centre", ellipsoid({12, 11, 10}, 5000), {0, 0, 0});
}

std::vector<PointCloud> flat_and_few() {
  std::vector<PointCloud> maps = degenerate_clouds();
  maps.push_back({{1, 2, 3}, {2, 3, 5}});
  maps.push_back({{1, 2, 3}, {2, 3, 5}, {3, 5, 4}});
  maps.push_back(lattice(0.5, 30));  // a plane
  PointCloud block;
  for (const double z : {0.0, 0.5, 1.0, 1.5}) {
    for (const Point& p : lattice(0.5, 8, {0, 0, z})) block.push_back(p);
  }
  maps.push_back(block);
  maps.push_back({{1, 1, 1}, {1, 1, 1 + 1e-15}, {1, 1 + 1e-15, 1}, {5, 5, 5}, {5, 1, 5}});
  return maps;
}

void degenerate(const Subject& subject) {
  const auto visibility = subject.make<VisibilityOperator>();
  for (const PointCloud& map : flat_and_few()) {
    CAPTURE(map.size());
    for (const double max_range : {kInfinity, 3.0}) {
      const auto scene = visibility->prepare(map, limits_of(map, max_range));
      if (!scene) {
        CHECK_FALSE(scene.error().message.empty());
        continue;
      }
      const Point inside = map[map.size() / 2];
      for (const Point& viewpoint :
           {inside, Point(inside + Point(0.25, 0.25, 0)), Point(inside + Point(0, 0, 0.25)),
            Point(inside + Point(1e-160, 0, 0)), Point(inside + Point(1000, 0, 0))}) {
        const auto seen = (*scene)->visible(viewpoint);
        if (seen) {
          CHECK(seen->size() <= map.size());
        } else {
          CHECK_FALSE(seen.error().message.empty());
        }
      }
    }
  }
}

void moving(const Subject& subject) {
  for (const Point& viewpoint : some_viewpoints(subject, 5)) {
    const PointCloud map = some_map(subject);
    const Labels expected = seen_from(subject, map, viewpoint);
    const Labels got = seen_from(subject, moved(map, kFarAway), viewpoint + kFarAway);
    const std::size_t differ = differing(expected, got);
    CHECK_MESSAGE(static_cast<double>(differ) <= kFew * static_cast<double>(count(expected)),
                  differ << " points differ in whether they are seen; " << count(expected)
                         << " are without moving");
  }
}

/// Also one of them again, one that is near to it, and one in a point of the map.
PointCloud repeated_viewpoints(const Subject& subject, const PointCloud& map) {
  PointCloud viewpoints = some_viewpoints(subject, 6);
  viewpoints.push_back(viewpoints.front());
  viewpoints.push_back(viewpoints.front() + Point(0.3, 0.2, 0.1));
  viewpoints.push_back(map.front());
  return viewpoints;
}

void any_is_the_union(const Subject& subject) {
  const auto visibility = subject.make<VisibilityOperator>();
  const PointCloud map = some_map(subject);
  const PointCloud viewpoints = repeated_viewpoints(subject, map);
  for (const double max_range : {kInfinity, 8.0}) {
    const auto scene = prepare(*visibility, map, limits_of(map, max_range));
    Labels expected(map.size(), 0);
    for (std::size_t n = 0; n < viewpoints.size(); ++n) {
      const Labels seen = seen_in(*scene, map.size(), viewpoints[n]);
      for (std::size_t i = 0; i < seen.size(); ++i) expected[i] |= seen[i];
      CAPTURE(n);
      const auto got = scene->visible_from_any(std::span(viewpoints).first(n + 1));
      REQUIRE_MESSAGE(got, to_string(got.error()));
      check_same(expected, labels_of(*got, map.size()));
    }
  }
}

/// An operator's answers at places where parameters differ; nothing if it refuses.
std::vector<std::optional<IndexList>> answers(const VisibilityOperator& visibility,
                                              const Subject& subject) {
  PointCloud walls = wall(5.0, 3.0);
  for (const Point& p : wall(5.0 + subject.claims<VisibilityClaims>().gap, 1.5)) {
    walls.push_back(p);
  }
  Random random(subject.seed());
  PointCloud rough = ellipsoid({10, 10, 10}, 2000);
  for (Point& p : rough) p *= random.uniform(0.95, 1.05);
  std::vector<std::optional<IndexList>> all;
  for (const PointCloud& map : {some_map(subject), walls, rough}) {
    for (const double max_range : {kInfinity, 8.0}) {
      std::optional<IndexList> answer;
      if (const auto scene = visibility.prepare(map, limits_of(map, max_range))) {
        if (auto seen = (*scene)->visible({0.1, 0.2, 0.3})) answer = *std::move(seen);
      }
      all.push_back(std::move(answer));
    }
  }
  return all;
}

/// Other values that a parameter could have.
std::vector<Value> alternatives(const Value& value, const std::vector<std::string>& choices) {
  std::vector<Value> others;
  if (const auto* flag = std::get_if<bool>(&value.data)) {
    others.push_back({!*flag, {}});
  } else if (const auto* whole = std::get_if<std::int64_t>(&value.data)) {
    for (const std::int64_t x : {*whole - 1, *whole + 1, *whole / 2, *whole * 2, *whole * 10}) {
      if (x != *whole) others.push_back({x, {}});
    }
  } else if (const auto* real = std::get_if<double>(&value.data)) {
    const double scale = *real == 0.0 ? 1.0 : *real;
    for (const double factor : {0.1, 0.5, 0.9, 1.1, 2.0, 10.0}) {
      others.push_back({factor * scale, {}});
    }
  } else if (const auto* array = std::get_if<Array>(&value.data)) {
    for (std::size_t i = 0; i < array->size(); ++i) {
      for (Value& other : alternatives((*array)[i], {})) {
        Array changed = *array;
        changed[i] = std::move(other);
        others.push_back({std::move(changed), {}});
      }
    }
  } else if (const auto* text = std::get_if<std::string>(&value.data)) {
    for (const std::string& choice : choices) {
      if (choice != *text) others.push_back({choice, {}});
    }
  }
  return others;
}

void parameters_matter(const Subject& subject) {
  const auto params = subject.effective_params(subject.params());
  REQUIRE_MESSAGE(params, to_string(params.error()));
  const auto expected = answers(*subject.make<VisibilityOperator>(), subject);
  for (const ParameterDoc& parameter : subject.info().parameters) {
    const Value* value = params->find(parameter.key);
    if (value == nullptr) continue;
    int tried = 0;
    bool changed = false;
    for (const Value& other : alternatives(*value, parameter.choices)) {
      Table table = *params;
      for (Entry& entry : table.entries) {
        if (entry.key == parameter.key) entry.value = other;
      }
      const auto visibility = subject.create<VisibilityOperator>(table);
      if (!visibility) continue;  // the value is out of range
      ++tried;
      changed = changed || answers(**visibility, subject) != expected;
    }
    CHECK_MESSAGE((changed || tried == 0), "'" << parameter.key << "' was given " << tried
                                               << " other values, without effect");
  }
}

void range(const Subject& subject) {
  constexpr double kRange = 12.0;
  const PointCloud map = some_map(subject);
  const Point viewpoint(0.5, 0.25, -0.5);
  PointCloud with_more, without;
  IndexList rest;  // the points of `with_more` that are also in `without`
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (i % 500 == 0) with_more.push_back(viewpoint);
    with_more.push_back(map[i]);
    if ((map[i] - viewpoint).norm() > kRange) continue;
    rest.push_back(static_cast<std::uint32_t>(with_more.size() - 1));
    without.push_back(map[i]);
  }
  const VisibilityLimits limits = limits_of(map, kRange);
  const Labels seen = seen_from(subject, with_more, viewpoint, limits);
  Labels expected(with_more.size(), 0);
  const Labels seen_without = seen_from(subject, without, viewpoint, limits);
  for (std::size_t i = 0; i < rest.size(); ++i) expected[rest[i]] = seen_without[i];
  check_same(expected, seen);

  PointCloud axes;
  for (const double distance : {kRange, kRange + 0.001}) {
    for (const Eigen::Index axis : {0, 1, 2}) {
      for (const double sign : {-1.0, 1.0})
        axes.push_back(viewpoint + sign * distance * Point::Unit(axis));
    }
  }
  check_same({1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0},
             seen_from(subject, axes, viewpoint, limits_of(axes, kRange)));
}

void concurrent(const Subject& subject) {
  constexpr std::size_t kThreads = 4;
  const auto visibility = subject.make<VisibilityOperator>();
  const PointCloud viewpoints = some_viewpoints(subject, kThreads);
  std::vector<PointCloud> maps;
  std::vector<Labels> expected_of_first, expected;
  for (std::uint32_t i = 0; i < kThreads; ++i) {
    maps.push_back(some_map(subject, i));
    expected_of_first.push_back(seen_from(subject, maps.front(), viewpoints[i]));
    expected.push_back(seen_from(subject, maps.back(), viewpoints[i]));
  }
  const auto scene = prepare(*visibility, maps.front(), limits_of(maps.front()));
  // From the first few of the viewpoints, a different number in each thread.
  const auto some = [&](std::size_t i) { return std::span(viewpoints).first(i + 1); };
  std::vector<Result<ViewCounts>> expected_counts;
  for (std::size_t i = 0; i < kThreads; ++i) {
    expected_counts.push_back(scene->view_counts(some(i)));
    REQUIRE_MESSAGE(expected_counts[i], to_string(expected_counts[i].error()));
  }
  for (int round = 0; round < 3; ++round) {
    std::vector<Result<IndexList>> of_first(kThreads), got(kThreads), of_any(kThreads);
    std::vector<Result<ViewCounts>> counts(kThreads);
    at_once(kThreads, [&](std::size_t i) { of_first[i] = scene->visible(viewpoints[i]); });
    at_once(kThreads, [&](std::size_t i) {
      counts[i] = scene->view_counts(some(i));
      of_any[i] = scene->visible_from_any(some(i));
    });
    at_once(kThreads, [&](std::size_t i) {
      const auto own = visibility->prepare(maps[i], limits_of(maps[i]));
      if (own) {
        got[i] = (*own)->visible(viewpoints[i]);
      } else {
        got[i] = fail(own.error());
      }
    });
    for (std::size_t i = 0; i < kThreads; ++i) {
      REQUIRE_MESSAGE(of_first[i], to_string(of_first[i].error()));
      check_same(expected_of_first[i], labels_of(*of_first[i], maps.front().size()));
      REQUIRE_MESSAGE(counts[i], to_string(counts[i].error()));
      CHECK(counts[i]->points == expected_counts[i]->points);
      CHECK(counts[i]->views == expected_counts[i]->views);
      REQUIRE_MESSAGE(of_any[i], to_string(of_any[i].error()));
      CHECK(*of_any[i] == expected_counts[i]->points);
      REQUIRE_MESSAGE(got[i], to_string(got[i].error()));
      check_same(expected[i], labels_of(*got[i], maps[i].size()));
    }
  }
}

void bad_map(const Subject& subject) {
  const auto visibility = subject.make<VisibilityOperator>();
  const PointCloud good = some_map(subject);
  const auto check_refused = [&](const PointCloud& map) {
    const auto scene = visibility->prepare(map, limits_of(good));
    check_fails(scene, ErrorCode::invalid_input);
  };
  check_refused({});
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    for (const Eigen::Index axis : {0, 1, 2}) {
      for (const std::size_t at : some_places(good.size())) {
        PointCloud map = good;
        map[at][axis] = bad;
        check_refused(map);
      }
    }
  }
}

void bad_viewpoint(const Subject& subject) {
  const auto visibility = subject.make<VisibilityOperator>();
  const PointCloud map = some_map(subject);
  const auto scene = prepare(*visibility, map, limits_of(map));
  const PointCloud good = some_viewpoints(subject, 3);
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    for (const Eigen::Index axis : {0, 1, 2}) {
      for (const std::size_t at : some_places(good.size())) {
        PointCloud viewpoints = good;
        viewpoints[at][axis] = bad;
        for (const auto& seen :
             {scene->visible(viewpoints[at]), scene->visible_from_any(viewpoints)}) {
          check_fails(seen, ErrorCode::invalid_input);
        }
        check_fails(scene->view_counts(viewpoints), ErrorCode::invalid_input);
      }
    }
  }
}

void order_of_points(const Subject& subject) {
  PointCloud map = some_map(subject);
  for (std::size_t i = 0; i < 200; ++i) map.push_back(map[i]);  // the same places again
  Random random(subject.seed() + 1);
  for (const Point& viewpoint : some_viewpoints(subject, 3)) {
    const Labels expected = seen_from(subject, map, viewpoint);
    const IndexList order = random.order(map.size());
    check_same(expected, labels_before(seen_from(subject, in_order(map, order), viewpoint), order));
  }
}

void only_the_map(const Subject& subject) {
  const auto visibility = subject.make<VisibilityOperator>();
  const PointCloud first = some_map(subject);
  const PointCloud second = moved(some_map(subject, 1), {3, 2, 1});
  const Point viewpoint(1, 2, 0.5);
  PointCloud place(first.size());  // both are read from the same memory
  for (const PointCloud* map : {&first, &second, &first}) {
    std::copy(map->begin(), map->end(), place.begin());
    const auto scene = prepare(*visibility, place, limits_of(place));
    check_same(seen_from(subject, *map, viewpoint), seen_in(*scene, place.size(), viewpoint));
  }
  const auto scene_of_first = prepare(*visibility, first, limits_of(first));
  const auto scene_of_second = prepare(*visibility, second, limits_of(second));
  for (int round = 0; round < 2; ++round) {
    check_same(seen_from(subject, first, viewpoint),
               seen_in(*scene_of_first, first.size(), viewpoint));
    check_same(seen_from(subject, second, viewpoint),
               seen_in(*scene_of_second, second.size(), viewpoint));
  }
}

void no_viewpoints(const Subject& subject) {
  const auto visibility = subject.make<VisibilityOperator>();
  const PointCloud map = some_map(subject);
  const auto scene = prepare(*visibility, map, limits_of(map));
  const auto seen = scene->visible_from_any({});
  REQUIRE_MESSAGE(seen, to_string(seen.error()));
  CHECK(seen->empty());
  const auto counts = scene->view_counts({});
  REQUIRE_MESSAGE(counts, to_string(counts.error()));
  CHECK(counts->points.empty());
  CHECK(counts->views.empty());
}

/// How many of the viewpoints see each point of a map; `view_counts` may report progress.
std::vector<std::uint32_t> views_in(const VisibilityScene& scene, std::size_t points,
                                    std::span<const Point> viewpoints,
                                    const VisibilityProgress* progress = nullptr) {
  const auto counts = scene.view_counts(viewpoints, progress);
  if (!counts) FAIL("the views are not counted: " << to_string(counts.error()));
  check_ascending(counts->points, points);
  REQUIRE(counts->views.size() == counts->points.size());
  std::vector<std::uint32_t> views(points, 0);
  for (std::size_t i = 0; i < counts->points.size(); ++i) {
    REQUIRE_MESSAGE(counts->views[i] > 0, "a point that is listed is seen from no viewpoint");
    views[counts->points[i]] = counts->views[i];
  }
  return views;
}

void counts_views(const Subject& subject) {
  const auto visibility = subject.make<VisibilityOperator>();
  const PointCloud map = some_map(subject);
  const PointCloud viewpoints = repeated_viewpoints(subject, map);
  for (const double max_range : {kInfinity, 8.0}) {
    const auto scene = prepare(*visibility, map, limits_of(map, max_range));
    std::vector<std::uint32_t> expected(map.size(), 0);
    for (std::size_t n = 0; n < viewpoints.size(); ++n) {
      const Labels seen = seen_in(*scene, map.size(), viewpoints[n]);
      for (std::size_t i = 0; i < seen.size(); ++i) expected[i] += seen[i] ? 1 : 0;
      CAPTURE(n);
      const auto got = views_in(*scene, map.size(), std::span(viewpoints).first(n + 1));
      std::size_t differ = 0;
      for (std::size_t i = 0; i < map.size(); ++i) differ += got[i] != expected[i] ? 1 : 0;
      CHECK_MESSAGE(differ == 0, differ << " points have another number of viewpoints");
    }
  }
}

/// Adds up the reported numbers.
class Sum final : public VisibilityProgress {
 public:
  void advanced(std::size_t viewpoints) const noexcept override { done_ += viewpoints; }
  [[nodiscard]] std::size_t done() const noexcept { return done_; }

 private:
  mutable std::atomic<std::size_t> done_ = 0;
};

void progress(const Subject& subject) {
  const auto visibility = subject.make<VisibilityOperator>();
  const PointCloud map = some_map(subject);
  const auto scene = prepare(*visibility, map, limits_of(map));
  PointCloud viewpoints = some_viewpoints(subject, 20);
  for (const std::size_t again : {0U, 3U, 3U}) viewpoints.push_back(viewpoints[again]);
  for (const std::size_t n : {std::size_t{1}, viewpoints.size()}) {
    const auto asked = std::span(viewpoints).first(n);
    const auto expected = scene->visible_from_any(asked, nullptr);
    REQUIRE_MESSAGE(expected, to_string(expected.error()));
    const Sum sum;
    const auto got = scene->visible_from_any(asked, &sum);
    REQUIRE_MESSAGE(got, to_string(got.error()));
    check_same(labels_of(*expected, map.size()), labels_of(*got, map.size()));
    CHECK_MESSAGE(sum.done() <= n, sum.done() << " of " << n << " viewpoints are reported");
    const Sum of_counts;
    CHECK(views_in(*scene, map.size(), asked, &of_counts) == views_in(*scene, map.size(), asked));
    CHECK_MESSAGE(of_counts.done() <= n, of_counts.done()
                                             << " of " << n << " viewpoints are reported");
  }
}

void decided_within_reach(const Subject& subject) {
  const auto visibility = subject.make<VisibilityOperator>();
  Random random(subject.seed());
  const PointCloud map = random_cloud(random, 12000, {-120, -20, -5}, {120, 20, 5});
  const VisibilityLimits limits = limits_of(map, 9.0);
  const double reach = visibility->reach(limits);
  if (!std::isfinite(reach)) does_not_apply("its reach is infinite");
  const auto whole = prepare(*visibility, map, limits);
  for (const Point& viewpoint : some_viewpoints(subject, 4)) {
    IndexList part;
    for (std::uint32_t k = 0; k < map.size(); ++k) {
      if ((map[k] - viewpoint).head<2>().lpNorm<Eigen::Infinity>() <= reach) part.push_back(k);
    }
    const PointCloud near = select(map, part);
    Labels seen(map.size());
    if (!near.empty()) {
      const Labels in_part = seen_in(*prepare(*visibility, near, limits), near.size(), viewpoint);
      for (std::size_t i = 0; i < part.size(); ++i) seen[part[i]] = in_part[i];
    }
    check_same(seen_in(*whole, map.size(), viewpoint), seen);
  }
}

void any_threads(const Subject& subject) {
  Random random(subject.seed());
  const PointCloud map = random_cloud(random, 20'000, {-20, -20, -5}, {20, 20, 5});
  const PointCloud viewpoints = some_viewpoints(subject, 9);
  const auto seen = [&] {
    const auto visibility = subject.make<VisibilityOperator>();
    const auto scene = prepare(*visibility, map, limits_of(map));
    auto indices = scene->visible_from_any(viewpoints);
    if (!indices) FAIL("nothing can be said of viewpoints: " << to_string(indices.error()));
    return *std::move(indices);
  };
  const IndexList expected = seen();
  with_threads([&] { CHECK(seen() == expected); });
}

constexpr std::array kClauses{
    Clause{"V1", "the indices ascend strictly and are in range", &ascending},
    Clause{"V2", "a wall behind a wall is hidden, and nine tenths of the one in front are seen",
           &wall_behind_wall},
    Clause{"V3", "every point of a sphere or an ellipsoid is seen from inside", &convex_shell},
    Clause{"V4", "few, equal, collinear or coplanar points: an answer or an error, no crash",
           &degenerate},
    Clause{"V5",
           "moving map and viewpoint by (1e6, 5e6, 300) m changes at most 1 % of what is seen",
           &moving},
    Clause{"V6", "visible_from_any is the union of visible", &any_is_the_union},
    Clause{"V7", "every parameter that is set, or has a default, has an effect",
           &parameters_matter},
    Clause{"V8", "points at the viewpoint and beyond max_range are not seen and do not occlude",
           &range},
    Clause{"V9", "concurrent calls on one operator or scene agree with calls one by one",
           &concurrent},
    Clause{"V10", "a map that is empty or not finite is invalid_input", &bad_map},
    Clause{"V11", "a viewpoint that is not finite is invalid_input, also among others",
           &bad_viewpoint},
    Clause{"V12", "the order of the points does not matter", &order_of_points},
    Clause{"V13", "what a scene sees depends only on its own map, not on earlier scenes",
           &only_the_map},
    Clause{"V14", "without viewpoints nothing is seen", &no_viewpoints},
    Clause{"V15", "progress adds up to at most the number of viewpoints, and changes no result",
           &progress},
    Clause{"V16",
           "view_counts gives the number of viewpoints whose visible set contains each point",
           &counts_views},
    Clause{"V17", "points out of reach of a viewpoint do not matter to what it sees",
           &decided_within_reach},
    Clause{"V18", "1, 2 and 7 threads give the same result", &any_threads},
};

}  // namespace

template <>
std::span<const Clause> own_clauses<VisibilityOperator>() {
  return kClauses;
}

}  // namespace vantage::conformance
