#include "vantage/engine/config.hpp"

#include <toml++/toml.h>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <tuple>

namespace vantage {
namespace {

SourceLocation location(const toml::source_region& region, const std::string& name) {
  return {name, static_cast<std::uint32_t>(region.begin.line),
          static_cast<std::uint32_t>(region.begin.column)};
}

Result<Table> convert(const toml::table& table, const std::string& name);

Result<Value> convert(const toml::node& node, const std::string& name) {
  Value value{false, location(node.source(), name)};
  if (const auto* table = node.as_table()) {
    VANTAGE_TRY(value.data, convert(*table, name));
  } else if (const auto* array = node.as_array()) {
    Array elements;
    for (const toml::node& element : *array) {
      VANTAGE_TRY(auto converted, convert(element, name));
      elements.push_back(std::move(converted));
    }
    value.data = std::move(elements);
  } else if (const auto* text = node.as_string()) {
    value.data = text->get();
  } else if (const auto* whole = node.as_integer()) {
    value.data = whole->get();
  } else if (const auto* real = node.as_floating_point()) {
    value.data = real->get();
  } else if (const auto* truth = node.as_boolean()) {
    value.data = truth->get();
  } else {
    return fail(ErrorCode::invalid_config, "dates and times have no meaning here", value.where);
  }
  return value;
}

Result<Table> convert(const toml::table& table, const std::string& name) {
  Table converted{{}, location(table.source(), name)};
  for (const auto& [key, node] : table) {
    VANTAGE_TRY(auto value, convert(node, name));
    converted.entries.push_back(
        {std::string(key.str()), std::move(value), location(key.source(), name)});
  }
  // toml++ sorts by key, but people read in the order of the file.
  std::stable_sort(
      converted.entries.begin(), converted.entries.end(), [](const Entry& a, const Entry& b) {
        return std::pair{a.where.line, a.where.column} < std::pair{b.where.line, b.where.column};
      });
  return converted;
}

/// Marks everything below as coming from the command line, which has no lines.
void relocate(Value& value, const SourceLocation& where) {
  value.where = where;
  if (auto* array = std::get_if<Array>(&value.data)) {
    for (Value& element : *array) relocate(element, where);
  } else if (auto* table = std::get_if<Table>(&value.data)) {
    table->where = where;
    for (Entry& entry : table->entries) {
      entry.where = where;
      relocate(entry.value, where);
    }
  }
}

constexpr std::size_t kMostParts = 256;  // of a dotted key; as many levels as brackets may have

/// toml++ bounds how deep brackets nest, but not dotted keys: very long ones would exhaust the
/// stack.
Result<void> check_keys(std::string_view text, const std::string& name) {
  std::uint32_t line = 1, column = 0;
  std::size_t dots = 0;  // in what may be one key
  for (const char c : text) {
    ++column;
    if (c == '.') {
      if (++dots < kMostParts) continue;
      return fail(ErrorCode::invalid_config,
                  "expected a key of at most " + std::to_string(kMostParts) + " parts",
                  SourceLocation{name, line, column});
    }
    constexpr std::string_view kOfKeys = "_-\"' \t";
    const bool is_of_key = (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') ||
                           (c >= 'a' && c <= 'z') || kOfKeys.find(c) != std::string_view::npos;
    if (!is_of_key) dots = 0;
    if (c == '\n') {
      ++line;
      column = 0;
    }
  }
  return {};
}

Result<void> apply_override(Table& root, const std::string& text) {
  constexpr std::size_t kShown = 200;  // characters
  const SourceLocation where{"--set " + text.substr(0, kShown), 0, 0};
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    return fail(ErrorCode::invalid_config, "expected key.path=value", where);
  }
  VANTAGE_CHECK(check_keys(text.substr(0, equals), where.file));
  const std::string written = text.substr(equals + 1);
  Value value{written, where};
  if (auto parsed = parse_toml("value = " + written, where.file)) {
    if (parsed->entries.size() == 1) value = std::move(parsed->entries.front().value);
  }
  relocate(value, where);

  Table* table = &root;
  std::istringstream path(text.substr(0, equals));
  std::vector<std::string> keys;
  for (std::string key; std::getline(path, key, '.');) keys.push_back(key);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (keys[i].empty()) return fail(ErrorCode::invalid_config, "empty key in the path", where);
    auto entry = std::find_if(table->entries.begin(), table->entries.end(),
                              [&](const Entry& e) { return e.key == keys[i]; });
    if (entry == table->entries.end()) {
      table->entries.push_back({keys[i], Value{Table{{}, where}, where}, where});
      entry = table->entries.end() - 1;
    }
    if (i + 1 == keys.size()) {
      entry->value = value;
      entry->where = where;
    } else {
      table = std::get_if<Table>(&entry->value.data);
      if (table == nullptr) {
        return fail(ErrorCode::invalid_config, "'" + keys[i] + "' is not a table", where);
      }
    }
  }
  return {};
}

/// Calls f(kind, section) for the table of each kind of plugin, whether it is there or not.
template <class C, class F>
void for_each_plugin_section(C& config, const F& f) {
  constexpr std::tuple kSections{&Config::partitioner, &Config::ground,  &Config::visibility,
                                 &Config::store,       &Config::matcher, &Config::selector,
                                 &Config::relocalizer};
  static_assert(std::tuple_size_v<decltype(kSections)> == kPluginKinds);
  for_each_kind([&]<class Interface>(const Kind<Interface>& kind) {
    f(kind, config.*std::get<static_cast<std::size_t>(kind_of<Interface>())>(kSections));
  });
}

/// Gives a plugin's section the places that errors about it point at.
template <class Section>
void locate_section(std::optional<Section>& section, const Table& root, std::string_view name) {
  if (!section) return;
  const auto& table = std::get<Table>(root.find(name)->data);
  const Value* library = table.find("library");
  section->where = library == nullptr ? table.find("plugin")->where : library->where;
  if (table.find("params") == nullptr) section->params.where = table.where;
}

const PluginChoice& choice_of(const PluginChoice& choice) { return choice; }
template <class Section>
PluginChoice choice_of(const Section& section) {
  return section.choice();
}

/// Turns toml++'s "Error while parsing X: what" into the word order of this project's errors.
Error syntax_error(const toml::parse_error& e, const std::string& name) {
  Error error{.code = ErrorCode::invalid_config,
              .message = std::string(e.description()),
              .where = location(e.source(), name),
              .context = {},
              .keys = {}};
  constexpr std::string_view kPrefix = "Error while parsing ";
  const std::size_t colon = error.message.find(": ");
  if (error.message.starts_with(kPrefix) && colon != std::string::npos) {
    const std::string construct = error.message.substr(kPrefix.size(), colon - kPrefix.size());
    error.message.erase(0, colon + 2);
    return std::move(error).during("parsing " + construct);
  }
  if (!error.message.empty() && error.message[0] >= 'A' && error.message[0] <= 'Z') {
    error.message[0] = static_cast<char>(error.message[0] - 'A' + 'a');
  }
  return error;
}

}  // namespace

