#include "vantage/kit/marked_folder.hpp"

#include <fcntl.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "vantage/kit/file_system.hpp"

namespace vantage::io {

namespace fs = std::filesystem;

Result<void> claim_folder(const fs::path& folder, const std::string& marker,
                          std::string_view what) {
  const auto refuse = [&](const std::string& reason) {
    return fail(ErrorCode::already_exists,
                "this is not " + std::string(what) + " (" + reason +
                    "): choose another name, or that of an empty folder",
                SourceLocation{folder.string(), 0, 0});
  };
  std::error_code error;
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder, error)) {
    if (fs::exists(folder, error)) return refuse("it is no folder");
    return system_error(folder, "the folder cannot be created", error ? error.value() : ENOTDIR);
  }
  VANTAGE_TRY(const auto names, names_in(folder));
  const auto other = std::ranges::find_if(names, [&](const auto& name) { return name != marker; });
  // Another process may have marked the folder since it was listed.
  if (other != names.end() && !fs::exists(folder / marker, error)) {
    return refuse("it holds '" + *other + "'");
  }
  if (!Descriptor::of(folder / marker, O_RDWR | O_CREAT).open()) {
    return system_error(folder / marker, "the file cannot be created", errno);
  }
  return {};
}

void release_folder(const fs::path& folder, const std::string& marker) noexcept {
  try {
    const auto names = names_in(folder);
    if (!names || names->size() != 1 || names->front() != marker) return;
    std::error_code ignored;
    fs::remove(folder / marker, ignored);
    fs::remove(folder, ignored);
  } catch (...) {  // a folder that stays does no harm
  }
}

}  // namespace vantage::io
