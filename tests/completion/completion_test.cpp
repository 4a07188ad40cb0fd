// What bash and zsh offer after `vantage ...`, by the scripts that `vantage completion` prints.
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <sstream>

#include "support/process.hpp"
#include "support/real_data.hpp"
#include "support/terminal.hpp"

namespace fs = std::filesystem;
using namespace vantage;

namespace {

using Words = std::set<std::string>;

std::string vantage_program() { return (fs::path(VANTAGE_PROGRAM_DIR) / "vantage").string(); }

Words lines(const std::string& text) {
  Words words;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    if (!line.empty()) words.insert(line);
  }
  return words;
}

/// The script, and what is around it in a shell that has no completion running.
class Shell {
 public:
  explicit Shell(const std::string& name) : program_(name == "bash" ? VANTAGE_BASH : VANTAGE_ZSH) {
    const auto script = test::run("vantage", {"completion", name});
    REQUIRE_MESSAGE(script.exit_code == 0, script.err);
    test::write_text(script_, script.out);
    const auto parsed = test::run(program_, {"-n", script_});
    CHECK_MESSAGE(parsed.exit_code == 0, parsed.err);
    frame_ = name == "bash" ? R"(source "$1"; shift
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _vantage; printf '%s\n' "${COMPREPLY[@]}")"
                            : R"(compdef() { : }; source "$1"; shift
# What the completion system would do with it, as lines that begin with the word typed.
offer() { local o; for o in "$@"; do [[ $o == "$PREFIX"* ]] && print -r -- "$o"; done }
compadd() { shift; offer "$@" }
compset() { PREFIX=${PREFIX#${~2}}; }
_describe() { [[ $1 == -o ]] && shift; local -a all=("${(@P)2}"); offer "${(@)all%%:*}" }
_files() { if [[ $1 == -/ ]]; then offer *(N/); else offer *(N); fi }
_message() { : }
words=("$@"); CURRENT=$#; PREFIX=${words[CURRENT]}; _vantage)";
  }

  /// What is offered for the last word, in a folder with `a file.toml`, `map.pcd` and `maps`.
  [[nodiscard]] Words offered(std::vector<std::string> words) const {
    const std::string enter = "cd '" + folder_.path().string() + "' || exit; ";
    std::vector<std::string> arguments{"-c", enter + frame_, "shell", script_, vantage_program()};
    arguments.insert(arguments.end(), words.begin(), words.end());
    const auto done = test::run(program_, arguments);
    CHECK_MESSAGE(done.err.empty(), done.err);
    return lines(done.out);
  }

 private:
  struct Folder : test::TemporaryFolder {
    Folder() {
      test::write_text(path() / "a file.toml", "");
      test::write_text(path() / "map.pcd", "");
      fs::create_directory(path() / "maps");
    }
  };
  Folder folder_;
  test::TemporaryFolder script_folder_;
  std::string program_, script_ = (script_folder_.path() / "script").string(), frame_;
};

bool includes(const Words& all, const Words& some) {
  return std::includes(all.begin(), all.end(), some.begin(), some.end());
}

/// The viewer is left out where there is no Open3D.
bool has_view() {
  static const bool has = std::filesystem::exists(VANTAGE_PROGRAM_DIR "/vantage-view");
  if (!has) MESSAGE("SKIPPED: the options of vantage-view, which this system's build leaves out");
  return has;
}

void check_offers(const Shell& shell) {
  {  // jobs
    CHECK(includes(shell.offered({""}), {"build", "evaluate", "plugins", "completion"}));
    CHECK(shell.offered({"bu"}) == Words{"build"});
    CHECK(shell.offered({"--v"}) == Words{"--version"});
  }
  {  // options of a job, asked of its program
    CHECK(includes(shell.offered({"build", "-"}), {"--set", "--plugin-dir", "--jobs", "-j"}));
    CHECK(shell.offered({"build", "--pri"}) == Words{"--print-config"});
    CHECK(shell.offered({"simulate", "w.toml", "--over"}) == Words{"--overwrite"});
    CHECK(shell.offered({"tile", "m.las", "--t"}) == Words{"--tile-size"});
  }
  {  // jobs of a job, and their options
    CHECK(shell.offered({"plugins", "de"}) == Words{"describe"});
    CHECK(shell.offered({"plugins", "describe", "--t"}) == Words{"--toml"});
    CHECK(shell.offered({"plugins", "list", "--t"}).empty());
  }
  {  // choices
    if (has_view()) {
      CHECK(includes(shell.offered({""}), {"view"}));
      CHECK(shell.offered({"view", "--color", ""}) ==
            Words{"contribution", "height", "localizability", "region", "views"});
      CHECK(shell.offered({"view", "b", "--color", "v"}) == Words{"views"});
    }
    CHECK(shell.offered({"completion", ""}) == Words{"bash", "zsh"});
  }
  {  // plugins and their kinds
    CHECK(includes(shell.offered({"plugins", "describe", ""}), {"ndt", "hpr"}));
    CHECK(shell.offered({"plugins", "describe", "nd"}) == Words{"ndt"});
    CHECK(shell.offered({"plugins", "new", "ma"}) == Words{"matcher"});
    CHECK(shell.offered({"plugins", "new", "matcher", ""}).empty());
  }
  {  // files, and folders where only those make sense
    CHECK(shell.offered({"build", ""}) == Words{"a file.toml", "map.pcd", "maps"});
    CHECK(shell.offered({"build", "a"}) == Words{"a file.toml"});
    CHECK(shell.offered({"build", "--plugin-dir", ""}) == Words{"maps"});
    CHECK(shell.offered({"build", "--set", ""}).empty());
    CHECK(shell.offered({"build", "a file.toml", ""}).empty());         // it takes one
    CHECK(shell.offered({"evaluate", "a file.toml", ""}).size() == 3);  // it takes many
  }
}

}  // namespace

