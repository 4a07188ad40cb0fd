#include "vantage/io/tiling.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/cloud_chunks.hpp"
#include "io/tiles/cell_table.hpp"
#include "io/tiles/folder_kind.hpp"
#include "io/tiles/index.hpp"
#include "io/tiles/placer.hpp"
#include "io/tiles/state.hpp"

namespace vantage::io {
namespace {

namespace fs = std::filesystem;
using tiles::Cell;
using tiles::CellTable;
using tiles::Index;
using tiles::Job;
using tiles::Placer;
using tiles::State;
using tiles::StoredTile;

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20U;
constexpr std::uint64_t kBlock = 2 * kMiB;                // CloudChunks's, and small things [bytes]
constexpr std::uint64_t kPart = std::uint64_t{1} << 14U;  // points that are read at once
constexpr std::uint64_t kLeastChunk = std::uint64_t{1} << 14U;  // points that are placed at once
constexpr std::uint64_t kLeastMemory = 4 * kMiB;  // beside a file that is read as a whole [bytes]
constexpr double kLargestTile = 1e5;              // [m]

std::string mebibytes(std::uint64_t bytes) {
  return fmt::format("{} MiB", (bytes + kMiB - 1) / kMiB);
}

tl::unexpected<Error> invalid(std::string message) {
  return fail(ErrorCode::invalid_input, std::move(message));
}

tl::unexpected<Error> error_in(const fs::path& file, ErrorCode code, std::string message) {
  return fail(code, std::move(message), SourceLocation{file.string(), 0, 0});
}

Result<std::uint64_t> cells_a_side(double tile_size) {
  const double cells = tile_size / kCanonicalCell;
  if (!(tile_size >= kCanonicalCell && tile_size <= kLargestTile) || cells != std::floor(cells)) {
    return invalid(fmt::format("tiles of {} m, expected a multiple of {} m from {} to {} m",
                               tile_size, kCanonicalCell, kCanonicalCell, kLargestTile));
  }
  return static_cast<std::uint64_t>(cells);
}

/// One run, which may continue an earlier one.
class Tiling {
 public:
  Tiling(std::span<const fs::path> files, const TilingOptions& options, OutputFolder folder)
      : files_(files), options_(options), folder_(std::move(folder)) {}

  [[nodiscard]] Result<TilingReport> run(Job job) {
    VANTAGE_CHECK(examine_inputs());
    VANTAGE_CHECK(take_up(std::move(job)));
    if (state_.stage == TilingStage::counting) VANTAGE_CHECK(count());
    VANTAGE_CHECK(lay_out());
    VANTAGE_CHECK(place());
    for (std::size_t t = 0; t < index_.tiles.size(); ++t) {
      index_.tiles[t].checksum = state_.checksums[t];
    }
    VANTAGE_CHECK(tiles::write_index(folder_.path() / tiles::kIndexFile, index_));
    VANTAGE_TRY(TilingReport done, report());
    VANTAGE_CHECK(folder_.commit());
    return done;
  }

 private:
  /// Reads all headers: a mistake shows before hours of work.
  [[nodiscard]] Result<void> examine_inputs() {
    bool knows_total = true;
    for (const fs::path& file : files_) {
      VANTAGE_TRY(const CloudChunks chunks, CloudChunks::open(file));
      total_ += chunks.points();
      knows_total = knows_total && chunks.points() > 0;
      const std::uint64_t needed = chunks.memory() + kLeastMemory;
      if (chunks.memory() > 0 && needed > options_.memory) {
        return error_in(
            file, ErrorCode::invalid_input,
            fmt::format("this file can only be read as a whole, which may take {}; the limit of "
                        "memory is {}: raise it, or store the points in a binary file that is not "
                        "compressed",
                        mebibytes(needed), mebibytes(options_.memory)));
      }
      whole_ = std::max(whole_, chunks.memory());
    }
    if (!knows_total) total_ = 0;
    if (kLeastMemory > options_.memory) {
      return invalid(fmt::format("a limit of memory of {}, expected {} or more",
                                 mebibytes(options_.memory), mebibytes(kLeastMemory)));
    }
    return {};
  }

