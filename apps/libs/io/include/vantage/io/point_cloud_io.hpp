#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "vantage/io/point_times.hpp"
#include "vantage/kit/file_content.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::io {

/// The finite points of a file, in the order and frame of the file [m].
struct LoadedCloud {
  PointCloud points;
  PointTimes times;           ///< of `points`; empty unless the caller asked for times
  std::uint64_t dropped = 0;  ///< points with a NaN or infinite coordinate, left out of `points`
  std::vector<std::uint8_t> tags = {};  ///< of `points`, see Tags; empty unless a message has them
};

enum class ReadTimes : bool { no, yes };

/// Reads x, y and z of a point cloud file. The content determines the format; if it does not, the
/// suffix does:
/// - PCD (ascii, binary, binary_compressed): fields in any order, size and type, named x y z or X Y
///   Z; bytes after the last binary point are padding; VIEWPOINT is not applied to the points
/// - PLY 1.0 (ascii, binary in either byte order): element `vertex`, properties x y z
/// - LAS 1.0 to 1.4, point formats 0 to 10: scale and offset are applied; read in blocks
/// - a tiled map, which is a folder: its points in canonical order, without those that were left
/// out
///   when it was made; see TiledMap
/// - KITTI: suffix `.bin`, float32 x y z intensity, little endian
/// PCD and PLY may hold the time of each point's measurement; PointTimes lists the fields.
/// Numbers in ascii files keep the precision of the text, whatever type the header declares.
/// Errors (`where` is the file and, in text, the line): `not_found`; `io_failure` for a path that
/// cannot be read or is not a regular file; `corrupt_data` for content that contradicts its format
/// or has none of these formats, with the byte offset in binary parts; `unsupported` for LAZ, COPC
/// and E57, with the name of a converter.
[[nodiscard]] Result<LoadedCloud> read_point_cloud(const std::filesystem::path& path,
                                                   ReadTimes read_times = ReadTimes::no);

/// Reads a file that is already open.
[[nodiscard]] Result<LoadedCloud> read_point_cloud(const InputFile& file,
                                                   ReadTimes read_times = ReadTimes::no);

/// Format and fields, from the header of a point cloud file.
struct CloudLayout {
  std::string format;               ///< "PCD (binary)", "LAS 1.4 (point format 6)"
  std::vector<std::string> fields;  ///< of a point: "x float32"
};

/// Reads the header of a file that read_point_cloud can read. Errors: those of read_point_cloud.
[[nodiscard]] Result<CloudLayout> read_cloud_layout(const std::filesystem::path& path);

/// Reads several files into one cloud, one after the other, without times. Needs memory for all
/// points, and for those of one file in addition. Errors: those of read_point_cloud.
[[nodiscard]] Result<LoadedCloud> read_point_clouds(std::span<const std::filesystem::path> paths);

enum class Precision : std::uint8_t { float32, float64 };

/// float32 if float32 holds every coordinate exactly, otherwise float64.
[[nodiscard]] Precision lossless_precision(PointsView points) noexcept;

/// Writes binary PCD v0.7 with fields x y z, atomically (see OutputFile).
/// @param views  one view count per point, written as field `views` (uint32); or empty
/// Errors: `invalid_input` for a point that is not finite in that precision, and for view counts
/// that are not one per point; those of OutputFile.
[[nodiscard]] Result<void> write_pcd(const std::filesystem::path& path, PointsView points,
                                     Precision precision,
                                     std::span<const std::uint32_t> views = {});

/// Writes PLY 1.0, binary little endian, with properties x y z of element vertex. Arguments and
/// errors are those of write_pcd. View counts become the property scalar_views (uint), which
/// CloudCompare reads as a scalar field.
[[nodiscard]] Result<void> write_ply(const std::filesystem::path& path, PointsView points,
                                     Precision precision,
                                     std::span<const std::uint32_t> views = {});

/// Writes LAS 1.4, point format 6, in millimetres: coordinates are rounded by at most half a
/// millimetre. View counts are extra bytes named `views` (unsigned long). The file has no creation
/// date and no coordinate system. Errors: those of write_pcd, and `invalid_input` for an extent of
/// more than about 4,294 km along an axis.
[[nodiscard]] Result<void> write_las(const std::filesystem::path& path, PointsView points,
                                     std::span<const std::uint32_t> views = {});

/// Writes a scan with the time of each point: as write_pcd in float32, with a further field t,
/// float32.
/// @param seconds  one time per point, after the scan's stamp [s]
/// Errors: those above; `invalid_input` for sizes that differ or a time that is not finite.
[[nodiscard]] Result<void> write_pcd(const std::filesystem::path& path, PointsView points,
                                     std::span<const float> seconds);

}  // namespace vantage::io
