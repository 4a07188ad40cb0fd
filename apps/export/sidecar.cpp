#include "export/sidecar.hpp"

#include <algorithm>
#include <set>
#include <system_error>
#include <utility>

#include "vantage/kit/atomic_file.hpp"
#include "vantage/kit/file_content.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage::exporting {
namespace {

namespace fs = std::filesystem;

tl::unexpected<Error> error_at(const fs::path& path, ErrorCode code, std::string message) {
  return fail(code, std::move(message), SourceLocation{path.string(), 0, 0});
}

Result<std::set<std::string>> files_of_export(const fs::path& folder) {
  const fs::path path = folder / kSidecar;
  auto text = io::read_file(path, "what an export writes");
  if (!text && text.error().code == ErrorCode::not_found) {
    return error_at(
        folder, ErrorCode::already_exists,
        std::string("is not an earlier export, so it is not replaced: it holds no ") + kSidecar);
  }
  if (!text) return fail(std::move(text).error());
  VANTAGE_TRY(const auto json, parse_json<nlohmann::json>(text->view(), path.string(),
                                                          "the list of exported files is damaged"));
  const auto files = json.is_object() ? json.find("files") : json.end();
  if (!json.is_object() || files == json.end() || !files->is_array()) {
    return error_at(path, ErrorCode::corrupt_data, "lists no files, expected an array 'files'");
  }
  std::set<std::string> names{kSidecar};
  for (const auto& file : *files) {
    if (file.is_string()) names.insert(file.get<std::string>());
  }
  return names;
}

}  // namespace

Result<void> write_sidecar(const fs::path& folder, nlohmann::ordered_json content,
                           const std::vector<std::string>& files, const BundleSummary& bundle) {
  content["map_points"] = bundle.map_points;
  content["config"] = bundle.config;
  content["files"] = files;
  // A configuration may contain any bytes, and all of them become text.
  return io::write_text_atomically(
      folder / kSidecar,
      content.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
}

Result<void> check_replaceable(const fs::path& folder) {
  std::error_code error;
  if (fs::symlink_status(folder, error).type() == fs::file_type::not_found) return {};
  if (!fs::is_directory(folder, error)) return {};  // OutputFolder reports what is wrong
  VANTAGE_TRY(const auto names, files_of_export(folder));
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error)) {
    if (it->is_directory(error) && !it->is_symlink(error)) continue;
    const std::string name = it->path().lexically_relative(folder).generic_string();
    if (names.contains(name)) continue;
    return error_at(it->path(), ErrorCode::already_exists,
                    "is not a file of the earlier export, so its folder is not replaced");
  }
  if (!error) return {};
  return error_at(folder, ErrorCode::io_failure,
                  "the folder cannot be listed (" + error.message() + ")");
}

}  // namespace vantage::exporting
