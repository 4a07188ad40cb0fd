#include <fmt/format.h>

#include <cstddef>

#include "io/cloud_formats.hpp"
#include "io/point_fields.hpp"

namespace vantage::io {

namespace {

Result<Records> kitti_records(const InputFile& file) {
  constexpr std::size_t kPointSize = 4 * sizeof(float);  // x y z intensity
  if (file.size() % kPointSize != 0) {
    return fail(
        ErrorCode::corrupt_data,
        fmt::format("the file ends at byte {}, inside point {}; expected points of {} bytes "
                    "(KITTI: float32 x y z intensity)",
                    file.size(), file.size() / kPointSize, kPointSize),
        SourceLocation{file.name(), 0, 0});
  }
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
