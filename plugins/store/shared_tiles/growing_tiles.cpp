#include "growing_tiles.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <utility>

#include "bytes.hpp"
#include "point_order.hpp"
#include "vantage/kit/canonical_order.hpp"
#include "vantage/kit/checksum.hpp"

namespace vantage::shared_tiles {
namespace {

constexpr std::string_view kTilesTitle = "vantage shared_tiles tiles    2\n";
static_assert(kTilesTitle.size() % kWord == 0);

/// What a put writes down of each tile, before the selection.
struct PutShare {
  std::uint32_t tile, points;  // of the tile at that time
  std::uint32_t count;         // of the points that are taken
  Coding coding;
  std::uint64_t selection_bytes;
};

/// What a put begins with; shares and the code of the order follow.
struct PutHeader {
  std::uint32_t put, shares;
};

/// Puts points in canonical order. @return  by place before, the place after
std::vector<std::uint32_t> put_in_order(PointCloud& points) {
  std::vector<CanonicalPlace> places;
  places.reserve(points.size());
  for (const Point& p : points) places.push_back(CanonicalPlace::of(p));
  std::vector<std::uint32_t> sorted(points.size());
  std::iota(sorted.begin(), sorted.end(), 0U);
  std::ranges::stable_sort(sorted, [&](std::uint32_t a, std::uint32_t b) {
    const auto order = places[a] <=> places[b];
    return order != 0 ? order < 0 : canonically_before(points[a], points[b]);
  });
  PointCloud in_order;
  in_order.reserve(points.size());
  std::vector<std::uint32_t> place(points.size());
  for (const std::uint32_t i : sorted) {
    place[i] = static_cast<std::uint32_t>(in_order.size());
    in_order.push_back(points[i]);
  }
  points = std::move(in_order);
  return place;
}

std::int64_t whole_below(double x) noexcept {
  const auto cut = static_cast<std::int64_t>(x);
  return static_cast<double>(cut) > x ? cut - 1 : cut;
}

}  // namespace

GrowingTiles::GrowingTiles(double width, std::uint64_t memory, Scratch& scratch)
    : width_(width),
      per_width_(1.0 / width),
      scratch_(scratch),
      growing_(memory),
      histories_(memory) {}

bool GrowingTiles::fits(const Point& p) const noexcept {
  // 2^100 m: float32 holds the distance of any two such points.
  return (p.head<2>().array().abs() / width_ < 0x1p40).all() && (p.array().abs() < 0x1p100).all();
}

Square GrowingTiles::square_of(const Point& p) const noexcept {
  return {whole_below(p.y() * per_width_), whole_below(p.x() * per_width_)};
}

std::uint32_t GrowingTiles::number_of(const Square& square) {
  const auto [at, is_new] = numbers_.try_emplace(square, static_cast<std::uint32_t>(tiles_.size()));
  if (is_new) tiles_.push_back({.square = square});
  return at->second;
}

/// By row and column. @param owner  set to the share of each point
std::vector<GrowingTiles::Share> GrowingTiles::shares_of(PointsView points,
                                                         std::vector<std::uint32_t>& owner) {
  std::vector<Share> found;  // in the order of their first points
  std::unordered_map<std::uint32_t, std::uint32_t> by_tile;
  owner.clear();
  owner.reserve(points.size());
  Square square{};
  std::uint32_t share = 0;
  for (const Point& given : points) {
    const Point p = given.array() + 0.0;  // -0 is 0
    if (const Square of_p = square_of(p); owner.empty() || of_p != square) {
      square = of_p;
      const std::uint32_t tile = number_of(square);
      share = by_tile.try_emplace(tile, static_cast<std::uint32_t>(found.size())).first->second;
      if (share == found.size()) found.push_back({.tile = tile});
    }
    found[share].points.push_back(p);
    owner.push_back(share);
  }
  std::vector<std::uint32_t> sorted(found.size());
  std::iota(sorted.begin(), sorted.end(), 0U);
  std::ranges::sort(sorted, {}, [&](std::uint32_t s) { return tiles_[found[s].tile].square; });
  std::vector<std::uint32_t> renamed(found.size());
  std::vector<Share> shares;
  shares.reserve(found.size());
  for (const std::uint32_t s : sorted) {
    renamed[s] = static_cast<std::uint32_t>(shares.size());
    shares.push_back(std::move(found[s]));
  }
  for (std::uint32_t& s : owner) s = renamed[s];
  return shares;
}

Result<std::string> GrowingTiles::put(bundle_folder::PartialFolder& folder, PointsView points) {
  std::vector<std::uint32_t> owner;
  std::vector<Share> shares = shares_of(points, owner);
  std::string bytes;
  append(bytes, PutHeader{puts_, static_cast<std::uint32_t>(shares.size())});
  for (Share& share : shares) {
    VANTAGE_TRY(GrowingTile* const tile, growing(share.tile));
    auto picks = tile->pick(share.points, puts_);
    if (!picks) {
      share.order = put_in_order(share.points);
      picks = tile->pick(share.points, puts_);
    }
    growing_.resize(tile->memory());
    if (tile->points().size() >= 0xffff'ffffU) {
      return fail(ErrorCode::invalid_input, "a tile has more than 2^32 - 2 points");
    }
    Tile& about = tiles_[share.tile];
    about.points = static_cast<std::uint32_t>(tile->points().size());
    std::string selection;
    const Coding coding = append_selection(selection, *picks, about.points);
    append(bytes, PutShare{.tile = share.tile,
                           .points = about.points,
                           .count = static_cast<std::uint32_t>(picks->size()),
                           .coding = coding,
                           .selection_bytes = selection.size()});
    bytes += selection;
    VANTAGE_CHECK(make_room(folder));
  }
  OrderWriter order(shares.size());
  std::vector<std::uint32_t> next(shares.size(), 0);
  for (const std::uint32_t s : owner) {
    const std::uint32_t i = next[s]++;
    order.add(s, shares[s].order.empty() ? i : shares[s].order[i]);
  }
  bytes += std::move(order).code();
  ++puts_;
  return bytes;
}

Result<GrowingTile*> GrowingTiles::growing(std::uint32_t tile) {
  if (GrowingTile* const here = growing_.find(tile)) return here;
  GrowingTile loaded(tiles_[tile].square, width_);
  if (Scratch::Place& place = tiles_[tile].scratch; place.bytes > 0) {
    VANTAGE_TRY(const std::string bytes, scratch_.read(place));
    loaded.decode(bytes);
    scratch_.forget(std::exchange(place, {}));
  }
  const std::uint64_t memory = loaded.memory();
  return &growing_.add(tile, std::move(loaded), memory);
}

Result<void> GrowingTiles::make_room(bundle_folder::PartialFolder& folder) {
  while (const auto tile = growing_.one_too_many()) {
    const auto value = growing_.take(*tile);
    VANTAGE_TRY(tiles_[*tile].scratch, scratch_.add(folder, value->encode()));
  }
  return {};
}

Result<void> GrowingTiles::finish(bundle_folder::PartialFolder& folder, const std::string& name) {
  std::vector<std::uint32_t> sorted(tiles_.size());
  std::iota(sorted.begin(), sorted.end(), 0U);
  std::ranges::sort(sorted, {}, [&](std::uint32_t t) { return tiles_[t].square; });
  return folder.write_file(name, [&](const bundle_folder::Sink& sink) -> Result<void> {
    VANTAGE_CHECK(sink(kTilesTitle));
    std::uint64_t offset = kTilesTitle.size();
    for (const std::uint32_t t : sorted) {
      VANTAGE_CHECK(growing(t));
      const auto growing = growing_.take(t);
      Tile& tile = tiles_[t];
      const Eigen::Vector2d corner(static_cast<double>(tile.square[1]) * width_,
                                   static_cast<double>(tile.square[0]) * width_);
      const std::string code = encode_tile(growing->points(), corner, width_);
      VANTAGE_CHECK(sink(code));
      tile.place = {.offset = offset, .bytes = code.size(), .checksum = checksum_of(code)};
      offset += code.size();
      const std::vector<std::uint32_t>& births = growing->births();
      VANTAGE_TRY(tile.scratch, scratch_.add(folder, {reinterpret_cast<const char*>(births.data()),
                                                      births.size() * sizeof(births[0])}));
    }
    return {};
  });
}

Result<const TileHistory*> GrowingTiles::history(std::uint32_t tile) {
  if (const TileHistory* const here = histories_.find(tile)) return here;
  VANTAGE_TRY(const std::string bytes, scratch_.read(tiles_[tile].scratch));
  std::vector<std::uint32_t> births(bytes.size() / sizeof(std::uint32_t));
  std::memcpy(births.data(), bytes.data(), bytes.size());
  TileHistory loaded(std::move(births));
  while (const auto oldest = histories_.one_too_many()) histories_.take(*oldest);
  const std::uint64_t memory = loaded.memory();
  return &histories_.add(tile, std::move(loaded), memory);
}

Result<std::string> GrowingTiles::parts_of(std::string_view put) {
  ByteReader reader(put);
  const auto header = reader.number<PutHeader>();
  std::vector<TilePart> parts;
  std::vector<std::string> codes(header.shares);
  parts.reserve(header.shares);
  for (std::string& code : codes) {
    const auto share = reader.number<PutShare>();
    TilePart& part = parts.emplace_back(TilePart{.place = tiles_[share.tile].place,
                                                 .count = share.count,
                                                 .coding = share.coding,
                                                 .selection = reader.raw(share.selection_bytes)});
    VANTAGE_TRY(const TileHistory* const tile, history(share.tile));
    if (tile->over_after(header.put)) continue;
    const auto runs = read_selection(part.selection, part.coding, share.points, share.count);
    if (!runs) return fail(ErrorCode::io_failure, "the scratch file of the build has changed");
    part.coding = append_selection(code, tile->now(*runs, header.put), tile->points());
    part.selection = code;
  }
  return encode_parts(parts, reader.raw(reader.left()));
}

}  // namespace vantage::shared_tiles
