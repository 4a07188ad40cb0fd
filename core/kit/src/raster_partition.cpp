#include "vantage/kit/raster_partition.hpp"
#include "vantage/plugin.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "vantage/kit/numbers.hpp"

namespace vantage {
namespace {

using Eigen::Vector2d;

constexpr double kMaxIndex = 0x1p31 - 2.0;  // the edges of the last cell also need an index

std::string place(double x, double y) { return "(" + shortest(x) + ", " + shortest(y) + ")"; }

/// Cells first <= i < last of rows bottom <= j < top.
struct Block {
  std::int64_t first, last, bottom, top;
};

HalfOpenBox box_of(const PlanRaster& raster, const Block& block) {
  return {raster.corner(block.first, block.bottom), raster.corner(block.last, block.top)};
}

/// Joins the cells of one region into blocks, sorted by their lower left corner.
std::vector<Block> blocks_of(std::span<const OwnedCell> cells) {
  std::vector<Block> blocks;
  std::vector<std::size_t> below, here;  // blocks that end with the row before; with this row
  std::size_t k = 0;
  while (k < cells.size()) {
    const std::int64_t j = cells[k].cell.j;
    if (!here.empty() && blocks[here.front()].top != j) here.clear();
    below.swap(here);
    here.clear();
    auto candidate = below.begin();
    while (k < cells.size() && cells[k].cell.j == j) {
      const std::int64_t first = cells[k].cell.i;
      std::int64_t last = first + 1;
      while (++k < cells.size() && cells[k].cell.j == j && cells[k].cell.i == last) ++last;

      while (candidate != below.end() && blocks[*candidate].first < first) ++candidate;
      if (candidate != below.end() && blocks[*candidate].first == first &&
          blocks[*candidate].last == last) {
        blocks[*candidate].top = j + 1;
        here.push_back(*candidate);
      } else {
        here.push_back(blocks.size());
        blocks.push_back({first, last, j, j + 1});
      }
    }
  }
  return blocks;
}

Footprint footprint_of(const PlanRaster& raster, const std::vector<Block>& blocks) {
  if (blocks.size() == 1) return box_of(raster, blocks.front());
  BoxUnion shape;
  shape.boxes.reserve(blocks.size());
  for (const Block& block : blocks) shape.boxes.push_back(box_of(raster, block));
  return shape;
}

/// Whether the cells of all places have an index, and are wider than the rounding of coordinates.
bool fits(const Bounds3& bounds, double cell_size, const Vector2d& origin) {
  const auto farthest = [&](const Vector2d& from) {
    return std::max((bounds.min.head<2>() - from).cwiseAbs().maxCoeff(),
                    (bounds.max.head<2>() - from).cwiseAbs().maxCoeff());
  };
  const double largest = std::max(farthest(Vector2d::Zero()), origin.cwiseAbs().maxCoeff());
  return farthest(origin) / cell_size < kMaxIndex &&
         cell_size > 8.0 * std::numeric_limits<double>::epsilon() * largest;
}

std::string too_small(const CellWidth& width, const Bounds3& bounds) {
  return std::string(width.key) + " = " + shortest(width.value) +
         " m is too small for a map from " + place(bounds.min.x(), bounds.min.y()) + " to " +
         place(bounds.max.x(), bounds.max.y()) + " m";
}

/// Collects the cells that hold a point.
class OccupiedCells final : public MapVisitor {
 public:
  explicit OccupiedCells(const PlanRaster& raster) : raster_(raster) {}

  [[nodiscard]] Result<void> see(PointsView points) noexcept override {
    return guarded([&]() -> Result<void> {
      for (const Point& p : points) add(raster_.cell_of(p.head<2>()));
      return {};
    });
  }
  [[nodiscard]] std::vector<PlanCell> sorted() && {
    tidy();
    return std::move(cells_);
  }

 private:
  void add(const PlanCell& cell) {
    // Neighbours in the file are mostly neighbours in the map.
    if (!cells_.empty() && cells_.back() == cell) return;
    cells_.push_back(cell);
    if (cells_.size() > limit_) {
      tidy();
      limit_ = std::max(limit_, 2 * cells_.size());
    }
  }
  void tidy() {
    std::sort(cells_.begin(), cells_.end());
    cells_.erase(std::unique(cells_.begin(), cells_.end()), cells_.end());
  }

