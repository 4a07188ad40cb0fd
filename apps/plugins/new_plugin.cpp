#include "new_plugin.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <map>
#include <optional>

#include "templates.hpp"
#include "text.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxName = 64;

Result<void> check_name(const std::string& name) {
  const auto lower = [](char c) { return c >= 'a' && c <= 'z'; };
  const bool good = !name.empty() && name.size() <= kMaxName && lower(name.front()) &&
                    std::all_of(name.begin(), name.end(), [&](char c) {
                      return lower(c) || (c >= '0' && c <= '9') || c == '_';
                    });
  if (good) return {};
  return fail(ErrorCode::invalid_input,
              "'" + name + "' is not a name for a plugin: expected 1 to " +
                  std::to_string(kMaxName) +
                  " lower-case letters, digits and '_', the first a letter, as in 'my_plugin'");
}

/// "MySplitPartitioner" for "my_split". The kind in the name prevents clashes with the names in the
/// template.
std::string class_name(const std::string& name, PluginKind kind) {
  std::string result;
  bool upper = true;
  for (const char c : name) {
    if (c == '_') {
      upper = true;
      continue;
    }
    result += upper && c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    upper = false;
  }
  return result + with_kind(kind, [](const auto& traits) { return traits.class_suffix; });
}

/// Replaces every @key@ of the map.
std::string filled(std::string_view text, const std::map<std::string, std::string>& values) {
  std::string result(text);
  for (const auto& [key, value] : values) {
    const std::string place = "@" + key + "@";
    for (std::size_t at = 0; (at = result.find(place, at)) != std::string::npos;
         at += value.size()) {
      result.replace(at, place.size(), value);
    }
  }
  return result;
}

tl::unexpected<Error> io_error(const fs::path& path, const std::string& reason) {
  return fail(ErrorCode::io_failure, path.string() + ": cannot be written: " + reason);
}

Result<void> write_file(const fs::path& path, const std::string& text) {
  errno = 0;
  std::ofstream out(path, std::ios::binary);
  out << text;
  if (!out.flush()) return io_error(path, std::strerror(errno));
  return {};
}

/// The table [params] of a kind's params.toml, as the params of a section of a configuration; ""
/// without parameters.
std::string params_of_section(const std::string& kind) {
  constexpr std::string_view kTable = "[params]\n", kFolder = "{folder}/";
  const auto all = templates::files();
  const auto file = std::ranges::find(all, kind + "/params.toml", &templates::File::path);
  if (file == all.end()) return "";
  std::string table(file->text.substr(std::min(file->text.find(kTable), file->text.size())));
  if (const auto end = table.find("\n\n"); end != std::string::npos) table.erase(end + 1);
  if (const auto folder = table.find(kFolder); folder != std::string::npos) {
    table.erase(folder, kFolder.size());
  }
  return table.empty() ? "" : "\n[" + kind + "." + table.substr(1);
}

/// The file of the project that a template becomes; "" if it belongs to another kind.
std::string file_of(std::string_view path, const std::string& kind, const std::string& name) {
  if (path.find('/') == std::string_view::npos) return std::string(path);
  if (!path.starts_with(kind + "/")) return "";
  const std::string file(path.substr(kind.size() + 1));
  if (file == "plugin.cpp") return name + ".cpp";
  if (file == "test.cpp") return "test_" + name + ".cpp";
  return file;
}

}  // namespace

std::string plugin_kinds(const std::string& between) {
  std::string listed;
  for_each_kind([&](const auto& kind) { listed += (listed.empty() ? "" : between) + kind.name; });
  return listed;
}

Result<PluginKind> plugin_kind(const std::string& word) {
  std::vector<std::string> kinds;
  std::optional<PluginKind> found;
  for_each_kind([&](const auto& kind) {
    kinds.emplace_back(kind.name);
    if (kinds.back() == word) found = kind.kind;
  });
  if (found) return *found;
  return fail(ErrorCode::invalid_input, "no kind '" + word + "'" + did_you_mean(word, kinds) +
                                            " (there are: " + plugin_kinds(", ") + ")");
}

Result<void> write_plugin_project(PluginKind kind, const std::string& name,
                                  const fs::path& folder) {
  VANTAGE_CHECK(check_name(name));
  if (folder.empty()) return fail(ErrorCode::invalid_input, "the folder to create has no name");
  std::error_code error;
  const fs::path target = fs::absolute(folder, error).lexically_normal();
  const bool there = fs::exists(fs::symlink_status(target, error));
  if (there && !(fs::is_directory(target, error) && fs::is_empty(target, error))) {
    return fail(ErrorCode::already_exists,
                folder.string() + " exists already; expected a folder to create, or an empty one");
  }
  const fs::path parent =
      target.has_filename() ? target.parent_path() : target.parent_path().parent_path();
  fs::create_directories(parent, error);
  std::string partial = (parent / (".vantage-new-" + name + "-XXXXXX")).string();
  if (error || mkdtemp(partial.data()) == nullptr) {
    return io_error(folder, error ? error.message() : std::strerror(errno));
  }
  const std::map<std::string, std::string> values{{"name", name},
                                                  {"Class", class_name(name, kind)},
                                                  {"kind", to_string(kind)},
                                                  {"keys", documentation::keys_of_section(kind)},
                                                  {"params", params_of_section(to_string(kind))},
                                                  {"version", VANTAGE_MAJOR_MINOR}};
  Result<void> done{};
  for (const templates::File& file : templates::files()) {
    const std::string path = file_of(file.path, to_string(kind), name);
    if (!path.empty() && done)
      done = write_file(fs::path(partial) / path, filled(file.text, values));
  }
  if (done) {
    // mkdtemp's folders are for their owner only; this folder gets the usual permissions.
    const mode_t mask = umask(0);
    umask(mask);
    fs::permissions(partial, static_cast<fs::perms>(0777U & ~mask), error);
    fs::rename(partial, target, error);  // replaces an empty folder
    if (error) done = io_error(folder, error.message());
  }
  if (!done) fs::remove_all(partial, error);
  return done;
}

}  // namespace vantage
