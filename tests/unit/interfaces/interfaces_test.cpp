// The list of plugin kinds, and what has to keep a list of its own beside it.
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#include "support/process.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/plugin.hpp"

using namespace vantage;
namespace fs = std::filesystem;

namespace {

const fs::path kRoot = VANTAGE_SOURCE_DIR;

std::vector<std::string> kind_names() {
  std::vector<std::string> names;
  for_each_kind([&](const auto& kind) { names.emplace_back(kind.name); });
  return names;
}

/// The words of the first line that begins so, up to the end of the list.
std::vector<std::string> words_after(const fs::path& file, const std::string& begin, char end) {
  const std::string text = test::read_text(kRoot / file);
  const std::size_t at = text.find(begin);
  REQUIRE_MESSAGE(at != std::string::npos, file.string() << " has no '" << begin << "'");
  const std::size_t from = at + begin.size();
  std::istringstream list(text.substr(from, text.find(end, from) - from));
  std::vector<std::string> words;
  for (std::string word; list >> word;) words.push_back(word);
  return words;
}

}  // namespace

TEST_CASE("kinds: enum, name, interface and factory say the same") {
  CHECK(kind_names() == std::vector<std::string>{"partitioner", "ground", "visibility", "store",
                                                 "matcher", "selector", "relocalizer"});
  static_assert(std::variant_size_v<AnyFactory> == kPluginKinds);
  for_each_kind([]<class Interface>(const Kind<Interface>& kind) {
    CHECK(kind_of<Interface>() == kind.kind);
    CHECK(std::string(to_string(kind.kind)) == kind.name);
    CHECK(with_kind(kind.kind, [](const auto& same) { return same.header; }) == kind.header);
    const AnyFactory factory = Factory<Interface>{};
    CHECK(factory.index() == static_cast<std::size_t>(kind.kind));
  });
}

TEST_CASE("kinds: each header declares its interface") {
  for_each_kind([](const auto& kind) {
    const std::string text =
        test::read_text(kRoot / "core/interfaces/include" / std::string(kind.header));
    CHECK_MESSAGE(text.find("class VANTAGE_API " + std::string(kind.interface_name) + " {") !=
                      std::string::npos,
                  kind.header);
  });
}

TEST_CASE("kinds: a configuration has a table for each") {
  const std::vector<ParameterDoc> tables = describe<Config>();
  for (const std::string& name : kind_names()) {
    CHECK_MESSAGE(std::any_of(tables.begin(), tables.end(),
                              [&](const ParameterDoc& table) { return table.key == name; }),
                  name);
  }
}

TEST_CASE("kinds: CMake, the test of the SDK and the templates know the same") {
  CHECK(words_after("core/cmake/VantageAddPlugin.cmake", "set(kinds ", ')') == kind_names());
  CHECK(words_after("core/cmake/VantageAddPlugin.cmake", "# Kinds: ", '.') ==
        std::vector<std::string>{"partitioner,", "ground,", "visibility,", "store,", "matcher,",
                                 "selector,", "relocalizer"});
  CHECK(words_after("tests/out_of_tree/run.sh", "for kind in ", ';') == kind_names());
  std::set<std::string> folders;
  for (const auto& entry : fs::directory_iterator(kRoot / "apps/plugins/templates")) {
    if (entry.is_directory()) folders.insert(entry.path().filename().string());
  }
  const auto names = kind_names();
  CHECK(folders == std::set<std::string>(names.begin(), names.end()));
}

TEST_CASE("kinds: the page for plugin authors has a row for each") {
  const std::string text = test::read_text(kRoot / "docs/plugin_author.md");
  for_each_kind([&](const auto& kind) {
    const std::string begin =
        "| `" + std::string(kind.name) + "` | `vantage::" + kind.interface_name + "`";
    const std::size_t at = text.find("\n" + begin);
    REQUIRE_MESSAGE(at != std::string::npos, begin);
    const std::string row = text.substr(at + 1, text.find('\n', at + 1) - at - 1);
    CHECK_MESSAGE(row.ends_with("| `" + std::string(kind.header) + "` |"), row);
  });
}

TEST_CASE("what a plugin sees of core stays small: 2,700 lines, 450 a file") {
  std::ptrdiff_t total = 0;
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / "core/interfaces")) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".hpp" && extension != ".cpp") continue;
    const std::string text = test::read_text(entry.path());
    const std::ptrdiff_t lines = std::count(text.begin(), text.end(), '\n');
    CHECK_MESSAGE(lines <= 450, entry.path().string() << " has " << lines);
    total += lines;
  }
  CHECK(total > 1000);  // there was something to count
  CHECK(total <= 2700);
}
