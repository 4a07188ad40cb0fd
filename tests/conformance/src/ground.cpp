// G: the contract of a GroundFilter.
#include "vantage/ground_filter.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "clauses.hpp"
#include "indices.hpp"
#include "scenes.hpp"

namespace vantage::conformance {
namespace {

// Share of the points, see G4 and G9: the points move into other cells. Measured with pmf: up to
// 0.3 %.
constexpr double kFew = 0.01;

/// The answer of a newly made object.
Labels ground_in(const Subject& subject, PointsView cloud) {
  const auto indices = subject.make<GroundFilter>()->ground(cloud);
  if (!indices) FAIL("no ground is found: " << to_string(indices.error()));
  return labels_of(*indices, cloud.size());
}

struct Box {
  Eigen::Vector2d centre;
  double angle, width, height;

  [[nodiscard]] Point at(double x, double y, double z) const {
    const Eigen::Vector2d p = centre + Eigen::Rotation2Dd(angle) * Eigen::Vector2d(x, y);
    return {p.x(), p.y(), z};
  }
  /// Plan-view distance of a place from the box, along the box's axes; negative inside.
  [[nodiscard]] double distance(const Point& p) const {
    const Eigen::Vector2d local = Eigen::Rotation2Dd(-angle) * (p.head<2>() - centre);
    return local.cwiseAbs().maxCoeff() - width / 2;
  }
};

/// Terrain with boxes on it, sampled from above and from the sides; there is no terrain below a
/// box.
struct Place {
  PointCloud points;
  std::vector<Box> boxes;
  std::size_t terrain, tops;  // points[0, terrain) are terrain, [terrain, tops) the tops of boxes
};

/// Points about `cell` apart, `n_x` by `n_y` of them, starting at the origin.
template <class Height>
Place place(Random& random, double cell, int n_x, int n_y, const std::vector<Box>& boxes,
            const Height& height) {
  Place result{{}, boxes, 0, 0};
  for (int i = 0; i < n_x; ++i) {
    for (int j = 0; j < n_y; ++j) {
      const double x = cell * (i + random.uniform(0.3, 0.7));
      const double y = cell * (j + random.uniform(0.3, 0.7));
      const Point p(x, y, height(x, y));
      if (std::all_of(boxes.begin(), boxes.end(),
                      [&](const Box& box) { return box.distance(p) > 0.0; })) {
        result.points.push_back(p);
      }
    }
  }
  result.terrain = result.points.size();
  for (const Box& box : boxes) {
    const double top = height(box.centre.x(), box.centre.y()) + box.height;
    const int n = static_cast<int>(std::ceil(box.width / cell));
    for (int i = 0; i <= n; ++i) {
      for (int j = 0; j <= n; ++j) {
        result.points.push_back(
            box.at(box.width * (i - n / 2.0) / n, box.width * (j - n / 2.0) / n, top));
      }
    }
  }
  result.tops = result.points.size();
  for (const Box& box : boxes) {
    const double bottom = height(box.centre.x(), box.centre.y()), half = box.width / 2;
    for (double along = -half; along < half; along += cell) {
      for (double z = bottom; z < bottom + box.height; z += cell) {
        result.points.insert(result.points.end(),
                             {box.at(along, -half, z), box.at(half, along, z),
                              box.at(-along, half, z), box.at(-half, -along, z)});
      }
    }
  }
  return result;
}

Place plane_with_box(Random& random, const GroundClaims& claims, double angle) {
  const int n = static_cast<int>(std::ceil((claims.box_width + 20.0) / claims.cell));
  const double middle = n * claims.cell / 2;
  const Box box{{middle + random.uniform(-1, 1), middle + random.uniform(-1, 1)},
                angle,
                claims.box_width,
                claims.box_height};
  return place(random, claims.cell, n, n, {box}, [](double, double) { return 0.0; });
}

/// Rolling terrain that is longer than wide, with boxes in various directions, shrubs, and crowns
/// of trees in the air.
PointCloud mixed_scene(const Subject& subject, std::uint32_t variant = 0) {
  const auto& claims = subject.claims<GroundClaims>();
  Random random(subject.seed() + variant);
  const double width = std::max(30.0, 8 * claims.box_width);
  const auto n = [&](double length) { return static_cast<int>(std::ceil(length / claims.cell)); };
  std::vector<Box> boxes;
  for (const auto& [x, y] : {std::pair{0.3, 0.4}, {0.7, 0.5}, {0.3, 1.0}, {0.6, 1.2}}) {
    boxes.push_back({{x * width, y * width},
                     random.uniform(0.0, std::numbers::pi),
                     claims.box_width,
                     claims.box_height});
  }
  const auto height = [](double x, double y) {
    return 0.3 * std::sin(x / 8.0) + 0.3 * std::sin(y / 10.0);
  };
  PointCloud cloud = place(random, claims.cell, n(width), n(1.5 * width), boxes, height).points;
  const auto add = [&](double x, double y, const Point& size, double above) {
    const Point low(x * width, y * width, height(x * width, y * width) + above);
    for (const Point& p : random_cloud(random, 300, low, low + size)) cloud.push_back(p);
  };
  for (const double y : {0.2, 0.8, 1.3}) {
    add(0.8, y, {3, 3, 3}, 1.0 + 2.0 * claims.box_height);  // the crown of a tree
    add(0.1, y, {2, 2, 1}, 0.0);                            // a shrub
  }
  return cloud;
}

PointCloud turned(PointsView cloud, double angle) {
  const Bounds3 bounds = bounds_of(cloud);
  const Point centre = (bounds.min + bounds.max) / 2;
  const Eigen::Matrix3d R = Eigen::AngleAxisd(angle, Point::UnitZ()).toRotationMatrix();
  PointCloud result;
  for (const Point& p : cloud) result.push_back(centre + R * (p - centre));
  return result;
}

void check_few_differ(const Labels& expected, const Labels& got) {
  const std::size_t differ = differing(expected, got);
  const double bound = kFew * static_cast<double>(expected.size());
  CHECK_MESSAGE(static_cast<double>(differ) < bound,
                differ << " of " << expected.size() << " points are labelled differently");
}

void check_same(const Labels& expected, const Labels& got) {
  const std::size_t differ = differing(expected, got);
  CHECK_MESSAGE(differ == 0,
                differ << " of " << expected.size() << " points are labelled differently");
}

void ascending(const Subject& subject) {
  const auto filter = subject.make<GroundFilter>();
  Random random(subject.seed());
  for (const auto& cloud : {random_cloud(random, 3000, {0, 0, 0}, {30, 30, 5}),
                            random_cloud(random, 3000, {-100, -100, -5}, {100, 100, 50}),
                            lattice(0.25, 60), mixed_scene(subject)}) {
    const auto indices = filter->ground(cloud);
    REQUIRE_MESSAGE(indices, to_string(indices.error()));
    check_ascending(*indices, cloud.size());
  }
}

void plane(const Subject& subject) {
  const double cell = subject.claims<GroundClaims>().cell;
  constexpr int kPoints = 100;  // along a side
  Random random(subject.seed());
  const auto check = [&](const char* which, const PointCloud& cloud) {
    CAPTURE(which);
    const Labels labels = ground_in(subject, cloud);
    const std::size_t lost = labels.size() - count(labels);
    CHECK_MESSAGE(lost == 0, lost << " of " << labels.size() << " points are not ground");
  };
  check("a lattice", lattice(cell, kPoints));
  check("at a height of -40 m, with noise",
        place(random, cell, kPoints, kPoints, {}, [&](double, double) {
          return -40.0 + random.uniform(-0.02, 0.02);
        }).points);
  const double side = cell * kPoints;
  check("at a height of 300 m, with noise, points anywhere",
        random_cloud(random, kPoints * kPoints, {0, 0, 299.98}, {side, side, 300.02}));
}

void box_top(const Subject& subject) {
  Random random(subject.seed());
  for (const double angle : {0.0, 0.5, 0.8}) {
    CAPTURE(angle);
    const Place scene = plane_with_box(random, subject.claims<GroundClaims>(), angle);
    const Labels labels = ground_in(subject, scene.points);
    std::size_t on_top = 0, around = 0, lost = 0;
    for (std::size_t i = scene.terrain; i < scene.tops; ++i) on_top += labels[i];
    for (std::size_t i = 0; i < scene.terrain; ++i) {
      const double distance = scene.boxes.front().distance(scene.points[i]);
      if (distance > 5.0) continue;
      ++around;
      lost += labels[i] == 0 ? 1U : 0U;
    }
    REQUIRE(around > 0);
    CHECK_MESSAGE(on_top == 0, on_top << " of " << scene.tops - scene.terrain
                                      << " points of the top are ground");
    CHECK_MESSAGE(lost == 0, lost << " of " << around << " points around it are not");
  }
}

void turning(const Subject& subject) {
  const PointCloud cloud = mixed_scene(subject);
  const Labels expected = ground_in(subject, cloud);
  for (const double degrees : {10.0, 37.0, 45.0, 90.0, 123.0, 180.0, 270.0}) {
    CAPTURE(degrees);
    const double angle = degrees * std::numbers::pi / 180.0;
    check_few_differ(expected, ground_in(subject, turned(cloud, angle)));
  }
}

void empty_cloud(const Subject& subject) {
  const auto indices = subject.make<GroundFilter>()->ground({});
  check_fails(indices, ErrorCode::invalid_input);
}

void not_finite(const Subject& subject) {
  const auto filter = subject.make<GroundFilter>();
  Random random(subject.seed());
  const PointCloud good = random_cloud(random, 500, {0, 0, 0}, {20, 20, 2});
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    for (const Eigen::Index axis : {0, 1, 2}) {
      for (const std::size_t at : some_places(good.size())) {
        PointCloud cloud = good;
        cloud[at][axis] = bad;
        const auto indices = filter->ground(cloud);
        check_fails(indices, ErrorCode::invalid_input);
      }
    }
  }
}

void order_of_points(const Subject& subject) {
  const PointCloud cloud = mixed_scene(subject);
  const Labels expected = ground_in(subject, cloud);
  Random random(subject.seed() + 1);
  for (int round = 0; round < 3; ++round) {
    const IndexList order = random.order(cloud.size());
    check_same(expected, labels_before(ground_in(subject, in_order(cloud, order)), order));
  }
}

void concurrent(const Subject& subject) {
  const auto filter = subject.make<GroundFilter>();
  constexpr std::size_t kThreads = 4;
  std::vector<PointCloud> clouds;
  std::vector<Labels> expected;
  for (std::uint32_t i = 0; i < kThreads; ++i) {
    clouds.push_back(mixed_scene(subject, i));
    expected.push_back(ground_in(subject, clouds.back()));
  }
  for (int round = 0; round < 3; ++round) {
    std::vector<Result<IndexList>> got(kThreads);
    at_once(kThreads, [&](std::size_t i) { got[i] = filter->ground(clouds[i]); });
    for (std::size_t i = 0; i < kThreads; ++i) {
      REQUIRE_MESSAGE(got[i], to_string(got[i].error()));
      check_same(expected[i], labels_of(*got[i], clouds[i].size()));
    }
  }
}

void moving(const Subject& subject) {
  for (const std::uint32_t variant : {0U, 1U}) {
    const PointCloud cloud = mixed_scene(subject, variant);
    check_few_differ(ground_in(subject, cloud), ground_in(subject, moved(cloud, kFarAway)));
  }
}

void degenerate(const Subject& subject) {
  const auto filter = subject.make<GroundFilter>();
  for (const PointCloud& cloud : degenerate_clouds()) {
    CAPTURE(cloud.size());
    const auto indices = filter->ground(cloud);
    if (!indices) {
      CHECK_FALSE(indices.error().message.empty());
      continue;
    }
    CHECK(indices->size() <= cloud.size());
  }
}

void only_the_cloud(const Subject& subject) {
  const auto filter = subject.make<GroundFilter>();
  Random random(subject.seed());
  const PointCloud first = random_cloud(random, 2000, {0, 0, 0}, {30, 30, 5});
  const PointCloud second = random_cloud(random, 2000, {0, 0, 20}, {30, 30, 28});
  PointCloud place(first.size());  // both are read from the same memory
  for (const PointCloud* cloud : {&first, &first, &second, &first}) {
    std::copy(cloud->begin(), cloud->end(), place.begin());
    const auto indices = filter->ground(place);
    REQUIRE_MESSAGE(indices, to_string(indices.error()));
    check_same(ground_in(subject, *cloud), labels_of(*indices, place.size()));
  }
}

/// A stretch of rolling terrain with boxes, and the ground of its middle, decided by the whole
/// stretch and by the middle with its margin.
void decided_within_reach(const Subject& subject) {
  const auto filter = subject.make<GroundFilter>();
  const double reach = filter->reach();
  if (!std::isfinite(reach)) does_not_apply("its reach is infinite");
  CHECK(reach >= 0.0);
  const auto& claims = subject.claims<GroundClaims>();
  const double middle = 10.0 + 2.0 * claims.box_width, length = 4.0 * reach + middle;
  Random random(subject.seed());
  std::vector<Box> boxes;
  for (double x = claims.box_width; x < length; x += 2.5 * claims.box_width) {
    boxes.push_back({{x, random.uniform(5.0, 10.0)},
                     random.uniform(0.0, std::numbers::pi),
                     claims.box_width,
                     claims.box_height});
  }
  const auto n = [&](double metres) { return static_cast<int>(std::ceil(metres / claims.cell)); };
  const auto height = [](double x, double y) {
    return 0.3 * std::sin(x / 8.0) + 0.3 * std::sin(y / 10.0);
  };
  const PointCloud cloud =
      place(random, claims.cell, n(length), n(15.0 + claims.box_width), boxes, height).points;
  const double from = 0.5 * (length - middle), to = from + middle;
  IndexList part;
  for (std::uint32_t k = 0; k < cloud.size(); ++k) {
    if (cloud[k].x() >= from - reach && cloud[k].x() <= to + reach) part.push_back(k);
  }
  const Labels whole = ground_in(subject, cloud);
  const Labels of_part = ground_in(subject, select(cloud, part));
  std::size_t differ = 0;
  for (std::size_t i = 0; i < part.size(); ++i) {
    const double x = cloud[part[i]].x();
    if (x >= from && x <= to && whole[part[i]] != of_part[i]) ++differ;
  }
  CHECK_MESSAGE(differ == 0, differ << " points of the middle are ground only in one of the two");
}

void any_threads(const Subject& subject) {
  Random random(subject.seed());
  const PointCloud cloud = random_cloud(random, 50'000, {0, 0, 0}, {80, 60, 3});
  const Labels expected = ground_in(subject, cloud);
  with_threads([&] { check_same(expected, ground_in(subject, cloud)); });
}

constexpr std::array kClauses{
    Clause{"G1", "the indices ascend strictly and are in range", &ascending},
    Clause{"G2", "a level plane is all ground, at any height and with 2 cm of noise", &plane},
    Clause{"G3", "the top of a box on a plane is not ground, and the plane around it is", &box_top},
    Clause{"G4", "turning the cloud about z changes less than 1 % of the points", &turning},
    Clause{"G5", "an empty cloud is invalid_input", &empty_cloud},
    Clause{"G6", "a point that is not finite is invalid_input", &not_finite},
    Clause{"G7", "the order of the points does not matter", &order_of_points},
    Clause{"G8", "concurrent calls on one object agree with calls one by one", &concurrent},
    Clause{"G9", "moving the cloud by (1e6, 5e6, 300) m changes less than 1 % of the points",
           &moving},
    Clause{
        "G10",
        "one point, two far apart, equal ones, a line, a column: an answer or an error, no crash",
        &degenerate},
    Clause{"G11", "the answer depends only on the cloud, not on earlier calls", &only_the_cloud},
    Clause{"G12", "a part of the cloud with a margin as wide as the reach has the whole's ground",
           &decided_within_reach},
    Clause{"G13", "1, 2 and 7 threads give the same result", &any_threads},
};

}  // namespace

template <>
std::span<const Clause> own_clauses<GroundFilter>() {
  return kClauses;
}

}  // namespace vantage::conformance
