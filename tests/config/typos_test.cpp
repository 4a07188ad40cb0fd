// Every key and table name of every shipped configuration, misspelt in every plain way: the error
// must come from that key, at its place, and name the word that was meant.
#include <doctest/doctest.h>

#include <cctype>
#include <set>

#include "live/live_params.hpp"
#include "shipped.hpp"
#include "simulate/params.hpp"
#include "support/plugins.hpp"
#include "support/process.hpp"
#include "vantage/engine/config.hpp"

using namespace vantage;

namespace {

/// A key in a text: at an offset, and where an error about it must point.
struct Key {
  std::size_t offset;
  std::string name;
  SourceLocation where;
};

/// Columns count characters, offsets bytes.
std::size_t offset_of(const std::string& text, const SourceLocation& where) {
  std::size_t offset = 0;
  for (std::uint32_t line = 1; line < where.line; ++line) offset = text.find('\n', offset) + 1;
  for (std::uint32_t column = 1; column < where.column; ++column) {
    do ++offset;
    while ((static_cast<unsigned char>(text[offset]) & 0xC0U) == 0x80U);
  }
  return offset;
}

void add_keys(const Table& table, const std::string& text, std::vector<Key>& keys);

void add_keys(const Value& value, const std::string& text, std::vector<Key>& keys) {
  if (const auto* table = std::get_if<Table>(&value.data)) add_keys(*table, text, keys);
  if (const auto* array = std::get_if<Array>(&value.data)) {
    for (const Value& element : *array) add_keys(element, text, keys);
  }
}

void add_keys(const Table& table, const std::string& text, std::vector<Key>& keys) {
  for (const Entry& entry : table.entries) {
    keys.push_back({offset_of(text, entry.where), entry.key, entry.where});
    add_keys(entry.value, text, keys);
  }
}

/// The table remembers one place a key; a name that several headers hold ([a], [a.b]) is found in
/// the others here.
void add_names_in_headers(const std::string& file, const std::string& text,
                          std::vector<Key>& keys) {
  std::set<std::size_t> known;
  for (const Key& key : keys) known.insert(key.offset);
  std::uint32_t line = 1;
  for (std::size_t begin = 0; begin < text.size(); ++line) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::size_t close = std::min(text.find(']', begin), end);
    std::size_t at = text[begin] == '[' ? begin + 1 : close;
    while (at < close) {
      const std::size_t stop = std::min(text.find('.', at), close);
      if (!known.contains(at)) {
        keys.push_back({at,
                        text.substr(at, stop - at),
                        {file, line, static_cast<std::uint32_t>(at - begin + 1)}});
      }
      at = stop + 1;
    }
    begin = end + 1;
  }
}

/// Every word that one slip makes of this one, at every letter. A slip that changes nothing (equal
/// neighbours swapped, a digit's case) is no slip, and a key of one letter cannot lose it.
std::set<std::string> slips(const std::string& word) {
  std::set<std::string> all;
  for (std::size_t i = 0; i < word.size(); ++i) {
    std::string dropped = word, doubled = word, swapped = word, replaced = word, cased = word;
    all.insert(dropped.erase(i, 1));
    all.insert(doubled.insert(i, 1, word[i]));
    if (i + 1 < word.size()) std::swap(swapped[i], swapped[i + 1]);
    all.insert(swapped);
    replaced[i] = word[i] == 'q' ? 'z' : 'q';  // no key is another one with a letter turned to q
    all.insert(replaced);
    cased[i] = static_cast<char>(std::toupper(static_cast<unsigned char>(word[i])));
    all.insert(cased);
  }
  std::string capitals;
  for (const char c : word) {
    capitals += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  }
  all.insert(capitals);
  all.erase(word);
  all.erase("");
  return all;
}

using Load = Result<void> (*)(const std::string& text, const std::string& name);

/// As `vantage build` and `localize` check it, the plugins' params included.
Result<void> load_as_config(const std::string& text, const std::string& name) {
  VANTAGE_TRY(const Table table, parse_toml(text, name));
  VANTAGE_TRY(const Config config, parse_config(table));
  VANTAGE_CHECK(effective_config(config, test::built_plugins()));
  VANTAGE_CHECK(parse<live::LiveParams>(config.live.value_or(Table{})));  // `vantage live` does
  return {};
}

/// As `vantage simulate` checks it.
Result<void> load_as_world(const std::string& text, const std::string& name) {
  VANTAGE_TRY(const Table table, parse_toml(text, name));
  VANTAGE_CHECK(simulation::parse_world(table));
  return {};
}

