#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "io/tiles/grid.hpp"
#include "vantage/kit/hash.hpp"

namespace vantage::io::tiles {

/// A number for each cell, by open addressing: 16 bytes a slot, at most 6 of 10 slots taken. A slot
/// whose number is 0 is free, so numbers that are kept must not be 0.
class CellTable {
 public:
  /// @param most_bytes  while the table grows, it and its successor take 1.5 times as much
  explicit CellTable(std::uint64_t most_bytes) : most_bytes_(most_bytes), slots_(kFirstSlots) {}

  /// The number of a cell, 0 if it is new. Null if the table is full.
  [[nodiscard]] std::uint64_t* at(std::int32_t x, std::int32_t y) {
    Cell* slot = &slot_of(x, y);
    if (slot->points != 0) return &slot->points;
    if (10 * (size_ + 1) > 6 * slots_.size()) {
      if (2 * bytes() > most_bytes_) return nullptr;
      grow();
      slot = &slot_of(x, y);
    }
    ++size_;
    slot->x = x;
    slot->y = y;
    return &slot->points;
  }
  /// The number of a cell; 0 if there is none.
  [[nodiscard]] std::uint64_t find(std::int32_t x, std::int32_t y) const noexcept {
    return slots_[place_of(x, y)].points;
  }

  /// All slots; those with the number 0 are free.
  [[nodiscard]] std::span<const Cell> slots() const noexcept { return slots_; }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::uint64_t bytes() const noexcept { return slots_.size() * sizeof(Cell); }

 private:
  static constexpr std::size_t kFirstSlots = 1024;

  [[nodiscard]] std::size_t place_of(std::int32_t x, std::int32_t y) const noexcept {
    const std::size_t mask = slots_.size() - 1;
    const std::uint64_t key = static_cast<std::uint32_t>(x) |
                              static_cast<std::uint64_t>(static_cast<std::uint32_t>(y)) << 32U;
    std::size_t place = scatter(key) & mask;
    while (slots_[place].points != 0 && (slots_[place].x != x || slots_[place].y != y)) {
      place = (place + 1) & mask;
    }
    return place;
  }
  [[nodiscard]] Cell& slot_of(std::int32_t x, std::int32_t y) noexcept {
    return slots_[place_of(x, y)];
  }
  void grow() {
    const std::vector<Cell> old = std::exchange(slots_, std::vector<Cell>(2 * slots_.size()));
    for (const Cell& cell : old) {
      if (cell.points != 0) slot_of(cell.x, cell.y) = cell;
    }
  }

  std::uint64_t most_bytes_;
  std::vector<Cell> slots_;
  std::size_t size_ = 0;
};

}  // namespace vantage::io::tiles
