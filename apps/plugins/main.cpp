// vantage-plugins: lists plugins, describes their parameters, and says whether a plugin fits this
// program.
#include <unistd.h>

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "json_schema.hpp"
#include "new_plugin.hpp"
#include "terminal/command_line.hpp"
#include "terminal/table.hpp"
#include "text.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage {
namespace {

struct Options {
  std::vector<std::filesystem::path> plugin_dirs;
  bool json = false, toml = false, names = false, quiet = false;
  std::string color = "auto";
  std::string name, kind;
  std::filesystem::path file, out;
};

Result<void> list_plugins(const Options& options) {
  const PluginLoader loader = PluginLoader::with_default_folders(options.plugin_dirs);
  const auto files = loader.list();
  if (options.json) {
    nlohmann::ordered_json all = nlohmann::ordered_json::array();
    for (const PluginFile& file : files) {
      all.push_back(
          {{"kind", to_string(file.kind)}, {"name", file.name}, {"file", file.path.string()}});
    }
    std::cout << json_text(all);
    return {};
  }
  if (options.names) {
    std::set<std::string> names;
    for (const PluginFile& file : files) names.insert(file.name);
    for (const std::string& name : names) std::cout << name << '\n';
    return {};
  }
  if (files.empty()) {
    std::string searched;
    for (const auto& folder : loader.folders()) searched += "\n  " + folder.string();
    return fail(ErrorCode::not_found, "no plugins found; searched:" + searched);
  }
  cli::TextTable table({"kind", "name", "file"}, 3);
  for (const PluginFile& file : files)
    table.add({to_string(file.kind), file.name, file.path.string()});
  std::cout << table.to_string(cli::Style::of(STDOUT_FILENO, options.color));
  return {};
}

Result<void> describe_plugin(const Options& options) {
  const PluginLoader loader = PluginLoader::with_default_folders(options.plugin_dirs);
  // A name, or kind/name if two kinds share the name.
  std::vector<PluginFile> matches;
  std::vector<std::string> names;
  for (const PluginFile& file : loader.list()) {
    names.push_back(file.name);
    if (file.name == options.name ||
        std::string(to_string(file.kind)) + "/" + file.name == options.name) {
      matches.push_back(file);
    }
  }
  if (matches.empty()) {
    return fail(ErrorCode::not_found,
                "no plugin '" + options.name + "'" + did_you_mean(options.name, names));
  }
  if (matches.size() > 1) {
    return fail(ErrorCode::invalid_input, "several kinds have a plugin '" + options.name +
                                              "'; say which: " + to_string(matches[0].kind) + "/" +
                                              options.name);
  }
  VANTAGE_TRY(const PluginInfo info, loader.inspect(matches.front().path));
  if (options.json) {
    std::cout << json_text(documentation::json_schema(info));
  } else {
    std::cout << (options.toml ? documentation::toml_template(info)
                               : documentation::description(info));
  }
  return {};
}

Result<void> check_plugin(const Options& options) {
  VANTAGE_TRY(const PluginInfo info, PluginLoader({}).inspect(options.file));
  if (options.json) {
    const nlohmann::ordered_json json{{"kind", to_string(info.kind)},
                                      {"name", info.name},
                                      {"summary", info.summary},
                                      {"file", info.path.string()}};
    std::cout << json_text(json);
  } else {
    std::cout << options.file.string() << ": ok, " << to_string(info.kind) << " plugin '"
              << info.name << "'\n";
    const std::string found_as = plugin_file_name(info.kind, info.name);
    if (options.file.filename() != found_as && !options.quiet) {
      std::cerr << "note: programs find a plugin by its file name, which should be " << found_as
                << '\n';
    }
  }
  return {};
}

/// The prefix below which this program is installed; none if it runs where it was built, from where
/// other projects cannot use it.
std::optional<std::string> installation() {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) return std::nullopt;
  const auto prefix = program.parent_path().parent_path();
  if (std::filesystem::exists(prefix / "CMakeCache.txt", error)) return std::nullopt;
  return prefix.string();
}

