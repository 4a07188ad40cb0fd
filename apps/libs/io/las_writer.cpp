#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include "io/cloud_writers.hpp"
#include "io/las_layout.hpp"

namespace vantage::io {
namespace {

constexpr double kScale = 0.001;  // [m]
constexpr std::uint8_t kFormat = 6;
constexpr std::uint16_t kCoordinateSystemIsWkt = 1U << 4U;  // required from point format 6 on

// Extra Bytes record (Sec. 2.7, Table 24): describes the bytes after the fields of each point.
constexpr std::string_view kExtraBytesUser = "LASF_Spec";
constexpr std::uint16_t kExtraBytesId = 4;
constexpr std::size_t kExtraBytesSize = 192;
constexpr std::size_t kExtraBytesType = 2;           // uint8
constexpr std::size_t kExtraBytesName = 4;           // char[32]
constexpr std::size_t kExtraBytesDescription = 160;  // char[32]
constexpr std::uint8_t kUnsignedLong = 5;            // uint32

void put_text(std::string& bytes, std::size_t at, std::string_view text) {
  bytes.replace(at, text.size(), text);
}

/// The stored numbers of a point count from this offset [m].
struct Grid {
  Point offset = Point::Zero();

  [[nodiscard]] std::array<std::int32_t, 3> stored(const Point& p) const {
    std::array<std::int32_t, 3> numbers{};
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      numbers[static_cast<std::size_t>(axis)] =
          static_cast<std::int32_t>(std::llround((p[axis] - offset[axis]) / kScale));
    }
    return numbers;
  }
  [[nodiscard]] double read_back(std::int32_t number, Eigen::Index axis) const {
    return number * kScale + offset[axis];
  }
};

Result<Grid> grid_around(const std::filesystem::path& path, const Bounds3& bounds) {
  Grid grid;
  if (bounds.empty()) return grid;
  // Whole kilometres, so that the numbers are easy to read.
  grid.offset = ((0.5 * bounds.min + 0.5 * bounds.max) / 1000.0).array().round() * 1000.0 + 0.0;
  const double reach = (bounds.max - grid.offset).cwiseMax(grid.offset - bounds.min).maxCoeff();
  if (reach < kScale * std::numeric_limits<std::int32_t>::max()) return grid;
  return fail(ErrorCode::invalid_input,
              fmt::format("points up to {:.7g} m from the middle of the cloud, expected {:.0f} m "
                          "at most in LAS with {} m steps",
                          reach, kScale * std::numeric_limits<std::int32_t>::max(), kScale),
              SourceLocation{path.string(), 0, 0});
}

/// The record that names the field `views`.
std::string extra_bytes_record() {
  std::string record(las::kVlrHeaderSize + kExtraBytesSize, '\0');
  put_text(record, las::kVlrUser, kExtraBytesUser);
  las::put(record.data() + las::kVlrRecordId, kExtraBytesId);
  las::put(record.data() + las::kVlrLength, static_cast<std::uint16_t>(kExtraBytesSize));
  put_text(record, las::kVlrDescription, "extra bytes");
  const std::size_t content = las::kVlrHeaderSize;
  las::put(record.data() + content + kExtraBytesType, kUnsignedLong);
  put_text(record, content + kExtraBytesName, "views");
  put_text(record, content + kExtraBytesDescription, "viewpoints that see the point");
  return record;
}

std::string header(const Grid& grid, const Bounds3& bounds, std::uint64_t points,
                   const std::string& records, bool has_views) {
  std::string bytes(las::kLargestHeader, '\0');
  const auto put = [&](std::size_t at, auto value) { las::put(bytes.data() + at, value); };
  put_text(bytes, 0, "LASF");
  put(las::kGlobalEncoding, kCoordinateSystemIsWkt);
  put(las::kMajorVersion, std::uint8_t{1});
  put(las::kMinorVersion, std::uint8_t{4});
  put_text(bytes, las::kSystem, "EXTRACTION");
  put_text(bytes, las::kSoftware, "vantage");
  put(las::kHeaderSize, static_cast<std::uint16_t>(las::kLargestHeader));
  put(las::kPointsOffset, static_cast<std::uint32_t>(las::kLargestHeader + records.size()));
  put(las::kVlrCount, std::uint32_t{has_views ? 1U : 0U});
  put(las::kFormat, kFormat);
  put(las::kPointSize, static_cast<std::uint16_t>(las::kPointSizes[kFormat] +
                                                  (has_views ? sizeof(std::uint32_t) : 0)));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const std::size_t place = axis * sizeof(double);
    put(las::kScale + place, kScale);
    put(las::kOffset + place, grid.offset[a]);
    if (bounds.empty()) continue;
    // Bounds of the points as they are read back, so that no point lies outside.
    put(las::kBounds + 2 * place, grid.read_back(grid.stored(bounds.max)[axis], a));
    put(las::kBounds + 2 * place + sizeof(double),
        grid.read_back(grid.stored(bounds.min)[axis], a));
  }
  put(las::kPoints, points);
  put(las::kPointsByReturn, points);  // each is the only return of its pulse
  return bytes;
}

}  // namespace

Result<void> write_las(const std::filesystem::path& path, PointsView points,
                       std::span<const std::uint32_t> views) {
  VANTAGE_CHECK(check_writable(path, points, Precision::float64, views));
  const Bounds3 bounds = bounds_of(points);
  VANTAGE_TRY(const Grid grid, grid_around(path, bounds));
  VANTAGE_TRY(auto file, OutputFile::create(path));
  const std::string records = views.empty() ? std::string() : extra_bytes_record();
  VANTAGE_CHECK(file.write(header(grid, bounds, points.size(), records, !views.empty())));
  VANTAGE_CHECK(file.write(records));
  VANTAGE_CHECK(write_records(file, points.size(), [&](std::string& bytes, std::size_t i) {
    constexpr std::size_t kReturns = 14;  // uint8: number of this return, of all returns
    constexpr char kOnlyReturn = 0x11;
    const std::size_t at = bytes.size();
    bytes.append(las::kPointSizes[kFormat], '\0');
    las::put(bytes.data() + at, grid.stored(points[i]));
    bytes[at + kReturns] = kOnlyReturn;
    if (!views.empty()) append(bytes, views[i]);
  }));
  return file.commit();
}

}  // namespace vantage::io
