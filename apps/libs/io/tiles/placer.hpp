#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "io/tiles/cell_table.hpp"
#include "io/tiles/index.hpp"
#include "io/tiles/state.hpp"
#include "vantage/kit/file_system.hpp"

namespace vantage::io::tiles {

/// Writes points to their places in the packs, a chunk at a time: sorts the chunk by cell, then
/// writes what belongs together in one piece.
class Placer {
 public:
  /// Bytes of memory for each cell beside the table of cells, for each tile, and for each point of
  /// a chunk.
  static constexpr std::uint64_t kBytesOfCell =
      sizeof(Cell) + 2 * sizeof(std::uint64_t) + 2 * sizeof(std::uint32_t);
  static constexpr std::uint64_t kBytesOfTile = sizeof(StoredTile) + sizeof(std::uint64_t);
  [[nodiscard]] static constexpr std::uint64_t bytes_of_point(std::uint64_t point_size) noexcept {
    return sizeof(Point) + 2 * sizeof(std::uint32_t) + point_size;
  }

  /// @param index  laid out; must outlive the object
  /// @param table  the cells of the index, each with its number; changed
  /// @param chunk  the most points of a chunk; < 2^32
  Placer(const std::filesystem::path& folder, const Index& index, CellTable table,
         std::size_t chunk);

  /// Makes the packs with their final sizes. Errors: `io_failure`.
  [[nodiscard]] Result<void> create_packs();
  /// Writes the points after those that the state says are placed, and adds them to the state.
  /// Errors: `io_failure`, also for points that were not counted.
  [[nodiscard]] Result<void> place(PointsView points, State& state);

 private:
  [[nodiscard]] Result<void> assign(PointsView points, const State& state);
  template <class Stored>
  void sort(PointsView points, State& state);
  [[nodiscard]] Result<void> write(const State& state);
  [[nodiscard]] Result<void> write_piece(std::uint64_t pack, std::uint64_t offset,
                                         std::uint64_t first, std::uint64_t end);
  [[nodiscard]] tl::unexpected<Error> disk_error(const std::filesystem::path& pack,
                                                 int reason) const;

  std::filesystem::path folder_;
  const Index& index_;
  CellTable table_;
  std::vector<std::uint64_t> in_tile_;  // of each cell: points of its tile before it
  std::vector<std::uint32_t> tile_;     // of each cell
  std::vector<std::uint32_t> next_;     // of each cell: its points in the chunk, then their end
  std::vector<std::uint32_t> touched_;  // cells that have points in the chunk, ascending
  std::unique_ptr<std::uint32_t[]> cell_of_point_;
  std::unique_ptr<char[]> sorted_;  // points of the chunk as they are stored
  Descriptor pack_;
  std::uint64_t pack_number_ = 0;
};

}  // namespace vantage::io::tiles
