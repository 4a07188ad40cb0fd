#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "vantage/engine/bundle.hpp"
#include "vantage/kit/atomic_folder.hpp"

namespace vantage::exporting {

enum class CloudFormat : std::uint8_t { pcd, ply, las };

struct RegionsReport {
  std::uint64_t files = 0;
  std::uint64_t points = 0;  ///< in all files
  bool has_views = false;    ///< whether the bundle says how many viewpoints see each point
  std::uint64_t regions_without_points = 0;
};

/// Writes the map of each region that has points as a file `<label>.<format>`, in the map frame.
/// PCD and PLY use float32 if that changes no coordinate, otherwise float64; LAS uses millimetres.
/// If the bundle has view counts (store.views), each point has its count in an extra field: see
/// io::write_pcd, write_ply and write_las. `vantage_export.json` lists the files.
/// Errors: those of the store and of writing.
[[nodiscard]] Result<RegionsReport> export_regions(const Bundle& bundle, CloudFormat format,
                                                   const std::filesystem::path& out,
                                                   io::OutputFolder::Existing existing,
                                                   const Bundle::Progress& progress);

}  // namespace vantage::exporting
