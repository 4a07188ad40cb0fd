// vantage-plugins: what plugins there are, what they can be told, and whether one fits this
// program.
#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/command_line.hpp"
#include "common/table.hpp"

namespace vantage {
namespace {

struct Options {
  std::vector<std::filesystem::path> plugin_dirs;
  bool json = false;
  std::string name;
  std::filesystem::path file;
};

nlohmann::ordered_json to_json(const PluginInfo& info) {
  nlohmann::ordered_json parameters = nlohmann::ordered_json::array();
  for (const ParameterDoc& p : info.parameters) {
    nlohmann::ordered_json parameter{{"key", p.key}, {"type", p.type}, {"required", p.required}};
    if (!p.unit.empty()) parameter["unit"] = p.unit;
    if (!p.range.empty()) parameter["range"] = p.range;
    if (!p.choices.empty()) parameter["choices"] = p.choices;
    if (!p.default_value.empty()) parameter["default"] = p.default_value;
    parameter["doc"] = p.doc;
    parameters.push_back(std::move(parameter));
  }
  return {{"kind", to_string(info.kind)},
          {"name", info.name},
          {"summary", info.summary},
          {"file", info.path.string()},
          {"parameters", std::move(parameters)}};
}

std::string allowed_values(const ParameterDoc& p) {
  std::string text = p.range;
  for (const std::string& choice : p.choices) text += (text.empty() ? "" : " | ") + choice;
  return text;
}

void print(const PluginInfo& info) {
  std::cout << to_string(info.kind) << ' ' << info.name << ": " << info.summary << '\n'
            << info.path.string() << '\n';
  if (info.parameters.empty()) {
    std::cout << "\nno parameters\n";
    return;
  }
  for (const ParameterDoc& p : info.parameters) {
    std::cout << fmt::format("\n  {} : {}{}{}\n", p.key, p.type,
                             p.unit.empty() ? "" : " [" + p.unit + "]",
                             p.required                ? ", required"
                             : p.default_value.empty() ? ", may be left out"
                                                       : ", default " + p.default_value);
    if (const std::string allowed = allowed_values(p); !allowed.empty()) {
      std::cout << "      " << allowed << '\n';
    }
    std::cout << "      " << p.doc << '\n';
  }
}

Result<void> list_plugins(const Options& options) {
  const PluginLoader loader = PluginLoader::with_default_folders(options.plugin_dirs);
  const auto files = loader.list();
  if (options.json) {
    nlohmann::ordered_json all = nlohmann::ordered_json::array();
    for (const PluginFile& file : files) {
      all.push_back(
          {{"kind", to_string(file.kind)}, {"name", file.name}, {"file", file.path.string()}});
    }
    std::cout << all.dump(2) << '\n';
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
  std::cout << table.to_string();
  return {};
}

Result<void> describe_plugin(const Options& options) {
  const PluginLoader loader = PluginLoader::with_default_folders(options.plugin_dirs);
  // A name, or kind/name where two kinds share it.
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
    std::cout << to_json(info).dump(2) << '\n';
  } else {
    print(info);
  }
  return {};
}

Result<void> check_plugin(const Options& options) {
  VANTAGE_TRY(const PluginInfo info, PluginLoader({}).inspect(options.file));
  if (options.json) {
    std::cout << to_json(info).dump(2) << '\n';
  } else {
    std::cout << options.file.string() << ": ok, " << to_string(info.kind) << " plugin '"
              << info.name << "'\n";
  }
  return {};
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  CLI::App app("Lists, describes and checks plugins.", "vantage plugins");
  vantage::Options options;
  app.require_subcommand(1);
  const auto add_json = [&](CLI::App* job) {
    job->add_flag("--json", options.json, "results as JSON on stdout");
  };
  const auto add_folders = [&](CLI::App* job) {
    job->add_option("--plugin-dir", options.plugin_dirs, "look for plugins here first")
        ->type_name("DIR")
        ->allow_extra_args(false);
    add_json(job);
  };
  auto* list = app.add_subcommand("list", "every plugin file that would be found; opens none");
  add_folders(list);
  auto* describe = app.add_subcommand("describe", "what a plugin does and its parameters");
  describe->add_option("NAME", options.name, "name, or kind/name")->required();
  add_folders(describe);
  auto* check = app.add_subcommand("check", "whether a file is a plugin that fits this program");
  check->add_option("FILE", options.file, "plugin file (.so)")->required();
  add_json(check);
  return vantage::cli::run_program(app, argc, argv, [&] {
    if (*list) return vantage::list_plugins(options);
    return *describe ? vantage::describe_plugin(options) : vantage::check_plugin(options);
  });
}
