#include "io/tiles/placer.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <utility>

namespace vantage::io::tiles {
namespace {

tl::unexpected<Error> not_counted() {
  return fail(ErrorCode::io_failure,
              "the file changed after its points were counted; run the same command again");
}

/// Returns 0, or an errno value.
int write_at(const Descriptor& file, std::uint64_t offset, std::string_view bytes) noexcept {
  while (!bytes.empty()) {
    const ssize_t written =
        ::pwrite(file.get(), bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    offset += static_cast<std::uint64_t>(written);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

}  // namespace

Placer::Placer(const std::filesystem::path& folder, const Index& index, CellTable table,
               std::size_t chunk)
    : folder_(folder),
      index_(index),
      table_(std::move(table)),
      in_tile_(index.cells.size()),
      tile_(index.cells.size()),
      next_(index.cells.size()),
      cell_of_point_(std::make_unique_for_overwrite<std::uint32_t[]>(chunk)),
      sorted_(std::make_unique_for_overwrite<char[]>(chunk * index.point_size())) {
  touched_.reserve(std::min(chunk, index.cells.size()));
  std::size_t cell = 0;
  for (std::size_t tile = 0; tile < index.tiles.size(); ++tile) {
    std::uint64_t before = 0;
    for (std::uint64_t k = 0; k < index.tiles[tile].cells; ++k, ++cell) {
      in_tile_[cell] = before;
      tile_[cell] = static_cast<std::uint32_t>(tile);
      before += index.cells[cell].points;
      *table_.at(index.cells[cell].x, index.cells[cell].y) = cell + 1;
    }
  }
}

Result<void> Placer::create_packs() {
  for (std::size_t pack = 0; pack < index_.packs.size(); ++pack) {
    const auto path = folder_ / pack_name(pack);
    const Descriptor file = Descriptor::of(path, O_WRONLY | O_CREAT);
    if (!file.open()) return system_error(path, "the file cannot be created", errno);
    const auto size = static_cast<off_t>(index_.packs[pack]);
    if (::ftruncate(file.get(), size) != 0) return disk_error(path, errno);
    // A full disk shows here, where the file system can tell.
    if (::fallocate(file.get(), 0, 0, size) == 0) continue;
    if (errno != EOPNOTSUPP && errno != ENOSYS) return disk_error(path, errno);
  }
  return {};
}

Result<void> Placer::place(PointsView points, State& state) {
  VANTAGE_CHECK(assign(points, state));
  if (index_.coordinate_size == sizeof(float)) {
    sort<float>(points, state);
  } else {
    sort<double>(points, state);
  }
  return write(state);
}

/// Finds the cell of each point, and where the points of each cell begin in the sorted chunk.
Result<void> Placer::assign(PointsView points, const State& state) {
  touched_.clear();
  std::int32_t x = 0;
  std::int32_t y = 0;
  std::uint64_t cell = 0;  // its number + 1
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point& point = points[i];
    if (std::abs(point.x()) > kLargestCoordinate || std::abs(point.y()) > kLargestCoordinate) {
      return not_counted();
    }
    const std::int32_t point_x = cell_at(point.x());
    const std::int32_t point_y = cell_at(point.y());
    if (cell == 0 || point_x != x || point_y != y) {
      x = point_x;
      y = point_y;
      cell = table_.find(x, y);
      if (cell == 0) return not_counted();
    }
    const auto number = static_cast<std::uint32_t>(cell - 1);
    cell_of_point_[i] = number;
    if (next_[number]++ == 0) touched_.push_back(number);
  }
  std::sort(touched_.begin(), touched_.end());
  std::uint32_t first = 0;
  for (const std::uint32_t number : touched_) {
    const std::uint32_t count = std::exchange(next_[number], first);
    if (state.placed[number] + count > index_.cells[number].points) return not_counted();
    first += count;
  }
  return {};
}

template <class Stored>
void Placer::sort(PointsView points, State& state) {
  using Bits = std::conditional_t<sizeof(Stored) == sizeof(float), std::uint32_t, std::uint64_t>;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point& point = points[i];
    const std::array<Stored, 3> xyz{static_cast<Stored>(point.x()), static_cast<Stored>(point.y()),
                                    static_cast<Stored>(point.z())};
    const std::uint32_t cell = cell_of_point_[i];
    std::memcpy(sorted_.get() + std::size_t{next_[cell]++} * sizeof(xyz), xyz.data(), sizeof(xyz));
    state.checksums[tile_[cell]] +=
        checksum_of_point(in_tile_[cell] + state.placed[cell]++, std::bit_cast<Bits>(xyz[0]),
                          std::bit_cast<Bits>(xyz[1]), std::bit_cast<Bits>(xyz[2]));
  }
}

Result<void> Placer::write(const State& state) {
  std::uint64_t pack = 0;
  std::uint64_t offset = 0;  // in the pack [bytes]
  std::uint64_t first = 0;   // of the piece that is not written yet [points of the chunk]
  std::uint64_t end = 0;
  for (const std::uint32_t cell : touched_) {
    const std::uint64_t begin = end;
    const std::uint64_t count = std::exchange(next_[cell], 0) - begin;
    const StoredTile& tile = index_.tiles[tile_[cell]];
    const std::uint64_t place =
        tile.offset + (in_tile_[cell] + state.placed[cell] - count) * index_.point_size();
    if (begin == first || tile.pack != pack ||
        place != offset + (begin - first) * index_.point_size()) {
      VANTAGE_CHECK(write_piece(pack, offset, first, begin));
      pack = tile.pack;
      offset = place;
      first = begin;
    }
    end = begin + count;
  }
  return write_piece(pack, offset, first, end);
}

Result<void> Placer::write_piece(std::uint64_t pack, std::uint64_t offset, std::uint64_t first,
                                 std::uint64_t end) {
  if (first == end) return {};
  const auto path = folder_ / pack_name(pack);
  if (!pack_.open() || pack_number_ != pack) {
    pack_ = Descriptor::of(path, O_WRONLY);
    pack_number_ = pack;
    if (!pack_.open()) return system_error(path, "the file cannot be opened", errno);
  }
  const std::uint64_t size = index_.point_size();
  const int reason = write_at(pack_, offset, {sorted_.get() + first * size, (end - first) * size});
  if (reason != 0) return disk_error(path, reason);
  return {};
}

tl::unexpected<Error> Placer::disk_error(const std::filesystem::path& pack, int reason) const {
  if (reason != ENOSPC && reason != EDQUOT) {
    return system_error(pack, "the file cannot be written", reason);
  }
  return system_error(
      pack, "the disk is full; make room and run the same command again to continue", reason);
}

}  // namespace vantage::io::tiles
