#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/bundle_format.hpp"
#include "common/bundle_head.hpp"
#include "common/packed_pages.hpp"
#include "vantage/kit/file_content.hpp"
#include "vantage/partition.hpp"
#include "vantage/result.hpp"

/// The regions of a bundle, in a file of their own. It is read where it is asked for, in pages of
/// 4096 bytes: nothing of it is held.
///
/// The file has the entries of all regions, one after another; a table of where each begins; a tree
/// of rectangles (an R-tree, packed by sorting and tiling); the labels, sorted by their hashes; and
/// a last page that says where all that is. The README of pcd_tiles has the bytes.
namespace vantage::bundle_folder {

inline constexpr const char* kRegionsFile = "regions.idx";

/// Numbers over all regions.
struct RegionTotals {
  std::uint64_t regions = 0;
  std::uint64_t empty = 0;                          ///< with nothing to match against
  std::uint64_t without_points = 0;                 ///< regions without a stored point
  std::uint64_t least_points = 0, most_points = 0;  ///< of a region
  std::uint64_t points = 0, viewpoints = 0, elements = 0, bytes = 0, max_views = 0;
  Bounds2 extent;  ///< of all footprints [m]

  void add(const Bounds2& box, const RegionFile& file);
  [[nodiscard]] packed::Summary summary(std::uint64_t entries_bytes, std::uint64_t content) const;
};

/// Errors: those of `sink`.
[[nodiscard]] Result<RegionsReference> write_packed(const BundleFormat& format,
                                                    std::span<const Region> regions,
                                                    std::span<const RegionFile> files,
                                                    const Sink& sink);

/// What is read is checked as far as it is read: a region by itself, a page of the tree against the
/// one above it. `all` checks the whole file.
/// Thread safety: const methods may run on one object from many threads at once.
class PackedIndex {
 public:
  /// Reads the last page. Errors (`where` is the file): `corrupt_data`; `io_failure`.
  /// @param format  must outlive the object
  [[nodiscard]] static Result<PackedIndex> open(const BundleFormat& format, io::InputFile file);

  [[nodiscard]] const std::string& name() const noexcept { return file_.name(); }
  [[nodiscard]] const RegionTotals& totals() const noexcept { return totals_; }
  /// As `index.json` names the file.
  [[nodiscard]] RegionsReference reference() const noexcept {
    return {.count = totals_.regions, .bytes = file_.size(), .checksum = checksum_};
  }
  /// Errors: `corrupt_data` for a damaged page or entry; `io_failure`.
  [[nodiscard]] Result<IndexedRegion> entry(std::uint32_t region) const;
  /// The regions whose rectangles meet an area, ascending and each once. Errors: those above.
  [[nodiscard]] Result<std::vector<RegionId>> meeting(const Bounds2& area) const;
  /// The region of that label. Errors: those above.
  [[nodiscard]] Result<std::optional<RegionId>> find(std::string_view label) const;
  /// All regions, by id. Errors: those above; also `corrupt_data` for a tree, labels or totals that
  /// are not those of the regions.
  [[nodiscard]] Result<std::vector<IndexedRegion>> all() const;

 private:
  using Page = std::array<char, packed::kPage>;
  PackedIndex(const BundleFormat& format, io::InputFile file)
      : format_(&format), file_(std::move(file)) {}
  [[nodiscard]] Result<void> read_page(std::uint64_t page, Page& into) const;
  [[nodiscard]] Result<std::uint64_t> offset_of(std::uint64_t region) const;
  [[nodiscard]] Result<IndexedRegion> decode(std::string_view bytes, std::uint32_t region,
                                             std::uint64_t offset) const;
  /// The leaves of the tree that meet an area, in any order.
  [[nodiscard]] Result<std::vector<packed::Child>> leaves_meeting(const Bounds2& area) const;
  [[nodiscard]] Result<void> check_tree(std::span<const IndexedRegion> regions) const;
  [[nodiscard]] Result<void> check_labels(std::span<const IndexedRegion> regions) const;
  [[nodiscard]] Result<void> check_content() const;
  [[nodiscard]] tl::unexpected<Error> corrupt(const std::string& reason) const;

  const BundleFormat* format_;
  io::InputFile file_;
  RegionTotals totals_;
  std::uint64_t checksum_ = 0;  // of the last page
  packed::Summary summary_{};
  packed::Layout layout_;
};

}  // namespace vantage::bundle_folder
