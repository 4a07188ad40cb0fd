#include "stored_tile.hpp"

#include <cmath>
#include <cstring>

#include "bytes.hpp"

namespace vantage::shared_tiles {
namespace {

/// The start of a tile.
struct TileHeader {
  std::uint64_t points;
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

std::string encode_tile(PointsView points, const Eigen::Vector2d& corner, double width) {
  const Bounds3 bounds = bounds_of(points);
  const Eigen::Vector2d centre = (corner.array() + 0.5 * width).round() + 0.0;
  const double height = std::round(0.5 * bounds.min.z() + 0.5 * bounds.max.z()) + 0.0;
  const Point origin(centre.x(), centre.y(), height);

  std::string code;
  code.reserve(sizeof(TileHeader) + points.size() * sizeof(TileCoordinates) + kWord);
  append(code, TileHeader{.points = points.size(), .origin = {origin.x(), origin.y(), origin.z()}});
  for (const Point& p : points) {
    const Eigen::Vector3f relative = (p - origin).cast<float>();
    append(code, TileCoordinates{relative.x(), relative.y(), relative.z()});
  }
  pad(code);
  return code;
}

bool decode_tile(StoredTile& tile) {
  ByteReader reader({tile.bytes.get(), tile.size});
  const auto header = reader.number<TileHeader>();
  tile.origin = {header.origin[0], header.origin[1], header.origin[2]};
  if (header.points > tile.size / sizeof(TileCoordinates)) return false;
  const std::string_view xyz = reader.raw(header.points * sizeof(TileCoordinates));
  if (!reader.ok() || reader.left() >= kWord || !tile.origin.allFinite()) return false;
  tile.points = static_cast<std::uint32_t>(header.points);
  return finite(xyz);
}

}  // namespace vantage::shared_tiles
