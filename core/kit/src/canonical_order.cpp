#include "vantage/kit/canonical_order.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <tuple>
#include <vector>

namespace vantage {
namespace {

constexpr unsigned kBits = 10;  // of a place along an axis
constexpr double kPlaces = 1U << kBits;
constexpr double kMostLayers = 1U << 30U;  // which a key of 64 bits can tell from each other

/// The bits of a number below 2^10, with two zeros between them.
constexpr std::uint32_t spread_bits(std::uint32_t x) noexcept {
  x = (x | x << 16U) & 0x0300'00ffU;
  x = (x | x << 8U) & 0x0300'f00fU;
  x = (x | x << 4U) & 0x030c'30c3U;
  return (x | x << 2U) & 0x0924'9249U;
}

/// Where a coordinate lies in its cell. It never falls as the coordinate rises.
std::uint32_t place_in(double cell, double coordinate) noexcept {
  const double place = (coordinate - cell * kCanonicalCell) * (kPlaces / kCanonicalCell);
  return static_cast<std::uint32_t>(std::clamp(place, 0.0, kPlaces - 1.0));
}

/// Where a point lies along the curve through its cube.
std::uint32_t along_curve(double cell_x, double cell_y, double layer, const Point& p) noexcept {
  return spread_bits(place_in(cell_x, p.x())) | spread_bits(place_in(cell_y, p.y())) << 1U |
         spread_bits(place_in(layer, p.z())) << 2U;
}

auto coordinates(const Point& p) noexcept { return std::tuple(p.x(), p.y(), p.z()); }

}  // namespace

double canonical_cell(double coordinate) noexcept {
  const double cell = std::floor(coordinate / kCanonicalCell);
  return cell * kCanonicalCell > coordinate ? cell - 1.0 : cell;
}

CanonicalPlace CanonicalPlace::of(const Point& p) noexcept {
  const Point cell(canonical_cell(p.x()), canonical_cell(p.y()), canonical_cell(p.z()));
  return {cell, along_curve(cell.x(), cell.y(), cell.z(), p)};
}

std::weak_ordering CanonicalPlace::operator<=>(const CanonicalPlace& other) const noexcept {
  for (const Eigen::Index axis : {1, 0, 2}) {
    if (cell[axis] != other.cell[axis]) {
      return cell[axis] < other.cell[axis] ? std::weak_ordering::less : std::weak_ordering::greater;
    }
  }
  return in_cube <=> other.in_cube;
}

bool canonically_before(const Point& a, const Point& b) noexcept {
  const std::weak_ordering places = CanonicalPlace::of(a) <=> CanonicalPlace::of(b);
  return places != 0 ? places < 0 : coordinates(a) < coordinates(b);
}

void sort_cell(std::span<Point> points) {
  if (points.empty()) return;
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
  for (const Point& p : points) {
    lowest = std::min(lowest, p.z());
    highest = std::max(highest, p.z());
  }
  const double x = canonical_cell(points.front().x()), y = canonical_cell(points.front().y());
  const double first_layer = canonical_cell(lowest);
  if (canonical_cell(highest) - first_layer >= kMostLayers) {
    std::ranges::stable_sort(points, canonically_before);
    return;
  }
  // The layer, and the place in its cube: one number, quick to compare.
  struct Keyed {
    std::uint64_t key;
    std::uint32_t index;
  };
  std::vector<Keyed> keyed;
  keyed.reserve(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const Point& p = points[i];
    const double layer = canonical_cell(p.z());
    keyed.push_back(
        {static_cast<std::uint64_t>(layer - first_layer) << 3 * kBits | along_curve(x, y, layer, p),
         i});
  }
  const auto before = [&](const Keyed& a, const Keyed& b) {
    if (a.key != b.key) return a.key < b.key;
    const auto at_a = coordinates(points[a.index]), at_b = coordinates(points[b.index]);
    return at_a != at_b ? at_a < at_b : a.index < b.index;
  };
  if (std::ranges::is_sorted(keyed, before)) return;
  std::ranges::sort(keyed, {}, &Keyed::key);
  for (auto begin = keyed.begin(); begin != keyed.end();) {
    const auto end =
        std::find_if(begin, keyed.end(), [&](const Keyed& k) { return k.key != begin->key; });
    if (end - begin > 1) std::sort(begin, end, before);
    begin = end;
  }
  const PointCloud unsorted(points.begin(), points.end());
  for (std::size_t i = 0; i < keyed.size(); ++i) points[i] = unsorted[keyed[i].index];
}

}  // namespace vantage
