#include "elements.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bit>
#include <cmath>
#include <string>
#include <tuple>
#include <unordered_set>

namespace vantage::surface {
namespace {

constexpr int kBits = 20;  // of a cell's number along an axis
constexpr double kMaxCells = 1 << kBits;
constexpr int kParts = 4;  // of a cell along each axis, whose occupation is counted

constexpr double kFlat = 0.85;            // |z| of a normal of ground, at least
constexpr double kGroundThickness = 0.1;  // of ground, at most [m]
constexpr double kAboveGround = 2.4;      // what moves is no higher [m]
constexpr int kGroundAround = 4;          // of eight neighbours that are ground, too, at least

using Cell = std::uint64_t;  // x, y and z from high to low bits

Cell packed(Cell x, Cell y, Cell z) { return (x << (2 * kBits)) | (y << kBits) | z; }

Cell cell_of(const Point& p, const Point& origin, double width) {
  const Point place = ((p - origin) / width).array().floor().max(0.0);
  return packed(static_cast<Cell>(place.x()), static_cast<Cell>(place.y()),
                static_cast<Cell>(place.z()));
}

std::int64_t part(Cell cell, int axis) {
  return static_cast<std::int64_t>((cell >> ((2 - axis) * kBits)) & ((Cell{1} << kBits) - 1));
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
    Cell cell;
    std::uint32_t index;
  };
  std::vector<Placed> placed(map.size());
  tbb::parallel_for(std::size_t{0}, map.size(), [&](std::size_t i) {
    placed[i] = {cell_of(map[i], origin, result.width_), static_cast<std::uint32_t>(i)};
  });
  // By place within a cell, so that sums do not depend on the order of the points.
  const auto key = [&](const Placed& p) {
    const Point& at = map[p.index];
    return std::tuple(p.cell, at.x(), at.y(), at.z(), p.index);
  };
  tbb::parallel_sort(placed.begin(), placed.end(), [&](const Placed& a, const Placed& b) {
    return a.cell != b.cell ? a.cell < b.cell : key(a) < key(b);
  });

  std::vector<Cell> cells;
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
  result.find_over_ground(cells);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto column = static_cast<std::size_t>(part(cells[i], 0));
    while (result.first_.size() <= column) result.first_.push_back(static_cast<std::uint32_t>(i));
  }
  result.first_.push_back(static_cast<std::uint32_t>(cells.size()));
  return result;
}

std::span<const Element> Elements::between(double low, double high) const noexcept {
  const auto columns = static_cast<double>(first_.size() - 1);
  const auto column = [&](double x) {
    return static_cast<std::size_t>(
        std::clamp(std::floor((x - origin_.x()) / width_), -1.0, columns) + 1.0);
  };
  // One column more on both sides: coordinates are rounded.
  const std::size_t begin = std::max<std::size_t>(column(low), 2) - 2;
  const std::size_t end = std::min(column(high) + 1, first_.size() - 1);
  if (begin >= end) return {};
  return std::span(elements_).subspan(first_[begin], first_[end] - first_[begin]);
}

double Elements::reach_of_ground() const noexcept { return kAboveGround + 4.0 * width_; }

Shape Elements::measure(PointsView map, std::span<const std::uint32_t> points) const {
  const Point& first = map[points.front()];
  const Point corner = origin_ + ((first - origin_) / width_).array().floor().matrix() * width_;
  Point sum = Point::Zero();
  std::uint64_t occupied = 0;
  for (const std::uint32_t k : points) {
    sum += map[k] - first;
    const Eigen::Array3i at =
        ((map[k] - corner) * (kParts / width_)).array().cast<int>().max(0).min(kParts - 1);
    occupied |= std::uint64_t{1} << ((at.x() * kParts + at.y()) * kParts + at.z());
  }
  const auto n = static_cast<double>(points.size());
  const Point mean = sum / n;
  const double spacing2 = point_spacing_ * point_spacing_;
  const double parts = std::min<int>(std::popcount(occupied), kParts * kParts);
  Shape shape;
  shape.centre = first + mean;
  shape.fill =
      static_cast<float>(parts / std::min<double>(kParts * kParts, width_ * width_ / spacing2));
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const std::uint32_t k : points) {
    const Point offset = map[k] - first - mean;
    scatter += offset * offset.transpose();
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(scatter / n);
  // As far as points this far apart extend that have this deviation, evenly spread.
  const Point variances = solver.eigenvalues().cwiseMax(0.0);
  const Point extents = (12.0 * variances.array() + Eigen::Array3d(0.0, spacing2, spacing2)).sqrt();
  shape.axes = solver.eigenvectors().cast<float>();
  shape.extents = extents.cast<float>();
  shape.thickness = static_cast<float>(std::sqrt(variances[0]));
  shape.density = static_cast<float>(parts * spacing2 / (extents[1] * extents[2]));
  shape.is_isolated = points.size() < 3;
  shape.is_flat = !shape.is_isolated && extents[1] > 1.1 * point_spacing_;
  // Around a line no direction is its normal.
  if (!shape.is_flat) shape.extents[0] = shape.extents[1];
  return shape;
}

void Elements::find_over_ground(std::span<const Cell> cells) {
  std::unordered_set<Cell> flat;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Element& element = elements_[i];
    const Shape& shape = element.shape;
    if (shape.is_flat && std::abs(shape.axes(2, 0)) > kFlat && shape.thickness < kGroundThickness) {
      flat.insert(cells[i]);
    }
  }
  const auto is_flat = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
    if (x < 0 || y < 0 || z < 0) return false;
    return flat.contains(packed(static_cast<Cell>(x), static_cast<Cell>(y), static_cast<Cell>(z)));
  };
  const auto levels = static_cast<std::int64_t>(std::ceil(kAboveGround / width_));
  tbb::parallel_for(std::size_t{0}, cells.size(), [&](std::size_t i) {
    const std::int64_t x = part(cells[i], 0), y = part(cells[i], 1), z = part(cells[i], 2);
    for (std::int64_t below = 1; below <= levels && !elements_[i].over_ground; ++below) {
      if (!is_flat(x, y, z - below)) continue;
      int around = 0;
      for (int dx = -1; dx <= 1; ++dx) {
        for (int dy = -1; dy <= 1; ++dy) {
          if (dx == 0 && dy == 0) continue;
          for (int dz = -1; dz <= 1; ++dz) {
            if (is_flat(x + dx, y + dy, z - below + dz)) {
              ++around;
              break;
            }
          }
        }
      }
      elements_[i].over_ground = around >= kGroundAround;
    }
  });
}

}  // namespace vantage::surface
