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
    return fail(ErrorCode::already_exists, std::string("it holds no ") + kSidecar);
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
  return io::write_text_atomically(folder / kSidecar, json_text(content));
}

io::FolderKind kind_of_export() {
  return {.what = "an earlier export",
          .overwrite = "--overwrite",
          .check = [](const fs::path& folder, auto names) -> Result<void> {
            VANTAGE_TRY(const auto exported, files_of_export(folder));
            std::error_code ignored;
            for (const std::string& name : names) {
              if (exported.contains(name)) continue;
              if (fs::symlink_status(folder / name, ignored).type() != fs::file_type::directory) {
                return io::it_holds(name);
              }
            }
            return {};
          }};
}

}  // namespace vantage::exporting
