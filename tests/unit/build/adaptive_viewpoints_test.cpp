#include "build/adaptive_viewpoints.hpp"

#include <doctest/doctest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <random>
#include <set>
#include <tuple>

using namespace vantage;

namespace {

/// A viewpoint a metre on a square of `size` m, in the middle of its voxel.
PointCloud square(int size) {
  PointCloud viewpoints;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) viewpoints.push_back({x + 0.5, y + 0.5, 1.0});
  }
  return viewpoints;
}

bool before(const Point& a, const Point& b) {
  return std::tuple(a.x(), a.y(), a.z()) < std::tuple(b.x(), b.y(), b.z());
}

/// Each viewpoint sees point 0, and west of x = `rich` one of its own as well.
struct World {
  double rich = 0.0;
  std::mutex mutex = {};
  PointCloud asked = {};

  Result<AdaptiveSight> see(const PointCloud& viewpoints, double min_gain) {
    return see_adaptively(viewpoints, 1.0, min_gain, 100'000, [&](std::span<const Point> some) {
      std::set<std::uint32_t> seen;
      for (const Point& q : some) {
        seen.insert(0);
        if (q.x() < rich) seen.insert(own(q));
      }
      const std::scoped_lock lock(mutex);
      asked.insert(asked.end(), some.begin(), some.end());
      return Result<IndexList>(IndexList(seen.begin(), seen.end()));
    });
  }
  static std::uint32_t own(const Point& q) {
    return 1 + 200 * static_cast<std::uint32_t>(q.y()) + static_cast<std::uint32_t>(q.x());
  }
};

}  // namespace

TEST_CASE("where everything shows something new, every viewpoint is asked, and once") {
  World world{.rich = 1e9};
  const PointCloud viewpoints = square(20);
  const auto sight = world.see(viewpoints, 0.3);
  REQUIRE(sight);
  CHECK(sight->skipped == 0);
  CHECK(sight->seen.size() == viewpoints.size() + 1);
  CHECK(std::is_sorted(sight->seen.begin(), sight->seen.end()));
  PointCloud expected = viewpoints;
  std::sort(expected.begin(), expected.end(), before);
  std::sort(world.asked.begin(), world.asked.end(), before);
  CHECK(world.asked == expected);
}

TEST_CASE("where nothing is new the spacing stays at four voxels, beside blocks that get finer") {
  World world{.rich = 8.0};
  const auto sight = world.see(square(16), 0.3);
  REQUIRE(sight);
  // West: two blocks with all of 64; east: one each of the widest, and three to a spacing of four.
  CHECK(world.asked.size() == 2 * 64 + 2 * 4);
  CHECK(sight->skipped == 16 * 16 - world.asked.size());
  CHECK(sight->seen.size() == 2 * 64 + 1);
}

TEST_CASE(
    "at most the share min_gain of what a spacing shows is missed at the next in such a world") {
  // 3 new of 4 seen at a spacing of four, 12 of 13 at two, 48 of 49 at one.
  for (const auto& [min_gain, asked] : {std::pair{0.76, 4U}, {0.74, 64U}, {0.93, 4U}}) {
    World world{.rich = 1e9};
    CHECK(world.see(square(8), min_gain)->seen.size() == asked + 1);
    CHECK(world.asked.size() == asked);
  }
}

TEST_CASE("all heights and storeys over a voxel are asked together") {
  PointCloud viewpoints = square(16);
  for (const Point& q : square(16)) viewpoints.push_back(q + Point(0, 0, 0.8));
  for (const Point& q : square(16)) viewpoints.push_back(q + Point(0, 0, 4.0));
  World world{.rich = 8.0};
  const auto sight = world.see(viewpoints, 0.3);
  REQUIRE(sight);
  CHECK(world.asked.size() == 3 * (2 * 64 + 2 * 4));
  std::map<std::pair<double, double>, int> over;
  for (const Point& q : world.asked) ++over[{q.x(), q.y()}];
  for (const auto& [voxel, count] : over) CHECK(count == 3);
}

TEST_CASE("adaptive spacing does not depend on the order of viewpoints or the number of threads") {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> u(-40.0, 40.0);
  PointCloud viewpoints(2000);
  for (Point& q : viewpoints) q = {u(random), u(random), 1.0};
  // Sees 300 numbers around its own: neighbours overlap.
  const auto see = [&] {
    std::mutex mutex;
    PointCloud asked;
    auto sight = see_adaptively(viewpoints, 1.0, 0.2, 100'000, [&](std::span<const Point> some) {
      std::set<std::uint32_t> seen;
      for (const Point& q : some) {
        const auto first = static_cast<std::uint32_t>(500 * (q.x() + 50) + 10 * (q.y() + 50));
        for (std::uint32_t k = 0; k < 300; ++k) seen.insert(first + k);
      }
      const std::scoped_lock lock(mutex);
      asked.insert(asked.end(), some.begin(), some.end());
      return Result<IndexList>(IndexList(seen.begin(), seen.end()));
    });
    std::sort(asked.begin(), asked.end(), before);
    return std::pair{*std::move(sight), asked};
  };
  const auto expected = see();
  CHECK(expected.first.skipped > 0);
  CHECK(expected.first.skipped + expected.second.size() == viewpoints.size());
  for (const std::size_t threads : {1U, 2U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    std::shuffle(viewpoints.begin(), viewpoints.end(), random);
    const auto again = see();
    CHECK(again.first.seen == expected.first.seen);
    CHECK(again.first.skipped == expected.first.skipped);
    CHECK(again.second == expected.second);
  }
}

TEST_CASE("adaptive spacing, degenerate: no viewpoint, one, blind ones, an operator that fails") {
  World world{.rich = 1e9};
  CHECK(world.see({}, 0.1)->seen.empty());
  CHECK(world.see(PointCloud{{3.5, 4.5, 1.0}}, 0.9)->seen.size() == 2);
  const auto blind = see_adaptively(square(16), 1.0, 0.1, 10, [](std::span<const Point>) {
    return Result<IndexList>(IndexList{});
  });
  CHECK(blind->seen.empty());
  CHECK(blind->skipped == 16 * 16 - 4 * 4);
  const auto failed = see_adaptively(square(16), 1.0, 0.1, 10,
                                     [](std::span<const Point> some) -> Result<IndexList> {
                                       if (some.front().x() > 8.0)
                                         return fail(ErrorCode::invalid_input, "too far east");
                                       return IndexList{1};
                                     });
  REQUIRE_FALSE(failed);
  CHECK(failed.error().message == "too far east");
}
