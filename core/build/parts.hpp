#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "build/condense.hpp"
#include "vantage/build/sharded_build.hpp"
#include "vantage/kit/file_system.hpp"
#include "vantage/kit/map_parts.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// A region in a file: its points by their ranks in the whole map, not by indices.
struct StoredPart {
  std::vector<std::uint64_t> ranks;  ///< ascending; empty if no points are stored
  BuiltRegion region;                ///< without indices
};

/// Ranks of points of a part of the map. Both are ascending.
[[nodiscard]] std::vector<std::uint64_t> ranks_of(const MapPart& part, const IndexList& points);
/// The points of some ranks. Errors: `internal` if the part of the map lacks one of them.
[[nodiscard]] Result<IndexList> indices_of(const MapPart& part,
                                           const std::vector<std::uint64_t>& ranks);

/// Where a finished region is.
struct PartPlace {
  std::uint32_t region = 0;
  std::uint32_t file = 0;
  std::uint64_t offset = 0, size = 0;  ///< [bytes]
};

/// Marks a folder of parts, and is locked while the plan is made.
inline constexpr const char* kPartsMarker = ".vantage-parts";

/// A file of finished regions, one after the other, each with a checksum. Each process has one of
/// its own, so that nothing depends on a lock. One that is stopped, whether it is killed or the
/// power fails, leaves at most one region that is not whole; it does not count.
class PartWriter {
 public:
  /// Begins a file of a shard, under a name that no other process has.
  /// Errors: `already_exists` if another process is seen to build the shard; `io_failure`.
  [[nodiscard]] static Result<PartWriter> create(const std::filesystem::path& folder,
                                                 const Shard& shard, std::uint64_t key);
  PartWriter(PartWriter&& other) noexcept;
  PartWriter& operator=(PartWriter&&) = delete;
  /// Removes a file without a region.
  ~PartWriter();

  /// Errors: `io_failure`; the file then ends with the region before.
  [[nodiscard]] Result<void> add(std::uint32_t region, const StoredPart& part);
  /// All regions are on the disk when it returns. Errors: `io_failure`.
  [[nodiscard]] Result<void> finish() &&;

 private:
  PartWriter() = default;
  std::filesystem::path path_;  // empty if there is no file to care for
  io::Descriptor file_;
  std::uint64_t end_ = 0;
};

/// All files of a folder.
class Parts {
 public:
  /// @param regions  number of regions
  /// Errors: `corrupt_data` for a file that is named like a file of parts and holds something else;
  /// `already_exists` for one with another key; `io_failure`.
  [[nodiscard]] static Result<Parts> in(const std::filesystem::path& folder, std::uint64_t key,
                                        std::size_t regions);

  [[nodiscard]] bool has(std::uint32_t region) const { return places_[region].size > 0; }
  [[nodiscard]] std::size_t missing() const noexcept;
  /// Errors: `corrupt_data` for a region whose checksum is wrong, `io_failure`.
  [[nodiscard]] Result<StoredPart> read(std::uint32_t region) const;
  /// The files: they are of this build, and nothing else is in them.
  [[nodiscard]] const std::vector<std::filesystem::path>& files() const noexcept { return files_; }

 private:
  std::vector<std::filesystem::path> files_;
  std::vector<PartPlace> places_;  // by region
};

}  // namespace vantage
