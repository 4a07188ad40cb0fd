#include "print_config.hpp"

#include <algorithm>

#include "building/input.hpp"
#include "terminal/table.hpp"

namespace vantage {
namespace {

/// The documentation of the keys of this configuration, including those of its plugins.
Result<std::vector<ParameterDoc>> documentation_of(const Config& config,
                                                   const PluginLoader& loader) {
  auto docs = describe<Config>();
  const auto add = [&](PluginKind kind, const std::optional<PluginChoice>& choice) -> Result<void> {
    if (!choice) return {};
    VANTAGE_TRY(auto params, loader.parameters(kind, *choice));
    for (ParameterDoc& section : docs) {
      if (section.key != to_string(kind)) continue;
      for (ParameterDoc& field : section.fields) {
        if (field.key == "params") field.fields = std::move(params);
      }
    }
    return {};
  };
  VANTAGE_CHECK(add(PluginKind::partitioner, config.partitioner));
  if (config.ground) VANTAGE_CHECK(add(PluginKind::ground, config.ground->choice()));
  if (config.visibility) {
    VANTAGE_CHECK(add(PluginKind::visibility, config.visibility->choice()));
  }
  if (config.store) VANTAGE_CHECK(add(PluginKind::store, config.store->choice()));
  VANTAGE_CHECK(add(PluginKind::matcher, config.matcher));
  return docs;
}

/// Leaves out what a build measures, so that the text means the same as what was written.
void leave_out_measured(Table& table, const Config& config) {
  const auto leave_out = [&](const char* section, const Table* written) {
    if (written == nullptr || written->find(building::kMeasured) != nullptr) return;
    for (Entry& entry : table.entries) {
      if (entry.key != section) continue;
      for (Entry& inner : std::get<Table>(entry.value.data).entries) {
        if (inner.key != "params") continue;
        std::erase_if(std::get<Table>(inner.value.data).entries,
                      [](const Entry& e) { return e.key == building::kMeasured; });
      }
    }
  };
  leave_out("partitioner", config.partitioner ? &config.partitioner->params : nullptr);
  leave_out("ground", config.ground ? &config.ground->params : nullptr);
  leave_out("visibility", config.visibility ? &config.visibility->params : nullptr);
}

/// As `to_toml`, with a comment for each key that is left out.
std::string commented_toml(const Table& table, const std::vector<ParameterDoc>& docs,
                           const std::string& prefix) {
  Table values;
  for (const Entry& entry : table.entries) {
    if (!std::holds_alternative<Table>(entry.value.data)) values.entries.push_back(entry);
  }
  std::string text = to_toml(values);
  for (const ParameterDoc& p : docs) {
    if (p.kind != ValueKind::table && table.find(p.key) == nullptr) {
      text += cli::one_line("# " + p.key + " is left out: " + p.doc) + "\n";
    }
  }
  for (const Entry& entry : table.entries) {
    const auto* section = std::get_if<Table>(&entry.value.data);
    if (section == nullptr) continue;
    const auto doc = std::find_if(docs.begin(), docs.end(),
                                  [&](const ParameterDoc& p) { return p.key == entry.key; });
    const std::string name = prefix + entry.key;
    const bool documented = doc != docs.end() && !doc->fields.empty();
    text += "\n[" + name + "]\n" +
            (documented ? commented_toml(*section, doc->fields, name + ".")
                        : to_toml(*section, name + "."));
  }
  return text;
}

}  // namespace

Result<std::string> printed_config(Config config, const PluginLoader& loader) {
  config.viewpoints = config.viewpoints.value_or(ViewpointParams{});
  config.localizer = config.localizer.value_or(LocalizerParams{});
  VANTAGE_TRY(const std::string text, effective_config(config, loader));
  VANTAGE_TRY(Table table, parse_toml(text, config.file));
  leave_out_measured(table, config);
  VANTAGE_TRY(const auto docs, documentation_of(config, loader));
  return commented_toml(table, docs, "");
}

}  // namespace vantage
