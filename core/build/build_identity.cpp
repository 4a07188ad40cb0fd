#include "build/build_identity.hpp"

#include <dlfcn.h>
#include <sys/stat.h>

#include <algorithm>
#include <bit>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <system_error>
#include <variant>
#include <vector>

#include "vantage/engine/config.hpp"
#include "vantage/kit/checksum.hpp"
#include "vantage/kit/file_content.hpp"
#include "vantage/partition.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;

Result<std::uint64_t> sum_of_file(const fs::path& file, std::string_view expected) {
  VANTAGE_TRY(const io::FileContent content, io::read_file(file, expected));
  return checksum_of(content.view());
}

/// The libraries that decide: that of builds, the engine, and that of values and regions.
Result<std::uint64_t> sum_of_program() {
  const auto engine = static_cast<Result<Config> (*)(const Table&)>(&parse_config);
  Checksum sum;
  for (const void* const within :
       {reinterpret_cast<const void*>(&sum_of_file), reinterpret_cast<const void*>(engine),
        reinterpret_cast<const void*>(&defect_of)}) {
    Dl_info info{};
    if (::dladdr(within, &info) == 0) continue;
    VANTAGE_TRY(const std::uint64_t of_file, sum_of_file(info.dli_fname, "a library"));
    sum.add(of_file);
  }
  return sum.value();
}

/// Of a plugin's file; 0 for an object of the program itself.
template <class T>
Result<std::uint64_t> sum_of_plugin(const PluginPtr<T>& plugin) {
  const auto& library = plugin.get_deleter().library;
  if (library == nullptr) return 0;
  return sum_of_file(file_of(*library), "a library");
}

Table* table_in(Table& table, std::string_view key) {
  const auto entry =
      std::ranges::find_if(table.entries, [&](const Entry& one) { return one.key == key; });
  return entry == table.entries.end() ? nullptr : std::get_if<Table>(&entry->value.data);
}

void leave_out(Table& table, std::string_view key) {
  std::erase_if(table.entries, [&](const Entry& entry) { return entry.key == key; });
}

void add_size_and_time(Checksum& sum, const fs::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return;
  sum.add(static_cast<std::uint64_t>(status.st_size));
  sum.add(static_cast<std::uint64_t>(status.st_mtim.tv_sec));
  sum.add(static_cast<std::uint64_t>(status.st_mtim.tv_nsec));
}

/// A file or folder, wherever it is: the names, sizes and times of its files. They may be too large
/// to be read by a process that does not need them.
void add_recording(Checksum& sum, const fs::path& recording) {
  std::error_code error;
  if (!fs::is_directory(recording, error)) {
    add_size_and_time(sum, recording);
    return;
  }
  std::vector<std::string> names;
  constexpr auto kFollow = fs::directory_options::follow_directory_symlink;
  for (fs::recursive_directory_iterator at(recording, kFollow, error), end; !error && at != end;
       at.increment(error)) {
    std::error_code ignored;
    if (at->is_directory(ignored)) continue;
    names.push_back(at->path().lexically_relative(recording).string());
  }
  std::ranges::sort(names);
  for (const std::string& name : names) {
    sum.add(std::uint64_t{name.size()});
    sum.add(name);
    add_size_and_time(sum, recording / name);
  }
}

/// @return  none if the table does not name a file
std::optional<fs::path> path_in(const Table* table, std::string_view key) {
  const Value* const named = table != nullptr ? table->find(key) : nullptr;
  const auto* const text = named != nullptr ? std::get_if<std::string>(&named->data) : nullptr;
  return text != nullptr ? std::optional<fs::path>(*text) : std::nullopt;
}

/// The scans for [selector], and their poses.
std::uint64_t sum_of_recording(const Table* selector, const Table* map) {
  Checksum sum;
  const auto scans = path_in(selector, "scans");
  if (!scans) return sum.value();
  add_recording(sum, *scans);
  auto poses = path_in(selector, "poses");
  if (!poses) poses = path_in(map, "trajectory");
  // A file that cannot be read is an error of the step that needs it.
  if (!poses) return sum.value();
  if (const auto content = sum_of_file(*poses, "poses")) sum.add(*content);
  return sum.value();
}

struct ConfigIdentity {
  std::uint64_t values = 0, recording = 0;
};

ConfigIdentity identity_of(const BuildParams& params) {
  std::string text = params.effective_config;
  Checksum values;
  std::uint64_t recording = 0;
  if (auto table = parse_toml(text, "")) {
    Table* const selector = table_in(*table, "selector");
    recording = sum_of_recording(selector, table_in(*table, "map"));
    if (selector != nullptr) {
      for (const char* key : {"scans", "poses"}) leave_out(*selector, key);
    }
    leave_out(*table, "map");
    for (Entry& entry : table->entries) {
      if (auto* const section = std::get_if<Table>(&entry.value.data)) {
        leave_out(*section, "library");
      }
    }
    text = to_toml(*table);
  }
  values.add(text);
  values.add(static_cast<std::uint64_t>(params.content));
  values.add(std::uint64_t{params.views});
  return {values.value(), recording};
}

}  // namespace

std::uint64_t BuildIdentity::key() const noexcept {
  Checksum sum;
  for (const auto& [name, value] : parts) {
    sum.add(name);
    sum.add(value);
  }
  return sum.value();
}

Result<BuildIdentity> identity_of(std::uint64_t map_key, PointsView trajectory,
                                  const BuildPlugins& plugins, const BuildParams& params) {
  Checksum driven;
  for (const Point& p : trajectory) {
    for (const double x : {p.x(), p.y(), p.z()}) driven.add(std::bit_cast<std::uint64_t>(x));
  }
  const ConfigIdentity config = identity_of(params);
  BuildIdentity identity{{{"map", map_key},
                          {"trajectory", driven.value()},
                          {"configuration", config.values},
                          {"recording for [selector]", config.recording}}};
  VANTAGE_TRY(const std::uint64_t program, sum_of_program());
  identity.parts.emplace_back("version of Vantage", program);
  // Not the store: it gets what all others have made.
  const auto add = [&](const char* section, const auto& plugin) -> Result<void> {
    VANTAGE_TRY(const std::uint64_t sum, sum_of_plugin(plugin));
    identity.parts.emplace_back("version of the plugin of [" + std::string(section) + "]", sum);
    return {};
  };
  VANTAGE_CHECK(add("partitioner", plugins.partitioner));
  VANTAGE_CHECK(add("ground", plugins.ground));
  VANTAGE_CHECK(add("visibility", plugins.visibility));
  VANTAGE_CHECK(add("selector", plugins.selector));
  VANTAGE_CHECK(add("matcher", plugins.matcher));
  VANTAGE_CHECK(add("relocalizer", plugins.relocalizer));
  return identity;
}

std::string difference(const BuildIdentity& here, const BuildIdentity& there) {
  std::string names;
  for (const auto& part : here.parts) {
    if (std::ranges::find(there.parts, part) != there.parts.end()) continue;
    names += (names.empty() ? "another " : " and another ") + part.first;
  }
  return names.empty() ? "another configuration" : names;
}

}  // namespace vantage
