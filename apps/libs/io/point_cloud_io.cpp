#include "vantage/io/point_cloud_io.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <new>
#include <optional>
#include <stdexcept>

#include "io/file_suffix.hpp"
#include "io/formats.hpp"
#include "io/las.hpp"
#include "io/point_fields.hpp"
#include "vantage/kit/file_content.hpp"

namespace vantage::io {

namespace {

/// Enough of a file to recognize its format; a header may end anywhere.
constexpr std::size_t kHead = 64 * 1024;  // [bytes]
constexpr std::string_view kExpected = "a point cloud (PCD, PLY, LAS or KITTI .bin)";

std::optional<Records> records_in(std::string_view head, std::size_t size, ReadTimes read_times) {
  if (looks_like_pcd(head)) return pcd_records(head, size, read_times);
  if (looks_like_ply(head)) return ply_records(head, size, read_times);
  return std::nullopt;
}

}  // namespace

Result<LoadedCloud> load_records(const InputFile& file, const Records& records) {
  constexpr std::size_t kBlock = std::size_t{1} << 20U;  // [bytes]
  const std::size_t most = std::max<std::size_t>(1, kBlock / records.size);
  std::string block;
  LoadedCloud cloud;
  cloud.times.field = records.time_name;
  cloud.times.format = records.time_format;
  cloud.points.reserve(records.count);
  if (records.time) cloud.times.values.reserve(records.count);
  for (std::size_t done = 0; done < records.count;) {
    const std::size_t count = std::min(most, records.count - done);
    block.resize(count * records.size);
    VANTAGE_CHECK(file.read(records.offset + done * records.size, block));
    const auto column = [&](const Records::Field& field) {
      return CoordinateColumn{block.data() + field.offset, records.size, field.read, field.scale,
                              field.shift};
    };
    PointColumns columns;
    std::transform(records.axes.begin(), records.axes.end(), columns.axes.begin(), column);
    if (records.time) columns.time = column(*records.time);
    add_columns(cloud, columns, count);
    done += count;
  }
  return cloud;
}

Result<LoadedCloud> parse_kitti_bin(std::string_view content, const std::string& file) {
  constexpr std::size_t kPointSize = 4 * sizeof(float);  // x y z intensity
  if (content.size() % kPointSize != 0) {
    return fail(
        ErrorCode::corrupt_data,
        fmt::format("the file ends at byte {}, inside point {}; expected points of {} bytes "
                    "(KITTI: float32 x y z intensity)",
                    content.size(), content.size() / kPointSize, kPointSize),
        SourceLocation{file, 0, 0});
  }
  PointColumns columns;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    columns.axes[axis] = {content.data() + axis * sizeof(float), kPointSize,
                          read_coordinate<float, ByteOrder::little>};
  }
  return load_columns(columns, content.size() / kPointSize);
}

Result<LoadedCloud> read_point_cloud(const std::filesystem::path& path, ReadTimes read_times) {
  VANTAGE_TRY(const auto input, InputFile::open(path, kExpected));
  return read_point_cloud(input, read_times);
}

Result<LoadedCloud> read_point_cloud(const InputFile& input, ReadTimes read_times) {
  const std::string& file = input.name();
  const std::string suffix = lower_case_suffix(file);
  try {
    std::string head(std::min(input.size(), kHead), '\0');
    VANTAGE_CHECK(input.read(0, head));
    if (looks_like_e57(head)) return refuse_e57(input);
    if (looks_like_las(head)) {
      VANTAGE_TRY(const auto records, las_records(input));
      return load_records(input, records);
    }
    if (const auto records = records_in(head, input.size(), read_times)) {
      return load_records(input, *records);
    }
    VANTAGE_TRY(const auto content, input.content());
    const std::string_view bytes = content.view();
    if (looks_like_pcd(bytes)) return parse_pcd(bytes, file, read_times);
    if (looks_like_ply(bytes)) return parse_ply(bytes, file, read_times);
    // The suffix decides only if the content says nothing, or to choose the reader that can best
    // say what is wrong.
    if (suffix == ".bin") return parse_kitti_bin(bytes, file);
    if (suffix == ".pcd") return parse_pcd(bytes, file, read_times);
    if (suffix == ".ply") return parse_ply(bytes, file, read_times);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::io_failure, "not enough memory for the points of this file",
                SourceLocation{file, 0, 0});
  } catch (const std::length_error&) {
    return fail(ErrorCode::io_failure, "more points than memory can address",
                SourceLocation{file, 0, 0});
  }
  return fail(ErrorCode::corrupt_data,
              fmt::format("unknown format at byte 0, expected {}", kExpected),
              SourceLocation{file, 0, 0});
}

Result<CloudLayout> read_cloud_layout(const std::filesystem::path& path) {
  VANTAGE_TRY(const auto input, InputFile::open(path, kExpected));
  std::string head(std::min(input.size(), kHead), '\0');
  VANTAGE_CHECK(input.read(0, head));
  const std::string suffix = lower_case_suffix(path);
  if (looks_like_e57(head)) return refuse_e57(input);
  if (looks_like_las(head)) return las_layout(input);
  if (looks_like_pcd(head) || suffix == ".pcd") return pcd_layout(head, input.name());
  if (looks_like_ply(head) || suffix == ".ply") return ply_layout(head, input.name());
  return CloudLayout{.format = "KITTI .bin",
                     .fields = {"x float32", "y float32", "z float32", "intensity float32"}};
}

Result<LoadedCloud> read_point_clouds(std::span<const std::filesystem::path> paths) {
  LoadedCloud all;
  std::vector<PointCloud> parts;
  std::size_t count = 0;
  for (const auto& path : paths) {
    VANTAGE_TRY(auto cloud, read_point_cloud(path));
    all.dropped += cloud.dropped;
    count += cloud.points.size();
    parts.push_back(std::move(cloud.points));
  }
  if (parts.size() == 1) {
    all.points = std::move(parts.front());
    return all;
  }
  all.points.reserve(count);  // reserved memory takes no space until it is written
  for (PointCloud& part : parts) {
    all.points.insert(all.points.end(), part.begin(), part.end());
    part = PointCloud();  // `= {}` would keep the memory
  }
  return all;
}

}  // namespace vantage::io
