#include "text.hpp"

#include <fmt/format.h>

#include <cmath>

#include "terminal/table.hpp"
#include "vantage/engine/toml.hpp"

namespace vantage::documentation {
namespace {

std::string joined(const std::vector<std::string>& words, const std::string& separator) {
  std::string text;
  for (const std::string& word : words) {
    if (word.empty()) continue;
    text += (text.empty() ? "" : separator) + word;
  }
  return text;
}

std::string default_of(const ParameterDoc& p) {
  return p.default_value ? to_toml(*p.default_value) : "";
}

}  // namespace

std::string allowed_values(const ParameterDoc& p) {
  if (!p.choices.empty()) return joined(p.choices, ", ");
  Range range = p.range;
  if (p.kind == ValueKind::integer && range.max >= 0x7fffffff) range.max = any_number.max;
  if (p.kind == ValueKind::integer && range.min <= -0x80000000LL) range.min = any_number.min;
  return range.to_string();
}

std::string source_of(const ParameterDoc& p) { return joined({p.equation, p.citation}, "; "); }

std::string description(const PluginInfo& plugin) {
  std::string text = fmt::format("{} {}: {}\n{}\n", to_string(plugin.kind), plugin.name,
                                 plugin.summary, plugin.path.string());
  if (plugin.parameters.empty()) return text + "\nno parameters\n";
  for (const ParameterDoc& p : plugin.parameters) {
    text += fmt::format("\n  {}: {}{}\n      {}\n", p.key, p.type,
                        p.unit.empty() ? "" : " [" + p.unit + "]", cli::one_line(p.doc));
    text += "      default: " +
            (p.required        ? "none, required"
             : p.default_value ? default_of(p)
                               : "none, may be left out") +
            "\n";
    const auto line = [&](const char* name, const std::string& value) {
      if (!value.empty()) text += fmt::format("      {}: {}\n", name, value);
    };
    line(p.choices.empty() ? "range" : "choices", allowed_values(p));
    line("equation", p.equation);
    line("citation", p.citation);
  }
  return text;
}

namespace {

constexpr std::string_view kFillIn = "\"FILL IN\"";

/// A value of a type that the parameter refuses.
std::string placeholder(const ParameterDoc& p) {
  const bool text = !p.array && (p.kind == ValueKind::string || p.kind == ValueKind::path);
  return text ? fmt::format("[{}]", kFillIn) : std::string(kFillIn);
}

/// "# number, m, > 0: grid width L (Eq. 2, ...)".
std::string comment(const ParameterDoc& p) {
  const std::string source = source_of(p);
  return cli::one_line(fmt::format("# {}: {}{}", joined({p.type, p.unit, allowed_values(p)}, ", "),
                                   p.doc, source.empty() ? "" : " (" + source + ")")) +
         "\n";
}

}  // namespace

std::string keys_of_section(PluginKind kind) {
  if (kind != PluginKind::selector) return "";
  return "max_bytes = 20_000  # of each region's prepared map; or the share of its elements: share "
         "= 0.2\n";
}

std::string toml_template(const PluginInfo& plugin) {
  const std::string kind = to_string(plugin.kind);
  std::string text = fmt::format("# {}\n[{}]\nplugin = {}\n{}", cli::one_line(plugin.summary), kind,
                                 to_toml(Value{plugin.name, {}}), keys_of_section(plugin.kind));
  if (plugin.parameters.empty()) return text;
  text += fmt::format("\n[{}.params]\n", kind);
  for (const ParameterDoc& p : plugin.parameters) {
    text += comment(p);
    if (p.required) {
      text += fmt::format("{} = {}  # required\n", p.key, placeholder(p));
    } else if (p.default_value) {
      text += fmt::format("# {} = {}\n", p.key, default_of(p));
    } else {
      text += fmt::format("# {} = {}  # may be left out\n", p.key, placeholder(p));
    }
  }
  return text;
}

namespace {

/// Text as one cell of a Markdown table.
std::string cell(const std::string& text) {
  std::string escaped;
  for (const char c : cli::one_line(text)) {
    if (std::string_view("\\|*<>[]`_").find(c) != std::string_view::npos) escaped += '\\';
    escaped += c;
  }
  return escaped;
}

/// Text as code in a table cell; only the vertical bar needs care there.
std::string code(const std::string& text) {
  if (text.empty()) return "";
  std::string escaped;
  for (const char c : cli::one_line(text)) {
    if (c == '|') escaped += '\\';
    escaped += c;
  }
  // A fence longer than any run of backticks in the text.
  return escaped.find('`') == std::string::npos ? "`" + escaped + "`" : "`` " + escaped + " ``";
}

std::string row(const std::vector<std::string>& cells) {
  std::string text = "|";
  for (const std::string& content : cells) text += content.empty() ? " |" : " " + content + " |";
  return text + "\n";
}

std::string parameter_table(const std::vector<ParameterDoc>& parameters) {
  std::string text = "\n" +
                     row({"key", "type", "unit", "default", "allowed", "meaning", "source"}) +
                     "|---|---|---|---|---|---|---|\n";
  for (const ParameterDoc& p : parameters) {
    std::vector<std::string> choices;
    for (const std::string& choice : p.choices) choices.push_back(code(choice));
    text +=
        row({code(p.key), cell(p.type), cell(p.unit), p.required ? "required" : code(default_of(p)),
             choices.empty() ? cell(allowed_values(p)) : joined(choices, ", "), cell(p.doc),
             cell(source_of(p))});
  }
  return text;
}

/// Makes a sentence from a doc, which is not one.
std::string sentence(const std::string& doc, const std::string& source = {}) {
  std::string text = cell(doc) + (source.empty() ? "" : " (" + cell(source) + ")") + ".";
  if (text[0] >= 'a' && text[0] <= 'z') text[0] = static_cast<char>(text[0] - 'a' + 'A');
  return text;
}

/// The tables inside a table, each under its own heading.
std::string nested_tables(const std::vector<ParameterDoc>& fields, const std::string& prefix) {
  std::string text;
  for (const ParameterDoc& p : fields) {
    if (p.fields.empty()) continue;
    const std::string name = prefix + p.key;
    text += fmt::format("\n### [{}]\n\n{}\n", name, sentence(p.doc, source_of(p)));
    text += parameter_table(p.fields) + nested_tables(p.fields, name + ".");
  }
  return text;
}

}  // namespace

std::string reference(const std::vector<ParameterDoc>& config,
                      const std::vector<PluginInfo>& plugins) {
  std::string text =
      "# Configuration reference\n"
      "\n"
      "Generated by `./dev docs` (`vantage plugins reference`) from the schemas that the programs "
      "check. Do not edit it by hand.\n"
      "\n"
      "If a default is empty, the key may be left out; its meaning says what happens then. "
      "Equations are those of Yagi et al.,\n"
      "*Observable Point Cloud Maps for Wide-Area Self-Localization*, 2026. A relative path refers "
      "to the folder of the file\n"
      "that contains it.\n"
      "\n"
      "## The file\n";
  text += parameter_table(config) + nested_tables(config, "");
  const PluginInfo* last = nullptr;
  for (const PluginInfo& plugin : plugins) {
    if (last == nullptr || last->kind != plugin.kind) {
      text += fmt::format("\n## Plugins: {}\n", to_string(plugin.kind));
    }
    text += fmt::format("\n### {}\n\n{}\n", code(plugin.name), sentence(plugin.summary));
    text += plugin.parameters.empty()
                ? "\nNo parameters.\n"
                : parameter_table(plugin.parameters) +
                      nested_tables(plugin.parameters,
                                    std::string(to_string(plugin.kind)) + ".params.");
    last = &plugin;
  }
  return text;
}

}  // namespace vantage::documentation
