#include "io/las.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <string>
#include <utility>

#include "io/cloud_formats.hpp"
#include "io/las_layout.hpp"
#include "io/text.hpp"

namespace vantage::io {
namespace {

/// The header fields by which the rest of the file is judged.
struct Header {
  unsigned minor_version = 0;
  std::uint64_t size = 0;           // [bytes]
  std::uint64_t points_offset = 0;  // [bytes]
  std::uint64_t vlrs = 0;           // variable length records between header and points
  unsigned format = 0;              // without the bits that mark compression
  bool has_compression_bit = false;
  std::uint64_t point_size = 0;  // [bytes]
  std::uint64_t points = 0;
  std::array<double, 3> scale{}, offset{};
};

class HeaderReader {
 public:
  explicit HeaderReader(const InputFile& file) noexcept : file_(file) {}

  [[nodiscard]] Result<Header> read() {
    VANTAGE_CHECK(read_bytes());
    Header header;
    header.minor_version = minor_;
    header.size = value<std::uint16_t>(las::kHeaderSize);
    header.points_offset = value<std::uint32_t>(las::kPointsOffset);
    header.vlrs = value<std::uint32_t>(las::kVlrCount);
    const unsigned format = value<std::uint8_t>(las::kFormat);
    header.format = format & ~las::kCompressionBits;
    header.has_compression_bit = (format & las::kCompressionBits) != 0;
    header.point_size = value<std::uint16_t>(las::kPointSize);
    VANTAGE_CHECK(check_layout(header));
    VANTAGE_TRY(header.points, points());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      VANTAGE_TRY(header.scale[axis], number(las::kScale, axis, "scale"));
      VANTAGE_TRY(header.offset[axis], number(las::kOffset, axis, "offset"));
      if (header.scale[axis] == 0.0) {
        return error(fmt::format("the scale of {} at byte {} is 0", kAxisNames[axis],
                                 las::kScale + axis * sizeof(double)));
      }
    }
    return header;
  }

 private:
  [[nodiscard]] tl::unexpected<Error> error(std::string message) const {
    return fail(ErrorCode::corrupt_data, std::move(message), SourceLocation{file_.name(), 0, 0});
  }

  /// Reads as many bytes as the header of this version has.
  [[nodiscard]] Result<void> read_bytes() {
    if (file_.size() < las::kSmallestHeader) return cut(las::kSmallestHeader);
    VANTAGE_CHECK(file_.read(0, std::span(bytes_).first(las::kSmallestHeader)));
    major_ = value<std::uint8_t>(las::kMajorVersion);
    minor_ = value<std::uint8_t>(las::kMinorVersion);
    if (major_ != 1 || minor_ > 4) {
      return error(fmt::format("LAS version {}.{} at byte {}, expected 1.0 to 1.4", major_, minor_,
                               las::kMajorVersion));
    }
    const std::size_t size = las::header_size(minor_);
    if (file_.size() < size) return cut(size);
    return file_.read(0, std::span(bytes_).first(size));
  }

  [[nodiscard]] tl::unexpected<Error> cut(std::size_t expected) const {
    return error(fmt::format("the file ends at byte {} inside the LAS header, expected {} bytes",
                             file_.size(), expected));
  }

  [[nodiscard]] Result<void> check_layout(const Header& header) const {
    if (header.size < las::header_size(minor_)) {
      return error(
          fmt::format("the header's size at byte {} is {}, expected {} or more in LAS 1.{}",
                      las::kHeaderSize, header.size, las::header_size(minor_), minor_));
    }
    if (header.points_offset < header.size || header.points_offset > file_.size()) {
      return error(
          fmt::format("the points begin at byte {} according to byte {}, expected a place "
                      "between the header's end at {} and the file's at {}",
                      header.points_offset, las::kPointsOffset, header.size, file_.size()));
    }
    if (header.format >= las::kPointSizes.size()) {
      return error(fmt::format("point format {} at byte {}, expected 0 to {}", header.format,
                               las::kFormat, las::kPointSizes.size() - 1));
    }
    if (header.point_size < las::kPointSizes[header.format]) {
      return error(fmt::format(
          "points of {} bytes according to byte {}, expected {} or more in "
          "point format {}",
          header.point_size, las::kPointSize, las::kPointSizes[header.format], header.format));
    }
    return {};
  }

