#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>

#include "vantage/io/tiled_map.hpp"
#include "vantage/result.hpp"

namespace vantage::io {

enum class TilingStage : std::uint8_t { counting, placing };

struct TilingProgress {
  TilingStage stage = TilingStage::counting;
  std::uint64_t done = 0;   ///< points, also those that are not finite
  std::uint64_t total = 0;  ///< 0 if it is not known: some headers state no number
};

/// What a run finds in the partial folder.
struct TilingStart {
  bool resumed = false;       ///< an interrupted run on the same input is continued
  bool started_over = false;  ///< there is one on other input or with other options; it is dropped
  std::uint64_t counted = 0;  ///< points that need not be counted again
  std::uint64_t placed = 0;   ///< points that need not be placed again
};

/// Known after counting, before any point is written.
struct TilingDiskUse {
  std::uint64_t needed = 0;  ///< for the folder [bytes]
  std::uint64_t free = 0;    ///< with what an interrupted run already holds [bytes]
};

struct TilingOptions {
  std::filesystem::path out;                       ///< the folder to make
  double tile_size = 25.0;                         ///< [m]; a multiple of kCanonicalCell
  std::uint64_t memory = std::uint64_t{1} << 30U;  ///< limit of all buffers [bytes]
  bool overwrite = false;                          ///< an older tiled map of that name is replaced
  std::uint64_t pack_size = std::uint64_t{4}
                            << 30U;  ///< of a pack of several tiles, at most [bytes]
  /// Finite points between two records of how far the run has come.
  std::uint64_t checkpoint_points = std::uint64_t{1} << 26U;
  std::function<void(const TilingStart&)> on_start{};
  std::function<void(const TilingDiskUse&)> on_disk_use{};
  std::function<void(const TilingProgress&)> on_progress{};
};

struct TilingReport {
  std::uint64_t points = 0;
  std::uint64_t dropped = 0;  ///< with a NaN or infinite coordinate
  std::uint64_t bytes = 0;    ///< of all files
  std::uint64_t packs = 0, tiles = 0, cells = 0;
  Precision precision = Precision::float32;
  Bounds3 bounds;
  std::uint64_t counted_now = 0, placed_now = 0;  ///< points, without those of an earlier run
  std::uint64_t buffers = 0;                      ///< the most memory of all buffers [bytes]
};

/// Sorts clouds into a tiled map. Reads every file twice: it counts the points of every cell, then
/// it writes each point to its place. The order of points is canonical, see TiledMap; coordinates
/// are float32 if that changes none of them, else float64.
///
/// Works in the folder `out`.partial, which gets the name `out` when it is complete. A run that
/// fails or is killed leaves it, and a run with the same files and options continues it. The
/// result has the same bytes, whatever `memory` is and however often a run was interrupted.
/// @param files  as map_files gives them; tiled maps may be among them
/// Errors: `invalid_input` for no finite point, a wrong tile size, a coordinate beyond +-10.7
/// million km in x or y, and a memory limit that is too small for a file that must be read as a
/// whole, or for the cells; those of OutputFolder::create for `out`; `io_failure`, also for a disk
/// that is full or has too little room, and for a file that changes meanwhile; those of
/// read_point_cloud.
[[nodiscard]] Result<TilingReport> tile_clouds(std::span<const std::filesystem::path> files,
                                               const TilingOptions& options);

}  // namespace vantage::io