  /// Continues an interrupted run, if there is one with the same job.
  [[nodiscard]] Result<void> take_up(Job job) {
    auto loaded = tiles::read_state(folder_.path() / tiles::kStateFile);
    TilingStart start;
    if (loaded && loaded->state.job == job) {
      state_ = std::move(loaded->state);
      cells_ = std::move(loaded->cells);
      start.resumed = true;
      start.counted = state_.counted;
      for (const std::uint64_t placed : state_.placed) start.placed += placed;
    } else {
      start.started_over = loaded || loaded.error().code != ErrorCode::not_found;
      VANTAGE_CHECK(folder_.clear());
      state_.job = std::move(job);
    }
    placed_ = start.placed;
    if (options_.on_start) options_.on_start(start);
    return {};
  }

  [[nodiscard]] std::uint64_t table_limit() const noexcept {
    return (options_.memory - whole_ - kBlock) / 2;
  }

  [[nodiscard]] Result<void> count() {
    table_.emplace(table_limit());
    for (const Cell& cell : cells_) {
      std::uint64_t* const points = table_->at(cell.x, cell.y);
      if (points == nullptr) return too_many_cells();
      *points = cell.points;
    }
    cells_ = {};
    std::uint64_t unsaved = 0;
    for (; state_.input < files_.size(); ++state_.input, state_.position = 0) {
      VANTAGE_TRY(CloudChunks chunks, CloudChunks::open(file()));
      while (true) {
        LoadedCloud part;
        part.points.reserve(kPart);
        VANTAGE_TRY(const std::uint64_t read, chunks.add(part, state_.position, kPart));
        state_.dropped += part.dropped;
        if (read == 0) break;
        VANTAGE_CHECK(count(part.points));
        state_.position += read;
        state_.counted += part.points.size();
        counted_now_ += part.points.size();
        unsaved += part.points.size();
        tell(state_.counted + state_.dropped);
        note_memory(3 * table_->bytes() / 2 + chunks.memory() + kPart * sizeof(Point));
        if (unsaved >= options_.checkpoint_points) {
          VANTAGE_CHECK(save(table_->slots()));
          unsaved = 0;
        }
      }
    }
    if (state_.counted == 0) {
      return error_in(files_.front(), ErrorCode::invalid_input,
                      fmt::format("the input holds no finite point ({} dropped)", state_.dropped));
    }
    VANTAGE_CHECK(save(table_->slots()));
    return {};
  }

  [[nodiscard]] Result<void> count(PointsView points) {
    if (!state_.needs_float64) {
      state_.needs_float64 = lossless_precision(points) == Precision::float64;
    }
    std::int32_t x = 0;
    std::int32_t y = 0;
    std::uint64_t* cell = nullptr;
    for (const Point& point : points) {
      for (const Eigen::Index axis : {0, 1}) {
        if (std::abs(point[axis]) <= tiles::kLargestCoordinate) continue;
        return error_in(file(), ErrorCode::invalid_input,
                        fmt::format("a point has {} = {} m, expected {} m at most in size",
                                    axis == 0 ? "x" : "y", point[axis], tiles::kLargestCoordinate));
      }
      state_.bounds.extend(point);
      const std::int32_t point_x = tiles::cell_at(point.x());
      const std::int32_t point_y = tiles::cell_at(point.y());
      if (cell == nullptr || point_x != x || point_y != y) {
        x = point_x;
        y = point_y;
        cell = table_->at(x, y);
        if (cell == nullptr) return too_many_cells();
      }
      ++*cell;
    }
    return {};
  }

  [[nodiscard]] tl::unexpected<Error> too_many_cells() const {
    return invalid(fmt::format(
        "the points lie in more than {} squares of {} m, whose table does not fit the limit of "
        "memory of {}: raise it",
        table_ ? table_->size() : cells_.size(), kCanonicalCell, mebibytes(options_.memory)));
  }

