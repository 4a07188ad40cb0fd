// P: the contract of a Partitioner.
#include <algorithm>
#include <array>
#include <limits>
#include <string>

#include "clauses.hpp"
#include "scenes.hpp"
#include "vantage/conformance/range_survey.hpp"
#include "vantage/kit/map_in_memory.hpp"
#include "vantage/partitioner.hpp"

namespace vantage::conformance {
namespace {

constexpr double kRange = 15.0;  // how far a viewpoint sees in these maps [m]

/// A drive through the middle of a map, from its lowest to its highest corner.
PointCloud drive_through(PointsView map) {
  const Bounds3 bounds = bounds_of(map);
  PointCloud positions;
  if (bounds.empty()) return positions;
  for (int i = 0; i <= 50; ++i) {
    Point p = bounds.min + (bounds.max - bounds.min) * (i / 50.0);
    p.z() = bounds.min.z() + 1.5;
    positions.push_back(p);
  }
  return positions;
}

Result<Partition> try_cut(const Partitioner& partitioner, PointsView map) {
  return partitioner.partition(MapInMemory(map), drive_through(map), RangeSurvey(map, kRange));
}

Partition cut(const Partitioner& partitioner, PointsView map) {
  auto partition = try_cut(partitioner, map);
  if (!partition) FAIL("the map is not cut: " << to_string(partition.error()));
  return *std::move(partition);
}

PointCloud some_map(const Subject& subject, std::uint32_t variant = 0) {
  Random random(subject.seed() + variant);
  return random_cloud(random, 3000, {10, 20, 0}, {110, 100, 8});
}

void check_all_located(const Partition& partition, PointsView map) {
  const auto lost = std::count_if(map.begin(), map.end(),
                                  [&](const Point& p) { return !partition.locate(p).has_value(); });
  CHECK_MESSAGE(lost == 0, lost << " of " << map.size() << " points are in no region");
}

void check_same(const Partition& a, const Partition& b) {
  CHECK(a.size() == b.size());
  CHECK(a.regions() == b.regions());
}

void empty_map(const Subject& subject) {
  const auto partition =
      subject.make<Partitioner>()->partition(MapInMemory({}), {}, RangeSurvey({}, kRange));
  check_fails(partition, ErrorCode::invalid_input);
}

void every_point_located(const Subject& subject) {
  const auto partitioner = subject.make<Partitioner>();
  const auto check = [&](const char* which, const PointCloud& map) {
    CAPTURE(which);
    check_all_located(cut(*partitioner, map), map);
  };
  check("random", some_map(subject));
  check("multiples of 0.1, which fall on edges", lattice(0.1, 40));
  check("multiples of 0.25", lattice(0.25, 40, {5, 5, 0}));
  check("multiples of 0.1 at a million metres", lattice(0.1, 40, {1e6, 5e6, 100}));
  check("random at a million metres", moved(some_map(subject, 1), {1e6, 5e6, 100}));
}

void deterministic(const Subject& subject) {
  const PointCloud map = some_map(subject);
  const auto partitioner = subject.make<Partitioner>();
  const Partition first = cut(*partitioner, map);
  check_same(first, cut(*partitioner, map));
  check_same(first, cut(*subject.make<Partitioner>(), map));
}

void labels(const Subject& subject) {
  // Partition::from refuses labels that are not unique or not safe in a file name, so a map that is
  // cut has good labels. These are the maps that break labels made from coordinates or counters.
  const auto partitioner = subject.make<Partitioner>();
  Random random(subject.seed());
  for (const auto& map : {random_cloud(random, 1000, {-60, -60, -5}, {60, 60, 5}),
                          random_cloud(random, 1000, {-1e6 - 50, -5e6 - 50, 0}, {-1e6, -5e6, 9}),
                          random_cloud(random, 300, {-900, -900, 0}, {900, 900, 9})}) {
    const auto partition = try_cut(*partitioner, map);
    CHECK_MESSAGE(partition, to_string(partition.error()));
  }
}

void order_of_points(const Subject& subject) {
  const PointCloud map = some_map(subject);
  const auto partitioner = subject.make<Partitioner>();
  const Partition expected = cut(*partitioner, map);
  Random random(subject.seed() + 1);
  for (int round = 0; round < 3; ++round) {
    check_same(expected, cut(*partitioner, in_order(map, random.order(map.size()))));
  }
}

void concurrent(const Subject& subject) {
  const auto partitioner = subject.make<Partitioner>();
  constexpr std::size_t kThreads = 4;
  std::vector<PointCloud> maps;
  std::vector<Partition> expected;
  for (std::uint32_t i = 0; i < kThreads; ++i) {
    maps.push_back(some_map(subject, i));
    expected.push_back(cut(*partitioner, maps.back()));
  }
  for (int round = 0; round < 3; ++round) {
    std::vector<Result<Partition>> got(kThreads);
    at_once(kThreads, [&](std::size_t i) { got[i] = try_cut(*partitioner, maps[i]); });
    for (std::size_t i = 0; i < kThreads; ++i) {
      REQUIRE_MESSAGE(got[i], to_string(got[i].error()));
      check_same(expected[i], *got[i]);
    }
  }
}

void not_finite(const Subject& subject) {
  const auto partitioner = subject.make<Partitioner>();
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    for (const Eigen::Index axis : {0, 1, 2}) {
      PointCloud map = some_map(subject);
      const PointCloud trajectory = drive_through(map);
      const RangeSurvey survey(map, kRange);
      map[map.size() / 2][axis] = bad;
      const auto partition = partitioner->partition(MapInMemory(map), trajectory, survey);
      check_fails(partition, ErrorCode::invalid_input);
    }
  }
}

void without_trajectory(const Subject& subject) {
  const PointCloud map = some_map(subject);
  const auto partition =
      subject.make<Partitioner>()->partition(MapInMemory(map), {}, RangeSurvey(map, kRange));
  if (subject.claims<PartitionerClaims>().needs_trajectory) {
    check_fails(partition, ErrorCode::invalid_input);
    CHECK_MESSAGE(partition.error().message.find("trajectory") != std::string::npos,
                  partition.error().message);
  } else {
    CHECK_MESSAGE(partition, to_string(partition.error())
                                 << "; if it cannot do without, claim needs_trajectory");
    if (partition) check_all_located(*partition, map);
  }
}

void degenerate(const Subject& subject) {
  const auto partitioner = subject.make<Partitioner>();
  const Point p(12.3, 45.6, 7.8);
  PointCloud line, column;
  for (int i = 0; i < 200; ++i) {
    line.push_back({0.5 * i, 30.0, 1.0});
    column.push_back({30.0, 40.0, 0.1 * i});
  }
  for (const auto& map : {PointCloud{p}, PointCloud(100, p), line, column}) {
    CAPTURE(map.size());
    check_all_located(cut(*partitioner, map), map);
  }
}

void no_region_is_empty(const Subject& subject) {
  const auto partitioner = subject.make<Partitioner>();
  Random random(subject.seed());
  PointCloud two_places = random_cloud(random, 500, {0, 0, 0}, {30, 30, 5});
  for (const Point& far : random_cloud(random, 500, {300, 300, 0}, {330, 330, 5})) {
    two_places.push_back(far);
  }
  for (const auto& map : {some_map(subject), two_places}) {
    const Partition partition = cut(*partitioner, map);
    std::vector<std::size_t> owned(partition.size());
    for (const Point& p : map) {
      if (const auto region = partition.locate(p)) ++owned[region->value];
    }
    const auto none = std::count(owned.begin(), owned.end(), 0U);
    CHECK_MESSAGE(none == 0, none << " of " << partition.size() << " regions own no map point");
  }
}

void cuts_in_passes(const Subject& subject) {
  const auto partitioner = subject.make<Partitioner>();
  bool cuts_any = false;
  for (const auto& [map, size] :
       {std::pair{some_map(subject), std::size_t{700}},
        std::pair{some_map(subject, 1), std::size_t{1}},
        std::pair{moved(some_map(subject, 2), {1e6, 5e6, 100}), std::size_t{100000}}}) {
    const auto in_passes =
        partitioner->partition(Pieces(map, size), drive_through(map), RangeSurvey(map, kRange));
    if (!in_passes && in_passes.error().code == ErrorCode::unsupported) continue;
    REQUIRE_MESSAGE(in_passes, to_string(in_passes.error()));
    check_same(cut(*partitioner, map), *in_passes);
    cuts_any = true;
  }
  if (!cuts_any) does_not_apply("it cuts no map in passes");
}

void any_threads(const Subject& subject) {
  Random random(subject.seed());
  const PointCloud map = random_cloud(random, 8'000, {10, 20, 0}, {170, 150, 8});
  const auto partitioner = subject.make<Partitioner>();
  const Partition expected = cut(*partitioner, map);
  with_threads([&] { check_same(expected, cut(*partitioner, map)); });
}

void counting_ends_early(const Subject& subject) {
  const auto partitioner = subject.make<Partitioner>();
  using Above = RangeSurvey::AboveEnough;
  for (const std::uint32_t variant : {0U, 1U}) {
    const PointCloud map = some_map(subject, variant);
    const Partition expected = cut(*partitioner, map);
    for (const Above above : {Above::one_more, Above::most}) {
      const auto got = partitioner->partition(MapInMemory(map), drive_through(map),
                                              RangeSurvey(map, kRange, above));
      REQUIRE_MESSAGE(got, to_string(got.error()));
      check_same(expected, *got);
    }
  }
}

constexpr std::array kClauses{
    Clause{"P1", "an empty map is invalid_input", &empty_map},
    Clause{"P2", "every map point is located, on edges and a million metres away too",
           &every_point_located},
    Clause{"P3", "the same map is cut the same way, by the same object and by another",
           &deterministic},
    Clause{"P4", "labels are unique and file-safe, on both sides of the origin and far from it",
           &labels},
    Clause{"P5", "the order of the points does not matter", &order_of_points},
    Clause{"P6", "concurrent calls on one object agree with calls one by one", &concurrent},
    Clause{"P7", "a map point that is not finite is invalid_input", &not_finite},
    Clause{"P8", "without a trajectory the map is cut, or invalid_input names the trajectory",
           &without_trajectory},
    Clause{"P9", "one point, equal points and points on a line are cut too", &degenerate},
    Clause{"P10", "every region owns a map point", &no_region_is_empty},
    Clause{"P11",
           "in passes the map is cut as in memory, whatever its pieces; or it is unsupported",
           &cuts_in_passes},
    Clause{"P12", "1, 2 and 7 threads give the same result", &any_threads},
    Clause{"P13", "where a survey ends counting, above what is enough, does not matter",
           &counting_ends_early},
};

}  // namespace

template <>
std::span<const Clause> own_clauses<Partitioner>() {
  return kClauses;
}

}  // namespace vantage::conformance
