#include "checks/map_facts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <unordered_map>
#include <utility>
#include <vector>

#include "checks/median.hpp"
#include "vantage/kit/hash.hpp"

namespace vantage::checks {
namespace {

/// So many points decide about shape; more change nothing.
constexpr std::size_t kEnough = 2'000'000;

PointCloud some_of(PointsView map) {
  if (map.size() <= kEnough) return {map.begin(), map.end()};
  PointCloud some(kEnough);
  for (std::size_t i = 0; i < kEnough; ++i) {
    some[i] = map[i * map.size() / kEnough];  // no overflow: there are less than 2^32 points
  }
  return some;
}

Bounds3 bulk_of(const PointCloud& points) {
  constexpr double kOutermost = 0.001;
  Bounds3 bulk;
  std::vector<double> values(points.size());
  const auto beyond = static_cast<std::ptrdiff_t>(kOutermost * static_cast<double>(points.size()));
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < points.size(); ++i) values[i] = points[i][axis];
    std::nth_element(values.begin(), values.begin() + beyond, values.end());
    bulk.min[axis] = values[static_cast<std::size_t>(beyond)];
    std::nth_element(values.begin(), values.end() - 1 - beyond, values.end());
    bulk.max[axis] = *(values.end() - 1 - beyond);
  }
  return bulk;
}

using Cell = std::array<std::int64_t, 3>;
struct CellHash {
  std::size_t operator()(const Cell& c) const noexcept {
    return hash(0, static_cast<std::uint64_t>(c[0]), static_cast<std::uint64_t>(c[1]),
                static_cast<std::uint64_t>(c[2]));
  }
};

/// The width of a square that holds `count` points of a map that covers its extent once [m].
double width_for(double count, const Bounds3& bulk, std::size_t points) {
  Eigen::Vector3d extent = bulk.max - bulk.min;
  std::sort(extent.begin(), extent.end());
  return std::sqrt(count * extent[1] * extent[2] / static_cast<double>(points));
}

double spacing_within(PointsView map, const Bounds3& bulk) {
  constexpr std::size_t kPlaces = 256, kNeighbours = 8, kFewest = 100;
  const double width = width_for(16.0, bulk, map.size());
  if (map.size() < kFewest || !(width > 0.0)) return 0.0;
  const auto cell_of = [&](const Point& p) {
    const Eigen::Vector3d c = ((p - bulk.min) / width).array().floor();
    Cell cell;
    for (std::size_t k = 0; k < 3; ++k) {
      cell[k] = static_cast<std::int64_t>(std::clamp(c[static_cast<Eigen::Index>(k)], -1e15, 1e15));
    }
    return cell;
  };
  const auto around = [](const Cell& c, const auto& take) {
    for (std::int64_t x = -1; x <= 1; ++x) {
      for (std::int64_t y = -1; y <= 1; ++y) {
        for (std::int64_t z = -1; z <= 1; ++z) take(Cell{c[0] + x, c[1] + y, c[2] + z});
      }
    }
  };
  const std::size_t places = std::min(kPlaces, map.size());
  std::vector<std::size_t> chosen(places);
  std::unordered_map<Cell, std::vector<Point>, CellHash> near;
  for (std::size_t i = 0; i < places; ++i) {
    chosen[i] = i * (map.size() / places) + map.size() / places / 2;
    around(cell_of(map[chosen[i]]), [&](const Cell& c) { near.try_emplace(c); });
  }
  for (const Point& p : map) {
    if (const auto found = near.find(cell_of(p)); found != near.end()) found->second.push_back(p);
  }
  std::vector<double> spacings;
  for (const std::size_t i : chosen) {
    std::vector<double> squared;
    around(cell_of(map[i]), [&](const Cell& c) {
      for (const Point& p : near.at(c)) {
        const double d = (p - map[i]).squaredNorm();
        if (d > 0.0 && d <= width * width) squared.push_back(d);
      }
    });
    double radius = width;  // fewer neighbours than asked for
    if (squared.size() >= kNeighbours) {
      std::nth_element(squared.begin(), squared.begin() + kNeighbours - 1, squared.end());
      radius = std::sqrt(squared[kNeighbours - 1]);
    }
    spacings.push_back(radius * std::sqrt(std::numbers::pi / kNeighbours));
  }
  return median_of(std::move(spacings));
}

/// The columns of points along an axis, and how things in them stand on what is flat.
class Columns {
 public:
  Columns(const PointCloud& points, const Bounds3& bulk, int axis, double width)
      : axis_(axis), width_(width) {
    for (const Point& p : points) {
      if (((p - bulk.min).array() < 0.0).any() || ((bulk.max - p).array() < 0.0).any()) continue;
      const double h = p[axis_];
      auto [column, fresh] = columns_.try_emplace(key_of(p - bulk.min), Span{h, h});
      column->second.low = std::min(column->second.low, h);
      column->second.high = std::max(column->second.high, h);
    }
  }