  /// The counted cells become the index, and are numbered.
  [[nodiscard]] Result<void> lay_out() {
    if (table_) {
      cells_.reserve(table_->size());
      for (const Cell& cell : table_->slots()) {
        if (cell.points != 0) cells_.push_back(cell);
      }
    } else {
      table_.emplace(table_limit());
      for (const Cell& cell : cells_) {
        std::uint64_t* const points = table_->at(cell.x, cell.y);
        if (points == nullptr) return too_many_cells();
        *points = cell.points;
      }
    }
    const auto side = static_cast<std::int64_t>(state_.job.cells_a_side);
    std::sort(cells_.begin(), cells_.end(), [side](const Cell& a, const Cell& b) {
      const TileIndex tile_a = tiles::tile_of(a.x, a.y, side);
      const TileIndex tile_b = tiles::tile_of(b.x, b.y, side);
      return tile_a != tile_b ? tiles::before(tile_a, tile_b) : tiles::before(a, b);
    });
    index_.cells_a_side = state_.job.cells_a_side;
    index_.coordinate_size = state_.needs_float64 ? sizeof(double) : sizeof(float);
    index_.dropped = state_.dropped;
    index_.bounds = state_.bounds;
    index_.cells = std::move(cells_);
    tiles::lay_out(index_, state_.job.pack_size);
    if (state_.stage == TilingStage::counting) {
      state_.stage = TilingStage::placing;
      state_.input = state_.position = 0;
      state_.placed.assign(index_.cells.size(), 0);
      state_.checksums.assign(index_.tiles.size(), 0);
    }
    if (state_.placed.size() != index_.cells.size() ||
        state_.checksums.size() != index_.tiles.size()) {
      return error_in(folder_.path() / tiles::kStateFile, ErrorCode::corrupt_data,
                      "the state contradicts itself; remove this folder");
    }
    return {};
  }

  /// Points of a chunk, as many as memory allows.
  [[nodiscard]] Result<std::uint64_t> chunk_points() {
    constexpr std::uint64_t kMost = std::uint64_t{1} << 30U;
    const std::uint64_t fixed = whole_ + kBlock + table_->bytes() +
                                index_.cells.size() * Placer::kBytesOfCell +
                                index_.tiles.size() * Placer::kBytesOfTile;
    const std::uint64_t of_point = Placer::bytes_of_point(index_.point_size());
    const std::uint64_t least = fixed + kLeastChunk * of_point;
    if (least > options_.memory) {
      return invalid(fmt::format(
          "the {} squares of {} m in which the points lie take {}; the limit "
          "of memory is {}: raise it",
          index_.cells.size(), kCanonicalCell, mebibytes(least), mebibytes(options_.memory)));
    }
    const std::uint64_t points = std::min(
        {(options_.memory - fixed) / of_point, kMost, std::max(kLeastChunk, index_.points)});
    note_memory(fixed + points * of_point);
    return points;
  }

  [[nodiscard]] Result<void> check_disk() {
    TilingDiskUse use;
    for (const std::uint64_t pack : index_.packs) use.needed += pack;
    // The index, and the state twice while it is replaced.
    use.needed += 3 * (40 * index_.cells.size() + 64 * index_.tiles.size()) + kMiB;
    std::error_code error;
    use.free = fs::space(folder_.path(), error).available;
    if (error) return system_error(folder_.path(), "the free space is not known", error.value());
    for (std::size_t pack = 0; pack < index_.packs.size(); ++pack) {
      struct stat status {};
      const fs::path file = folder_.path() / tiles::pack_name(pack);
      if (::stat(file.c_str(), &status) == 0) {
        use.free += 512 * static_cast<std::uint64_t>(status.st_blocks);
      }
    }
    if (options_.on_disk_use) options_.on_disk_use(use);
    if (use.needed <= use.free) return {};
    return error_in(
        folder_.path(), ErrorCode::io_failure,
        fmt::format("the disk has too little room: {:.1f} MB are needed, {:.1f} MB are "
                    "free; make room and run the same command again to continue",
                    1e-6 * static_cast<double>(use.needed), 1e-6 * static_cast<double>(use.free)));
  }

  [[nodiscard]] Result<void> place() {
    VANTAGE_TRY(const std::uint64_t chunk, chunk_points());
    VANTAGE_CHECK(check_disk());
    Placer placer(folder_.path(), index_, *std::exchange(table_, std::nullopt), chunk);
    VANTAGE_CHECK(placer.create_packs());
    LoadedCloud cloud;
    cloud.points.reserve(chunk);
    std::uint64_t unsaved = 0;
    const auto flush = [&]() -> Result<void> {
      VANTAGE_CHECK(placer.place(cloud.points, state_));
      unsaved += cloud.points.size();
      placed_ += cloud.points.size();
      placed_now_ += cloud.points.size();
      cloud.points.clear();
      if (unsaved < options_.checkpoint_points) return {};
      unsaved = 0;
      VANTAGE_CHECK(flush_folder(folder_.path()));
      return save(index_.cells);
    };
    for (; state_.input < files_.size(); ++state_.input, state_.position = 0) {
      auto done = place_file(cloud, chunk, flush);
      if (!done) return about_file(std::move(done).error());
    }
    VANTAGE_CHECK(flush());
    if (placed_ != index_.points) {
      return invalid("the input changed after its points were counted; run the same command again");
    }
    return {};
  }

