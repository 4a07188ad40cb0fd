#include "bundle/built_as_asked.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bundle/content_config.hpp"
#include "vantage/engine/toml.hpp"

namespace vantage {
namespace {

/// A key that a configuration and a bundle disagree on; values as TOML.
struct Difference {
  std::string key, asked, built;  // built: empty if the bundle was built without it
  SourceLocation where;
};

/// 1 and 1.0 are the same number.
bool equal(const Value& a, const Value& b) {
  const auto number = [](const Value& value) -> std::optional<double> {
    if (const auto* x = std::get_if<std::int64_t>(&value.data)) return static_cast<double>(*x);
    if (const auto* x = std::get_if<double>(&value.data)) return *x;
    return std::nullopt;
  };
  if (number(a) || number(b)) return number(a) == number(b);
  const auto *as = std::get_if<Array>(&a.data), *bs = std::get_if<Array>(&b.data);
  if (as != nullptr && bs != nullptr) {
    return std::equal(as->begin(), as->end(), bs->begin(), bs->end(), equal);
  }
  return to_toml(a) == to_toml(b);
}

bool holds_text(const Value& value) {
  const auto* array = std::get_if<Array>(&value.data);
  return array == nullptr ? std::holds_alternative<std::string>(value.data)
                          : std::any_of(array->begin(), array->end(), holds_text);
}

const Table* table_in(const Table* table, std::string_view key) {
  const Value* value = table == nullptr ? nullptr : table->find(key);
  return value == nullptr ? nullptr : std::get_if<Table>(&value->data);
}

/// Says which keys a configuration sets, and where in its file.
struct Written {
  const Table* table;  // nullptr if nothing was written here
  SourceLocation file;

