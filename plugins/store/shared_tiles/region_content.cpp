#include "region_content.hpp"

#include <array>
#include <cstring>

#include "bytes.hpp"
#include "vantage/kit/checksum.hpp"

namespace vantage::shared_tiles {
namespace {

constexpr std::string_view kTitle = "vantage shared_tiles region   2\n";
static_assert(kTitle.size() % kWord == 0);

using ViewpointCoordinates = std::array<float, 3>;

/// The bytes of a view count.
std::size_t width_of(std::uint32_t max_views) {
  if (max_views == 0) return 0;
  if (max_views <= 0xff) return 1;
  return max_views <= 0xffff ? 2 : 4;
}

/// What the file says about a part before all the codes.
struct PartHeader {
  TilePlace place;
  std::uint32_t count;
  Coding coding;
  std::uint64_t selection_bytes;
};
static_assert(sizeof(PartHeader) == 40);

}  // namespace

std::string encode_head(const RegionMap& map, const bundle_folder::RegionFile& file) {
  std::string head(kTitle);
  for (const Point& p : map.viewpoints) {
    const Eigen::Vector3f relative = (p - file.origin).cast<float>();
    append(head, ViewpointCoordinates{relative.x(), relative.y(), relative.z()});
  }
  const std::size_t width = width_of(file.max_views);
  for (const std::uint32_t views : map.views) {
    head.append(reinterpret_cast<const char*>(&views), width);
  }
  const std::vector<std::byte>& prepared = map.prepared.bytes;
  head.append(reinterpret_cast<const char*>(prepared.data()), prepared.size());
  pad(head);
  return head;
}

std::string encode_parts(const std::vector<TilePart>& parts, std::string_view order) {
  std::string bytes;
  append(bytes, std::uint64_t{parts.size()});
  append(bytes, std::uint64_t{order.size()});
  for (const TilePart& part : parts) {
    append(bytes, PartHeader{part.place, part.count, part.coding, part.selection.size()});
  }
  for (const TilePart& part : parts) bytes += part.selection;
  bytes += order;
  pad(bytes);
  return bytes;
}

Result<RegionContent> decode_region(std::string_view content, const bundle_folder::RegionFile& file,
                                    const std::string& path) {
  const auto corrupt = [&](const std::string& reason) {
    return fail(ErrorCode::corrupt_data, reason, SourceLocation{path, 0, 0});
  };
  if (content.size() != file.bytes || content.size() % kWord != 0) {
    return corrupt("the file has " + std::to_string(content.size()) + " bytes, expected " +
                   std::to_string(file.bytes));
  }
  if (checksum_of(content) != file.checksum) {
    return corrupt("the checksum of the file differs from the index: the file is damaged");
  }
  ByteReader reader(content);
  if (reader.raw(kTitle.size()) != kTitle) return corrupt("this is not a region of a bundle");

  RegionContent region;
  RegionMap& map = region.map;
  const std::string_view xyz = reader.raw(file.viewpoints * sizeof(ViewpointCoordinates));
  const std::size_t width = width_of(file.max_views);
  const std::string_view views = reader.raw(file.points * width);
  const std::string_view prepared = reader.raw(file.prepared_bytes);
  if (!reader.ok()) return corrupt("the file is shorter than the counts of the index say");
  (void)reader.raw(reader.left() % kWord);
  map.viewpoints.resize(file.viewpoints);
  for (std::size_t i = 0; i < map.viewpoints.size(); ++i) {
    ViewpointCoordinates at;
    std::memcpy(at.data(), xyz.data() + i * sizeof at, sizeof at);
    map.viewpoints[i] = file.origin + Eigen::Vector3f(at[0], at[1], at[2]).cast<double>();
  }
  if (!all_finite(map.viewpoints)) return corrupt("a coordinate is not finite");
  if (width > 0) map.views.resize(file.points);
  for (std::size_t i = 0; i < map.views.size(); ++i) {
    std::memcpy(&map.views[i], views.data() + i * width, width);
  }
  const auto* const first = reinterpret_cast<const std::byte*>(prepared.data());
  map.prepared = {.bytes = {first, first + prepared.size()}, .elements = file.elements};

  const auto count = reader.number<std::uint64_t>();
  const auto order_bytes = reader.number<std::uint64_t>();
  if (count > reader.left() / sizeof(PartHeader)) return corrupt("the list of tiles is cut off");
  std::vector<std::uint64_t> sizes;
  std::uint64_t points = 0, end = 0;  // of the tile before
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto header = reader.number<PartHeader>();
    // Each byte of the tiles is in one tile, and each tile is named once: a region has no more
    // points than there are bytes for.
    const TilePlace& place = header.place;
    if (place.offset < end || place.bytes > ~std::uint64_t{0} - place.offset || header.count == 0 ||
        header.count > place.bytes / sizeof(TileCoordinates)) {
      return corrupt("the list of tiles is damaged: tile " + std::to_string(i) +
                     " overlaps the one before it, or is too small for its points");
    }
    end = place.offset + place.bytes;
    region.parts.push_back({header.place, header.count, header.coding, {}});
    sizes.push_back(header.selection_bytes);
    points += header.count;
  }
  for (std::uint64_t i = 0; i < count; ++i) region.parts[i].selection = reader.raw(sizes[i]);
  region.order = reader.raw(order_bytes);
  if (!reader.ok() || reader.left() >= kWord) return corrupt("the list of tiles is damaged");
  if (points != file.points) {
    return corrupt("the tiles give " + std::to_string(points) + " points, expected " +
                   std::to_string(file.points));
  }
  return region;
}

}  // namespace vantage::shared_tiles