Result<Table> parse_toml(std::string_view text, const std::string& name) {
  VANTAGE_CHECK(check_keys(text, name));
  try {
    return convert(toml::parse(text, name), name);
  } catch (const toml::parse_error& e) {
    return fail(syntax_error(e, name));
  }
}

Result<Table> with_overrides(Table table, const std::vector<std::string>& overrides) {
  for (const std::string& override_text : overrides) {
    VANTAGE_CHECK(apply_override(table, override_text));
  }
  return table;
}

Result<Table> load_toml(const std::filesystem::path& file,
                        const std::vector<std::string>& overrides) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) {
    return fail(ErrorCode::invalid_config, "expected a TOML file, found a folder",
                SourceLocation{file.string(), 0, 0});
  }
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  if (in) text << in.rdbuf();
  if (!in) {
    const int reason = errno;
    return fail(reason == ENOENT ? ErrorCode::not_found : ErrorCode::io_failure,
                std::string("cannot read the configuration: ") + std::strerror(reason),
                SourceLocation{file.string(), 0, 0});
  }
  VANTAGE_TRY(Table table, parse_toml(text.str(), file.string()));
  return with_overrides(std::move(table), overrides);
}

Result<void> MapSource::validate() const {
  if (files.empty())
    return fail_at({"files"}, "'files' is empty: expected at least one point cloud");
  return {};
}

