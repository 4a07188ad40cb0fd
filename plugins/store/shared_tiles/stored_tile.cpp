#include "stored_tile.hpp"

#include <array>
#include <cmath>
#include <cstring>

#include "bytes.hpp"

namespace vantage::shared_tiles {
namespace {

using TileCoordinates = std::array<float, 3>;
static_assert(sizeof(TileCoordinates) == 12);

/// The start of a tile.
struct TileHeader {
  std::uint32_t points;
  std::uint32_t rank_bytes;
  std::array<double, 3> origin;
};
static_assert(sizeof(TileHeader) == 32);

/// Of float32: neither infinite nor NaN. Compiles to vector instructions.
bool finite(std::string_view floats) noexcept {
  constexpr std::uint32_t kExponent = 0x7f80'0000;
  std::uint32_t bad = 0;
  for (std::size_t at = 0; at < floats.size(); at += sizeof(float)) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, floats.data() + at, sizeof bits);
    bad |= static_cast<std::uint32_t>((bits & kExponent) == kExponent);
  }
  return bad == 0;
}

}  // namespace

Point* StoredTile::copy(std::uint32_t begin, std::uint32_t end, Point* to) const noexcept {
  const char* at = bytes.get() + sizeof(TileHeader) + begin * sizeof(TileCoordinates);
  for (std::uint32_t i = begin; i < end; ++i, at += sizeof(TileCoordinates)) {
    TileCoordinates xyz;
    std::memcpy(xyz.data(), at, sizeof xyz);
    *to++ = origin + Eigen::Vector3f(xyz[0], xyz[1], xyz[2]).cast<double>();
  }
  return to;
}

std::string encode_tile(PointsView points, std::span<const std::uint32_t> ranks,
                        const Eigen::Vector2d& corner, double width) {
  const Bounds3 bounds = bounds_of(points);
  const Eigen::Vector2d centre = (corner.array() + 0.5 * width).round() + 0.0;
  const double height = std::round(0.5 * bounds.min.z() + 0.5 * bounds.max.z()) + 0.0;
  const Point origin(centre.x(), centre.y(), height);

  std::string rank_code;
  std::uint64_t expected = 0;
  for (std::size_t i = 0; i < ranks.size();) {
    const std::size_t begin = i;
    append_leb(rank_code, ranks[begin] - expected);
    for (expected = ranks[begin]; i < ranks.size() && ranks[i] == expected; ++i) ++expected;
    append_leb(rank_code, i - begin);
  }
  std::string code;
  code.reserve(sizeof(TileHeader) + points.size() * sizeof(TileCoordinates) + rank_code.size() +
               kWord);
  append(code, TileHeader{.points = static_cast<std::uint32_t>(points.size()),
                          .rank_bytes = static_cast<std::uint32_t>(rank_code.size()),
                          .origin = {origin.x(), origin.y(), origin.z()}});
  for (const Point& p : points) {
    const Eigen::Vector3f relative = (p - origin).cast<float>();
    append(code, TileCoordinates{relative.x(), relative.y(), relative.z()});
  }
  code += rank_code;
  pad(code);
  return code;
}

bool decode_tile(StoredTile& tile) {
  ByteReader reader({tile.bytes.get(), tile.size});
  const auto header = reader.number<TileHeader>();
  tile.origin = {header.origin[0], header.origin[1], header.origin[2]};
  const std::uint64_t coordinates = std::uint64_t{header.points} * sizeof(TileCoordinates);
  const std::string_view xyz = reader.take(coordinates);
  ByteReader ranks(reader.take(header.rank_bytes));
  if (!reader.ok() || reader.left() >= kWord || !tile.origin.allFinite()) return false;

  if (!finite(xyz)) return false;
  std::uint64_t rank = 0;
  while (ranks.left() > 0) {
    rank += ranks.leb();
    const std::uint64_t count = ranks.leb();
    if (!ranks.ok() || count == 0 || count > header.points - tile.points ||
        rank + count > 0xffff'ffff) {
      return false;
    }
    tile.stretches.push_back({tile.points, static_cast<std::uint32_t>(rank)});
    tile.points += static_cast<std::uint32_t>(count);
    rank += count;
  }
  return tile.points == header.points;
}

}  // namespace vantage::shared_tiles
