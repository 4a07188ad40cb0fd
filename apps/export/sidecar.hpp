#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "vantage/kit/atomic_folder.hpp"
#include "vantage/region_directory.hpp"

namespace vantage::exporting {

/// The file that says what made an export; it lies beside the exported files.
inline constexpr const char* kSidecar = "vantage_export.json";

/// Writes the sidecar into `folder`. @param files  of the export, relative to the folder
[[nodiscard]] Result<void> write_sidecar(const std::filesystem::path& folder,
                                         nlohmann::ordered_json content,
                                         const std::vector<std::string>& files,
                                         const BundleSummary& bundle);

/// What the folder of an export holds: the sidecar and the files that it lists.
[[nodiscard]] io::FolderKind kind_of_export();

}  // namespace vantage::exporting
