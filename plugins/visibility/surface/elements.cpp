#include "elements.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <ranges>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace vantage::surface {
namespace {

constexpr int kBits = 20;  // of a cell's number along an axis
constexpr double kMaxCells = 1 << kBits;
constexpr int kBlocks = 4;  // along each axis of a cell; their occupation is counted

constexpr double kFlat = 0.85;            // |z| of a normal of ground, at least
constexpr double kGroundThickness = 0.1;  // of ground, at most [m]
constexpr double kLow = 2.4;              // moving objects are at most this high above the ground
                                          // [m]
constexpr double kHigh = 3.6;      // if something is above an object up to this height, the object
                                   // is part of it [m]
constexpr int kAround = 3;         // cells to each side in which ground is searched for
constexpr int kGroundAround = 6;   // this many of their 49 columns must have ground
constexpr int kGroundBeneath = 4;  // this many of the eight columns next to ground must be ground,
                                   // too

using Packed = std::uint64_t;  // x, y and z from high to low bits

Packed packed(Packed x, Packed y, Packed z) { return (x << (2 * kBits)) | (y << kBits) | z; }

Packed cell_of(const Point& p, const Point& origin, double width) {
  const Point place = ((p - origin) / width).array().floor().max(0.0);
  return packed(static_cast<Packed>(place.x()), static_cast<Packed>(place.y()),
                static_cast<Packed>(place.z()));
}

std::int64_t coordinate(Packed cell, int axis) {
  return static_cast<std::int64_t>((cell >> ((2 - axis) * kBits)) & ((Packed{1} << kBits) - 1));
}

/// A point of the map, and its cell.
struct Placed {
  Packed cell;
  std::uint32_t index;
};

/// Sorts points by their cells, those of a cell by `before`.
template <class Before>
void sort_by_cell(std::vector<Placed>& points, const Before& before) {
  // By x first, counted; then each x for itself.
  const auto x_of = [](const Placed& p) { return static_cast<std::size_t>(p.cell >> (2 * kBits)); };
  std::vector<std::size_t> ends;
  for (const Placed& p : points) {
    if (x_of(p) >= ends.size()) ends.resize(x_of(p) + 1);
    ++ends[x_of(p)];
  }
  for (std::size_t x = 1; x < ends.size(); ++x) ends[x] += ends[x - 1];
  const std::vector<std::size_t> all_ends = ends;
  std::vector<Placed> sorted(points.size());
  for (auto p = points.rbegin(); p != points.rend(); ++p) sorted[--ends[x_of(*p)]] = *p;
  points = std::move(sorted);
  tbb::parallel_for(std::size_t{0}, ends.size(), [&](std::size_t x) {
    const auto begin = points.begin() + static_cast<std::ptrdiff_t>(ends[x]);
    const auto end = points.begin() + static_cast<std::ptrdiff_t>(all_ends[x]);
    std::sort(begin, end, [](const Placed& a, const Placed& b) { return a.cell < b.cell; });
    for (auto first = begin; first != end;) {
      const auto last =
          std::find_if(first, end, [&](const Placed& p) { return p.cell != first->cell; });
      std::sort(first, last, before);
      first = last;
    }
  });
}

}  // namespace

Result<Elements> Elements::of(PointsView map, const Point& origin, double point_spacing) {
  Elements result(origin, point_spacing);
  const Point extent = bounds_of(map).max - origin;
  if (!(extent.maxCoeff() / result.width_ < kMaxCells)) {
    return fail(ErrorCode::invalid_input, "the map is " + std::to_string(extent.maxCoeff()) +
                                              " m wide; with a point_spacing of " +
                                              std::to_string(point_spacing) + " m it may be " +
                                              std::to_string(kMaxCells * result.width_) + " m");
  }

  std::vector<Placed> placed(map.size());
  tbb::parallel_for(std::size_t{0}, map.size(), [&](std::size_t i) {
    placed[i] = {cell_of(map[i], origin, result.width_), static_cast<std::uint32_t>(i)};
  });
  // Sorted by place within a cell, so that sums do not depend on the order of the points.
  const auto key = [&](const Placed& p) {
    const Point& at = map[p.index];
    return std::tuple(at.x(), at.y(), at.z(), p.index);
  };
  sort_by_cell(placed, [&](const Placed& a, const Placed& b) { return key(a) < key(b); });

  std::vector<Packed>& cells = result.cells_;
  result.indices_.reserve(placed.size());
  for (const Placed& p : placed) {
    if (cells.empty() || cells.back() != p.cell) {
      cells.push_back(p.cell);
      const auto begin = static_cast<std::uint32_t>(result.indices_.size());
      result.elements_.push_back({.shape = {}, .begin = begin, .end = begin});
    }
    result.indices_.push_back(p.index);
    ++result.elements_.back().end;
  }
  tbb::parallel_for(std::size_t{0}, cells.size(), [&](std::size_t i) {
    Element& element = result.elements_[i];
    element.shape = result.measure(map, result.points(element));
  });
  result.find_parts();
  return result;
}

