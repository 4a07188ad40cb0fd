#include "blocks.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "optics.hpp"

namespace vantage::surface {
namespace {

constexpr int kSide = 8;  // cells along each axis of a block

Block block_of(const Elements::Cell& cell) {
  return {.x = cell.x / kSide,
          .y = cell.y / kSide,
          .z = cell.z / kSide,
          .begin = 0,
          .end = 0,
          .low = {},
          .high = {}};
}

bool is_same(const Block& a, const Block& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

/// Rounded down to a number that an index can take.
std::int64_t index_of(double quotient) {
  constexpr double kMost = 1e9;
  return static_cast<std::int64_t>(std::floor(std::clamp(quotient, -kMost, kMost)));
}

}  // namespace

Blocks::Blocks(const Elements& elements, double thickness)
    : origin_(elements.origin()),
      width_(kSide * elements.width()),
      numbers_(elements.all().size()),
      values_(static_cast<std::size_t>(Field::count) * numbers_.size()) {
  std::iota(numbers_.begin(), numbers_.end(), 0U);
  const auto place = [&](std::uint32_t number) {
    const Block at = block_of(elements.cell(number));
    return std::tuple(at.x, at.y, at.z, number);
  };
  // Elements are sorted by x, so what is out of order is near.
  for (auto begin = numbers_.begin(); begin != numbers_.end();) {
    const std::int32_t x = block_of(elements.cell(*begin)).x;
    const auto end = std::partition_point(begin, numbers_.end(), [&](std::uint32_t number) {
      return block_of(elements.cell(number)).x == x;
    });
    std::sort(begin, end, [&](auto a, auto b) { return place(a) < place(b); });
    begin = end;
  }
  for (std::uint32_t k = 0; k < numbers_.size(); ++k) {
    Block here = block_of(elements.cell(numbers_[k]));
    if (blocks_.empty() || !is_same(blocks_.back(), here)) {
      while (first_.size() <= static_cast<std::size_t>(here.x)) {
        first_.push_back(static_cast<std::uint32_t>(blocks_.size()));
      }
      here.begin = k;
      here.low.fill(std::numeric_limits<float>::infinity());
      here.high.fill(-std::numeric_limits<float>::infinity());
      blocks_.push_back(here);
    }
    blocks_.back().end = k + 1;
  }
  first_.push_back(static_cast<std::uint32_t>(blocks_.size()));

  const auto set = [&](Field field, std::size_t k, float value) {
    values_[static_cast<std::size_t>(field) * numbers_.size() + k] = value;
  };
  const auto set_vector = [&](Field field, std::size_t k, const Eigen::Vector3f& v) {
    for (int axis = 0; axis < 3; ++axis) {
      set(static_cast<Field>(static_cast<int>(field) + axis), k, v[axis]);
    }
  };
  tbb::parallel_for(std::size_t{0}, blocks_.size(), [&](std::size_t b) {
    Block& block = blocks_[b];
    const Point at = corner(block);
    for (std::uint32_t k = block.begin; k < block.end; ++k) {
      const Element& element = elements.all()[numbers_[k]];
      const Shape& shape = element.shape;
      const Eigen::Vector3f centre = (shape.centre - at).cast<float>();
      const Eigen::Matrix3f sides = shape.axes * shape.extents.asDiagonal();
      const Eigen::Vector3f half = 0.5F * sides.cwiseAbs().rowwise().sum();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<Eigen::Index>(axis);
        block.low[axis] = std::min(block.low[axis], centre[i] - half[i]);
        block.high[axis] = std::max(block.high[axis], centre[i] + half[i]);
      }
      const Optics bare = Optics::of(shape, elements.width(), thickness);
      const Optics optics = bare.as(element.part);
      set_vector(Field::x, k, centre);
      set_vector(Field::normal_x, k, shape.axes.col(0));
      set(Field::extent, k, shape.extents[0]);
      set_vector(Field::first_x, k, sides.col(1));
      set_vector(Field::second_x, k, sides.col(2));
      set(Field::flat, k, shape.is_flat ? 1.0F : 0.0F);
      set(Field::roughness, k, optics.roughness);
      set(Field::brightness, k, optics.brightness);
      set(Field::depth, k, optics.depth);
      set(Field::bare_brightness, k, bare.brightness);
      set(Field::bare_depth, k, bare.depth);
    }
  });
}

std::vector<Blocks::Row> Blocks::rows_around(const Point& low, const Point& high,
                                             double radius) const {
  // One more block on every side, because coordinates are rounded and elements are larger than
  // their cells.
  const auto index = [&](double coordinate, Eigen::Index axis) {
    return index_of((coordinate - origin_[axis]) / width_);
  };
  const auto xs = static_cast<std::int64_t>(first_.size()) - 1;
  const std::int64_t begin_x = std::max<std::int64_t>(0, index(low.x() - radius, 0) - 1);
  const std::int64_t end_x = std::min(xs, index(high.x() + radius, 0) + 2);
  std::vector<Row> rows;
  for (std::int64_t x = begin_x; x < end_x; ++x) {
    // How far a block of this x is at least from the box, along x.
    const double from = origin_.x() + static_cast<double>(x - 1) * width_;
    const double off = std::max({0.0, from - high.x(), low.x() - (from + 3.0 * width_)});
    const double half = std::sqrt(std::max(0.0, radius * radius - off * off));
    const std::int64_t first_y = index(low.y() - half, 1) - 1;
    const std::int64_t last_y = index(high.y() + half, 1) + 1;
    const auto column = static_cast<std::size_t>(x);
    const auto first = blocks_.begin() + first_[column],
               last = blocks_.begin() + first_[column + 1];
    const auto begin =
        std::partition_point(first, last, [&](const Block& b) { return b.y < first_y; });
    const auto end =
        std::partition_point(begin, last, [&](const Block& b) { return b.y <= last_y; });
    rows.push_back({.x = static_cast<std::int32_t>(x),
                    .begin = static_cast<std::uint32_t>(begin - blocks_.begin()),
                    .end = static_cast<std::uint32_t>(end - blocks_.begin())});
  }
  return rows;
}

Known::Known(const Blocks& blocks, std::span<const Point> viewpoints, double reach)
    : blocks_(blocks) {
  const Bounds3 box = bounds_of(viewpoints);
  rows_ = blocks.rows_around(box.min, box.max, reach);
  std::uint32_t size = 0;
  for (const Blocks::Row& row : rows_) {
    if (row.begin == row.end) {
      shifts_.push_back(0);
      continue;
    }
    const std::uint32_t begin = blocks.all()[row.begin].begin, end = blocks.all()[row.end - 1].end;
    shifts_.push_back(size - begin);  // modulo 2^32
    size += end - begin;
  }
  seen_ = std::vector<std::atomic<std::uint8_t>>(size);
}

std::vector<std::uint32_t> Known::elements() const {
  std::vector<std::uint32_t> seen;
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const Blocks::Row& row = rows_[k];
    if (row.begin == row.end) continue;
    const std::uint32_t end = blocks_.all()[row.end - 1].end;
    for (std::uint32_t number = blocks_.all()[row.begin].begin; number < end; ++number) {
      if (is_seen(number + shifts_[k])) seen.push_back(number);
    }
  }
  return seen;
}

}  // namespace vantage::surface
