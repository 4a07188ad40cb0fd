#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "io/tiles/grid.hpp"
#include "vantage/io/tiling.hpp"
#include "vantage/result.hpp"

namespace vantage::io::tiles {

inline constexpr const char* kStateFile = "state.vtiles";

/// A file that is tiled, as it was when counting began.
struct Input {
  std::string path;
  std::uint64_t size = 0;     // [bytes]
  std::int64_t modified = 0;  // [ns]
  friend bool operator==(const Input&, const Input&) = default;
};

/// What decides about the bytes of the result.
struct Job {
  std::uint64_t cells_a_side = 1;
  std::uint64_t pack_size = 0;  // [bytes]
  std::vector<Input> inputs;
  friend bool operator==(const Job&, const Job&) = default;
};

/// How far a run has come. All that is before `input` and `position` need not be read again.
struct State {
  Job job;
  TilingStage stage = TilingStage::counting;
  std::uint64_t input = 0;
  std::uint64_t position = 0;  // see CloudChunks
  std::uint64_t counted = 0;   // finite points
  std::uint64_t dropped = 0;
  bool needs_float64 = false;
  Bounds3 bounds;
  std::vector<std::uint64_t> placed;     // points, of each cell as in the index; when placing
  std::vector<std::uint64_t> checksums;  // of what is placed, of each tile; when placing
};

/// A state and the cells that are counted so far.
struct LoadedState {
  State state;
  std::vector<Cell> cells;
};

/// @param cells  those without points are left out
/// Errors: those of OutputFile.
[[nodiscard]] Result<void> write_state(const std::filesystem::path& file, const State& state,
                                       std::span<const Cell> cells);
/// Errors: `not_found`, `corrupt_data`, `io_failure`.
[[nodiscard]] Result<LoadedState> read_state(const std::filesystem::path& file);

/// A file or tiled map as it is now. Errors: `not_found`, `io_failure`.
[[nodiscard]] Result<Input> examine(const std::filesystem::path& path);

}  // namespace vantage::io::tiles
