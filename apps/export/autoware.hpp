#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "vantage/engine/bundle.hpp"
#include "vantage/kit/atomic_folder.hpp"

namespace vantage::exporting {

struct AutowareOptions {
  std::uint32_t resolution = 20;                ///< width of a tile, whole metres; > 0
  std::string prefix = "pointcloud_map";        ///< of file names
  std::optional<Point> origin = Point::Zero();  ///< subtracted [m]; none: below the map
};

struct AutowareReport {
  std::uint64_t points = 0;    ///< written
  std::uint64_t repeated = 0;  ///< points that several region maps share, written once
  std::uint64_t tiles = 0;
  std::uint64_t regions_without_points = 0;
  Point origin = Point::Zero();  ///< was subtracted [m]
  double rounding = 0.0;         ///< the largest change of a coordinate by float32 [m]
};

/// Writes the points of all region maps, each once, as Autoware's tiles: `pointcloud_map.pcd/`,
/// with a float32 PCD for each square of a grid of whole metres that contains a (rounded) point,
/// and `pointcloud_map_metadata.yaml`. Information for which Autoware has no place goes into
/// `vantage_export.json`.
/// Errors: those of the store and of writing; `invalid_input` for coordinates that float32 would
/// move by more than kMostRounding.
[[nodiscard]] Result<AutowareReport> export_autoware(const Bundle& bundle,
                                                     const AutowareOptions& options,
                                                     const std::filesystem::path& out,
                                                     io::OutputFolder::Existing existing,
                                                     const Bundle::Progress& progress);

}  // namespace vantage::exporting
