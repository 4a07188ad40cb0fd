#include "vantage/kit/canonical_order.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

namespace vantage {
namespace {

constexpr unsigned kBits = 10;  // of a place along an axis
constexpr double kPlaces = 1U << kBits;

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

auto coordinates(const Point& p) noexcept { return std::tuple(p.x(), p.y(), p.z()); }

}  // namespace

double canonical_cell(double coordinate) noexcept {
  const double cell = std::floor(coordinate / kCanonicalCell);
  return cell * kCanonicalCell > coordinate ? cell - 1.0 : cell;
}

CanonicalPlace CanonicalPlace::of(const Point& p) noexcept {
  const Point cell(canonical_cell(p.x()), canonical_cell(p.y()), canonical_cell(p.z()));
  return {cell, spread_bits(place_in(cell.x(), p.x())) |
                    spread_bits(place_in(cell.y(), p.y())) << 1U |
                    spread_bits(place_in(cell.z(), p.z())) << 2U};
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
  struct Keyed {
    double layer;
    std::uint32_t in_cube, index;
  };
  std::vector<Keyed> keyed;
  keyed.reserve(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const CanonicalPlace place = CanonicalPlace::of(points[i]);
    keyed.push_back({place.cell.z(), place.in_cube, i});
  }
  const auto before = [&](const Keyed& a, const Keyed& b) {
    if (a.layer != b.layer) return a.layer < b.layer;
    if (a.in_cube != b.in_cube) return a.in_cube < b.in_cube;
    const auto x = coordinates(points[a.index]), y = coordinates(points[b.index]);
    return x != y ? x < y : a.index < b.index;
  };
  if (std::ranges::is_sorted(keyed, before)) return;
  std::ranges::sort(keyed, before);
  const PointCloud unsorted(points.begin(), points.end());
  for (std::size_t i = 0; i < keyed.size(); ++i) points[i] = unsorted[keyed[i].index];
}

}  // namespace vantage
