#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "io/cloud_formats.hpp"
#include "io/point_fields.hpp"

namespace vantage::io {

namespace {

constexpr std::size_t kPointSize = 4 * sizeof(float);  // x y z intensity

/// Checks that the 4th numbers of the first points may be intensities, which are not negative.
/// Files of other data sets have the same name and more numbers a point: read as four, coordinates
/// soon come fourth. NaN may stand for an unknown intensity.
Result<void> check_intensities(const InputFile& file) {
  constexpr std::size_t kChecked = 1000;  // points
  std::vector<char> bytes(std::min<std::uint64_t>(file.size() / kPointSize, kChecked) * kPointSize);
  VANTAGE_CHECK(file.read(0, bytes));
  for (std::size_t at = 0; at < bytes.size(); at += kPointSize) {
    const double fourth =
        read_coordinate<float, ByteOrder::little>(bytes.data() + at + 3 * sizeof(float));
    if (!(fourth < 0.0) && !std::isinf(fourth)) continue;
    return fail(ErrorCode::corrupt_data,
                fmt::format("the 4th number of point {} is {:g}, expected an intensity: has a "
                            "point of this file 5 or 6 numbers?",
                            at / kPointSize, fourth),
                SourceLocation{file.name(), 0, 0});
  }
  return {};
}

Result<Records> kitti_records(const InputFile& file) {
  if (file.size() % kPointSize != 0) {
    return fail(
        ErrorCode::corrupt_data,
        fmt::format("the file ends at byte {}, inside point {}; expected points of {} bytes "
                    "(KITTI: float32 x y z intensity)",
                    file.size(), file.size() / kPointSize, kPointSize),
        SourceLocation{file.name(), 0, 0});
  }
  VANTAGE_CHECK(check_intensities(file));
  Records records;
  records.size = kPointSize;
  records.count = file.size() / kPointSize;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    records.axes[axis] = {.offset = axis * sizeof(float),
                          .read = read_coordinate<float, ByteOrder::little>};
  }
  return records;
}

}  // namespace

Result<LoadedCloud> read_kitti_bin(CloudFile& file, ReadTimes) {
  VANTAGE_TRY(const Records records, kitti_records(file.input()));
  return load_records(file.input(), records);
}

Result<CloudParts> kitti_bin_parts(const CloudFile& file) {
  return kitti_records(file.input()).map(parts_of);
}

Result<CloudLayout> kitti_bin_layout(const CloudFile&) {
  return CloudLayout{.format = "KITTI .bin",
                     .fields = {"x float32", "y float32", "z float32", "intensity float32"}};
}

}  // namespace vantage::io
