// What the programs tell about the configuration: docs/config_reference.md, `plugins describe`.
#include <doctest/doctest.h>
#include <filesystem>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "support/plugins.hpp"
#include "support/process.hpp"
#include "support/text.hpp"
#include "vantage/engine/config.hpp"

using namespace vantage;
namespace fs = std::filesystem;
using Json = nlohmann::json;

namespace {

using test::has;

std::string output_of(const std::vector<std::string>& arguments) {
  const auto finished = test::run("vantage-plugins", arguments);
  REQUIRE_MESSAGE(finished.exit_code == 0, finished.err);
  return finished.out;
}

std::vector<PluginInfo> built() {
  std::vector<PluginInfo> plugins;
  for (const PluginFile& file : test::built_plugins().list()) {
    const auto plugin = test::built_plugins().inspect(file.path);
    REQUIRE_MESSAGE(plugin, to_string(plugin.error()));
    plugins.push_back(*plugin);
  }
  REQUIRE(plugins.size() >= 7);
  return plugins;
}

std::string full_name(const PluginInfo& plugin) {
  return std::string(to_string(plugin.kind)) + "/" + plugin.name;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// What is left out has a meaning, and the doc says it.
bool says_what_unset_means(const std::string& doc) {
  return has(doc, "left out") || has(doc, "instead of");
}

/// The params of a template, as the plugin reads them.
Result<Table> params_of(const PluginInfo& plugin, const std::string& toml) {
  VANTAGE_TRY(const Table root, parse_toml(toml, "template.toml"));
  const auto& section = std::get<Table>(root.find(to_string(plugin.kind))->data);
  PluginChoice choice{.plugin = plugin.name, .library = {}, .params = {}, .where = {}};
  if (const Value* params = section.find("params")) choice.params = std::get<Table>(params->data);
  return test::built_plugins().effective_params(plugin.kind, choice);
}

/// As TOML.
std::string some_value(const ParameterDoc& p) {
  std::string value = "{}";
  switch (p.kind) {
    case ValueKind::boolean: value = "true"; break;
    case ValueKind::integer:
    case ValueKind::number:
      for (const char* candidate : {"100", "0.5", "1"}) {
        if (p.range.contains(std::stod(candidate))) value = candidate;
      }
      break;
    case ValueKind::string:
    case ValueKind::path: value = "\"x\""; break;
    case ValueKind::choice: value = "\"" + p.choices.at(0) + "\""; break;
    case ValueKind::table: break;
  }
  if (!p.array) return value;
  std::string array = value;
  for (std::size_t i = 1; i < p.length.value_or(1); ++i) array += ", " + value;
  return "[" + array + "]";
}

Table defaults_of(const PluginInfo& plugin) {
  Table table;
  for (const ParameterDoc& p : plugin.parameters) {
    if (p.default_value) table.entries.push_back({p.key, *p.default_value, {}});
  }
  return table;
}

}  // namespace

TEST_CASE("docs/config_reference.md is what the programs say; ./dev docs makes it again") {
  const std::vector<std::string> arguments{"reference", "--plugin-dir", VANTAGE_PLUGIN_DIR};
  setenv("VANTAGE_PLUGIN_PATH", VANTAGE_PROGRAM_DIR "/../tests/broken_plugins", 1);
  const std::string reference = output_of(arguments);
  CHECK(output_of({"reference"}) == reference);
  unsetenv("VANTAGE_PLUGIN_PATH");
  CHECK(output_of(arguments) == reference);

  std::string kept = test::read_text(VANTAGE_SOURCE_DIR "/docs/config_reference.md");
  if (!std::filesystem::exists(VANTAGE_PLUGIN_DIR "/vantage_visibility_hpr_open3d.so")) {
    MESSAGE("SKIPPED: hpr_open3d, which this system's build leaves out");
    const std::size_t begin = kept.find("### `hpr_open3d`"), end = kept.find("\n##", begin);
    REQUIRE(end != std::string::npos);
    kept.erase(begin, end + 1 - begin);
  }
  const auto there = lines_of(kept), made = lines_of(reference);
  for (std::size_t i = 0; kept != reference && i < std::max(there.size(), made.size()); ++i) {
    const std::string is = i < there.size() ? there[i] : "(end)";
    const std::string should = i < made.size() ? made[i] : "(end)";
    if (is == should) continue;
    FAIL("docs/config_reference.md is out of date, run ./dev docs and commit it; line "
         << i + 1 << " is\n  " << is << "\nand should be\n  " << should);
  }
  CHECK(kept == reference);
  CHECK_FALSE(has(reference, VANTAGE_SOURCE_DIR));
  CHECK_FALSE(has(reference, VANTAGE_PLUGIN_DIR));
}

TEST_CASE("reference: every row of a table has the columns of its head") {
  std::size_t rows = 0;
  for (const std::string& line :
       lines_of(output_of({"reference", "--plugin-dir", VANTAGE_PLUGIN_DIR}))) {
    if (!line.starts_with("|")) continue;
    ++rows;
    std::size_t bars = 0;
    for (std::size_t i = 0; i < line.size(); ++i) {
      bars += line[i] == '|' && (i == 0 || line[i - 1] != '\\') ? 1 : 0;
    }
    CHECK_MESSAGE(bars == 8, line);
  }
  CHECK(rows > 40);
}

TEST_CASE("every parameter has a doc, and one without a default says what its absence means") {
  for (const PluginInfo& plugin : built()) {
    for (const ParameterDoc& p : plugin.parameters) {
      CAPTURE(full_name(plugin));
      CAPTURE(p.key);
      CHECK_FALSE(p.doc.empty());
      if (!p.required && !p.default_value) CHECK_MESSAGE(says_what_unset_means(p.doc), p.doc);
    }
  }
}

TEST_CASE("describe: type, unit, default, range, doc, equation and citation as text") {
  const std::string grid = output_of({"describe", "uniform_grid"});
  for (const char* part :
       {"\n  cell_width: number [m]\n      grid width L\n      default: none, required\n"
        "      range: > 0\n      equation: Eq. 2\n      citation: Yagi et al. 2026, Sec. 2.1\n",
        "\n  origin: array of 2 numbers or choice [m]\n", "default: none, may be left out\n",
        "      choices: ground\n"}) {
    CHECK_MESSAGE(has(grid, part), grid);
  }
  CHECK(has(output_of({"describe", "hpr"}), "choices: spherical_flip, inversion\n"));
  for (const PluginInfo& plugin : built()) {
    const std::string text = output_of({"describe", full_name(plugin)});
    for (const ParameterDoc& p : plugin.parameters) CHECK(has(text, "\n  " + p.key + ": "));
  }
}

TEST_CASE("describe --json is the JSON Schema of the params") {
  const Json grid = Json::parse(output_of({"describe", "uniform_grid", "--json"}));
  CHECK(grid["$schema"] == "https://json-schema.org/draft/2020-12/schema");
  CHECK(grid["title"] == "partitioner uniform_grid");
  CHECK(grid["required"] == Json{"cell_width"});
  CHECK(grid["properties"]["cell_width"] == Json{{"type", "number"},
                                                 {"exclusiveMinimum", 0.0},
                                                 {"description", "grid width L"},
                                                 {"x-unit", "m"},
                                                 {"x-equation", "Eq. 2"},
                                                 {"x-citation", "Yagi et al. 2026, Sec. 2.1"}});
  const Json origin = grid["properties"]["origin"];
  REQUIRE(origin["anyOf"].size() == 2);
  CHECK(origin["anyOf"][0] == Json{{"type", "string"}, {"enum", Json::array({"ground"})}});
  CHECK(origin["anyOf"][1] ==
        Json{{"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", 2}, {"maxItems", 2}});
  CHECK_FALSE(origin.contains("default"));

  const Json hpr = Json::parse(output_of({"describe", "hpr", "--json"}))["properties"];
  CHECK(hpr["kernel"]["type"] == "string");
  CHECK(hpr["kernel"]["enum"] == Json{"spherical_flip", "inversion"});
  CHECK(hpr["kernel"]["default"] == "spherical_flip");
  CHECK(hpr["angular_spacing"]["exclusiveMaximum"] == 90.0);

  const Json ndt = Json::parse(output_of({"describe", "ndt", "--json"}))["properties"];
  CHECK(ndt["max_iterations"]["type"] == "integer");
  CHECK(ndt["max_iterations"]["minimum"].is_number_integer());
  CHECK(ndt["max_iterations"]["maximum"] == 4294967295);  // what its type can hold

  for (const PluginInfo& plugin : built()) {
    CAPTURE(full_name(plugin));
    const Json schema = Json::parse(output_of({"describe", full_name(plugin), "--json"}));
    CHECK(schema["type"] == "object");
    CHECK(schema["description"] == plugin.summary);
    CHECK(schema["additionalProperties"] == false);
    REQUIRE(schema["properties"].size() == plugin.parameters.size());
    for (const ParameterDoc& p : plugin.parameters) {
      CAPTURE(p.key);
      const Json& property = schema["properties"][p.key];
      CHECK(property["description"] == p.doc);
      CHECK(property.contains("default") == p.default_value.has_value());
      CHECK(property.contains("enum") == (!p.choices.empty() && !p.array));
      CHECK(property.value("x-citation", "") == p.citation);
    }
  }
}

TEST_CASE("describe --toml: a template fails at what must be filled in; else it is the defaults") {
  for (const PluginInfo& plugin : built()) {
    CAPTURE(full_name(plugin));
    const std::string toml = output_of({"describe", full_name(plugin), "--toml"});
    CAPTURE(toml);
    const auto lines = lines_of(toml);
    const auto as_it_is = params_of(plugin, toml);
    const auto required = std::find_if(plugin.parameters.begin(), plugin.parameters.end(),
                                       [](const ParameterDoc& p) { return p.required; });
    if (required == plugin.parameters.end()) {
      REQUIRE_MESSAGE(as_it_is, to_string(as_it_is.error()));
      CHECK(to_toml(*as_it_is) == to_toml(defaults_of(plugin)));
      const auto config = parse_toml("schema = 1\n" + toml, "c.toml").and_then(parse_config);
      CHECK_MESSAGE(config, to_string(config.error()));
    } else {
      REQUIRE_FALSE(as_it_is);
      CHECK(as_it_is.error().code == ErrorCode::invalid_config);
      REQUIRE(as_it_is.error().where->line >= 1);
      CHECK(lines.at(as_it_is.error().where->line - 1).starts_with(required->key + " = "));
    }

    // Taking the "# " from each default changes nothing.
    std::string filled;
    for (std::string line : lines) {
      for (const ParameterDoc& p : plugin.parameters) {
        if (p.default_value && line.starts_with("# " + p.key + " = ")) line.erase(0, 2);
        if (!p.required || !line.starts_with(p.key + " = ")) continue;
        line = p.key + " = " + some_value(p);
      }
      filled += line + "\n";
    }
    CAPTURE(filled);
    const auto params = params_of(plugin, filled);
    REQUIRE_MESSAGE(params, to_string(params.error()));
    for (const Entry& entry : defaults_of(plugin).entries) {
      CHECK(to_toml(*params->find(entry.key)) == to_toml(entry.value));
    }
    for (const ParameterDoc& p : plugin.parameters) {
      if (!p.required && !p.default_value) CHECK(has(toml, "# " + p.key + " = "));
    }
  }
}

TEST_CASE("new: the section that a project's README shows is complete") {
  const test::TemporaryFolder folder;
  for_each_kind([&](const auto& kind) {
    CAPTURE(kind.name);
    const fs::path project = folder.path() / kind.name;
    const auto made = test::run("vantage-plugins",
                                {"new", std::string(kind.name), "mine", "--out", project.string()});
    REQUIRE_MESSAGE(made.exit_code == 0, made.err);
    const std::string readme = test::read_text(project / "README.md");
    const std::size_t from = readme.find("```toml\n") + 8;
    const std::string section = readme.substr(from, readme.find("```", from) - from);
    CAPTURE(section);
    const auto config = parse_toml("schema = 1\n" + section, "c.toml").and_then(parse_config);
    REQUIRE_MESSAGE(config, to_string(config.error()));
    const std::string plugin = test::read_text(project / "mine.cpp");
    const std::regex required("required\\(\"([a-z_]+)\"");
    for (auto key = std::sregex_iterator(plugin.begin(), plugin.end(), required);
         key != std::sregex_iterator(); ++key) {
      CAPTURE((*key)[1].str());
      const std::string line = "\n" + (*key)[1].str() + " = ";
      CHECK(section.find(line, section.find(".params]")) != std::string::npos);
    }
  });
}

TEST_CASE("describe: --json and --toml exclude each other") {
  const auto finished = test::run("vantage-plugins", {"describe", "hpr", "--json", "--toml"});
  CHECK(finished.exit_code == 2);
  CHECK(finished.out.empty());
}
