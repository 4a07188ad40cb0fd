#include "vantage/engine/plugin_loader.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <boost/dll/shared_library.hpp>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>

#include "plugins/elf.hpp"

namespace vantage {

class SharedLibrary {
 public:
  explicit SharedLibrary(const std::filesystem::path& file)
      : file_(file),
        library_(file, boost::dll::load_mode::rtld_now | boost::dll::load_mode::rtld_local) {}

  [[nodiscard]] const std::filesystem::path& file() const noexcept { return file_; }

  [[nodiscard]] const PluginManifest* manifest() const {
    if (!library_.has("vantage_plugin")) return nullptr;
    return &library_.get<const PluginManifest>("vantage_plugin");
  }

 private:
  std::filesystem::path file_;
  boost::dll::shared_library library_;
};

namespace {

/// Reads kind and name from `vantage_<kind>_<name>.so`.
std::optional<PluginFile> parse_file_name(const std::filesystem::path& path) {
  const std::string file = path.filename().string();
  std::optional<PluginFile> parsed;
  for_each_kind([&](const auto& kind) {
    const std::string prefix = std::string("vantage_") + kind.name + "_";
    if (file.starts_with(prefix) && file.ends_with(".so") && file.size() > prefix.size() + 3) {
      parsed = {kind.kind, file.substr(prefix.size(), file.size() - prefix.size() - 3), path};
    }
  });
  return parsed;
}

tl::unexpected<Error> refuse(const std::filesystem::path& file, const std::string& reason) {
  return fail(ErrorCode::incompatible_plugin, file.string() + ": " + reason);
}

/// Names the first member in which the tags differ; "" if they agree.
std::string abi_difference(const AbiTag& plugin, const AbiTag& core) {
  const auto differs = [](const char* what, std::uint32_t theirs, std::uint32_t ours) {
    std::ostringstream out;
    out << "built for " << what << ' ' << theirs << ", this program has " << ours;
    return out.str();
  };
  if (plugin.interface_version != core.interface_version) {
    return differs("plugin interface version", plugin.interface_version, core.interface_version);
  }
  if (plugin.gxx_abi_version != core.gxx_abi_version) {
    return differs("C++ ABI version", plugin.gxx_abi_version, core.gxx_abi_version);
  }
  if (plugin.cxx11_abi != core.cxx11_abi) {
    return differs("_GLIBCXX_USE_CXX11_ABI", plugin.cxx11_abi, core.cxx11_abi);
  }
  if (plugin.eigen_version != core.eigen_version) {
    return differs("Eigen version", plugin.eigen_version, core.eigen_version);
  }
  if (plugin.eigen_max_align_bytes != core.eigen_max_align_bytes) {
    return differs("an Eigen alignment (EIGEN_MAX_ALIGN_BYTES; -mavx and -march change it) of",
                   plugin.eigen_max_align_bytes, core.eigen_max_align_bytes);
  }
  if (plugin.libstdcxx_debug != core.libstdcxx_debug) {
    return differs("libstdc++ debug mode", plugin.libstdcxx_debug, core.libstdcxx_debug);
  }
  return "";
}

constexpr const char* kNoManifest = "is no Vantage plugin: it lacks the symbol 'vantage_plugin'";

/// Why a manifest cannot be read any further, or "".
std::string manifest_defect(std::uint64_t magic, std::uint64_t size, const AbiTag& abi) {
  if (magic != kPluginMagic) {
    return "is no Vantage plugin: its 'vantage_plugin' has a wrong magic number";
  }
  if (std::string difference = abi_difference(abi, abi_tag_here()); !difference.empty()) {
    return difference;
  }
  if (size != sizeof(PluginManifest)) {
    return "its manifest has " + std::to_string(size) + " bytes, expected " +
           std::to_string(sizeof(PluginManifest));
  }
  return "";
}

/// Boost.DLL's message without its repetitions; names a missing symbol.
std::string loading_defect(std::string_view what, const std::filesystem::path& file) {
  static constexpr std::string_view kUndefined = "undefined symbol: ";
  if (const auto at = what.find(kUndefined); at != std::string_view::npos) {
    const std::string_view rest = what.substr(at + kUndefined.size());
    const std::string symbol(rest.substr(0, rest.find_first_of(",) ")));
    return "no library that it names has the symbol '" + elf::demangled(symbol) + "'";
  }
  std::string reason(what.substr(
      what.find(" message: ") == std::string_view::npos ? 0 : what.find(" message: ") + 10));
  if (const auto end = reason.rfind("): "); end != std::string::npos) reason.resize(end);
  if (reason.starts_with(file.string() + ": ")) reason.erase(0, file.string().size() + 2);
  return reason;
}

struct Checked {
  std::shared_ptr<const SharedLibrary> library;
  const PluginManifest* manifest;
};

Result<Checked> open_checked(const std::filesystem::path& file) {
  std::error_code error;
  const std::filesystem::path absolute = std::filesystem::absolute(file, error);
  if (error || !std::filesystem::exists(absolute, error)) {
    const bool missing = !error || error == std::errc::no_such_file_or_directory;
    return fail(ErrorCode::not_found,
                "no plugin file at " + file.string() + (missing ? "" : ": " + error.message()));
  }
  if (!std::filesystem::is_regular_file(absolute, error)) return refuse(file, "is not a file");
  if (const std::string defect = elf::defect(absolute); !defect.empty())
    return refuse(file, defect);
  // The bytes come first: opening a library of another ABI would run its constructors.
  if (const elf::Inspection seen = elf::inspect(absolute); seen.has_symbols) {
    if (!seen.has_manifest) return refuse(file, kNoManifest);
    if (seen.head) {
      const auto& [magic, size, abi] = *seen.head;
      if (std::string defect = manifest_defect(magic, size, abi); !defect.empty()) {
        return refuse(file, defect);
      }
    }
  }
  std::shared_ptr<const SharedLibrary> library;
  const PluginManifest* manifest = nullptr;
  try {
    library = std::make_shared<const SharedLibrary>(absolute);
    manifest = library->manifest();
  } catch (const std::exception& e) {
    return refuse(file, "cannot be loaded: " + loading_defect(e.what(), absolute));
  }
  if (manifest == nullptr) return refuse(file, kNoManifest);
  if (std::string defect = manifest_defect(manifest->magic, manifest->size, manifest->abi);
      !defect.empty()) {
    return refuse(file, defect);
  }
  const auto kind = static_cast<PluginKind>(manifest->factory.index());
  if (const auto named = parse_file_name(file)) {
    if (named->kind != kind) {
      return refuse(file, std::string("is a ") + to_string(kind) + " plugin by its content, a " +
                              to_string(named->kind) + " plugin by its name");
    }
    if (named->name != manifest->name) {
      return refuse(file, std::string("calls itself '") + manifest->name +
                              "', its file name says '" + named->name + "'");
    }
  }
  return Checked{std::move(library), manifest};
}

std::filesystem::path folder_beside_core() {
  Dl_info info{};
  if (dladdr(reinterpret_cast<const void*>(&folder_beside_core), &info) == 0) return {};
  std::error_code error;
  const auto core = std::filesystem::canonical(info.dli_fname, error);
  return error ? std::filesystem::path{} : core.parent_path() / "vantage";
}

}  // namespace

const std::filesystem::path& file_of(const SharedLibrary& library) noexcept {
  return library.file();
}

std::string plugin_file_name(PluginKind kind, const std::string& name) {
  return std::string("vantage_") + to_string(kind) + "_" + name + ".so";
}

PluginLoader::PluginLoader(std::vector<std::filesystem::path> folders)
    : folders_(std::move(folders)) {}

PluginLoader PluginLoader::with_default_folders(std::vector<std::filesystem::path> plugin_dirs) {
  if (const char* variable = std::getenv("VANTAGE_PLUGIN_PATH")) {
    std::istringstream list{std::string(variable)};
    for (std::string folder; std::getline(list, folder, ':');) {
      if (!folder.empty()) plugin_dirs.emplace_back(folder);
    }
  }
  if (auto folder = folder_beside_core(); !folder.empty()) plugin_dirs.push_back(std::move(folder));
  return PluginLoader(std::move(plugin_dirs));
}

std::vector<PluginFile> PluginLoader::list() const {
  std::map<std::pair<PluginKind, std::string>, PluginFile> found;
  for (const auto& folder : folders_) {
    std::error_code error;
    for (std::filesystem::directory_iterator it(folder, error), end; !error && it != end;
         it.increment(error)) {
      if (auto file = parse_file_name(it->path())) {
        found.emplace(std::pair{file->kind, file->name}, *file);  // the first folder wins
      }
    }
  }
  std::vector<PluginFile> files;
  for (auto& [key, file] : found) files.push_back(std::move(file));
  return files;
}

Result<PluginLoader::Opened> PluginLoader::open(PluginKind kind, const PluginChoice& choice) const {
  const auto at_choice = [&](Error error) {
    if (!error.where && !choice.where.file.empty()) error.where = choice.where;
    return fail(std::move(error));
  };
  std::filesystem::path path;
  if (choice.library) {
    path = *choice.library;
  } else {
    const auto there = list();
    const auto file = std::find_if(there.begin(), there.end(), [&](const PluginFile& f) {
      return f.kind == kind && f.name == choice.plugin;
    });
    if (file == there.end()) {
      std::vector<std::string> names;
      std::string listed;
      for (const PluginFile& f : there) {
        if (f.kind != kind) continue;
        names.push_back(f.name);
        listed += (listed.empty() ? "" : ", ") + f.name;
      }
      std::string searched;
      for (const auto& folder : folders_)
        searched += (searched.empty() ? "" : ":") + folder.string();
      return at_choice(Error{
          .code = ErrorCode::not_found,
          .message = std::string("no ") + to_string(kind) + " plugin '" + choice.plugin + "'" +
                     did_you_mean(choice.plugin, names) +
                     (listed.empty() ? " (none found" : " (there are: " + listed) + "; searched " +
                     searched + " for " + plugin_file_name(kind, choice.plugin) + ")",
          .where = {},
          .context = {}});
    }
    path = file->path;
  }
  auto checked = open_checked(path);
  if (!checked) return at_choice(std::move(checked).error());
  if (static_cast<PluginKind>(checked->manifest->factory.index()) != kind) {
    return at_choice(
        Error{.code = ErrorCode::incompatible_plugin,
              .message = path.string() + ": is a " +
                         to_string(static_cast<PluginKind>(checked->manifest->factory.index())) +
                         " plugin, expected a " + to_string(kind) + " plugin",
              .where = {},
              .context = {}});
  }
  if (checked->manifest->name != choice.plugin) {
    return at_choice(Error{.code = ErrorCode::incompatible_plugin,
                           .message = path.string() + ": holds the plugin '" +
                                      checked->manifest->name + "', not '" + choice.plugin + "'",
                           .where = {},
                           .context = {}});
  }
  return Opened{std::move(checked->library), checked->manifest};
}

Result<Table> PluginLoader::effective_params(PluginKind kind, const PluginChoice& choice) const {
  VANTAGE_TRY(const Opened opened, open(kind, choice));
  return std::visit([&](const auto& factory) { return factory.effective_params(choice.params); },
                    opened.manifest->factory);
}

Result<std::vector<ParameterDoc>> PluginLoader::parameters(PluginKind kind,
                                                           const PluginChoice& choice) const {
  VANTAGE_TRY(const Opened opened, open(kind, choice));
  return std::visit([](const auto& factory) { return factory.describe(); },
                    opened.manifest->factory);
}

Result<PluginInfo> PluginLoader::inspect(const std::filesystem::path& file) const {
  VANTAGE_TRY(const Checked checked, open_checked(file));
  VANTAGE_TRY(auto parameters, std::visit([](const auto& factory) { return factory.describe(); },
                                          checked.manifest->factory));
  return PluginInfo{.kind = static_cast<PluginKind>(checked.manifest->factory.index()),
                    .name = checked.manifest->name,
                    .summary = checked.manifest->summary,
                    .path = file,
                    .parameters = std::move(parameters)};
}

}  // namespace vantage
