#include <fmt/format.h>

#include <cstddef>

#include "io/cloud_formats.hpp"
#include "io/point_fields.hpp"

namespace vantage::io {

Result<LoadedCloud> read_kitti_bin(CloudFile& file, ReadTimes) {
  VANTAGE_TRY(const auto content, file.content());
  constexpr std::size_t kPointSize = 4 * sizeof(float);  // x y z intensity
  if (content.size() % kPointSize != 0) {
    return fail(
        ErrorCode::corrupt_data,
        fmt::format("the file ends at byte {}, inside point {}; expected points of {} bytes "
                    "(KITTI: float32 x y z intensity)",
                    content.size(), content.size() / kPointSize, kPointSize),
        SourceLocation{file.name(), 0, 0});
  }
  PointColumns columns;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    columns.axes[axis] = {content.data() + axis * sizeof(float), kPointSize,
                          read_coordinate<float, ByteOrder::little>};
  }
  return load_columns(columns, content.size() / kPointSize);
}

Result<CloudLayout> kitti_bin_layout(const CloudFile&) {
  return CloudLayout{.format = "KITTI .bin",
                     .fields = {"x float32", "y float32", "z float32", "intensity float32"}};
}

}  // namespace vantage::io
