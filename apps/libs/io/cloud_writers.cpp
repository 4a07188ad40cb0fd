#include "io/cloud_writers.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace vantage::io {
namespace {

constexpr const char* kPcdHeader =
    "# .PCD v0.7 - Point Cloud Data file format\n"
    "VERSION 0.7\n"
    "FIELDS {fields}\n"
    "SIZE {sizes}\n"
    "TYPE {types}\n"
    "COUNT {counts}\n"
    "WIDTH {points}\n"
    "HEIGHT 1\n"
    "VIEWPOINT 0 0 0 1 0 0 0\n"
    "POINTS {points}\n"
    "DATA binary\n";

/// A fourth field beside x, y and z.
struct ExtraField {
  const char* name;
  char type;  // I, U or F
};

std::string pcd_header(std::size_t points, Precision precision, const ExtraField* extra) {
  const int size = precision == Precision::float32 ? 4 : 8;
  const bool more = extra != nullptr;  // of 4 bytes
  return fmt::format(kPcdHeader,
                     fmt::arg("fields", more ? fmt::format("x y z {}", extra->name) : "x y z"),
                     fmt::arg("sizes", fmt::format("{0} {0} {0}{1}", size, more ? " 4" : "")),
                     fmt::arg("types", more ? fmt::format("F F F {}", extra->type) : "F F F"),
                     fmt::arg("counts", more ? "1 1 1 1" : "1 1 1"), fmt::arg("points", points));
}

/// Writes points in a row, each followed by its view count if there are counts.
Result<void> write_points(OutputFile& file, PointsView points, Precision precision,
                          std::span<const std::uint32_t> views) {
  return write_records(file, points.size(), [&](std::string& bytes, std::size_t i) {
    append_point(bytes, points[i], precision);
    if (!views.empty()) append(bytes, views[i]);
  });
}

}  // namespace

Precision lossless_precision(PointsView points) noexcept {
  // Compares bits, because GCC 12 turns a vectorized float(x) that is at once converted back to
  // double into x itself.
  const auto is_float = [](double x) {
    constexpr std::uint64_t kBeyondFloat = (std::uint64_t{1} << 29U) - 1U;  // of the mantissa
    if ((std::bit_cast<std::uint64_t>(x) & kBeyondFloat) != 0) return false;
    return x == 0.0 || (std::abs(x) >= static_cast<double>(std::numeric_limits<float>::min()) &&
                        std::abs(x) <= static_cast<double>(std::numeric_limits<float>::max()));
  };
  const bool holds = std::all_of(points.begin(), points.end(), [&](const Point& p) {
    return std::all_of(p.begin(), p.end(), is_float);
  });
  return holds ? Precision::float32 : Precision::float64;
}

Result<void> check_writable(const std::filesystem::path& path, PointsView points,
                            Precision precision, std::span<const std::uint32_t> views) {
  const SourceLocation where{path.string(), 0, 0};
  if (!views.empty() && views.size() != points.size()) {
    return fail(ErrorCode::invalid_input,
                fmt::format("{} views for {} points", views.size(), points.size()), where);
  }
  const auto largest = precision == Precision::float32
                           ? static_cast<double>(std::numeric_limits<float>::max())
                           : std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < points.size(); ++i) {
    // Written so that NaN fails, too.
    if ((points[i].array().abs() <= largest).all()) continue;
    return fail(
        ErrorCode::invalid_input,
        fmt::format("point {} of {} is ({}, {}, {}), expected numbers that are finite in {}", i,
                    points.size(), points[i].x(), points[i].y(), points[i].z(),
                    precision == Precision::float32 ? "float32" : "float64"),
        where);
  }
  return {};
}

void append_point(std::string& bytes, const Point& point, Precision precision) {
  for (const double value : point) {
    if (precision == Precision::float32) {
      append(bytes, static_cast<float>(value));
    } else {
      append(bytes, value);
    }
  }
}

Result<void> write_pcd(const std::filesystem::path& path, PointsView points, Precision precision,
                       std::span<const std::uint32_t> views) {
  VANTAGE_CHECK(check_writable(path, points, precision, views));
  VANTAGE_TRY(auto file, OutputFile::create(path));
  constexpr ExtraField kViews{"views", 'U'};
  VANTAGE_CHECK(
      file.write(pcd_header(points.size(), precision, views.empty() ? nullptr : &kViews)));
  VANTAGE_CHECK(write_points(file, points, precision, views));
  return file.commit();
}

Result<void> write_pcd(const std::filesystem::path& path, PointsView points,
                       std::span<const float> seconds) {
  const SourceLocation where{path.string(), 0, 0};
  if (seconds.size() != points.size()) {
    return fail(ErrorCode::invalid_input,
                fmt::format("{} times for {} points", seconds.size(), points.size()), where);
  }
  for (std::size_t i = 0; i < seconds.size(); ++i) {
    if (std::isfinite(seconds[i])) continue;
    return fail(ErrorCode::invalid_input,
                fmt::format("point {} of {} was measured after {} s, expected a finite number", i,
                            points.size(), seconds[i]),
                where);
  }
  VANTAGE_CHECK(check_writable(path, points, Precision::float32, {}));
  VANTAGE_TRY(auto file, OutputFile::create(path));
  constexpr ExtraField kTime{"t", 'F'};
  VANTAGE_CHECK(file.write(pcd_header(points.size(), Precision::float32, &kTime)));
  VANTAGE_CHECK(write_records(file, points.size(), [&](std::string& bytes, std::size_t i) {
    append_point(bytes, points[i], Precision::float32);
    append(bytes, seconds[i]);
  }));
  return file.commit();
}

Result<void> write_ply(const std::filesystem::path& path, PointsView points, Precision precision,
                       std::span<const std::uint32_t> views) {
  VANTAGE_CHECK(check_writable(path, points, precision, views));
  VANTAGE_TRY(auto file, OutputFile::create(path));
  VANTAGE_CHECK(
      file.write(fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {0}\n"
                             "property {1} x\nproperty {1} y\nproperty {1} z\n{2}end_header\n",
                             points.size(), precision == Precision::float32 ? "float" : "double",
                             views.empty() ? "" : "property uint scalar_views\n")));
  VANTAGE_CHECK(write_points(file, points, precision, views));
  return file.commit();
}

}  // namespace vantage::io
