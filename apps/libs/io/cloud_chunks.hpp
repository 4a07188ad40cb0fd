#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include "io/formats.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/tiled_map.hpp"
#include "vantage/kit/file_content.hpp"
#include "vantage/result.hpp"

namespace vantage::io {

/// A cloud that is read part by part, in the order of the file, through a buffer of 1 MiB. An ascii
/// or compressed file is read as a whole at the first part; a tiled map is read tile by tile.
/// Positions count what is read: points of the file, or of those that are finite if the file is
/// read as a whole.
class CloudChunks {
 public:
  /// Reads the header. Errors: those of read_point_cloud and of TiledMap::open.
  [[nodiscard]] static Result<CloudChunks> open(const std::filesystem::path& path);

  /// The points that the header states; 0 if it is not known.
  [[nodiscard]] std::uint64_t points() const noexcept { return parts_.points; }
  /// What reading needs beside the buffer and the points of one part, at most [bytes].
  [[nodiscard]] std::uint64_t memory() const noexcept { return parts_.memory; }

  /// Adds the finite points among `most` from a position on, without times.
  /// @return  how many positions were read; 0 at the end of the file
  /// Errors: those of read_point_cloud and TiledMap::read.
  [[nodiscard]] Result<std::uint64_t> add(LoadedCloud& cloud, std::uint64_t position,
                                          std::uint64_t most);

 private:
  CloudChunks() = default;
  [[nodiscard]] Result<std::uint64_t> add_of_tiles(LoadedCloud& cloud, std::uint64_t position,
                                                   std::uint64_t most);

  CloudParts parts_;
  std::unique_ptr<InputFile> file_;
  std::optional<LoadedCloud> whole_;
  std::optional<TiledMap> map_;
  std::uint64_t tile_first_ = 0;  // position of the first point of `tile_`
  PointCloud tile_;
};

}  // namespace vantage::io
