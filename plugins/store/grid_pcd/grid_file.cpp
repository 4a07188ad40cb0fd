#include "grid_file.hpp"

#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>

namespace vantage::grid_pcd {
namespace {

static_assert(std::endian::native == std::endian::little, "PCD binary data is little endian");

constexpr std::string_view kPrefix = "grid_", kSuffix = ".pcd";
using Coordinates = std::array<float, 3>;
static_assert(sizeof(Coordinates) == 12);

std::string header(std::uint64_t points) {
  const std::string n = std::to_string(points);
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\n"
         "TYPE F F F\nCOUNT 1 1 1\nWIDTH " +
         n + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + n + "\nDATA binary\n";
}

/// A whole number without sign and leading zeros.
template <class T>
std::optional<T> number_in(std::string_view text) {
  T x{};
  const char* const end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, x);
  if (read.ec != std::errc() || read.ptr != end) return std::nullopt;
  if (text.front() == '-' || (text.size() > 1 && text.front() == '0')) return std::nullopt;
  return x;
}

/// The number of points that the header states; none if it has no such line.
std::optional<std::uint64_t> stated_points(std::string_view content) {
  constexpr std::string_view kLine = "\nPOINTS ";
  constexpr std::size_t kLongest = 1000;  // of a header [bytes]
  content = content.substr(0, kLongest);
  const std::size_t at = content.find(kLine);
  if (at == std::string_view::npos) return std::nullopt;
  content.remove_prefix(at + kLine.size());
  return number_in<std::uint64_t>(content.substr(0, content.find('\n')));
}

}  // namespace

bool is_grid_file(std::string_view name) {
  return name.starts_with(kPrefix) && name.ends_with(kSuffix) &&
         name.size() >= kPrefix.size() + kSuffix.size();
}

std::optional<CellIndex> cell_of(std::string_view name) {
  if (!is_grid_file(name)) return std::nullopt;
  name.remove_prefix(kPrefix.size());
  name.remove_suffix(kSuffix.size());
  const std::size_t between = name.find('_');
  if (between == std::string_view::npos) return std::nullopt;
  const auto i = number_in<std::int32_t>(name.substr(0, between));
  const auto j = number_in<std::int32_t>(name.substr(between + 1));
  if (!i || !j) return std::nullopt;
  return CellIndex{.j = static_cast<std::uint32_t>(*j), .i = static_cast<std::uint32_t>(*i)};
}

std::string label_of(const CellIndex& cell) {
  return std::string(kPrefix) + std::to_string(cell.i) + '_' + std::to_string(cell.j);
}

Result<PointCloud> points_in(std::string_view content, const std::string& file) {
  const auto corrupt = [&](const std::string& reason) {
    return fail(ErrorCode::corrupt_data, reason, SourceLocation{file, 0, 0});
  };
  const auto count = stated_points(content);
  const std::string head = count ? header(*count) : std::string();
  if (!count || !content.starts_with(head)) {
    return corrupt(
        "the header is not that of a binary PCD with the fields x y z in float32, as "
        "PCL writes it");
  }
  const std::string_view data = content.substr(head.size());
  // Divided, because a header may state any number.
  if (data.size() % sizeof(Coordinates) != 0 || data.size() / sizeof(Coordinates) != *count) {
    return corrupt("there are " + std::to_string(data.size()) + " bytes of data, expected 12 for " +
                   "each of the " + std::to_string(*count) + " points that the header states");
  }
  PointCloud points(*count);
  for (std::size_t k = 0; k < points.size(); ++k) {
    Coordinates xyz;
    std::memcpy(xyz.data(), data.data() + k * sizeof xyz, sizeof xyz);
    points[k] = Eigen::Vector3f(xyz[0], xyz[1], xyz[2]).cast<double>();
    if (!points[k].allFinite()) {
      return corrupt("a coordinate of point " + std::to_string(k) + " is not finite");
    }
  }
  return points;
}

}  // namespace vantage::grid_pcd
