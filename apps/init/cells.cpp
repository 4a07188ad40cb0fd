#include "init/cells.hpp"

#include <cmath>
#include <unordered_map>
#include <unordered_set>

namespace vantage::init {
namespace {

constexpr std::uint32_t kFewest = 6;  // points: min_points_per_voxel of ndt
constexpr double kSquare = 10.0;      // of the ground plan [m]

std::uint64_t key_of(const Point& p, double edge, bool plan) {
  const auto index = [&](double x) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(x / edge))) & 0x1FFFFFU;
  };
  return index(p.x()) << 42U | index(p.y()) << 21U | (plan ? 0U : index(p.z()));
}

}  // namespace

CellCount count_cells(PointsView map, double resolution) {
  std::unordered_map<std::uint64_t, std::uint32_t> points;
  std::unordered_set<std::uint64_t> squares;
  CellCount count;
  for (const Point& p : map) {
    if (++points[key_of(p, resolution, false)] == kFewest) ++count.cells;
    squares.insert(key_of(p, kSquare, true));
  }
  count.area = kSquare * kSquare * static_cast<double>(squares.size());
  return count;
}

}  // namespace vantage::init
