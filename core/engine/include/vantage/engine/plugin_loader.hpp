#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/params.hpp"
#include "vantage/plugin.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// The plugin that a configuration asks for.
struct PluginChoice {
  std::string plugin;                            ///< name, as in the file name
  std::optional<std::filesystem::path> library;  ///< a file to load instead of searching
  Table params;
  SourceLocation where;  ///< of the name, or of the library if there is one

  static constexpr auto schema() {
    return std::tuple{
        required("plugin", &PluginChoice::plugin, "", "name of the plugin"),
        optional("library", &PluginChoice::library, "", "plugin file, instead of searching"),
        optional("params", &PluginChoice::params, "", "parameters of the plugin"),
    };
  }
};

/// "vantage_partitioner_uniform_grid.so": the file name by which the loader finds a plugin.
[[nodiscard]] VANTAGE_API std::string plugin_file_name(PluginKind kind, const std::string& name);

class SharedLibrary;  // an open plugin file; closed when the last owner goes

/// The file that a library was opened from, as an absolute path.
[[nodiscard]] VANTAGE_API const std::filesystem::path& file_of(
    const SharedLibrary& library) noexcept;

/// Deletes an object of a plugin first, and releases its library afterwards.
template <class T>
struct InLibrary {
  std::shared_ptr<const SharedLibrary> library;  // none for objects of the program itself
  void operator()(T* object) const noexcept { delete object; }
};

/// Owns an object whose code may live in a plugin, and keeps that plugin loaded.
template <class T>
using PluginPtr = std::unique_ptr<T, InLibrary<T>>;

/// Ties an object that a plugin's object made (a scene, a match target) to the same library.
template <class T, class U>
[[nodiscard]] PluginPtr<U> in_library_of(const PluginPtr<T>& parent, std::unique_ptr<U> object) {
  return PluginPtr<U>(object.release(), InLibrary<U>{parent.get_deleter().library});
}

/// A file with the name of a plugin; it has not been opened.
struct PluginFile {
  PluginKind kind;
  std::string name;
  std::filesystem::path path;
};

/// What an opened plugin says about itself.
struct PluginInfo {
  PluginKind kind;
  std::string name, summary;
  std::filesystem::path path;
  std::vector<ParameterDoc> parameters;
};

/// Finds and opens plugins. The loader itself keeps no plugin open.
class VANTAGE_API PluginLoader {
 public:
  /// @param folders  searched in this order; the current directory is never searched
  explicit PluginLoader(std::vector<std::filesystem::path> folders);

  /// `plugin_dirs`, then $VANTAGE_PLUGIN_PATH (':'-separated), then `vantage/` beside
  /// libvantage_core.
  [[nodiscard]] static PluginLoader with_default_folders(
      std::vector<std::filesystem::path> plugin_dirs);

  [[nodiscard]] const std::vector<std::filesystem::path>& folders() const noexcept {
    return folders_;
  }

  /// Every plugin file in the folders, sorted by kind and name. If a name occurs twice, the first
  /// folder wins. Opens no file. A folder that does not exist counts as empty.
  [[nodiscard]] std::vector<PluginFile> list() const;

  /// Makes the plugin's object with the choice's params.
  /// Errors: `not_found`, with the plugins that exist and what was probably meant;
  /// `incompatible_plugin` with what differs; `invalid_config` from the params.
  template <class Interface>
  [[nodiscard]] Result<PluginPtr<Interface>> load(const PluginChoice& choice) const;

  /// The choice's params with the plugin's defaults filled in. Errors: as `load`.
  [[nodiscard]] Result<Table> effective_params(PluginKind kind, const PluginChoice& choice) const;

  /// The parameters that the choice's plugin describes. Errors: as `load`.
  [[nodiscard]] Result<std::vector<ParameterDoc>> parameters(PluginKind kind,
                                                             const PluginChoice& choice) const;

  /// Opens a plugin and reads its description. Errors: as `load`.
  [[nodiscard]] Result<PluginInfo> inspect(const std::filesystem::path& file) const;

 private:
  struct Opened {
    std::shared_ptr<const SharedLibrary> library;
    const PluginManifest* manifest;
  };
  [[nodiscard]] Result<Opened> open(PluginKind kind, const PluginChoice& choice) const;

  std::vector<std::filesystem::path> folders_;
};

template <class Interface>
Result<PluginPtr<Interface>> PluginLoader::load(const PluginChoice& choice) const {
  VANTAGE_TRY(const Opened opened, open(kind_of<Interface>(), choice));
  auto object = std::get<Factory<Interface>>(opened.manifest->factory).create(choice.params);
  if (!object) return fail(std::move(object).error());
  return PluginPtr<Interface>(object->release(), InLibrary<Interface>{opened.library});
}

}  // namespace vantage
