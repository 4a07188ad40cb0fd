#include "recall.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

namespace vantage::benchmarks {
namespace {

using Runs = std::vector<std::pair<int, int>>;

TEST_CASE("a score counts what is selected, seen and both, and adds up over viewpoints") {
  const IndexList selected{0, 2, 5, 7}, seen{2, 3, 7, 8, 9};
  Score score = score_of(selected, seen, 10);
  CHECK(score.hits == 2);
  CHECK(score.share() == doctest::Approx(0.4));
  CHECK(score.recall() == doctest::Approx(0.4));
  CHECK(score.precision() == doctest::Approx(0.5));
  score += score_of(seen, seen, 10);
  CHECK(score.share() == doctest::Approx(9.0 / 20.0));
  CHECK(score.recall() == doctest::Approx(7.0 / 10.0));
  CHECK(score.precision() == doctest::Approx(7.0 / 9.0));
}

TEST_CASE("of nothing every share is zero") {
  const Score none = score_of({}, {}, 0);
  CHECK(none.share() == 0.0);
  CHECK(none.recall() == 0.0);
  CHECK(none.precision() == 0.0);
}

TEST_CASE("between marks the share is interpolated, from the origin on") {
  const std::vector<RecallMark> marks{{0.6, 0.9}, {0.2, 0.4}};  // in any order
  CHECK(share_at(0.2, marks) == doctest::Approx(0.1));
  CHECK(share_at(0.4, marks) == doctest::Approx(0.2));
  CHECK(share_at(0.65, marks) == doctest::Approx(0.4));
  CHECK(share_at(0.9, marks) == doctest::Approx(0.6));
}

TEST_CASE("a recall that no mark has is not extrapolated") {
  CHECK_FALSE(share_at(0.91, {{0.2, 0.4}, {0.6, 0.9}}));
  CHECK_FALSE(share_at(0.1, {}));
}

TEST_CASE("where a curve falls the first place that has the recall counts") {
  const std::vector<RecallMark> marks{{0.1, 0.5}, {0.3, 0.2}, {0.5, 1.0}};
  CHECK(share_at(0.5, marks) == doctest::Approx(0.1));
  CHECK(share_at(0.6, marks) == doctest::Approx(0.4));
}

TEST_CASE("a curve has less where it lies above the other or reaches higher") {
  const std::vector<RecallMark> straight{{0.8, 0.8}}, bent{{0.1, 0.4}, {0.92, 0.6}, {1.0, 1.0}};
  // They cross where 0.1 + 4.1 (recall - 0.4) = recall: at 49.7 %.
  CHECK(recalls_with_less(bent, straight) == Runs{{1, 49}, {81, 100}});
  CHECK(recalls_with_less(straight, bent) == Runs{{50, 80}});
  CHECK(recalls_with_less(bent, bent).empty());
}

TEST_CASE("points near a scan are those that brute force finds") {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> coordinate(0.0, 1.0);
  const auto cloud = [&](std::size_t size) {
    PointCloud points(size);
    for (Point& p : points) p = {coordinate(random), coordinate(random), coordinate(random)};
    return points;
  };
  const PointCloud map = cloud(500), scan = cloud(100);
  constexpr double kRadius = 0.1;
  IndexList expected;
  for (std::uint32_t i = 0; i < map.size(); ++i) {
    for (const Point& s : scan) {
      if ((map[i] - s).norm() >= kRadius) continue;
      expected.push_back(i);
      break;
    }
  }
  CHECK(expected.size() > 50);
  CHECK(expected.size() < 450);
  CHECK(points_near(map, scan, kRadius) == expected);
  CHECK(points_near(map, {}, kRadius).empty());
}

TEST_CASE("a point is of the first surface within the noise of the map, not behind it") {
  CHECK(is_on_first_surface(9.0, 10.0, 1.0));  // before it
  CHECK(is_on_first_surface(10.06, 10.0, 1.0));
  CHECK_FALSE(is_on_first_surface(10.08, 10.0, 1.0));
  // Along a grazing ray 6 cm of noise are metres.
  CHECK(is_on_first_surface(12.0, 10.0, 0.03));
  CHECK_FALSE(is_on_first_surface(13.1, 10.0, 0.01));  // another surface
}

}  // namespace
}  // namespace vantage::benchmarks
