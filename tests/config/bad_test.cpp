// Every bad/NAME.toml gives exactly the error in bad/NAME.stderr. New cases: write the .toml, run
// this test with VANTAGE_BLESS=1, read what it wrote.
//
// `{plugin_dir}` stands for the folder of the built plugins, `{partitioner plugins}` for the names
// of that kind, in both files. A first line `# --print-config` runs `vantage build` with that.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdlib>

#include "support/plugins.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"

using namespace vantage;
namespace fs = std::filesystem;

namespace {

using Placeholders = std::vector<std::pair<std::string, std::string>>;

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos;
       at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

std::string filled(std::string text, const Placeholders& placeholders) {
  for (const auto& [name, value] : placeholders) text = replaced(std::move(text), name, value);
  return text;
}

/// The other way round. A list of one name would replace that name everywhere, so it needs its
/// place in the message.
std::string emptied(std::string text, const Placeholders& placeholders) {
  for (const auto& [name, value] : placeholders) {
    const std::string before = name == "{plugin_dir}" ? "" : "there are: ";
    text = replaced(std::move(text), before + value, before + name);
  }
  return text;
}

Placeholders placeholders_of_this_build() {
  Placeholders placeholders{{"{plugin_dir}", fs::canonical(VANTAGE_PLUGIN_DIR).string()}};
  for_each_kind([&](const auto& kind) {
    std::string names;
    for (const PluginFile& file : test::built_plugins().list()) {
      if (file.kind == kind.kind) names += (names.empty() ? "" : ", ") + file.name;
    }
    placeholders.emplace_back("{" + std::string(kind.name) + " plugins}", names);
  });
  return placeholders;
}

/// Runs `vantage build` on a copy of the case, in the copy's folder.
test::Finished build(const fs::path& bad, const Placeholders& placeholders) {
  const test::TemporaryFolder folder;
  const fs::path copy = folder.path() / bad.filename();
  std::vector<std::string> arguments{bad.filename().string()};
  if (fs::is_directory(bad)) {
    fs::create_directory(copy);
  } else {
    const std::string text = test::read_text(bad);
    if (text.starts_with("# --print-config\n")) arguments.emplace_back("--print-config");
    test::write_text(copy, filled(text, placeholders));
  }
  const fs::path before = fs::current_path();
  fs::current_path(folder.path());
  auto finished = test::run("vantage-build", arguments);
  fs::current_path(before);
  CHECK_MESSAGE(std::distance(fs::directory_iterator(folder.path()), {}) == 1, bad.string());
  return finished;
}

}  // namespace

TEST_CASE("every bad configuration gives exactly the error that is written beside it") {
  unsetenv("VANTAGE_PLUGIN_PATH");
  const bool bless = std::getenv("VANTAGE_BLESS") != nullptr;
  const Placeholders placeholders = placeholders_of_this_build();
  std::size_t cases = 0;
  for (const auto& entry : fs::directory_iterator(VANTAGE_SOURCE_DIR "/tests/config/bad")) {
    if (entry.path().extension() != ".toml") continue;
    CAPTURE(entry.path().string());
    ++cases;
    const auto finished = build(entry.path(), placeholders);
    CHECK(finished.exit_code == 1);
    CHECK(finished.out.empty());
    CHECK(std::count(finished.err.begin(), finished.err.end(), '\n') == 1);
    const fs::path expected = fs::path(entry.path()).replace_extension(".stderr");
    if (bless) test::write_text(expected, emptied(finished.err, placeholders));
    REQUIRE(fs::exists(expected));
    CHECK(finished.err == filled(test::read_text(expected), placeholders));
  }
  CHECK(cases >= 25);
}
