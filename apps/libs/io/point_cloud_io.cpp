#include "vantage/io/point_cloud_io.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <new>
#include <optional>
#include <stdexcept>

#include "io/cloud_formats.hpp"
#include "io/formats.hpp"
#include "io/point_fields.hpp"
#include "vantage/io/tiled_map.hpp"
#include "vantage/kit/file_content.hpp"

namespace vantage::io {

namespace {

const Format* told_by_content(std::string_view content) {
  return find_format([&](const Format& format) {
    return format.cloud.read != nullptr && format.probe != nullptr && format.probe(content);
  });
}

const Format* told_by_name(const std::string& name) {
  return find_format([&](const Format& format) {
    return format.cloud.read != nullptr && format.is(kByName) && has_extension_of(format, name);
  });
}

tl::unexpected<Error> unknown_format(const std::string& file) {
  return fail(ErrorCode::corrupt_data,
              fmt::format("unknown format at byte 0, expected {}", expected_cloud()),
              SourceLocation{file, 0, 0});
}

}  // namespace

std::string expected_cloud() {
  return fmt::format("a point cloud ({})", format_names(FormatUse::cloud));
}

Result<const Format*> cloud_format(CloudFile& file) {
  const Format* format = told_by_content(file.head());
  if (format == nullptr && !file.is_all_head()) {  // a comment may be longer than the head
    VANTAGE_TRY(const auto content, file.content());
    format = told_by_content(content);
  }
  if (format == nullptr) format = told_by_name(file.name());
  if (format == nullptr) return unknown_format(file.name());
  return format;
}

Result<CloudFile> CloudFile::of(const InputFile& input) {
  constexpr std::size_t kHead = 64 * 1024;  // [bytes]
  CloudFile file(input);
  file.head_.resize(std::min(input.size(), kHead));
  VANTAGE_CHECK(input.read(0, file.head_));
  return file;
}

Result<std::string_view> CloudFile::content() {
  if (!content_) {
    VANTAGE_TRY(content_, input_->content());
  }
  return content_->view();
}

Result<void> add_records(LoadedCloud& cloud, const InputFile& file, const Records& records,
                         std::size_t first, std::size_t count) {
  constexpr std::size_t kBlock = std::size_t{1} << 20U;  // [bytes]
  const std::size_t most = std::max<std::size_t>(1, kBlock / records.size);
  std::string block;
  for (const std::size_t end = first + count; first < end;) {
    const std::size_t part = std::min(most, end - first);
    block.resize(part * records.size);
    VANTAGE_CHECK(file.read(records.offset + first * records.size, block));
    const auto column = [&](const Records::Field& field) {
      return CoordinateColumn{block.data() + field.offset, records.size, field.read, field.scale,
                              field.shift};
    };
    PointColumns columns;
    std::transform(records.axes.begin(), records.axes.end(), columns.axes.begin(), column);
    if (records.time) columns.time = column(*records.time);
    add_columns(cloud, columns, part);
    first += part;
  }
  return {};
}

Result<LoadedCloud> load_records(const InputFile& file, const Records& records) {
  LoadedCloud cloud;
  cloud.times.field = records.time_name;
  cloud.times.format = records.time_format;
  cloud.points.reserve(records.count);
  if (records.time) cloud.times.values.reserve(records.count);
  VANTAGE_CHECK(add_records(cloud, file, records, 0, records.count));
  return cloud;
}

Result<LoadedCloud> read_blocks_or_all(
    CloudFile& file, ReadTimes read_times,
    std::optional<Records> (*records_in)(std::string_view head, std::size_t size, ReadTimes),
    Result<LoadedCloud> (*parse)(std::string_view content, const std::string& file, ReadTimes)) {
  if (const auto records = records_in(file.head(), file.input().size(), read_times)) {
    return load_records(file.input(), *records);
  }
  VANTAGE_TRY(const auto content, file.content());
  return parse(content, file.name(), read_times);
}

Result<LoadedCloud> read_point_cloud(const std::filesystem::path& path, ReadTimes read_times) {
  if (is_tiled_map(path)) {
    VANTAGE_TRY(const TiledMap map, TiledMap::open(path));
    LoadedCloud cloud;
    VANTAGE_TRY(cloud.points, map.read());
    return cloud;
  }
  VANTAGE_TRY(const auto input, InputFile::open(path, expected_cloud()));
  return read_point_cloud(input, read_times);
}

Result<LoadedCloud> read_point_cloud(const InputFile& input, ReadTimes read_times) {
  try {
    VANTAGE_TRY(CloudFile file, CloudFile::of(input));
    VANTAGE_TRY(const Format* format, cloud_format(file));
    return format->cloud.read(file, read_times);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::io_failure, "not enough memory for the points of this file",
                SourceLocation{input.name(), 0, 0});
  } catch (const std::length_error&) {
    return fail(ErrorCode::io_failure, "more points than memory can address",
                SourceLocation{input.name(), 0, 0});
  }
}

Result<CloudLayout> read_cloud_layout(const std::filesystem::path& path) {
  VANTAGE_TRY(const auto input, InputFile::open(path, expected_cloud()));
  VANTAGE_TRY(const CloudFile file, CloudFile::of(input));
  const Format* format = told_by_content(file.head());
  if (format == nullptr) format = told_by_name(file.name());
  if (format == nullptr) return unknown_format(file.name());
  return format->cloud.layout(file);
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