Result<void> new_plugin(const Options& options) {
  VANTAGE_TRY(const PluginKind kind, plugin_kind(options.kind));
  for (const PluginFile& file : PluginLoader::with_default_folders(options.plugin_dirs).list()) {
    if (file.kind == kind && file.name == options.name) {
      return fail(ErrorCode::already_exists, "there is a " + options.kind + " plugin '" +
                                                 options.name + "' already: " + file.path.string());
    }
  }
  VANTAGE_CHECK(write_plugin_project(kind, options.name, options.out));
  if (options.quiet) return {};
  const std::string folder = "'" + (options.out / "").parent_path().string() + "'";
  const auto prefix = installation();
  std::cerr << folder << " is a " << options.kind << " plugin. Build and test it:\n"
            << (prefix ? ""
                       : "  ./dev install ~/vantage-sdk    # in the folder of Vantage's sources\n")
            << "  cmake -S " << folder << " -B " << folder << "/build -G Ninja -DCMAKE_PREFIX_PATH="
            << (prefix ? "'" + *prefix + "'" : "\"$HOME/vantage-sdk\"") << "\n"
            << "  cmake --build " << folder << "/build && ctest --test-dir " << folder
            << "/build\n";
  return {};
}

/// The reference of the plugins in --plugin-dir, or otherwise of those beside the library. Plugins
/// from $VANTAGE_PLUGIN_PATH are not part of this project.
Result<void> print_reference(const Options& options) {
  auto folders = options.plugin_dirs;
  if (folders.empty()) {
    const auto defaults = PluginLoader::with_default_folders({}).folders();
    if (!defaults.empty()) folders.push_back(defaults.back());
  }
  const PluginLoader loader(folders);
  std::vector<PluginInfo> plugins;
  for (const PluginFile& file : loader.list()) {
    VANTAGE_TRY(auto plugin, loader.inspect(file.path));
    plugins.push_back(std::move(plugin));
  }
  if (plugins.empty()) {
    return fail(ErrorCode::not_found,
                "no plugins to document" + (folders.empty() ? "" : " in " + folders[0].string()));
  }
  std::cout << documentation::reference(describe<Config>(), plugins);
  return {};
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  CLI::App app("Lists, describes, checks and creates plugins.", "vantage plugins");
  vantage::Options options;
  app.require_subcommand(1);
  const auto add_json = [&](CLI::App* job, const char* what = "results as JSON on stdout") {
    return job->add_flag("--json", options.json, what);
  };
  const auto add_folders = [&](CLI::App* job, const char* what = "look for plugins here first") {
    vantage::cli::add_plugin_folders_option(*job, options.plugin_dirs, what);
  };
  auto* list =
      app.add_subcommand("list", "all plugin files that would be found, without opening them");
  add_folders(list);
  list->add_flag("--names", options.names, "names only, one per line")->excludes(add_json(list));
  auto* describe = app.add_subcommand("describe", "what a plugin does and its parameters");
  describe->add_option("NAME", options.name, "name, or kind/name")->required()->type_name("PLUGIN");
  add_folders(describe);
  auto* json = add_json(describe, "the JSON Schema of its params");
  describe->add_flag("--toml", options.toml, "its section of a configuration file, to fill in")
      ->excludes(json);
  auto* check = app.add_subcommand("check", "whether a file is a plugin that fits this program");
  check->add_option("FILE", options.file, "plugin file (.so)")->required();
  add_json(check);
  auto* reference = app.add_subcommand(
      "reference", "every key of a configuration file, as Markdown: docs/config_reference.md");
  add_folders(reference, "document the plugins in this folder instead of those beside the library");
  auto* create = app.add_subcommand("new", "create a project for a new plugin");
  create->add_option("KIND", options.kind, "what kind of plugin")
      ->required()
      ->type_name("{" + vantage::plugin_kinds(",") + "}");
  create->add_option("NAME", options.name, "name of the plugin: lower-case letters, digits and _")
      ->required()
      ->type_name("WORD");
  create->add_option("--out,-o", options.out, "folder to create")->required()->type_name("DIR");
  for (CLI::App* job : {check, create}) {
    job->add_flag("--quiet,-q", options.quiet, "no advice on stderr");
  }
  for (CLI::App* job : {list, describe, check, reference, create}) {
    vantage::cli::add_color_option(*job, options.color);
  }
  return vantage::cli::run_program(app, argc, argv, [&] {
    if (*create) return vantage::new_plugin(options);
    if (*list) return vantage::list_plugins(options);
    if (*check) return vantage::check_plugin(options);
    if (*reference) return vantage::print_reference(options);
    return vantage::describe_plugin(options);
  });
}
