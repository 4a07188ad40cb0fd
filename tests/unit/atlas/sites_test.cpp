#include "build/atlas/sites.hpp"

#include <doctest/doctest.h>

#include <vector>

using namespace vantage;

TEST_CASE("sites are spread over the map, and no more than asked for") {
  std::vector<PointCloud> viewpoints(2);
  for (int x = 0; x < 100; x += 2) {
    for (int y = 0; y < 40; y += 2) viewpoints[x < 50 ? 0 : 1].emplace_back(x, y, 1.0);
  }
  const auto sites = spread_sites(viewpoints, 20.0, 1000);
  REQUIRE(sites.size() == 10);
  for (std::size_t k = 0; k < sites.size(); ++k) {
    const Eigen::Array2d in_square = sites[k].position.head<2>().array() / 20.0;
    CHECK((in_square - in_square.floor() - 0.5).abs().maxCoeff() <= 0.05 + 1e-9);
    if (k > 0) CHECK(sites[k - 1].region <= sites[k].region);
  }
  CHECK(spread_sites(viewpoints, 20.0, 4).size() <= 4);
  CHECK(spread_sites(viewpoints, 20.0, 1).size() == 1);
  CHECK(spread_sites({PointCloud{{-1, -1, 0}, {1, 1, 0}}}, 20.0, 1).size() == 1);
  CHECK(spread_sites(viewpoints, 20.0, 0).empty());
  CHECK(spread_sites({}, 20.0, 9).empty());
}