  /// LAS 1.4 has a 64-bit count besides the old one, which is 0 if it cannot hold the number.
  [[nodiscard]] Result<std::uint64_t> points() const {
    const std::uint64_t legacy = value<std::uint32_t>(las::kLegacyPoints);
    if (minor_ < 4) return legacy;
    const auto points = value<std::uint64_t>(las::kPoints);
    if (legacy == 0 || legacy == points) return points;
    if (points == 0) return legacy;
    return error(fmt::format("{} points according to byte {} and {} according to byte {}", points,
                             las::kPoints, legacy, las::kLegacyPoints));
  }

  [[nodiscard]] Result<double> number(std::size_t first, std::size_t axis,
                                      std::string_view what) const {
    const std::size_t at = first + axis * sizeof(double);
    const auto number = value<double>(at);
    if (std::isfinite(number)) return number;
    return error(fmt::format("the {} of {} at byte {} is {}, expected a finite number", what,
                             kAxisNames[axis], at, number));
  }

  template <class Stored>
  [[nodiscard]] Stored value(std::size_t at) const noexcept {
    return las::value<Stored>(bytes_.data() + at);
  }

  const InputFile& file_;
  unsigned major_ = 0, minor_ = 0;
  std::array<char, las::kLargestHeader> bytes_{};
};

enum class Compression : std::uint8_t { none, laz, copc };

/// Walks the variable length records, which say whether points are compressed.
Result<Compression> compression_of(const InputFile& file, const Header& header) {
  const auto error = [&](std::uint64_t at, std::uint64_t record, std::string_view found) {
    return fail(
        ErrorCode::corrupt_data,
        fmt::format("variable length record {} of {} (counted at byte {}) is at byte {}, "
                    "{} byte {}, where the points begin",
                    record + 1, header.vlrs, las::kVlrCount, at, found, header.points_offset),
        SourceLocation{file.name(), 0, 0});
  };
  if (header.vlrs > (header.points_offset - header.size) / las::kVlrHeaderSize) {
    return fail(ErrorCode::corrupt_data,
                fmt::format("{} variable length records according to byte {}, expected {} at most: "
                            "the header ends at byte {}, the points begin at byte {}",
                            header.vlrs, las::kVlrCount,
                            (header.points_offset - header.size) / las::kVlrHeaderSize, header.size,
                            header.points_offset),
                SourceLocation{file.name(), 0, 0});
  }
  Compression compression = header.has_compression_bit ? Compression::laz : Compression::none;
  std::uint64_t at = header.size;
  for (std::uint64_t record = 0; record < header.vlrs; ++record) {
    if (header.points_offset - at < las::kVlrHeaderSize) return error(at, record, "too near to");
    std::array<char, las::kVlrHeaderSize> head{};
    VANTAGE_CHECK(file.read(at, head));
    const auto size = las::value<std::uint16_t>(head.data() + las::kVlrLength);
    if (header.points_offset - at - las::kVlrHeaderSize < size) {
      return error(at, record, fmt::format("and its {} bytes reach beyond", size));
    }
    const std::string_view user(head.data() + las::kVlrUser, las::kVlrUserSize);
    const std::string_view name = user.substr(0, user.find('\0'));
    if (name == "copc") return Compression::copc;
    if (name == "laszip encoded") compression = Compression::laz;
    at += las::kVlrHeaderSize + size;
  }
  return compression;
}

tl::unexpected<Error> unsupported(const InputFile& file, std::string_view format,
                                  std::string_view from, std::string_view converters) {
  return fail(ErrorCode::unsupported,
              fmt::format("{} is not read; convert it: `pdal translate {} out.las`{}", format, from,
                          converters),
              SourceLocation{file.name(), 0, 0});
}

tl::unexpected<Error> refuse_e57(const InputFile& file) {
  return unsupported(file, "E57", "in.e57", " or CloudCompare");
}

}  // namespace