Result<void> StoreConfig::validate() const {
  if (!views || content != StoredContent::prepared) return {};
  return fail_at({"views"},
                 "'views' are stored with points, but content = \"prepared\" stores no points");
}

Result<void> SelectorConfig::validate() const {
  if (!(lowest < highest)) {
    return fail_at({"lowest", "highest"}, "'lowest' must be below 'highest'");
  }
  if (poses && !scans) {
    return fail_at({"poses"}, "'poses' are those of 'scans', which is missing");
  }
  if (max_bytes && share) {
    return fail_at({"max_bytes", "share"},
                   "'max_bytes' and 'share' both say how much is kept; give one of them");
  }
  if (max_bytes || share || target_error) return {};
  return fail_at({"max_bytes", "share", "target_error"},
                 "a selector needs 'max_bytes', 'share' or 'target_error'");
}

Result<void> Config::validate() const {
  if (selector && store && store->content == StoredContent::points) {
    return fail_at({"selector"},
                   "[selector] chooses elements of prepared maps, but [store] content = \"points\" "
                   "stores none");
  }
  if (selector && selector->scans && !selector->poses && !(map && map->trajectory)) {
    return fail_at({"selector.scans"},
                   "'scans' need 'poses', or a [map] with the 'trajectory' of the sensor");
  }
  const bool counted = (visibility && visibility->min_views > 1) || (store && store->views);
  if (counted && viewpoints && viewpoints->min_gain > 0.0) {
    return fail_at(
        {"viewpoints.min_gain"},
        "'min_gain' leaves viewpoints out, but 'min_views' and 'views' count all of them");
  }
  if (!thinning || !store || store->content != StoredContent::prepared) return {};
  return fail_at({"thinning"},
                 "[thinning] thins the points of region maps, but [store] content = \"prepared\" "
                 "stores none of them");
}

PluginChoice Config::relocalizer_in_use() const {
  return relocalizer.value_or(
      PluginChoice{.plugin = "voxel_search", .library = {}, .params = {}, .where = {}});
}

Result<Config> parse_config(const Table& table) {
  VANTAGE_TRY(Config config, parse<Config>(table));
  config.file = table.where.file;
  config.written = table;
  for_each_plugin_section(
      config, [&](const auto& kind, auto& section) { locate_section(section, table, kind.name); });
  return config;
}

Result<Config> load_config(const std::filesystem::path& file,
                           const std::vector<std::string>& overrides) {
  VANTAGE_TRY(const Table table, load_toml(file, overrides));
  VANTAGE_TRY(Config config, parse_config(table));
  config.file = file.string();
  return config;
}

Result<Config> with_plugin_defaults(const Config& config, const PluginLoader& plugins) {
  Config effective = config;
  Result<void> filled{};
  for_each_plugin_section(effective, [&](const auto& kind, auto& section) {
    if (!filled || !section) return;
    auto params = plugins.effective_params(kind.kind, choice_of(*section));
    if (params) {
      section->params = *std::move(params);
    } else {
      filled = fail(std::move(params).error());
    }
  });
  VANTAGE_CHECK(filled);
  return effective;
}

Result<std::string> effective_config(const Config& config, const PluginLoader& plugins) {
  VANTAGE_TRY(const Config effective, with_plugin_defaults(config, plugins));
  std::string text = to_toml(to_table(effective));
  // Text that cannot be read again is of no use. Only a path may hold bytes that TOML refuses.
  if (parse_toml(text, config.file)) return text;
  return fail(
      ErrorCode::invalid_config,
      "a path is not UTF-8, so the configuration cannot be written down: rename its folder, "
      "or start the program in the folder of the configuration",
      SourceLocation{config.file, 0, 0});
}

}  // namespace vantage
