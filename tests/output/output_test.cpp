// What programs write to a terminal, and what to anything else: colours, width, --quiet, --json.
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "support/process.hpp"
#include "support/small_map.hpp"
#include "support/terminal.hpp"
#include "support/text.hpp"

namespace fs = std::filesystem;
using namespace vantage;

namespace {

using test::has;
using test::on_terminal;

const std::map<std::string, std::string> kXterm{{"TERM", "xterm-256color"}};

constexpr const char* kRed = "\033[1;31merror:\033[0m ";

/// A square of ground, its configuration, and a drive of simulated scans.
struct Ground : test::SmallMap {
  Ground() : SmallMap({.store = "params = { root = \"bundle\", overwrite = true }\n"}) {}
};

std::size_t longest_line(const std::string& text) {
  std::size_t longest = 0;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) longest = std::max(longest, line.size());
  return longest;
}

}  // namespace

// A run of its own in ctest, which skips it where there is no terminal.
TEST_SUITE_BEGIN("terminal");

TEST_CASE("errors are red on a terminal, and nowhere else") {
  if (!test::terminals_exist()) return;
  for (const std::string program :
       {"vantage", "vantage-build", "vantage-compare", "vantage-completion", "vantage-conformance",
        "vantage-evaluate", "vantage-localize", "vantage-plugins", "vantage-simulate",
#ifdef VANTAGE_VIEW
        "vantage-view",
#endif
        "vantage-tile"}) {
    CAPTURE(program);
    const std::vector<std::string> wrong{"no_such_thing", "no_such_thing", "no_such_thing"};
    const std::string text = on_terminal(program, wrong, 200, kXterm);
    CHECK_MESSAGE(has(text, kRed), text);
    CHECK_FALSE(has(on_terminal(program, wrong, 200, {{"TERM", "dumb"}}), "\033"));
    CHECK_FALSE(
        has(on_terminal(program, wrong, 200, {{"TERM", "xterm"}, {"NO_COLOR", "1"}}), "\033"));
    const auto piped = test::run(program, wrong);
    CHECK_FALSE(has(piped.out + piped.err, "\033"));
    CHECK(has(piped.err, "error: "));
    CHECK(std::count(piped.err.begin(), piped.err.end(), '\n') == 1);
    CHECK(piped.exit_code != 0);
  }
}

TEST_CASE("--color never holds on a terminal") {
  if (!test::terminals_exist()) return;
  CHECK_FALSE(
      has(on_terminal("vantage-build", {"none.toml", "--color", "never"}, 80, kXterm), "\033"));
}

TEST_CASE("a table is bold above a dim rule on a terminal, as wide as that, and plain elsewhere") {
  if (!test::terminals_exist()) return;
  const Ground ground;
  const std::string wide = on_terminal("vantage-build", {ground.config, "-q"}, 200, kXterm);
  CHECK_MESSAGE(has(wide, "\033[1m               regions  points (mean)"), wide);
  CHECK(has(wide, "\033[2m-----"));
  const std::string narrow =
      on_terminal("vantage-build", {ground.config, "-q", "--color", "never"}, 50, kXterm);
  const std::string tables = narrow.substr(0, narrow.find("ground points"));
  CHECK_MESSAGE(longest_line(tables) <= 50, narrow);
  CHECK(has(tables, "size [MB]"));
  const auto piped = test::run("vantage-build", {ground.config, "-q"});
  CHECK(piped.exit_code == 0);
  CHECK(piped.err.empty());
  CHECK(has(piped.out, "reduction [%]  size [MB]\n"));
  CHECK_FALSE(has(piped.out, "\033"));
}

TEST_CASE("progress draws over itself on a terminal only, and never wraps") {
  if (!test::terminals_exist()) return;
  const Ground ground;
  const std::string drawn = on_terminal("vantage-build", {ground.config}, 30, kXterm);
  CHECK(has(drawn, "\033[K"));
  const std::size_t first = drawn.find('\n') + 1;  // below "cutting the map"
  std::istringstream bars(drawn.substr(first, drawn.rfind("\033[K") - first));
  for (std::string bar; std::getline(bars, bar, '\033');) CHECK(bar.size() <= 31);
  CHECK_FALSE(has(on_terminal("vantage-build", {ground.config}, 30, {{"TERM", "dumb"}}), "\033"));
}

TEST_SUITE_END();

TEST_CASE("--color holds for errors too, before and after a job") {
  const auto always = test::run("vantage-build", {"none.toml", "--color", "always"});
  CHECK(has(always.err, kRed));
  CHECK(has(test::run("vantage-plugins", {"describe", "ntd", "--color", "always"}).err, kRed));
  CHECK(test::run("vantage-build", {"none.toml", "--color", "blue"}).exit_code == 2);
}

TEST_CASE("--json is JSON and nothing else on stdout, --quiet is silence on stderr") {
  const Ground ground;
  const std::string plugin = std::string(VANTAGE_PLUGIN_DIR) + "/vantage_visibility_keep_all.so";
  const std::string params =
      std::string(VANTAGE_SOURCE_DIR) + "/tests/conformance/params/visibility_keep_all.toml";
  test::write_text(ground.folder.path() / "w.toml", R"(schema = 1
seed = 1
[campus]
size_x = 84.0
size_y = 84.0
street_spacing = 40.0
[map]
point_spacing = 1.0
[drive]
scan_every = 100
)");
  const std::vector<std::vector<std::string>> commands{
      {"build", ground.config, "--quiet"},
      {"plugins", "list"},
      {"plugins", "describe", "ndt"},
      {"plugins", "check", plugin, "--quiet"},
      {"conformance", plugin, params, "--clause", "C1", "--quiet"},
      {"simulate", (ground.folder.path() / "w.toml").string(), "--out",
       (ground.folder.path() / "world").string(), "--quiet"}};
  for (auto command : commands) {
    CAPTURE(command[0]);
    command.insert(command.end(), {"--json", "--color", "always"});
    const auto done = test::run("vantage", command);
    CHECK_MESSAGE(done.exit_code == 0, done.err);
    CHECK(done.err.empty());
    CHECK_MESSAGE(nlohmann::json::accept(done.out), done.out);
  }
}