struct Tally {
  std::size_t slips = 0, ambiguous = 0;
};

/// The words in 'quotes' of "; did you mean 'a', 'b' or 'c'?".
std::set<std::string> suggestions(const std::string& message) {
  std::set<std::string> words;
  std::size_t at = message.find("; did you mean '");
  while (at != std::string::npos) {
    const std::size_t open = message.find('\'', at);
    if (open == std::string::npos) break;
    const std::size_t close = message.find('\'', open + 1);
    words.insert(message.substr(open + 1, close - open - 1));
    at = close + 1;
  }
  return words;
}

/// No slip may be silently skipped: a mutation that is another valid key would load, or be a
/// duplicate, and fail here. Where the same slip could have been made of another key that is not
/// written (d1, d2 and d3 with the digit lost), nobody can tell which was meant: then, and only
/// then, the error may name others beside the original.
void check_slip(const std::string& text, const Key& key, const std::string& slip, Load load,
                Tally& tally) {
  ++tally.slips;
  std::string mutated = text;
  mutated.replace(key.offset, key.name.size(), slip);
  const auto loaded = load(mutated, key.where.file);
  REQUIRE_MESSAGE(!loaded.has_value(), "'" << slip << "' for '" << key.name << "' is accepted");
  const Error& error = loaded.error();
  CAPTURE(to_string(error));
  CAPTURE(key.name);
  CHECK(error.code == ErrorCode::invalid_config);
  REQUIRE(error.where);
  CHECK(*error.where == key.where);
  CHECK(error.message.starts_with("unknown key '" + slip + "'"));
  const std::set<std::string> meant = suggestions(error.message);
  CHECK(meant.contains(key.name));
  for (const std::string& word : meant) {
    CHECK_MESSAGE((word == key.name || slips(word).contains(slip)), word);
  }
  if (meant.size() > 1) {
    ++tally.ambiguous;
  } else {
    CHECK(error.message.ends_with("; did you mean '" + key.name + "'?"));
  }
}

}  // namespace

TEST_CASE("a slip in any key of any shipped configuration is reported at that key, and named") {
  const auto files = test::shipped_configs();
  REQUIRE(files.size() >= 11);
  Tally tally;
  for (const auto& path : files) {
    const std::string name = path.string();
    CAPTURE(name);
    const std::string text = test::read_text(path);
    const bool is_config = load_as_config(text, name).has_value();
    const auto as_world = load_as_world(text, name);
    REQUIRE_MESSAGE((is_config || as_world), "neither a configuration nor a world file");

    const auto table = parse_toml(text, name);
    REQUIRE(table);
    std::vector<Key> keys;
    add_keys(*table, text, keys);
    add_names_in_headers(name, text, keys);
    REQUIRE(keys.size() >= 5);
    for (const Key& key : keys) {
      REQUIRE_MESSAGE(text.substr(key.offset, key.name.size()) == key.name, key.name);
      for (const std::string& slip : slips(key.name)) {
        check_slip(text, key, slip, is_config ? load_as_config : load_as_world, tally);
      }
    }
  }
  MESSAGE(tally.slips << " slips, " << tally.ambiguous << " of them ambiguous");
  CHECK(tally.slips > 1000);
}

TEST_CASE("names in dotted headers are found and their slips reported") {
  const std::string text =
      "schema = 1\n[partitioner]\nplugin = \"uniform_grid\"\n# [partitionr.params]\n"
      "[partitioner.params]\ncell_width = 20.0\n";
  const auto table = parse_toml(text, "c.toml");
  REQUIRE(table);
  std::vector<Key> keys;
  add_keys(*table, text, keys);
  add_names_in_headers("c.toml", text, keys);
  CHECK(keys.size() == 6);  // schema, partitioner twice, plugin, params, cell_width
  Tally tally;
  for (const Key& key : keys) {
    for (const std::string& slip : slips(key.name)) {
      check_slip(text, key, slip, load_as_config, tally);
    }
  }
  CHECK(tally.ambiguous == 0);
}

TEST_CASE("a slip that could be of several keys names all that are not written") {
  const auto message = [](const std::string& params) {
    const auto loaded = load_as_config(
        "schema = 1\n[matcher]\nplugin = \"ndt\"\nparams = { " + params + " }\n", "c");
    REQUIRE_FALSE(loaded.has_value());
    return loaded.error().message;
  };
  CHECK(message("d = 1.0") == "unknown key 'd'; did you mean 'd1', 'd2' or 'd3'?");
  CHECK(message("d1 = 1.0, d2 = 1.0, d = 1.0") == "unknown key 'd'; did you mean 'd3'?");
}