Elements::Cell Elements::cell(std::uint32_t number) const noexcept {
  const auto along = [&](int axis) {
    return static_cast<std::int32_t>(coordinate(cells_[number], axis));
  };
  return {.x = along(0), .y = along(1), .z = along(2)};
}

double Elements::reach_of_part() const noexcept {
  return kHigh + (kAround + 2) * std::numbers::sqrt2 * width_;
}

double Elements::reach_around(double point_spacing) noexcept {
  return (kAround + 2) * kSpacings * point_spacing;
}

double Elements::fullest() noexcept {
  return kBlocks * kBlocks / std::min<double>(kBlocks * kBlocks, kSpacings * kSpacings);
}

Shape Elements::measure(PointsView map, std::span<const std::uint32_t> points) const {
  const Point& first = map[points.front()];
  const Point corner = origin_ + ((first - origin_) / width_).array().floor().matrix() * width_;
  Point sum = Point::Zero();
  std::uint64_t occupied = 0;
  for (const std::uint32_t k : points) {
    sum += map[k] - first;
    const Eigen::Array3i at =
        ((map[k] - corner) * (kBlocks / width_)).array().cast<int>().max(0).min(kBlocks - 1);
    occupied |= std::uint64_t{1} << ((at.x() * kBlocks + at.y()) * kBlocks + at.z());
  }
  const auto n = static_cast<double>(points.size());
  const Point mean = sum / n;
  const double spacing2 = point_spacing_ * point_spacing_;
  const double blocks = std::min<int>(std::popcount(occupied), kBlocks * kBlocks);
  Shape shape;
  shape.centre = first + mean;
  shape.fill = static_cast<float>(blocks / (kBlocks * kBlocks) * fullest());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const std::uint32_t k : points) {
    const Point offset = map[k] - first - mean;
    scatter += offset * offset.transpose();
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(scatter / n);
  // The extent of evenly spread points that have this spacing and this deviation.
  const Point variances = solver.eigenvalues().cwiseMax(0.0);
  const Point extents = (12.0 * variances.array() + Eigen::Array3d(0.0, spacing2, spacing2)).sqrt();
  shape.axes = solver.eigenvectors().cast<float>();
  shape.extents = extents.cast<float>();
  shape.thickness = static_cast<float>(std::sqrt(variances[0]));
  shape.density = static_cast<float>(blocks * spacing2 / (extents[1] * extents[2]));
  shape.is_isolated = points.size() < 3;
  shape.is_flat = !shape.is_isolated && extents[1] > 1.1 * point_spacing_;
  // Points on a line have no normal direction.
  if (!shape.is_flat) shape.extents[0] = shape.extents[1];
  return shape;
}

