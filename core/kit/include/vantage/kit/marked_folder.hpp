#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "vantage/result.hpp"

/// Folders that several processes work in, one after the other or at once. A file marks them: what
/// has no marker is a user's, and is left alone.
namespace vantage::io {

/// Takes a folder that has the marker, that is empty, or that is not there yet. Makes the folders
/// above it, too.
/// @param marker  the name of the file
/// @param what    the folder is marked as, for errors: "a folder of parts"
/// Errors: `already_exists` for anything else of that name; `io_failure`.
[[nodiscard]] Result<void> claim_folder(const std::filesystem::path& folder,
                                        const std::string& marker, std::string_view what);

/// Removes a folder and its marker, unless anything else is in it; it then stays marked.
void release_folder(const std::filesystem::path& folder, const std::string& marker) noexcept;

}  // namespace vantage::io
