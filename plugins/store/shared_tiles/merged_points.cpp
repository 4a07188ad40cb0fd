#include "merged_points.hpp"

#include <algorithm>
#include <array>
#include <bit>

namespace vantage::shared_tiles {

void MergedPoints::add(const StoredTile& tile, std::span<const Run> runs) {
  const auto number = static_cast<std::uint32_t>(tiles_.size());
  tiles_.push_back(&tile);
  std::size_t s = 0;
  const auto end_of = [&](std::size_t stretch) {
    return stretch + 1 < tile.stretches.size() ? tile.stretches[stretch + 1].begin : tile.points;
  };
  for (const Run& run : runs) {
    count_ += run.end - run.begin;
    for (std::uint32_t begin = run.begin; begin < run.end;) {
      while (end_of(s) <= begin) ++s;
      const Stretch& stretch = tile.stretches[s];
      const std::uint32_t end = std::min(run.end, end_of(s));
      pieces_.push_back({stretch.rank + (begin - stretch.begin), number, begin, end});
      begin = end;
    }
  }
}

std::optional<PointCloud> MergedPoints::points() {
  sort();
  PointCloud points(count_);
  Point* to = points.data();
  std::uint64_t next = 0;  // the least rank that may follow
  for (const Piece& piece : pieces_) {
    if (piece.rank < next) return std::nullopt;
    next = std::uint64_t{piece.rank} + (piece.end - piece.begin);
    to = tiles_[piece.tile]->copy(piece.begin, piece.end, to);
  }
  return points;
}

/// By rank: a radix sort, the lowest digits first. It takes the same time for each piece, however
/// many there are. As few digits as have 11 bits at most, all equally wide: narrow digits scatter
/// less.
void MergedPoints::sort() {
  constexpr unsigned kWidest = 11;  // [bits]
  std::uint32_t greatest = 0;
  for (const Piece& piece : pieces_) greatest = std::max(greatest, piece.rank);
  const auto bits = static_cast<unsigned>(std::bit_width(greatest));
  const unsigned digits = (bits + kWidest - 1) / kWidest;
  const unsigned width = digits == 0 ? 0 : (bits + digits - 1) / digits;
  const std::uint32_t mask = (std::uint32_t{1} << width) - 1;
  std::vector<Piece> sorted(pieces_.size());
  for (unsigned digit = 0; digit < digits; ++digit) {
    std::array<std::uint32_t, (1U << kWidest) + 1> begin{};
    const auto value_in = [&](const Piece& piece) { return piece.rank >> digit * width & mask; };
    for (const Piece& piece : pieces_) ++begin[value_in(piece) + 1];
    for (std::size_t d = 1; d <= mask; ++d) begin[d] += begin[d - 1];
    for (const Piece& piece : pieces_) sorted[begin[value_in(piece)]++] = piece;
    pieces_.swap(sorted);
  }
}

}  // namespace vantage::shared_tiles