TEST_CASE("bash is offered jobs, options, choices, plugins and files") {
  check_offers(Shell("bash"));
}
TEST_CASE("zsh is offered jobs, options, choices, plugins and files") {
  check_offers(Shell("zsh"));
}

TEST_CASE("a value after = is completed too") {
  if (!has_view()) return;
  // bash makes three words of it, zsh one.
  CHECK(Shell("bash").offered({"view", "--color", "=", "re"}) == Words{"region"});
  CHECK(Shell("bash").offered({"view", "--color", "="}) ==
        Words{"contribution", "height", "localizability", "region", "views"});
  CHECK(Shell("zsh").offered({"view", "--color=re"}) == Words{"region"});
}

TEST_CASE("zsh itself, typing" * doctest::test_suite("terminal")) {
  if (!test::terminals_exist()) return;
  const test::TemporaryFolder folder;
  const auto script = test::run("vantage", {"completion", "zsh"});
  test::write_text(folder.path() / "_vantage", script.out);
  const std::string type = R"(zmodload zsh/zpty
zpty z "zsh -f -i"
zpty -w z "PS1='' fpath=($1 \$fpath) PATH=$2:\$PATH; autoload -Uz compinit; compinit -u -D; bindkey '^I' complete-word; echo rea''dy"
zpty -r -m z x '*ready*'
zpty -w -n z $'vantage simu\t --overw\t\C-aprint -r -- "got: \C-e"\n'
zpty -r -m z out '*got: vantage*'
zpty -r z more
print -r -- "$out$more")";
  const auto done = test::run(VANTAGE_ZSH, {"-f", "-c", type, "zsh", folder.path().string(),
                                            fs::path(VANTAGE_PROGRAM_DIR).string()});
  CHECK_MESSAGE(done.out.find("got: vantage simulate --overwrite") != std::string::npos, done.out);
}

TEST_CASE("a shell that there is no script for") {
  const auto done = test::run("vantage", {"completion", "fish"});
  CHECK(done.exit_code == 2);
  CHECK(done.err.find("fish") != std::string::npos);
}
