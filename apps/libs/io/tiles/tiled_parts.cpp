#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "io/tiles/grid.hpp"
#include "vantage/io/tiled_map.hpp"
#include "vantage/plugin.hpp"

namespace vantage::io {
namespace {

/// (y, x) of a canonical cell, so that cells compare row by row.
using Row = std::pair<std::int32_t, std::int32_t>;

Row cell_of(const Point& p) {
  const auto along = [](double x) {
    return tiles::cell_at(std::clamp(x, -tiles::kLargestCoordinate, tiles::kLargestCoordinate));
  };
  return {along(p.y()), along(p.x())};
}

bool overlap(const CellRectangle& a, const CellRectangle& b) {
  return a.min_x < b.max_x && b.min_x < a.max_x && a.min_y < b.max_y && b.min_y < a.max_y;
}

}  // namespace

Result<void> TiledParts::pass(MapVisitor& visitor) const noexcept {
  const Bounds3 all = bounds();
  return pass_over({all.min.head<2>(), all.max.head<2>()}, visitor);
}

Result<void> TiledParts::pass_over(const Bounds2& area, MapVisitor& visitor) const noexcept {
  return guarded([&]() -> Result<void> {
    const CellRectangle wanted = CellRectangle::covering(area.min, area.max);
    for (const TiledMap::Tile& tile : map_.tiles()) {
      if (!overlap(map_.cells_of(tile.index), wanted)) continue;
      VANTAGE_TRY(const PointCloud points, map_.read_as_stored(tile.index));
      VANTAGE_CHECK(visitor.see(points));
    }
    return {};
  });
}

std::uint64_t TiledParts::points_in(const Bounds2& area) const {
  return map_.points_in(CellRectangle::covering(area.min, area.max));
}

Result<MapPart> TiledParts::read(const Bounds2& area) const {
  const CellRectangle cells = CellRectangle::covering(area.min, area.max);
  VANTAGE_TRY(PointCloud points, map_.read(cells));
  return MapPart{std::move(points), map_.runs_in(cells)};
}

void into_canonical_order(PointCloud& points) {
  std::vector<Row> cells;
  for (const Point& p : points) {
    const Row cell = cell_of(p);
    if (cells.empty() || cells.back() != cell) cells.push_back(cell);
  }
  std::ranges::sort(cells);
  cells.erase(std::ranges::unique(cells).begin(), cells.end());

  std::vector<std::uint32_t> number(points.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size()), [&](const auto& range) {
    for (std::size_t k = range.begin(); k != range.end(); ++k) {
      number[k] = static_cast<std::uint32_t>(std::ranges::lower_bound(cells, cell_of(points[k])) -
                                             cells.begin());
    }
  });
  std::vector<std::size_t> next(cells.size() + 1);
  for (const std::uint32_t n : number) ++next[n + 1];
  for (std::size_t n = 1; n < next.size(); ++n) next[n] += next[n - 1];
  PointCloud sorted(points.size());
  for (std::size_t k = 0; k < points.size(); ++k) sorted[next[number[k]]++] = points[k];
  // Where a cell began, the one before it ends by now.
  tbb::parallel_for(std::size_t{0}, cells.size(), [&](std::size_t cell) {
    const std::size_t begin = cell == 0 ? 0 : next[cell - 1];
    sort_cell({sorted.data() + begin, next[cell] - begin});
  });
  points = std::move(sorted);
}

}  // namespace vantage::io