bool looks_like_las(std::string_view content) noexcept { return content.starts_with("LASF"); }
bool looks_like_e57(std::string_view content) noexcept { return content.starts_with("ASTM-E57"); }

Result<Records> las_records(const InputFile& file) {
  VANTAGE_TRY(const Header header, HeaderReader(file).read());
  VANTAGE_TRY(const Compression compression, compression_of(file, header));
  if (compression == Compression::copc) {
    return unsupported(file, "COPC (compressed LAS)", "in.copc.laz", "");
  }
  if (compression == Compression::laz) {
    return unsupported(file, "LAZ (compressed LAS)", "in.laz", " or `laszip -i in.laz -o out.las`");
  }
  const std::uint64_t available = file.size() - header.points_offset;
  if (header.points > available / header.point_size) {
    return fail(ErrorCode::corrupt_data,
                fmt::format("the file ends at byte {}, expected {} points of {} bytes from byte {} "
                            "on but there is room for {}",
                            file.size(), header.points, header.point_size, header.points_offset,
                            available / header.point_size),
                SourceLocation{file.name(), 0, 0});
  }
  Records records;
  records.offset = header.points_offset;
  records.size = header.point_size;
  records.count = header.points;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    records.axes[axis] = {.offset = axis * sizeof(std::int32_t),
                          .read = read_coordinate<std::int32_t, ByteOrder::little>,
                          .scale = header.scale[axis],
                          .shift = header.offset[axis]};
  }
  return records;
}

Result<LoadedCloud> read_las(CloudFile& file, ReadTimes) {
  VANTAGE_TRY(const auto records, las_records(file.input()));
  return load_records(file.input(), records);
}

Result<CloudParts> las_parts(const CloudFile& file) {
  return las_records(file.input()).map(parts_of);
}

Result<CloudLayout> las_layout(const CloudFile& file) {
  VANTAGE_TRY(const Header header, HeaderReader(file.input()).read());
  const unsigned format = header.format;
  const bool new_formats = format >= 6;
  const auto is_one_of = [&](std::initializer_list<unsigned> formats) {
    return std::find(formats.begin(), formats.end(), format) != formats.end();
  };
  CloudLayout layout{
      .format = fmt::format("LAS 1.{} (point format {})", header.minor_version, format),
      .fields = {"x int32", "y int32", "z int32", "intensity uint16", "returns", "classification",
                 new_formats ? "scan_angle int16" : "scan_angle_rank int8", "user_data uint8",
                 "point_source_id uint16"}};
  if (new_formats || is_one_of({1, 3, 4, 5})) layout.fields.emplace_back("gps_time float64");
  if (is_one_of({2, 3, 5, 7, 8, 10})) layout.fields.emplace_back("rgb uint16[3]");
  if (is_one_of({8, 10})) layout.fields.emplace_back("nir uint16");
  if (is_one_of({4, 5, 9, 10})) layout.fields.emplace_back("waveform");
  if (const std::uint64_t extra = header.point_size - las::kPointSizes[format]; extra > 0) {
    layout.fields.push_back(fmt::format("{} extra bytes", extra));
  }
  return layout;
}

Result<LoadedCloud> read_e57(CloudFile& file, ReadTimes) { return refuse_e57(file.input()); }
Result<CloudParts> e57_parts(const CloudFile& file) { return refuse_e57(file.input()); }
Result<CloudLayout> e57_layout(const CloudFile& file) { return refuse_e57(file.input()); }

}  // namespace vantage::io
