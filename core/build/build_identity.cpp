#include "build/build_identity.hpp"

#include <dlfcn.h>
#include <sys/stat.h>

#include <algorithm>
#include <bit>
#include <filesystem>
#include <span>
#include <string_view>
#include <system_error>
#include <variant>

#include "vantage/engine/config.hpp"
#include "vantage/kit/checksum.hpp"
#include "vantage/kit/file_content.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;

Result<std::uint64_t> sum_of_file(const fs::path& file) {
  VANTAGE_TRY(const io::FileContent content, io::read_file(file, "a library"));
  return checksum_of(content.view());
}

/// The libraries that decide: that of builds, the engine, and that of values and regions.
Result<std::uint64_t> sum_of_program() {
  const auto core = static_cast<std::string (*)(const Value&)>(&to_toml);
  const auto engine = static_cast<Result<Config> (*)(const Table&)>(&parse_config);
  Checksum sum;
  for (const void* const within :
       {reinterpret_cast<const void*>(&sum_of_file), reinterpret_cast<const void*>(engine),
        reinterpret_cast<const void*>(core)}) {
    Dl_info info{};
    if (::dladdr(within, &info) == 0) continue;
    VANTAGE_TRY(const std::uint64_t of_file, sum_of_file(info.dli_fname));
    sum.add(of_file);
  }
  return sum.value();
}

/// Of a plugin's file; 0 for an object of the program itself.
template <class T>
Result<std::uint64_t> sum_of_plugin(const PluginPtr<T>& plugin) {
  const auto& library = plugin.get_deleter().library;
  if (library == nullptr) return 0;
  return sum_of_file(file_of(*library));
}

Table* table_in(Table& table, std::string_view key) {
  const auto entry =
      std::ranges::find_if(table.entries, [&](const Entry& one) { return one.key == key; });
  return entry == table.entries.end() ? nullptr : std::get_if<Table>(&entry->value.data);
}

void leave_out(Table& table, std::string_view key) {
  std::erase_if(table.entries, [&](const Entry& entry) { return entry.key == key; });
}

/// A file or folder: where it is, and its size and time. It is read by shards only.
void add_file(Checksum& sum, const Value* named) {
  const auto* const text = named != nullptr ? std::get_if<std::string>(&named->data) : nullptr;
  if (text == nullptr) return;
  std::error_code ignored;
  const fs::path file = fs::weakly_canonical(*text, ignored);
  sum.add(file.string());
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return;
  sum.add(static_cast<std::uint64_t>(status.st_size));
  sum.add(static_cast<std::uint64_t>(status.st_mtim.tv_sec));
  sum.add(static_cast<std::uint64_t>(status.st_mtim.tv_nsec));
}

struct ConfigIdentity {
  std::uint64_t values = 0, recording = 0;
};

ConfigIdentity identity_of(const BuildParams& params) {
  std::string text = params.effective_config;
  Checksum values, recording;
  if (auto table = parse_toml(text, "")) {
    leave_out(*table, "map");
    for (Entry& entry : table->entries) {
      if (auto* const section = std::get_if<Table>(&entry.value.data)) {
        leave_out(*section, "library");
      }
    }
    if (Table* const selector = table_in(*table, "selector")) {
      for (const char* key : {"scans", "poses"}) {
        add_file(recording, selector->find(key));
        leave_out(*selector, key);
      }
    }
    text = to_toml(*table);
  }
  values.add(text);
  values.add(static_cast<std::uint64_t>(params.content));
  values.add(std::uint64_t{params.views});
  return {values.value(), recording.value()};
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
