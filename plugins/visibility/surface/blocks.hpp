#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "elements.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage::surface {

/// The elements of 8 x 8 x 8 cells.
struct Block {
  std::int32_t x, y, z;            ///< where it lies among the blocks
  std::uint32_t begin, end;        ///< its elements, as `Blocks` numbers them
  std::array<float, 3> low, high;  ///< box around all that its elements cover, from the corner [m]
};

/// What does not depend on the viewpoint, of each element. Each is an array over all elements.
enum class Field : std::uint8_t {
  x,
  y,
  z,  // centre, from the corner of the block [m]
  normal_x,
  normal_y,
  normal_z,
  extent,  // along the normal [m]
  first_x,
  first_y,
  first_z,  // the other axes, as long as the element extends [m]
  second_x,
  second_y,
  second_z,
  flat,       // 1 for a piece of a plane, 0 for another shape
  roughness,  // of `Optics`
  brightness,
  depth,  // of `Optics`, for its part of the scene
  bare_brightness,
  bare_depth,  // the same for structure
  count,
};

/// Elements as they are looked at: block by block, in arrays. Blocks are anchored as the elements
/// are.
class Blocks {
 public:
  /// @param thickness  of a surface's points [m]
  Blocks(const Elements& elements, double thickness);

  /// In ascending order of x, then y, then z.
  [[nodiscard]] std::span<const Block> all() const noexcept { return blocks_; }
  [[nodiscard]] double width() const noexcept { return width_; }  ///< of a block [m]
  [[nodiscard]] Point corner(const Block& block) const noexcept {
    return origin_ + width_ * Point(block.x, block.y, block.z);
  }
  [[nodiscard]] const float* field(Field of) const noexcept {
    return &values_[static_cast<std::size_t>(of) * numbers_.size()];
  }
  /// The number that `Elements` gives to an element.
  [[nodiscard]] std::uint32_t number(std::uint32_t element) const noexcept {
    return numbers_[element];
  }

  /// Blocks [begin, end) with the same x.
  struct Row {
    std::int32_t x;
    std::uint32_t begin, end;
  };
  /// All blocks that can hold a point within a radius of a box in plan view, and some others; in
  /// ascending order. What it costs does not depend on how far the map extends elsewhere.
  [[nodiscard]] std::vector<Row> rows_around(const Point& low, const Point& high,
                                             double radius) const;

 private:
  Point origin_;
  double width_;
  std::vector<Block> blocks_;
  std::vector<std::uint32_t> first_;    // first block of each x, and the end
  std::vector<std::uint32_t> numbers_;  // of the elements
  std::vector<float> values_;           // fields
};

/// The elements that are known to be seen from some viewpoints. Threads may share it.
class Known {
 public:
  /// @param reach  no element farther than this from all viewpoints is asked about [m]
  Known(const Blocks& blocks, std::span<const Point> viewpoints, double reach);

  /// What to add to the number of an element to get its place here. Precondition: x is that of a
  /// block within reach of a viewpoint.
  [[nodiscard]] std::uint32_t shift(std::int32_t x) const noexcept {
    return shifts_[static_cast<std::size_t>(x - rows_.front().x)];
  }
  [[nodiscard]] bool is_seen(std::uint32_t place) const noexcept {
    return seen_[place].load(std::memory_order_relaxed) != 0;
  }
  void see(std::uint32_t place) noexcept { seen_[place].store(1, std::memory_order_relaxed); }

  /// The elements that are seen, as `Blocks` numbers them, in ascending order.
  [[nodiscard]] std::vector<std::uint32_t> elements() const;

 private:
  std::vector<Blocks::Row> rows_;
  std::vector<std::uint32_t> shifts_;  // of each x from that of the first row
  std::vector<std::atomic<std::uint8_t>> seen_;
  const Blocks& blocks_;
};

}  // namespace vantage::surface
