#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "vantage/engine/bundle.hpp"
#include "vantage/kit/atomic_folder.hpp"

namespace vantage::exporting {

struct GridReport {
  std::uint64_t files = 0;
  std::uint64_t points = 0;  ///< in all files
  std::uint64_t regions_without_points = 0;
  Point origin = Point::Zero();  ///< was subtracted [m]
  double rounding = 0.0;         ///< the largest change of a coordinate by float32 [m]
};

/// Writes the folder that the program of the paper's authors writes: for each region that has
/// points, `grid_<i>_<j>.pcd`, float32 in the map frame, and `grid_meta_data.yaml`. Cells are
/// counted from the lowest ones with points. The ground is no part of a bundle, so `max_pt` is that
/// of the viewpoints, which stand over it. A bundle that was such a folder gives its files back
/// byte for byte. `vantage_export.json` lists the files.
/// @param origin  is subtracted [m]; none: whole metres below the map
/// Errors: those of the store and of writing; `invalid_input` for regions that are not squares of
/// one grid, and for coordinates that float32 would move by more than kMostRounding.
[[nodiscard]] Result<GridReport> export_grid(const Bundle& bundle,
                                             const std::optional<Point>& origin,
                                             const std::filesystem::path& out,
                                             io::OutputFolder::Existing existing,
                                             const Bundle::Progress& progress);

}  // namespace vantage::exporting