  [[nodiscard]] bool has(std::string_view key) const {
    return table != nullptr && table->find(key) != nullptr;
  }
  [[nodiscard]] SourceLocation where(std::string_view key) const {
    const Value* value = table == nullptr ? nullptr : table->find(key);
    return value == nullptr || value->where.file.empty() ? file : value->where;
  }
  [[nodiscard]] Written in(std::string_view key) const { return {table_in(table, key), file}; }
};

/// Whether a table has each of these keys with an equal value.
bool has_all(const Table* table, const Table& keys) {
  return std::all_of(keys.entries.begin(), keys.entries.end(), [&](const Entry& entry) {
    const Value* value = table == nullptr ? nullptr : table->find(entry.key);
    return value != nullptr && equal(entry.value, *value);
  });
}

/// Compares the keys of a section and of the tables in it.
/// @param docs  of its keys; nullptr for the parameters of a plugin that is not installed
void compare(const std::string& prefix, const Table& asked, const Written& written,
             const Table* built, const std::vector<ParameterDoc>* docs,
             std::vector<Difference>& found) {
  for (const Entry& entry : asked.entries) {
    if (!written.has(entry.key)) continue;
    const ParameterDoc* doc = nullptr;
    if (docs != nullptr) {
      const auto known = std::find_if(docs->begin(), docs->end(),
                                      [&](const ParameterDoc& d) { return d.key == entry.key; });
      if (known != docs->end()) doc = &*known;
    }
    // Paths may differ, because files move. Without `doc`, any text may be a path.
    if (doc != nullptr ? doc->kind == ValueKind::path : holds_text(entry.value)) continue;
    if (const auto* section = std::get_if<Table>(&entry.value.data)) {
      compare(prefix + entry.key + ".", *section, written.in(entry.key), table_in(built, entry.key),
              doc != nullptr && !doc->fields.empty() ? &doc->fields : nullptr, found);
      continue;
    }
    const Value* value = built == nullptr ? nullptr : built->find(entry.key);
    if (value == nullptr && doc != nullptr && doc->default_value) value = &*doc->default_value;
    if (value != nullptr && equal(entry.value, *value)) continue;
    found.push_back({prefix + entry.key, to_toml(entry.value),
                     value == nullptr ? "" : to_toml(*value), written.where(entry.key)});
  }
}

std::string text_in(const Table* table, std::string_view key) {
  const Value* value = table == nullptr ? nullptr : table->find(key);
  const auto* text = value == nullptr ? nullptr : std::get_if<std::string>(&value->data);
  return text == nullptr ? "" : *text;
}

/// A section that names a plugin, with what the plugin says of its parameters.
std::vector<ParameterDoc> docs_with_params(std::vector<ParameterDoc> docs,
                                           Result<std::vector<ParameterDoc>> params) {
  for (ParameterDoc& doc : docs) {
    if (doc.key == "params" && params) doc.fields = *params;
  }
  return docs;
}

/// [store]: what is kept of each region is in the index.
void compare_content(const StoreConfig& asked, const Written& written, const BundleSummary& bundle,
                     std::vector<Difference>& found) {
  const bool points = bundle.sum.points > 0, prepared = bundle.sum.elements > 0;
  const bool views = bundle.sum.max_views > 0;
  if (!points && !prepared) return;
  Table built;
  const char* content = points && prepared ? "both" : points ? "points" : "prepared";
  built.entries.push_back({"content", {std::string(content), {}}, {}});
  built.entries.push_back({"views", {views, {}}, {}});
  Table kept = to_table(asked);
  std::erase_if(kept.entries,
                [](const Entry& entry) { return entry.key != "content" && entry.key != "views"; });
  const auto docs = describe<StoreConfig>();
  compare("store.", kept, written, &built, &docs, found);
}

std::string message_of(const std::vector<Difference>& found) {
  const Difference& first = found.front();
  std::string message = "'" + first.key + "' is " + first.asked + ", and the bundle was built " +
                        (first.built.empty() ? "without it" : "with " + first.built) +
                        ": build the bundle again, or change the key to match it";
  for (std::size_t i = 1; i < found.size(); ++i) {
    message += (i == 1 ? "; also different: '" : ", '") + found[i].key + "'";
  }
  return message;
}

}  // namespace

Result<void> check_built_as_asked(const Config& asked, const BundleSummary& bundle,
                                  const PluginLoader& plugins) {
  const auto built = parse_toml(bundle.config, "");
  if (!built || built->find("schema") == nullptr) return {};
  const Table content = to_table(content_config(asked));
  // A program asks for all that its configuration holds.
  const bool from_file = !asked.written.entries.empty();
  const Table held = from_file ? Table{} : to_table(asked);
  const Written written{from_file ? &asked.written : &held, {asked.file, 0, 0}};

  std::vector<Difference> found;
  for (const ParameterDoc& section : describe<Config>()) {
    // A map's file moves, and a plugin judges itself what was made for it.
    if (section.key == "map" || section.key == "matcher" || section.key == "relocalizer") continue;
    const Table* here = table_in(&content, section.key);
    const Table* there = table_in(&*built, section.key);
    if (here == nullptr || !written.has(section.key)) continue;
    // Viewpoints that need no ground: `viewpoints.source` tells.
    if (section.key == "ground" && there == nullptr) continue;
    const Written inside = written.in(section.key);
    const std::string prefix = section.key + ".";
    const std::string plugin = text_in(here, "plugin"), made_by = text_in(there, "plugin");
    if (plugin != made_by) {
      found.push_back(
          {prefix + "plugin", '"' + plugin + '"', '"' + made_by + '"', inside.where("plugin")});
      continue;
    }
    std::vector<ParameterDoc> docs = section.fields;
    // A plugin is loaded only if something is left that its documentation must explain.
    const Table* params = table_in(here, "params");
    const bool same_params = params == nullptr || has_all(table_in(there, "params"), *params);
    const auto add = [&](PluginKind kind, const std::optional<PluginChoice>& choice) {
      if (choice && !same_params && section.key == to_string(kind)) {
        docs = docs_with_params(std::move(docs), plugins.parameters(kind, *choice));
      }
    };
    add(PluginKind::partitioner, asked.partitioner);
    add(PluginKind::ground, asked.ground ? std::optional(asked.ground->choice()) : std::nullopt);
    add(PluginKind::visibility,
        asked.visibility ? std::optional(asked.visibility->choice()) : std::nullopt);
    compare(prefix, *here, inside, there, &docs, found);
  }
  // The [store] of a program always has a content, asked for or not.
  if (asked.store && from_file && written.has("store")) {
    compare_content(*asked.store, written.in("store"), bundle, found);
  }
  if (found.empty()) return {};
  return fail(Error{.code = ErrorCode::invalid_config,
                    .message = message_of(found),
                    .where = found.front().where,
                    .context = {}});
}

Result<void> check_prepared_for(const Bundle& bundle, const ScanMatcher& matcher) {
  const RegionDirectory& directory = *bundle.directory();
  if (directory.summary().sum.elements == 0) return {};
  for (std::uint32_t r = 0; r < directory.summary().regions; ++r) {
    VANTAGE_TRY(const DirectoryEntry entry, directory.entry(RegionId{r}));
    if (entry.summary.elements == 0) continue;
    const auto map = bundle.get(RegionId{r});
    if (!map || map->prepared.bytes.empty()) return {};  // told where the region is needed
    const auto target = matcher.restore(map->prepared.bytes);
    if (target || target.error().code == ErrorCode::too_few_matches) return {};
    const auto& built = bundle.built_with();
    const std::string expected = built && built->matcher ? "'" + built->matcher->plugin + "'"
                                                         : std::string("another matcher");
    return fail(Error{.code = ErrorCode::invalid_config,
                      .message = "the bundle holds maps prepared for " + expected +
                                 ", which this matcher cannot use: " + target.error().message +
                                 "; expected the matcher that the bundle was built with, or a "
                                 "bundle with store.content = \"points\"",
                      .where = SourceLocation{bundle.name(), 0, 0},
                      .context = {"opening the bundle"}});
  }
  return {};
}

}  // namespace vantage
