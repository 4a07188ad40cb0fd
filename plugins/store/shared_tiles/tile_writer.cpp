#include "tile_writer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include "bytes.hpp"
#include "vantage/kit/hash.hpp"

namespace vantage::shared_tiles {
namespace {

constexpr std::string_view kTilesTitle = "vantage shared_tiles tiles    1\n";
static_assert(kTilesTitle.size() % kWord == 0);

using Square = std::array<std::int64_t, 2>;  // row, column

Square square_of(const Point& p, double width) noexcept {
  return {static_cast<std::int64_t>(std::floor(p.y() / width)),
          static_cast<std::int64_t>(std::floor(p.x() / width))};
}

}  // namespace

bool TileWriter::fits(const Point& p, double width) noexcept {
  // 2^100 m: float32 holds the distance of any two such points.
  return (p.head<2>().array().abs() / width < 0x1p40).all() && (p.array().abs() < 0x1p100).all();
}

TileWriter::TileWriter(const PointCloud& points, const PointOrder& order, double width)
    : points_(points), order_(order), width_(width) {
  const std::vector<std::uint32_t>& ids = order.ids();
  tile_.reserve(ids.size());
  place_.reserve(ids.size());
  std::unordered_map<Square, std::uint32_t, CellHash> numbers;
  for (const std::uint32_t id : ids) {
    const Square square = square_of(points[id], width);
    const auto [at, is_new] =
        numbers.try_emplace(square, static_cast<std::uint32_t>(tiles_.size()));
    if (is_new) tiles_.push_back({.row = square[0], .column = square[1], .points = 0, .place = {}});
    tile_.push_back(at->second);
    place_.push_back(tiles_[at->second].points++);
  }

  std::vector<std::uint32_t> sorted(tiles_.size());
  for (std::uint32_t t = 0; t < sorted.size(); ++t) sorted[t] = t;
  std::sort(sorted.begin(), sorted.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(tiles_[a].row, tiles_[a].column) < std::pair(tiles_[b].row, tiles_[b].column);
  });
  std::vector<std::uint32_t> renamed(sorted.size());
  std::vector<Tile> in_order;
  in_order.reserve(sorted.size());
  for (std::uint32_t t = 0; t < sorted.size(); ++t) {
    renamed[sorted[t]] = t;
    in_order.push_back(tiles_[sorted[t]]);
  }
  tiles_ = std::move(in_order);
  for (std::uint32_t& tile : tile_) tile = renamed[tile];
  picks_.resize(tiles_.size());
}

Result<void> TileWriter::write(bundle_folder::PartialFolder& folder, const std::string& name) {
  // The ranks, sorted by tile.
  std::vector<std::size_t> begin(tiles_.size() + 1, 0);
  for (std::size_t t = 0; t < tiles_.size(); ++t) begin[t + 1] = begin[t] + tiles_[t].points;
  std::vector<std::uint32_t> ranks(tile_.size());
  for (std::uint32_t rank = 0; rank < tile_.size(); ++rank) {
    ranks[begin[tile_[rank]] + place_[rank]] = rank;
  }
  return folder.write_file(name, [&](const bundle_folder::Sink& sink) -> Result<void> {
    VANTAGE_CHECK(sink(kTilesTitle));
    std::uint64_t offset = kTilesTitle.size();
    PointCloud points;
    for (std::size_t t = 0; t < tiles_.size(); ++t) {
      Tile& tile = tiles_[t];
      const std::span<const std::uint32_t> own(ranks.data() + begin[t], tile.points);
      points.clear();
      for (const std::uint32_t rank : own) points.push_back(points_[order_.ids()[rank]]);
      const Eigen::Vector2d corner(static_cast<double>(tile.column) * width_,
                                   static_cast<double>(tile.row) * width_);
      const std::string code = encode_tile(points, own, corner, width_);
      VANTAGE_CHECK(sink(code));
      tile.place = {.offset = offset, .bytes = code.size(), .checksum = sum_of(code).value()};
      offset += code.size();
    }
    return {};
  });
}

std::string TileWriter::parts_of(RegionSequences::Cursor region) {
  std::vector<std::uint32_t> used;
  for (std::int64_t rank = -1; !region.at_end(); region.next()) {
    rank = order_.rank(region.id(), rank);
    const auto at = static_cast<std::size_t>(rank);
    std::vector<std::uint32_t>& picks = picks_[tile_[at]];
    if (picks.empty()) used.push_back(tile_[at]);
    picks.push_back(place_[at]);
  }
  std::sort(used.begin(), used.end());
  std::vector<std::string> codes;
  std::vector<TilePart> parts;
  codes.reserve(used.size());
  for (const std::uint32_t t : used) {
    std::string& code = codes.emplace_back();
    const Coding coding = append_selection(code, picks_[t], tiles_[t].points);
    parts.push_back({.place = tiles_[t].place,
                     .count = static_cast<std::uint32_t>(picks_[t].size()),
                     .coding = coding,
                     .selection = code});
    picks_[t].clear();
  }
  return encode_parts(parts);
}

}  // namespace vantage::shared_tiles