  const PlanRaster& raster_;
  std::vector<PlanCell> cells_;
  std::size_t limit_ = std::size_t{1} << 20U;
};

}  // namespace

Result<PlanRaster> PlanRaster::over(const Bounds3& bounds, double cell_size) {
  const Vector2d origin = Vector2d::Zero();
  if (fits(bounds, cell_size, origin)) return PlanRaster(cell_size, origin);
  return fail(ErrorCode::invalid_input,
              too_small({cell_size, "cell_size"}, bounds) +
                  ": cells are counted from the origin, their indices must stay below 2^31 and a "
                  "cell must be wider than the rounding of coordinates");
}

Result<PlanRaster> PlanRaster::over(const Bounds3& bounds, const CellWidth& width,
                                    const Vector2d& origin) {
  if (fits(bounds, width.value, origin)) return PlanRaster(width.value, origin);
  return fail(ErrorCode::invalid_input,
              too_small(width, bounds) + " with the grid's origin at " +
                  place(origin.x(), origin.y()) +
                  " m: cell indices must stay below 2^31 and a cell must be wider than the "
                  "rounding of coordinates");
}

double PlanRaster::edge(Eigen::Index axis, std::int64_t i) const noexcept {
  return std::fma(static_cast<double>(i), cell_size_, origin_[axis]);  // rounded once
}

PlanCell PlanRaster::cell_of(const Vector2d& xy) const noexcept {
  // The quotient of Eq. 11 rounds, the edges decide.
  const auto index = [&](Eigen::Index axis) {
    const double x = xy[axis];
    auto i = static_cast<std::int64_t>(std::floor((x - origin_[axis]) / cell_size_));
    while (x < edge(axis, i)) --i;
    while (x >= edge(axis, i + 1)) ++i;
    return static_cast<std::int32_t>(i);
  };
  return {.j = index(1), .i = index(0)};
}

Vector2d PlanRaster::centre(const PlanCell& cell) const noexcept {
  return origin_ + cell_size_ * Vector2d(cell.i + 0.5, cell.j + 0.5);
}

Result<std::vector<PlanCell>> occupied_cells(const MapPasses& map, const PlanRaster& raster) {
  OccupiedCells occupied(raster);
  VANTAGE_CHECK(map.pass(occupied));
  return std::move(occupied).sorted();
}

Result<Partition> partition_of_cells(const PlanRaster& raster, std::vector<OwnedCell> cells,
                                     std::span<const std::string> labels) {
  const auto by_cell = [](const OwnedCell& a, const OwnedCell& b) { return a.cell < b.cell; };
  std::sort(cells.begin(), cells.end(), by_cell);
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const auto name = [&] {
      return "cell (" + std::to_string(cells[k].cell.i) + ", " + std::to_string(cells[k].cell.j) +
             ")";
    };
    if (cells[k].region >= labels.size()) {
      return fail(ErrorCode::invalid_input, name() + " belongs to region " +
                                                std::to_string(cells[k].region) +
                                                ", but there are " + std::to_string(labels.size()));
    }
    if (k > 0 && cells[k - 1].cell == cells[k].cell) {
      return fail(ErrorCode::invalid_input, name() + " is named twice");
    }
  }
  std::stable_sort(cells.begin(), cells.end(),
                   [](const OwnedCell& a, const OwnedCell& b) { return a.region < b.region; });

  std::vector<Region> regions;
  regions.reserve(labels.size());
  auto begin = cells.begin();
  for (std::uint32_t r = 0; r < labels.size(); ++r) {
    const auto end =
        std::find_if(begin, cells.end(), [&](const OwnedCell& cell) { return cell.region != r; });
    regions.push_back({.label = labels[r],
                       .footprint = footprint_of(raster, blocks_of({begin, end})),
                       .height = {}});
    begin = end;
  }
  return Partition::from(std::move(regions));
}

}  // namespace vantage
