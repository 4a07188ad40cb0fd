#include "build/plan_index.hpp"

#include <doctest/doctest.h>

#include <limits>
#include <random>

using namespace vantage;

namespace {

PlanIndex index_of(const PointCloud& map, const IndexList& members) {
  return PlanIndex(map, members.size(), [&](std::size_t k) { return members[k]; });
}

/// Nothing in the box is missing, nothing comes twice, and nothing comes that is no member.
void check_near(const PointCloud& map, const IndexList& members, const IndexList& found,
                const Eigen::Vector2d& min, const Eigen::Vector2d& max) {
  CHECK(std::is_sorted(found.begin(), found.end(), std::less_equal<>()));
  CHECK(std::includes(members.begin(), members.end(), found.begin(), found.end()));
  for (const std::uint32_t k : members) {
    const auto p = map[k].head<2>().array();
    if (!(p >= min.array()).all() || !(p <= max.array()).all()) continue;
    CHECK(std::binary_search(found.begin(), found.end(), k));
  }
}

}  // namespace

TEST_CASE("a plan index finds all that lies in a box, and little else") {
  std::mt19937 random(6);
  for (const double offset : {0.0, 5e6}) {
    std::uniform_real_distribution<double> u(offset - 50.0, offset + 50.0);
    PointCloud map(20'000);
    for (Point& p : map) p = {u(random), u(random) / 3.0, u(random)};
    IndexList members;
    for (std::uint32_t k = 0; k < map.size(); k += 2) members.push_back(k);
    const PlanIndex index = index_of(map, members);
    for (int n = 0; n < 200; ++n) {
      const Eigen::Vector2d a(u(random), u(random) / 3.0), b(u(random), u(random) / 3.0);
      check_near(map, members, index.near(a.cwiseMin(b), a.cwiseMax(b)), a.cwiseMin(b),
                 a.cwiseMax(b));
    }
    const Eigen::Vector2d at = map[2].head<2>();
    const IndexList found = index.near(at, at);
    check_near(map, members, found, at, at);
    CHECK(found.size() < 1000);
  }
}

TEST_CASE("a plan index of places in a line, in one spot, far apart, or of none") {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Eigen::Vector2d least(-kInfinity, -kInfinity), most(kInfinity, kInfinity);
  const std::vector<PointCloud> maps{{},
                                     {{1, 2, 3}},
                                     PointCloud(500, Point(1, 2, 3)),
                                     {{0, 0, 0}, {0, 1e300, 0}, {0, -1e300, 0}},
                                     {{1.7e308, 1.7e308, 0}, {-1.7e308, -1.7e308, 0}, {0, 0, 0}}};
  for (const PointCloud& map : maps) {
    IndexList members(map.size());
    for (std::uint32_t k = 0; k < map.size(); ++k) members[k] = k;
    const PlanIndex index = index_of(map, members);
    CHECK(index.near(least, most) == members);
    for (const Point& p : map) {
      check_near(map, members, index.near(p.head<2>(), p.head<2>()), p.head<2>(), p.head<2>());
    }
    const Eigen::Vector2d none = Eigen::Vector2d::Constant(std::nan(""));
    (void)index.near(none, none);  // no box at all: whatever comes, it ends
  }
}
