#include "elements.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <string>
#include <tuple>
#include <unordered_map>

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

  struct Placed {
    Packed cell;
    std::uint32_t index;
  };
  std::vector<Placed> placed(map.size());
  tbb::parallel_for(std::size_t{0}, map.size(), [&](std::size_t i) {
    placed[i] = {cell_of(map[i], origin, result.width_), static_cast<std::uint32_t>(i)};
  });
  // Sorted by place within a cell, so that sums do not depend on the order of the points.
  const auto key = [&](const Placed& p) {
    const Point& at = map[p.index];
    return std::tuple(p.cell, at.x(), at.y(), at.z(), p.index);
  };
  tbb::parallel_sort(placed.begin(), placed.end(), [&](const Placed& a, const Placed& b) {
    return a.cell != b.cell ? a.cell < b.cell : key(a) < key(b);
  });

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
  std::vector<std::uint8_t> is_level(cells.size());
  // Cells are in ascending order, so the cells of a column are consecutive.
  struct Column {
    std::size_t begin = 0, end = 0;
  };
  std::vector<Column> columns;
  std::unordered_map<Packed, std::size_t> column_at;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Shape& shape = elements_[i].shape;
    is_level[i] =
        shape.is_flat && std::abs(shape.axes(2, 0)) > kFlat && shape.thickness < kGroundThickness;
    if (i == 0 || cells[i] >> kBits != cells[i - 1] >> kBits) {
      column_at.emplace(cells[i] >> kBits, columns.size());
      columns.push_back({i, i});
    }
    columns.back().end = i + 1;
  }

  const auto z_of = [&](std::size_t i) { return coordinate(cells[i], 2); };
  const auto low = static_cast<std::int64_t>(std::ceil(kLow / width_));
  const auto high = static_cast<std::int64_t>(std::ceil(kHigh / width_));
  tbb::parallel_for(std::size_t{0}, columns.size(), [&](std::size_t c) {
    const std::int64_t x = coordinate(cells[columns[c].begin], 0);
    const std::int64_t y = coordinate(cells[columns[c].begin], 1);
    // Missing columns count as empty.
    constexpr int kSide = 2 * kAround + 1;
    std::array<Column, kSide * kSide> around;
    const auto column = [&](int dx, int dy) -> Column& {
      return around[static_cast<std::size_t>((dx + kAround) * kSide + dy + kAround)];
    };
    for (int dx = -kAround; dx <= kAround; ++dx) {
      for (int dy = -kAround; dy <= kAround; ++dy) {
        if (x + dx < 0 || y + dy < 0) continue;
        const auto found =
            column_at.find(packed(0, static_cast<Packed>(x + dx), static_cast<Packed>(y + dy)));
        if (found != column_at.end()) column(dx, dy) = columns[found->second];
      }
    }
    /// Whether a column has cells with from <= z <= to for which `has` holds.
    const auto any = [&](const Column& in, std::int64_t from, std::int64_t to, const auto& has) {
      const auto [first, last] = std::pair(cells.begin() + in.begin, cells.begin() + in.end);
      const auto begin = std::partition_point(
          first, last, [&](Packed cell) { return coordinate(cell, 2) < from; });
      for (auto i = static_cast<std::size_t>(begin - cells.begin()); i < in.end; ++i) {
        if (z_of(i) > to) return false;
        if (has(i)) return true;
      }
      return false;
    };
    const auto level = [&](std::size_t i) { return is_level[i] != 0; };
    const auto goes_on = [&](std::int64_t z) {
      int n = 0;
      for (int dx = -1; dx <= 1; ++dx) {
        for (int dy = -1; dy <= 1; ++dy) {
          n += (dx != 0 || dy != 0) && any(column(dx, dy), z - 1, z + 1, level);
        }
      }
      return n >= kGroundBeneath;
    };

    for (std::size_t i = columns[c].begin; i < columns[c].end; ++i) {
      const std::int64_t z = z_of(i);
      Part& part = elements_[i].part;
      if (any(columns[c], z - low, z - 1,
              [&](std::size_t k) { return level(k) && goes_on(z_of(k)); })) {
        part = Part::low;
        continue;
      }
      int grounds = 0;
      std::int64_t ground = z;
      for (const Column& in : around) {
        grounds += any(in, z - low, z - 1, [&](std::size_t k) {
          if (level(k)) ground = std::min(ground, z_of(k));
          return level(k);
        });
      }
      if (grounds < kGroundAround) {
        if (level(i)) part = Part::ground;
        continue;
      }
      bool is_part_of_higher = false;
      for (int dx = -1; dx <= 1; ++dx) {
        for (int dy = -1; dy <= 1; ++dy) {
          is_part_of_higher |= any(column(dx, dy), ground + low + 1, ground + high,
                                   [](std::size_t) { return true; });
        }
      }
      if (!is_part_of_higher) part = Part::low;
    }
  });
}

}  // namespace vantage::surface