  [[nodiscard]] std::size_t occupied() const { return columns_.size(); }
  [[nodiscard]] std::size_t flat() const {
    return static_cast<std::size_t>(
        std::count_if(columns_.begin(), columns_.end(),
                      [&](const auto& column) { return is_flat(column.second); }));
  }

  /// How many things have their lower end, and their upper end, at the height of the flat columns
  /// around them.
  struct Ends {
    std::size_t lower = 0, upper = 0;
  };
  [[nodiscard]] Ends ends() const {
    constexpr std::int64_t kAround = 3;
    constexpr std::size_t kFewest = 3;
    const double near = 0.4 * width_, tall = 2.0 * width_;
    Ends ends;
    std::vector<double> heights;
    for (const auto& [key, span] : columns_) {
      if (span.high - span.low < tall) continue;
      heights.clear();
      for (std::int64_t x = -kAround; x <= kAround; ++x) {
        for (std::int64_t y = -kAround; y <= kAround; ++y) {
          const auto other = columns_.find({key[0] + x, key[1] + y, 0});
          if (other == columns_.end() || !is_flat(other->second)) continue;
          heights.push_back(0.5 * (other->second.low + other->second.high));
        }
      }
      if (heights.size() < kFewest) continue;
      const double level = median_of(heights);
      ends.lower += std::abs(span.low - level) < near ? 1 : 0;
      ends.upper += std::abs(span.high - level) < near ? 1 : 0;
    }
    return ends;
  }

 private:
  struct Span {
    double low, high;
  };
  [[nodiscard]] bool is_flat(const Span& span) const { return span.high - span.low < 0.3 * width_; }
  [[nodiscard]] Cell key_of(const Point& p) const {
    const double u = p[axis_ == 0 ? 1 : 0], v = p[axis_ == 2 ? 1 : 2];
    return {static_cast<std::int64_t>(u / width_), static_cast<std::int64_t>(v / width_), 0};
  }

  Eigen::Index axis_;
  double width_;
  std::unordered_map<Cell, Span, CellHash> columns_;
};

/// The direction in which things stand on the ground, and the share of flat columns along z.
void find_up(const PointCloud& points, MapFacts& facts) {
  constexpr std::size_t kFewest = 30;
  constexpr double kClear = 2.0;
  const double width = width_for(10.0, facts.bulk, points.size());
  if (!(width > 0.0)) return;
  const Eigen::Vector3d extent = facts.bulk.max - facts.bulk.min;
  std::array<std::size_t, 3> flat;
  std::vector<Columns> along;
  for (int axis = 0; axis < 3; ++axis) {
    along.emplace_back(points, facts.bulk, axis, width);
    flat[static_cast<std::size_t>(axis)] = along.back().flat();
  }
  facts.flat_share = static_cast<double>(flat[2]) /
                     static_cast<double>(std::max<std::size_t>(1, along[2].occupied()));
  // The ground is the largest flat thing, and the map is lowest across it. Without both, z it is.
  int axis = 2;
  for (const int other : {0, 1}) {
    if (kClear * extent[other] < extent[2] &&
        static_cast<double>(flat[static_cast<std::size_t>(other)]) >
            kClear * static_cast<double>(flat[static_cast<std::size_t>(axis)])) {
      axis = other;
    }
  }
  const Columns::Ends ends = along[static_cast<std::size_t>(axis)].ends();
  const auto [less, more] = std::minmax(ends.lower, ends.upper);
  if (more < kFewest || static_cast<double>(more) < kClear * static_cast<double>(less)) return;
  facts.up = Direction{axis, ends.upper > ends.lower};
}

}  // namespace

std::string_view to_string(const Direction& direction) noexcept {
  constexpr std::array<std::array<std::string_view, 2>, 3> kNames{
      {{"+x", "-x"}, {"+y", "-y"}, {"+z", "-z"}}};
  return kNames[static_cast<std::size_t>(direction.axis)][direction.negative ? 1 : 0];
}

double spacing_of(PointsView map) {
  return map.empty() ? 0.0 : spacing_within(map, bulk_of(some_of(map)));
}

MapFacts measure_map(PointsView map) {
  MapFacts facts;
  facts.points = map.size();
  if (map.empty()) return facts;
  const PointCloud some = some_of(map);
  facts.bulk = bulk_of(some);
  bool floats = true;
  for (const Point& p : some) {
    facts.farthest_coordinate = std::max(facts.farthest_coordinate, p.cwiseAbs().maxCoeff());
    floats = floats && p == p.cast<float>().cast<double>();
  }
  if (floats) {
    const auto largest = static_cast<float>(facts.farthest_coordinate);
    facts.rounding = std::nextafter(largest, std::numeric_limits<float>::infinity()) - largest;
  }
  facts.spacing = spacing_within(map, facts.bulk);
  find_up(some, facts);
  return facts;
}

}  // namespace vantage::checks
