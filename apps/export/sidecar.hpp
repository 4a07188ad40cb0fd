#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "vantage/region_directory.hpp"

namespace vantage::exporting {

/// The file that says what made an export; it lies beside the exported files.
inline constexpr const char* kSidecar = "vantage_export.json";

/// Writes the sidecar into `folder`. @param files  of the export, relative to the folder
[[nodiscard]] Result<void> write_sidecar(const std::filesystem::path& folder,
                                         nlohmann::ordered_json content,
                                         const std::vector<std::string>& files,
                                         const BundleSummary& bundle);

/// Checks that a folder may be replaced: it does not exist, or it is an earlier export and holds
/// nothing else. Errors: `already_exists`; `corrupt_data` for a damaged sidecar.
[[nodiscard]] Result<void> check_replaceable(const std::filesystem::path& folder);

}  // namespace vantage::exporting