  template <class Flush>
  [[nodiscard]] Result<void> place_file(LoadedCloud& cloud, std::uint64_t chunk,
                                        const Flush& flush) {
    VANTAGE_TRY(const tiles::Input now, tiles::examine(file()));
    if (now != state_.job.inputs[state_.input]) {
      return error_in(file(), ErrorCode::io_failure,
                      "the file changed after its points were counted; run the same command again");
    }
    VANTAGE_TRY(CloudChunks chunks, CloudChunks::open(file()));
    while (true) {
      const std::uint64_t room = std::min(kPart, chunk - cloud.points.size());
      VANTAGE_TRY(const std::uint64_t read, chunks.add(cloud, state_.position, room));
      if (read == 0) return {};
      state_.position += read;
      tell(placed_ + cloud.points.size());
      if (cloud.points.size() == chunk) VANTAGE_CHECK(flush());
    }
  }

  [[nodiscard]] tl::unexpected<Error> about_file(Error error) const {
    if (!error.where) error.where = SourceLocation{file().string(), 0, 0};
    return fail(std::move(error));
  }

  [[nodiscard]] Result<void> save(std::span<const Cell> cells) const {
    return tiles::write_state(folder_.path() / tiles::kStateFile, state_, cells);
  }

  [[nodiscard]] Result<TilingReport> report() const {
    TilingReport report{.points = index_.points,
                        .dropped = index_.dropped,
                        .bytes = 0,
                        .packs = index_.packs.size(),
                        .tiles = index_.tiles.size(),
                        .cells = index_.cells.size(),
                        .precision = state_.needs_float64 ? Precision::float64 : Precision::float32,
                        .bounds = index_.bounds,
                        .counted_now = counted_now_,
                        .placed_now = placed_now_,
                        .buffers = buffers_};
    for (const std::uint64_t pack : index_.packs) report.bytes += pack;
    std::error_code error;
    report.bytes += fs::file_size(folder_.path() / tiles::kIndexFile, error);
    if (error) return system_error(folder_.path(), "the index is gone", error.value());
    return report;
  }

  [[nodiscard]] const fs::path& file() const { return files_[state_.input]; }

  void tell(std::uint64_t done) const {
    if (!options_.on_progress) return;
    const bool counting = state_.stage == TilingStage::counting;
    options_.on_progress({state_.stage, done, counting ? total_ : index_.points});
  }
  void note_memory(std::uint64_t bytes) { buffers_ = std::max(buffers_, bytes); }

  std::span<const fs::path> files_;
  const TilingOptions& options_;
  OutputFolder folder_;
  State state_;
  std::vector<Cell> cells_;  // of a state that was read; later in index_
  std::optional<CellTable> table_;
  Index index_;
  std::uint64_t total_ = 0;  // points that all headers state
  std::uint64_t whole_ = 0;  // memory for the largest file that is read as a whole [bytes]
  std::uint64_t placed_ = 0, counted_now_ = 0, placed_now_ = 0;
  std::uint64_t buffers_ = 0;  // [bytes]
};

}  // namespace

Result<TilingReport> tile_clouds(std::span<const fs::path> files, const TilingOptions& options) {
  if (files.empty()) return invalid("there is no file to tile");
  Job job;
  VANTAGE_TRY(job.cells_a_side, cells_a_side(options.tile_size));
  job.pack_size = options.pack_size;
  const auto existing = OutputFolder::existing(options.overwrite);
  VANTAGE_CHECK(OutputFolder::check(tiles::tiled_map_kind(), options.out, existing));
  for (const fs::path& file : files) {
    VANTAGE_TRY(auto input, tiles::examine(file));
    job.inputs.push_back(std::move(input));
  }
  VANTAGE_TRY(OutputFolder folder,
              OutputFolder::create(tiles::tiled_map_kind(), options.out, existing));
  return Tiling(files, options, std::move(folder)).run(std::move(job));
}

}  // namespace vantage::io
