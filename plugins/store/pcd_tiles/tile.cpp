#include "tile.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <span>

#include "vantage/kit/checksum.hpp"
#include "vantage/kit/max_views_of.hpp"
#include "vantage/kit/numbers.hpp"

namespace vantage::pcd_tiles {
namespace {

static_assert(std::endian::native == std::endian::little, "PCD binary data is little endian");

using Coordinates = std::array<float, 3>;
static_assert(sizeof(Coordinates) == 12);

std::string header(const RegionFile& info) {
  const std::string n = std::to_string(info.points);
  const Point& origin = info.origin;
  const std::string fields = info.max_views > 0
                                 ? "FIELDS x y z views\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1"
                                 : "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1";
  return "# .PCD v0.7 - Point Cloud Data file format\n"
         "# vantage origin " +
         shortest(origin.x()) + ' ' + shortest(origin.y()) + ' ' + shortest(origin.z()) +
         "\nVERSION 0.7\n" + fields + "\nWIDTH " + n +
         "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + n + "\nDATA binary\n";
}

constexpr std::size_t kWord = 4;  // [bytes]

/// Rounds up to the next whole word.
std::uint64_t padded(std::uint64_t bytes) { return (bytes + kWord - 1) / kWord * kWord; }

/// The size of the points, with their view counts.
std::uint64_t points_size(const RegionFile& info) {
  return info.points * (sizeof(Coordinates) + (info.max_views > 0 ? sizeof(std::uint32_t) : 0));
}

std::uint64_t data_size(const RegionFile& info) {
  return points_size(info) + info.viewpoints * sizeof(Coordinates) + padded(info.prepared_bytes);
}

/// Passes data on in whole words, and computes their checksum.
class SummedSink {
 public:
  explicit SummedSink(const Sink& sink) : sink_(sink) {}

  [[nodiscard]] Result<void> write(std::string_view words) {
    sum_.add(words);
    return sink_(words);
  }
  /// @param views  one count per point, or none
  [[nodiscard]] Result<void> write(PointsView points, const Point& origin,
                                   std::span<const std::uint32_t> views = {}) {
    constexpr std::size_t kBlock = 16'384;  // [points]
    std::string block;
    for (std::size_t begin = 0; begin < points.size(); begin += kBlock) {
      const std::size_t end = std::min(points.size(), begin + kBlock);
      block.clear();
      for (std::size_t i = begin; i < end; ++i) {
        const Eigen::Vector3f relative = (points[i] - origin).cast<float>();
        const Coordinates xyz{relative.x(), relative.y(), relative.z()};
        block.append(reinterpret_cast<const char*>(xyz.data()), sizeof xyz);
        if (!views.empty()) block.append(reinterpret_cast<const char*>(&views[i]), sizeof views[i]);
      }
      VANTAGE_CHECK(write(block));
    }
    return {};
  }
  [[nodiscard]] Result<void> write_padded(std::span<const std::byte> bytes) {
    if (bytes.empty()) return {};
    const std::string_view all(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const std::size_t whole = all.size() / kWord * kWord;
    VANTAGE_CHECK(write(all.substr(0, whole)));
    if (whole == all.size()) return {};
    std::string last(all.substr(whole));
    last.resize(kWord, '\0');
    return write(last);
  }
  [[nodiscard]] std::uint64_t checksum() const noexcept { return sum_.value(); }

 private:
  const Sink& sink_;
  Checksum sum_;
};

/// @param data   of at least `count` points
/// @param views  receives as many view counts as it has room for, from between the points
PointCloud points_in(std::string_view data, std::uint64_t count, const Point& origin,
                     std::span<std::uint32_t> views = {}) {
  PointCloud points(count);
  const char* at = data.data();
  for (std::size_t i = 0; i < count; ++i) {
    Coordinates xyz;
    std::memcpy(xyz.data(), at, sizeof xyz);
    points[i] = origin + Eigen::Vector3f(xyz[0], xyz[1], xyz[2]).cast<double>();
    at += sizeof xyz;
    if (views.empty()) continue;
    std::memcpy(&views[i], at, sizeof views[i]);
    at += sizeof views[i];
  }
  return points;
}

}  // namespace

std::uint64_t file_size(const RegionFile& info) { return header(info).size() + data_size(info); }

Result<RegionFile> encode(const RegionMap& map, const Sink& sink) {
  VANTAGE_TRY(RegionFile info, bundle_folder::checked(map));
  info.bytes = file_size(info);
  VANTAGE_CHECK(sink(header(info)));
  SummedSink data(sink);
  VANTAGE_CHECK(data.write(map.points, info.origin, map.views));
  VANTAGE_CHECK(data.write(map.viewpoints, info.origin));
  VANTAGE_CHECK(data.write_padded(map.prepared.bytes));
  info.checksum = data.checksum();
  return info;
}

Result<RegionMap> decode(std::string_view content, const RegionFile& info,
                         const std::filesystem::path& file) {
  const auto corrupt = [&](const std::string& reason) {
    return fail(ErrorCode::corrupt_data, reason, SourceLocation{file.string(), 0, 0});
  };
  if (content.size() != info.bytes) {
    return corrupt("the file has " + std::to_string(content.size()) + " bytes, expected " +
                   std::to_string(info.bytes));
  }
  const std::string head = header(info);
  if (!content.starts_with(head)) {
    return corrupt("the header is not that of a binary PCD with " + std::to_string(info.points) +
                   " points x y z" + (info.max_views > 0 ? " views" : "") + ", as the index says");
  }
  std::string_view data = content.substr(head.size());
  if (data.size() != data_size(info)) {
    return corrupt("there are " + std::to_string(data.size()) + " bytes of data, expected " +
                   std::to_string(data_size(info)));
  }
  if (checksum_of(data) != info.checksum) {
    return corrupt("the checksum of the data differs from the index: the file is damaged");
  }
  RegionMap map;
  if (info.max_views > 0) map.views.resize(info.points);
  map.points = points_in(data, info.points, info.origin, map.views);
  data.remove_prefix(points_size(info));
  map.viewpoints = points_in(data, info.viewpoints, info.origin);
  data.remove_prefix(info.viewpoints * sizeof(Coordinates));
  if (!all_finite(map.points) || !all_finite(map.viewpoints)) {
    return corrupt("a coordinate is not finite");
  }
  if (const auto max_views = max_views_of(map); !max_views || *max_views != info.max_views) {
    return corrupt("the views do not go from 1 to the largest that the index says");
  }
  const auto* const prepared = reinterpret_cast<const std::byte*>(data.data());
  map.prepared = {.bytes = {prepared, prepared + info.prepared_bytes}, .elements = info.elements};
  return map;
}

}  // namespace vantage::pcd_tiles
