#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "vantage/map_store.hpp"

namespace vantage::exporting {

/// Beside the files of an export: what made them.
inline constexpr const char* kSidecar = "vantage_export.json";

/// Writes it into `folder`. @param files  of the export, relative to the folder
[[nodiscard]] Result<void> write_sidecar(const std::filesystem::path& folder,
                                         nlohmann::ordered_json content,
                                         const std::vector<std::string>& files,
                                         const MapIndex& index);

/// Whether a folder may be replaced: there is none, or it is an earlier export and holds nothing
/// that was not written by it. Errors: `already_exists`, `corrupt_data` for a damaged sidecar.
[[nodiscard]] Result<void> check_replaceable(const std::filesystem::path& folder);

}  // namespace vantage::exporting
