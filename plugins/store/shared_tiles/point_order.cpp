#include "point_order.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "bytes.hpp"

namespace vantage::shared_tiles {
namespace {

// A jump is a difference modulo 2^32 with the sign in the lowest bit.
std::uint32_t folded(std::uint32_t jump) noexcept {
  return jump << 1U ^ (jump >> 31U != 0 ? 0xffff'ffffU : 0U);
}
std::uint32_t unfolded(std::uint32_t code) noexcept {
  return code >> 1U ^ ((code & 1U) != 0 ? 0xffff'ffffU : 0U);
}

}  // namespace

void OrderWriter::add(std::uint32_t part, std::uint32_t pick) {
  if (piece_.count > 0 && part == piece_.part && pick == piece_.begin + piece_.count) {
    ++piece_.count;
    return;
  }
  write();
  piece_ = {.part = part, .begin = pick, .count = 1};
}

void OrderWriter::write() {
  if (piece_.count == 0) return;
  const std::uint32_t jump = piece_.begin - next_[piece_.part];
  append_leb(code_, std::uint64_t{piece_.part} << 1U | (jump != 0 ? 1U : 0U));
  if (jump != 0) append_leb(code_, folded(jump));
  append_leb(code_, piece_.count);
  next_[piece_.part] = piece_.begin + piece_.count;
}

std::string OrderWriter::code() && {
  write();
  return std::move(code_);
}

std::optional<std::vector<std::vector<PlacedPiece>>> read_order(
    std::string_view code, std::span<const std::uint32_t> counts) {
  const std::uint64_t all = std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
  std::vector<std::vector<PlacedPiece>> pieces(counts.size());
  std::vector<std::uint32_t> next(counts.size(), 0);  // the point after the last piece, by tile
  std::uint64_t to = 0;
  ByteReader reader(code);
  while (reader.left() > 0) {
    const std::uint64_t number = reader.counted();
    const std::uint64_t part = number >> 1U;
    if (part >= counts.size()) return std::nullopt;
    std::uint32_t begin = next[part];
    if ((number & 1U) != 0) begin += unfolded(static_cast<std::uint32_t>(reader.counted()));
    const std::uint64_t count = reader.counted();
    if (!reader.ok() || count == 0 || begin >= counts[part] || count > counts[part] - begin ||
        count > all - to) {
      return std::nullopt;
    }
    pieces[part].push_back({to, begin, static_cast<std::uint32_t>(count)});
    next[part] = begin + static_cast<std::uint32_t>(count);
    to += count;
  }
  if (to != all) return std::nullopt;
  return pieces;
}

void place_points(const StoredTile& tile, std::span<const Run> runs,
                  std::span<const PlacedPiece> pieces, PointCloud& points) {
  std::vector<std::uint32_t> taken{0};  // before each run, and in all
  taken.reserve(runs.size() + 1);
  for (const Run& run : runs) taken.push_back(taken.back() + (run.end - run.begin));
  std::size_t run = 0;  // where the last piece ended
  for (const PlacedPiece& piece : pieces) {
    if (piece.begin < taken[run] || piece.begin > taken[run + 1]) {
      run = static_cast<std::size_t>(std::ranges::upper_bound(taken, piece.begin) - taken.begin()) -
            1;
    }
    Point* to = points.data() + piece.to;
    const std::uint32_t end = piece.begin + piece.count;
    for (std::uint32_t at = piece.begin; at < end;) {
      if (taken[run + 1] <= at) {
        ++run;
        continue;
      }
      const std::uint32_t until = std::min(end, taken[run + 1]);
      const std::uint32_t first = runs[run].begin + (at - taken[run]);
      to = tile.copy(first, first + (until - at), to);
      at = until;
    }
  }
}

}  // namespace vantage::shared_tiles
