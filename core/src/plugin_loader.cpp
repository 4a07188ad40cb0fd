#include "vantage/plugin_loader.hpp"

#include <dlfcn.h>
#include <link.h>

#include <algorithm>
#include <boost/dll/shared_library.hpp>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>

namespace vantage {

class SharedLibrary {
 public:
  explicit SharedLibrary(const std::filesystem::path& file)
      : library_(file, boost::dll::load_mode::rtld_now | boost::dll::load_mode::rtld_local) {}

  [[nodiscard]] const PluginManifest* manifest() const {
    if (!library_.has("vantage_plugin")) return nullptr;
    return &library_.get<const PluginManifest>("vantage_plugin");
  }

 private:
  boost::dll::shared_library library_;
};

namespace {

constexpr std::array kKindNames{"partitioner", "ground", "visibility", "store", "matcher"};
static_assert(kKindNames.size() == kPluginKinds);

std::string file_name(PluginKind kind, const std::string& name) {
  return std::string("vantage_") + to_string(kind) + "_" + name + ".so";
}

/// Kind and name from `vantage_<kind>_<name>.so`.
std::optional<PluginFile> parse_file_name(const std::filesystem::path& path) {
  const std::string file = path.filename().string();
  for (std::size_t kind = 0; kind < kPluginKinds; ++kind) {
    const std::string prefix = std::string("vantage_") + kKindNames[kind] + "_";
    if (file.starts_with(prefix) && file.ends_with(".so") && file.size() > prefix.size() + 3) {
      return PluginFile{static_cast<PluginKind>(kind),
                        file.substr(prefix.size(), file.size() - prefix.size() - 3), path};
    }
  }
  return std::nullopt;
}

tl::unexpected<Error> refuse(const std::filesystem::path& file, const std::string& reason) {
  return fail(ErrorCode::incompatible_plugin, file.string() + ": " + reason);
}

/// The dynamic linker maps what the headers promise and dies of SIGBUS where the file is shorter,
/// so the promise is checked before it sees the file. "" for a file it can take.
std::string elf_defect(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return "cannot be read";
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  ElfW(Ehdr) header{};
  const std::string_view magic(ELFMAG, SELFMAG);
  in.read(reinterpret_cast<char*>(&header), sizeof header);
  if (error || std::string_view(reinterpret_cast<const char*>(header.e_ident), SELFMAG) != magic) {
    return "is no shared library (it does not begin as an ELF file)";
  }
  const std::string cut =
      "is cut short: its ELF headers promise more than its " + std::to_string(size) + " bytes";
  if (!in || header.e_phentsize != sizeof(ElfW(Phdr))) return cut;
  std::vector<ElfW(Phdr)> segments(header.e_phnum);
  in.seekg(static_cast<std::streamoff>(header.e_phoff));
  in.read(reinterpret_cast<char*>(segments.data()),
          static_cast<std::streamsize>(segments.size() * sizeof(ElfW(Phdr))));
  if (!in) return cut;
  for (const auto& segment : segments) {
    if (segment.p_filesz > size || segment.p_offset > size - segment.p_filesz) return cut;
  }
  return "";
}

/// Names the first member of the tags that differs; "" for none.
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

struct Checked {
  std::shared_ptr<const SharedLibrary> library;
  const PluginManifest* manifest;
};

Result<Checked> open_checked(const std::filesystem::path& file) {
  std::error_code error;
  const std::filesystem::path absolute = std::filesystem::absolute(file, error);
  if (error || !std::filesystem::exists(absolute)) {
    return fail(ErrorCode::not_found, "no plugin file at " + file.string());
  }
  if (const std::string defect = elf_defect(absolute); !defect.empty()) return refuse(file, defect);
  std::shared_ptr<const SharedLibrary> library;
  const PluginManifest* manifest = nullptr;
  try {
    library = std::make_shared<const SharedLibrary>(absolute);
    manifest = library->manifest();
  } catch (const std::exception& e) {
    return refuse(file, std::string("cannot be loaded: ") + e.what());
  }
  if (manifest == nullptr)
    return refuse(file, "is no Vantage plugin: it lacks the symbol 'vantage_plugin'");
  if (manifest->magic != kPluginMagic) {
    return refuse(file, "is no Vantage plugin: its 'vantage_plugin' has a wrong magic number");
  }
  if (const std::string difference = abi_difference(manifest->abi, abi_tag_here());
      !difference.empty()) {
    return refuse(file, difference);
  }
  if (manifest->size != sizeof(PluginManifest)) {
    return refuse(file, "its manifest has " + std::to_string(manifest->size) + " bytes, expected " +
                            std::to_string(sizeof(PluginManifest)));
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

const char* to_string(PluginKind kind) noexcept {
  return kKindNames.at(static_cast<std::size_t>(kind));
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
                     searched + " for " + file_name(kind, choice.plugin) + ")",
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
