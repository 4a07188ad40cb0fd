#include "tile.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>

namespace vantage::pcd_tiles {
namespace {

static_assert(std::endian::native == std::endian::little, "PCD binary data is little endian");

using Coordinates = std::array<float, 3>;
static_assert(sizeof(Coordinates) == 12);

std::string shortest(double x) {
  char text[32];
  return std::string(text, std::to_chars(text, text + sizeof text, x).ptr);
}

std::string header(std::uint64_t points, const Point& origin) {
  const std::string n = std::to_string(points);
  return "# .PCD v0.7 - Point Cloud Data file format\n"
         "# vantage origin " +
         shortest(origin.x()) + ' ' + shortest(origin.y()) + ' ' + shortest(origin.z()) +
         "\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " + n +
         "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + n + "\nDATA binary\n";
}

constexpr std::uint64_t kEmptyChecksum = 0xcbf29ce484222325U;

/// Every step is a bijection of the state and of the word: no single wrong word goes unseen.
/// @param data  goes on where the data that `hash` is of ended
std::uint64_t checksum_of(std::string_view data, std::uint64_t hash = kEmptyChecksum) noexcept {
  for (std::size_t i = 0; i + 4 <= data.size(); i += 4) {
    std::uint32_t word = 0;
    std::memcpy(&word, data.data() + i, sizeof word);
    hash = (hash ^ word) * 0x100000001b3U;
  }
  return hash;
}

/// Errors: `invalid_input` for what float32 cannot hold.
Result<Point> origin_of(PointsView points) {
  if (!all_finite(points)) {
    return fail(ErrorCode::invalid_input, "a point of the region map is not finite");
  }
  if (points.empty()) return Point(Point::Zero());
  const Bounds3 bounds = bounds_of(points);
  // Whole metres: the same origin comes out of every compiler, and it is short to read.
  const Point origin = (0.5 * bounds.min + 0.5 * bounds.max).array().round() + 0.0;
  const double reach = std::max((bounds.max - origin).maxCoeff(), (origin - bounds.min).maxCoeff());
  if (!(reach <= static_cast<double>(std::numeric_limits<float>::max()))) {
    return fail(ErrorCode::invalid_input, "the region map is too large for float32: it reaches " +
                                              shortest(reach) + " m from its centre");
  }
  return origin;
}

}  // namespace

std::uint64_t file_size(std::uint64_t points, const Point& origin) {
  return header(points, origin).size() + points * sizeof(Coordinates);
}

Result<TileInfo> encode(PointsView points, const Sink& sink) {
  constexpr std::size_t kBlock = 16'384;  // [points]
  TileInfo info{.points = points.size(), .checksum = kEmptyChecksum};
  VANTAGE_TRY(info.origin, origin_of(points));
  info.bytes = file_size(info.points, info.origin);
  VANTAGE_CHECK(sink(header(info.points, info.origin)));
  std::string block;
  while (!points.empty()) {
    const PointsView now = points.first(std::min(points.size(), kBlock));
    block.resize(now.size() * sizeof(Coordinates));
    char* out = block.data();
    for (const Point& p : now) {
      const Eigen::Vector3f relative = (p - info.origin).cast<float>();
      const Coordinates xyz{relative.x(), relative.y(), relative.z()};
      std::memcpy(out, xyz.data(), sizeof xyz);
      out += sizeof xyz;
    }
    info.checksum = checksum_of(block, info.checksum);
    VANTAGE_CHECK(sink(block));
    points = points.subspan(now.size());
  }
  return info;
}

Result<PointCloud> decode(std::string_view content, const TileInfo& info, const std::string& file) {
  const auto corrupt = [&](const std::string& reason) {
    return fail(ErrorCode::corrupt_data, reason, SourceLocation{file, 0, 0});
  };
  if (content.size() != info.bytes) {
    return corrupt("the file has " + std::to_string(content.size()) + " bytes, expected " +
                   std::to_string(info.bytes));
  }
  const std::string head = header(info.points, info.origin);
  if (!content.starts_with(head)) {
    return corrupt("the header is not that of a binary PCD with " + std::to_string(info.points) +
                   " points x y z, as the index says");
  }
  const std::string_view data = content.substr(head.size());
  if (data.size() != info.points * sizeof(Coordinates)) {
    return corrupt("there are " + std::to_string(data.size()) + " bytes of data, expected " +
                   std::to_string(info.points * sizeof(Coordinates)));
  }
  if (checksum_of(data) != info.checksum) {
    return corrupt("the data does not have the checksum that the index says: the file is damaged");
  }
  PointCloud points(info.points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    Coordinates xyz;
    std::memcpy(xyz.data(), data.data() + i * sizeof xyz, sizeof xyz);
    points[i] = info.origin + Eigen::Vector3f(xyz[0], xyz[1], xyz[2]).cast<double>();
  }
  if (!all_finite(points)) return corrupt("a coordinate is not finite");
  return points;
}

}  // namespace vantage::pcd_tiles
