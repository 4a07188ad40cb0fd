#include "merged_points.hpp"

#include <algorithm>
#include <array>

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

/// By rank: a radix sort with digits of 11 bits, the lowest first. Of a few pieces, or of many: it
/// takes the same time for each.
void MergedPoints::sort() {
  constexpr unsigned kDigit = 11;
  std::vector<Piece> sorted(pieces_.size());
  std::uint32_t greatest = 0;
  for (const Piece& piece : pieces_) greatest = std::max(greatest, piece.rank);
  for (unsigned shift = 0; shift < 32 && greatest >> shift != 0; shift += kDigit) {
    std::array<std::uint32_t, (1U << kDigit) + 1> begin{};
    const auto digit_of = [&](const Piece& piece) {
      return (piece.rank >> shift) & ((1U << kDigit) - 1);
    };
    for (const Piece& piece : pieces_) ++begin[digit_of(piece) + 1];
    for (std::size_t d = 1; d < begin.size(); ++d) begin[d] += begin[d - 1];
    for (const Piece& piece : pieces_) sorted[begin[digit_of(piece)]++] = piece;
    pieces_.swap(sorted);
  }
}

}  // namespace vantage::shared_tiles