void Elements::find_parts() {
  const std::span<const Packed> cells = cells_;
  const auto z_of = [&](std::size_t i) { return coordinate(cells[i], 2); };
  const auto is_level = [&](std::size_t i) {
    const Shape& shape = elements_[i].shape;
    return shape.is_flat && std::abs(shape.axes(2, 0)) > kFlat &&
           shape.thickness < kGroundThickness;
  };
  // Cells are in ascending order, so the cells of a column are consecutive, and so are columns of
  // one x.
  struct Column {
    Packed xy = 0;
    std::size_t begin = 0, end = 0;             // of its cells
    std::span<const std::int64_t> levels = {};  // the z of its level cells, ascending
  };
  std::vector<Column> columns;
  std::vector<std::int64_t> levels;  // of all columns, one after another
  std::vector<std::size_t> first_level;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (i == 0 || cells[i] >> kBits != cells[i - 1] >> kBits) {
      columns.push_back({.xy = cells[i] >> kBits, .begin = i, .end = i});
      first_level.push_back(levels.size());
    }
    if (is_level(i)) levels.push_back(z_of(i));
    columns.back().end = i + 1;
  }
  first_level.push_back(levels.size());
  for (std::size_t c = 0; c < columns.size(); ++c) {
    columns[c].levels =
        std::span(levels).subspan(first_level[c], first_level[c + 1] - first_level[c]);
  }

  const auto low = static_cast<std::int64_t>(std::ceil(kLow / width_));
  const auto high = static_cast<std::int64_t>(std::ceil(kHigh / width_));
  /// Those of a few z, in ascending order, with from <= z <= to.
  const auto within = [](std::span<const std::int64_t> all, std::int64_t from, std::int64_t to) {
    while (!all.empty() && all.front() < from) all = all.subspan(1);
    while (!all.empty() && all.back() > to) all = all.first(all.size() - 1);
    return all;
  };
  /// Whether a column has any cell with from <= z <= to.
  const auto has_any = [&](const Column& column, std::int64_t from, std::int64_t to) {
    const std::span all = cells.subspan(column.begin, column.end - column.begin);
    const auto first =
        std::ranges::partition_point(all, [&](Packed cell) { return coordinate(cell, 2) < from; });
    return first != all.end() && coordinate(*first, 2) <= to;
  };
  // For each dx, the first column that may be around: it moves on with the column looked at.
  constexpr std::size_t kRows = 2 * kAround + 1;
  using Firsts = std::array<std::size_t, kRows>;
  const auto look_at = [&](std::size_t c, Firsts& firsts) {
    const auto x = static_cast<std::int64_t>(columns[c].xy >> kBits);
    const auto y = static_cast<std::int64_t>(columns[c].xy & ((Packed{1} << kBits) - 1));
    // Missing columns count as empty ones.
    std::array<std::array<Column, 3>, 3> next;  // to it, by x and y
    std::array<std::span<const std::int64_t>, kRows * kRows> with_levels;
    std::size_t around = 0;  // columns in with_levels
    for (int dx = -kAround; dx <= kAround; ++dx) {
      if (x + dx < 0) continue;
      const Packed row = static_cast<Packed>(x + dx) << kBits;
      const auto first = row | static_cast<Packed>(std::max<std::int64_t>(y - kAround, 0));
      std::size_t& from = firsts[static_cast<std::size_t>(dx + kAround)];
      while (from < columns.size() && columns[from].xy < first) ++from;
      for (auto found = columns.begin() + static_cast<std::ptrdiff_t>(from);
           found != columns.end() && found->xy >> kBits == row >> kBits; ++found) {
        const std::int64_t dy = static_cast<std::int64_t>(found->xy - row) - y;
        if (dy > kAround) break;
        if (!found->levels.empty()) with_levels[around++] = found->levels;
        if (std::abs(dx) > 1 || std::abs(dy) > 1) continue;
        next[static_cast<std::size_t>(dx + 1)][static_cast<std::size_t>(dy + 1)] = *found;
      }
    }
    const auto goes_on = [&](std::int64_t z) {
      int n = -1;  // not itself
      for (const auto& row : next) {
        for (const Column& one : row) n += !within(one.levels, z - 1, z + 1).empty();
      }
      return n >= kGroundBeneath;
    };

    for (std::size_t i = columns[c].begin; i < columns[c].end; ++i) {
      const std::int64_t z = z_of(i);
      Part& part = elements_[i].part;
      if (std::ranges::any_of(within(columns[c].levels, z - low, z - 1), goes_on)) {
        part = Part::low;
        continue;
      }
      int grounds = 0;
      std::int64_t ground = z;
      for (const auto& of_column : std::span(with_levels).first(around)) {
        const auto below = within(of_column, z - low, z - 1);
        if (below.empty()) continue;
        ++grounds;
        ground = std::min(ground, below.front());
      }
      if (grounds < kGroundAround) {
        if (is_level(i)) part = Part::ground;
        continue;
      }
      bool is_part_of_higher = false;
      for (const auto& row : next) {
        for (const Column& one : row) {
          is_part_of_higher |= has_any(one, ground + low + 1, ground + high);
        }
      }
      if (!is_part_of_higher) part = Part::low;
    }
  };
  constexpr std::size_t kGrain = 1024;  // columns
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, columns.size(), kGrain), [&](const auto& range) {
        const auto here = static_cast<std::int64_t>(columns[range.begin()].xy);
        Firsts firsts{};
        for (int dx = -kAround; dx <= kAround; ++dx) {
          const std::int64_t first = here + dx * (std::int64_t{1} << kBits) - kAround;
          firsts[static_cast<std::size_t>(dx + kAround)] = static_cast<std::size_t>(
              std::ranges::lower_bound(
                  columns, static_cast<Packed>(std::max<std::int64_t>(first, 0)), {}, &Column::xy) -
              columns.begin());
        }
        for (std::size_t c = range.begin(); c != range.end(); ++c) look_at(c, firsts);
      });
}

}  // namespace vantage::surface
