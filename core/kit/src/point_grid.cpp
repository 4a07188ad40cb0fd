#include "vantage/kit/point_grid.hpp"

#include <array>
#include <cmath>
#include <unordered_map>

#include "vantage/kit/hash.hpp"

namespace vantage {

PointGrid::PointGrid(PointsView map, double width) : indices_(map.size()) {
  using Key = std::array<double, 3>;  // whole numbers that no integer type need hold
  std::unordered_map<Key, std::uint32_t, CellHash> number_of;
  std::vector<std::uint32_t> cell_of(map.size());
  Key last{};
  for (std::size_t i = 0; i < map.size(); ++i) {
    const Point& p = map[i];
    const Key key{std::floor(p.x() / width), std::floor(p.y() / width), std::floor(p.z() / width)};
    if (i > 0 && key == last) {  // neighbours in the map mostly share a cell
      cell_of[i] = cell_of[i - 1];
    } else {
      const auto next = static_cast<std::uint32_t>(cells_.size());
      cell_of[i] = number_of.try_emplace(key, next).first->second;
      if (cell_of[i] == next) cells_.emplace_back();
      last = key;
    }
    Cell& cell = cells_[cell_of[i]];
    cell.bounds.extend(p);
    ++cell.end;  // a count until all are counted
  }
  std::uint32_t begin = 0;
  for (Cell& cell : cells_) {
    const std::uint32_t size = cell.end;
    cell.begin = cell.end = begin;
    begin += size;
  }
  for (std::uint32_t i = 0; i < map.size(); ++i) indices_[cells_[cell_of[i]].end++] = i;
}

}  // namespace vantage
