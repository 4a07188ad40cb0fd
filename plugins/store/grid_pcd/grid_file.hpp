#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::grid_pcd {

/// The cell that a file is about; sorted by rows.
struct CellIndex {
  std::uint32_t j = 0, i = 0;
  friend auto operator<=>(const CellIndex&, const CellIndex&) = default;
};

/// Whether a name looks like that of a cell's file: `grid_*.pcd`.
[[nodiscard]] bool is_grid_file(std::string_view name);
/// The cell of `grid_<i>_<j>.pcd`; none if the indices are not plain numbers below 2^31.
[[nodiscard]] std::optional<CellIndex> cell_of(std::string_view name);
[[nodiscard]] std::string label_of(const CellIndex& cell);

/// The points of a cell's file, in their order.
/// Errors: `corrupt_data` for anything but a binary PCD of x y z in float32, in the words of the
/// program that writes these folders; for a coordinate that is not finite.
/// @param file  the file's name in error messages
[[nodiscard]] Result<PointCloud> points_in(std::string_view content, const std::string& file);

}  // namespace vantage::grid_pcd
