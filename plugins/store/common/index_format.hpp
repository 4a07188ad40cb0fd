#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/bundle_format.hpp"
#include "common/bundle_index.hpp"
#include "vantage/partition.hpp"

/// What an index says of regions and their files, said once for all writers and readers: those of
/// `index.json` (one writer, the reader of any JSON, and the faster one of what a build writes) and
/// those of a packed index. Whoever reads a region checks what the others check.
///
/// An Archive goes through the members in the order of the file. As a writer it takes the values,
/// as a reader it puts them in; after its first error it does nothing more. It has
///     void member(key, visit);                  // calls visit() at the member
///     bool member_if(key, is_there, visit);     // a writer asks `is_there`, a reader the file
///     void object(visit), list(elements, visit);
///     void text(std::string&), numbers(Eigen vector&), count(std::uint64_t&, max);
///     void checksum(std::uint64_t&), version(const BundleFormat&, bool with_views);
///     void check(bool, key, reason);  // of a reader: refuses the member for what reason() says
namespace vantage::bundle_folder {

/// Of an edge of a region that has none; "inf" in the file.
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A region as the index has it.
struct IndexedRegion {
  Region region;
  RegionFile file;
};

/// All that the index says but its own checksum.
struct IndexContent {
  std::uint64_t map_points = 0;
  Bounds3 map_bounds;
  std::string config;
  std::vector<IndexedRegion> regions;
  PackedRegions packed = {};  // instead of `regions`
  bool with_views = false;    // of packed regions; others say it themselves
};

inline constexpr const char* kChecksum = "checksum";
inline constexpr std::uint64_t kMostRegions = 0xffff'fffeU;
inline constexpr auto kAnyCount = std::numeric_limits<std::uint64_t>::max();

/// A text from outside, for a message: in quotes, and with escapes for what is not printable.
[[nodiscard]] std::string shown(const std::string& text);

/// The bundle of what was read. Errors: those of Partition::from.
[[nodiscard]] Result<BundleIndex> bundle_of(IndexContent content);

template <class Archive>
void describe(Archive& archive, HalfOpenBox& box) {
  archive.object([&] {
    archive.member("min", [&] { archive.numbers(box.min); });
    archive.member("max", [&] { archive.numbers(box.max); });
  });
}

/// Returns whether the footprint has that shape.
template <class Shape, class Archive, class Visit>
bool describe_if(Archive& archive, Footprint& footprint, const char* key, const Visit& visit) {
  return archive.member_if(key, std::holds_alternative<Shape>(footprint), [&] {
    if (!std::holds_alternative<Shape>(footprint)) footprint.emplace<Shape>();
    visit(std::get<Shape>(footprint));
  });
}

template <class Archive>
void describe(Archive& archive, Footprint& footprint) {
  archive.object([&] {
    const bool known =
        describe_if<HalfOpenBox>(archive, footprint, "box",
                                 [&](HalfOpenBox& box) { describe(archive, box); }) ||
        describe_if<BoxUnion>(archive, footprint, "boxes",
                              [&](BoxUnion& shape) {
                                archive.list(shape.boxes,
                                             [&](HalfOpenBox& box) { describe(archive, box); });
                              }) ||
        describe_if<ConvexPolygon>(archive, footprint, "polygon", [&](ConvexPolygon& polygon) {
          archive.list(polygon.corners, [&](Eigen::Vector2d& corner) { archive.numbers(corner); });
        });
    archive.check(known, nullptr, [] { return " must have a member 'box', 'boxes' or 'polygon'"; });
  });
}

template <class Archive>
void describe_file(Archive& archive, const BundleFormat& format, RegionFile& file) {
  const auto count = [&](const char* key, std::uint64_t& value, std::uint64_t max) {
    archive.member(key, [&] { archive.count(value, max); });
  };
  count("points", file.points, kMaxPoints);
  count("viewpoints", file.viewpoints, kMaxPoints);
  count("elements", file.elements, kAnyCount);
  count("prepared_bytes", file.prepared_bytes, kMaxPreparedBytes);
  archive.check(file.elements == 0 || file.prepared_bytes > 0, "elements",
                [] { return " must be 0 without prepared bytes"; });
  archive.member_if("max_views", file.max_views > 0, [&] {
    std::uint64_t most = file.max_views;
    archive.count(most, std::numeric_limits<std::uint32_t>::max());
    file.max_views = static_cast<std::uint32_t>(most);
    archive.check(most > 0 && file.points > 0, nullptr,
                  [] { return " must be above 0, and left out where no point is"; });
  });
  count("bytes", file.bytes, kAnyCount);
  archive.member("origin", [&] { archive.numbers(file.origin); });
  archive.check(file.origin.allFinite(), "origin", [] { return " must be finite"; });
  const std::uint64_t bytes = format.file_size != nullptr ? format.file_size(file) : file.bytes;
  archive.check(file.bytes == bytes, "bytes", [&] {
    return " must be " + std::to_string(bytes) + " for what the file holds, not " +
           std::to_string(file.bytes);
  });
  archive.member(kChecksum, [&] { archive.checksum(file.checksum); });
}

/// A region but for its label.
template <class Archive>
void describe_area_and_file(Archive& archive, const BundleFormat& format, IndexedRegion& one) {
  Region& region = one.region;
  archive.member("footprint", [&] { describe(archive, region.footprint); });
  Eigen::Vector2d height(region.height.min, region.height.max);
  archive.member("height", [&] { archive.numbers(height); });
  region.height = {height[0], height[1]};
  describe_file(archive, format, one.file);
}

template <class Archive>
void describe(Archive& archive, const BundleFormat& format, IndexedRegion& one) {
  archive.object([&] {
    archive.member("label", [&] { archive.text(one.region.label); });
    const std::string expected = region_file_name(format, one.region);
    std::string name = expected;
    archive.member("file", [&] { archive.text(name); });
    archive.check(name == expected, "file",
                  [&] { return " must be " + shown(expected) + ", not " + shown(name); });
    describe_area_and_file(archive, format, one);
  });
}

/// The members of the index but for its checksum, which follows them.
template <class Archive>
void describe(Archive& archive, const BundleFormat& format, IndexContent& content) {
  const std::string title = "vantage " + std::string(format.store);
  std::string said = title;
  archive.member("format", [&] { archive.text(said); });
  archive.check(said == title, "format", [&] { return " must be '" + title + "'"; });
  bool with_views = content.with_views;
  for (const auto& [region, file] : content.regions) with_views |= file.max_views > 0;
  archive.member("version", [&] { archive.version(format, with_views); });
  archive.member("map", [&] {
    archive.object([&] {
      archive.member("points", [&] { archive.count(content.map_points, kAnyCount); });
      archive.member("bounds", [&] {
        archive.object([&] {
          archive.member("min", [&] { archive.numbers(content.map_bounds.min); });
          archive.member("max", [&] { archive.numbers(content.map_bounds.max); });
        });
      });
    });
  });
  archive.member("config", [&] { archive.text(content.config); });
  const bool packed = archive.member_if("packed_regions", content.packed.count > 0, [&] {
    archive.object([&] {
      archive.member("count", [&] { archive.count(content.packed.count, kMostRegions); });
      archive.check(content.packed.count > 0, "count", [] { return " must be above 0"; });
      archive.member("bytes", [&] { archive.count(content.packed.bytes, kAnyCount); });
      archive.member(kChecksum, [&] { archive.checksum(content.packed.checksum); });
    });
  });
  if (packed) return;
  archive.member("regions", [&] {
    archive.list(content.regions, [&](IndexedRegion& one) { describe(archive, format, one); });
  });
}

}  // namespace vantage::bundle_folder
