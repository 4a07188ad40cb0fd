#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "build/condense.hpp"
#include "vantage/map_parts.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// A region that is built, before it is stored: its points by their ranks in the whole map.
struct StoredPart {
  std::uint64_t seen = 0, skipped = 0, points = 0;
  std::vector<std::uint64_t> ranks;  ///< ascending; empty if no points are stored
  std::vector<std::uint32_t> views;
  PreparedMap prepared;
  std::vector<PredictedError> errors;
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

/// The file of one process: finished regions, one after the other, each with a checksum. A process
/// that is killed leaves at most one region that is not whole; it is cut off when the file is
/// opened again.
class PartWriter {
 public:
  /// Continues the file, if there is one. Holds a lock on it as long as it lives.
  /// Errors: `already_exists` if another process writes it; `corrupt_data` for a file that is no
  /// such file; `io_failure`.
  [[nodiscard]] static Result<PartWriter> open(const std::filesystem::path& file,
                                               std::uint64_t key);
  PartWriter(PartWriter&& other) noexcept;
  PartWriter& operator=(PartWriter&&) = delete;
  ~PartWriter();

  /// Errors: `io_failure`; the file then ends with the region before.
  [[nodiscard]] Result<void> add(std::uint32_t region, const StoredPart& part);

 private:
  PartWriter() = default;
  std::filesystem::path path_;
  int descriptor_ = -1;
  std::uint64_t end_ = 0;
};

/// All files of a folder.
class Parts {
 public:
  /// @param regions  number of regions
  /// Errors: `corrupt_data` for a file that is not one of parts; `already_exists` for one with
  /// another key; `io_failure`.
  [[nodiscard]] static Result<Parts> in(const std::filesystem::path& folder, std::uint64_t key,
                                        std::size_t regions);

  [[nodiscard]] bool has(std::uint32_t region) const { return places_[region].size > 0; }
  [[nodiscard]] std::size_t missing() const noexcept;
  /// Errors: `corrupt_data` for a region whose checksum is wrong, `io_failure`.
  [[nodiscard]] Result<StoredPart> read(std::uint32_t region) const;

 private:
  std::vector<std::filesystem::path> files_;
  std::vector<PartPlace> places_;  // by region
};

}  // namespace vantage
