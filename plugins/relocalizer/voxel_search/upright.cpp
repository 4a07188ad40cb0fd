#include "upright.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>

namespace vantage::voxel_search {
namespace {

using Cell = std::pair<std::int64_t, std::int64_t>;

Cell cell_of(const Point& p, double width) {
  return {static_cast<std::int64_t>(std::floor(p.x() / width)),
          static_cast<std::int64_t>(std::floor(p.y() / width))};
}

}  // namespace

PointCloud upright_part(PointsView scan) {
  // A cell's ground is the lowest point in it and its neighbours: a wall has ground in front of it
  // within 8 m. What lies half a metre above is no curb.
  constexpr double kCell = 4.0, kAbove = 0.5;
  std::map<Cell, double> lowest;
  for (const Point& p : scan) {
    const Cell cell = cell_of(p, kCell);
    for (std::int64_t dx = -1; dx <= 1; ++dx) {
      for (std::int64_t dy = -1; dy <= 1; ++dy) {
        const auto [at, first] = lowest.try_emplace({cell.first + dx, cell.second + dy}, p.z());
        if (!first) at->second = std::min(at->second, p.z());
      }
    }
  }
  PointCloud upright;
  for (const Point& p : scan) {
    if (p.z() > lowest.at(cell_of(p, kCell)) + kAbove) upright.push_back(p);
  }
  constexpr std::size_t kFewest = 60;  // fewer points do not tell one place from another
  if (upright.size() < kFewest) upright.assign(scan.begin(), scan.end());
  return upright;
}

}  // namespace vantage::voxel_search
