#include "terminal/option_values.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "support/real_data.hpp"

using namespace vantage;

namespace {

enum class End { first, last };

/// A program with options of each kind.
struct Program {
  CLI::App app;
  std::string config, scans, reference, html, mcap, out;
  double rate = 10.0, start = 0.0;
  std::size_t jobs = 0;
  End point = End::first;

  Program() {
    app.add_option("CONFIG", config);
    app.add_option("--scans", scans);
    app.add_option("--reference", reference);
    app.add_option("--html", html);
    app.add_option("--mcap", mcap);
    app.add_option("--out", out);
    app.add_option("--rate", rate)->check(cli::positive_number());
    app.add_option("--start", start)->check(cli::non_negative_number());
    app.add_option("--jobs", jobs)->check(cli::whole_number(0, 64));
    app.add_option("--point", point)
        ->transform(cli::one_of<End>({{"first", End::first}, {"last", End::last}}));
  }

  /// What is wrong with a call; empty if nothing is.
  std::string error(std::vector<std::string> arguments) {
    std::reverse(arguments.begin(), arguments.end());
    try {
      app.parse(arguments);
    } catch (const CLI::ParseError& e) {
      return e.what();
    }
    const auto sound = cli::check_values(app);
    return sound ? "" : sound.error().message;
  }
};

std::string error(const std::vector<std::string>& arguments) { return Program().error(arguments); }

}  // namespace

TEST_CASE("an empty value is an error, not an option that is left out") {
  CHECK(error({"--reference", ""}) == "--reference is given an empty value");
  CHECK(error({""}) == "CONFIG is given an empty value");
  CHECK(error({"c.toml", "--reference", "r.tum"}).empty());
}

TEST_CASE("numbers are checked, and the message says what is expected") {
  for (const char* rate : {"0", "-1", "nan", "inf", "fast", "1x"}) {
    CHECK(error({"--rate", rate}) ==
          "--rate: expected a number above 0, not '" + std::string(rate) + "'");
  }
  CHECK(error({"--start", "-1"}) == "--start: expected a number that is not negative, not '-1'");
  CHECK(error({"--start", "nan"}) == "--start: expected a number that is not negative, not 'nan'");
  for (const char* jobs : {"-1", "65", "99999999999999999999", "1.5", "two"}) {
    CHECK(error({"--jobs", jobs}) ==
          "--jobs: expected a whole number from 0 to 64, not '" + std::string(jobs) + "'");
  }
  CHECK(error({"--rate", "2.5", "--start", "0", "--jobs", "64"}).empty());
}

TEST_CASE("one of several names") {
  Program program;
  CHECK(program.error({"--point", "LAST"}).empty());
  CHECK(program.point == End::last);
  CHECK(error({"--point", "middle"}) == "--point: expected one of first, last, not 'middle'");
}

TEST_CASE("what is written is nothing that is read, and nothing else that is written") {
  const test::TemporaryFolder folder;
  const auto file = [&](const std::string& name) {
    const auto path = folder.path() / name;
    std::ofstream(path) << "content";
    return path.string();
  };
  const std::string config = file("c.toml"), recording = file("drive.mcap");
  std::filesystem::create_symlink(recording, folder.path() / "link.mcap");
  std::filesystem::create_directory(folder.path() / "run");
  const std::string run = (folder.path() / "run").string();
  const std::string track = file("run/trajectory.tum"), other = file("run/reference.tum");

  CHECK(error({config, "--html", config}) ==
        "--html would overwrite " + config + ", which is given to CONFIG");
  CHECK(error({config, "--scans", recording, "--mcap", (folder.path() / "link.mcap").string()})
            .find("--mcap would overwrite") == 0);
  CHECK(error({"--html", run + "/new.html", "--mcap", run + "/../run/new.html"})
            .find("--html would overwrite") == 0);
  CHECK(error({"--reference", track, "--out", run}).find("--out would overwrite") == 0);
  CHECK(error({"--html", run + "/scans.csv", "--out", run}).find("--out would overwrite") == 0);
  CHECK(error({config, "--scans", run, "--reference", other, "--out", run, "--html",
               run + "/page.html"})
            .empty());

  CHECK(error({"my_run", "--out", "my_run"}).empty());  // a name

  Program program;
  REQUIRE(program.error({"--html", config}).empty());
  const auto names = [&](const std::optional<MapSource>& map,
                         const std::optional<SelectorConfig>& selector = {}) {
    Config named;
    named.map = map;
    named.selector = selector;
    return cli::check_outputs(program.app, named);
  };
  SelectorConfig selector;
  selector.poses = config;
  for (const auto& checked : {names(MapSource{{recording, config}, {}}),
                              names(MapSource{{recording}, config}), names({}, selector)}) {
    REQUIRE_FALSE(checked);
    CHECK(checked.error().message ==
          "--html would overwrite " + config + ", which the configuration names");
  }
  CHECK(names(MapSource{{recording}, {}}));

  // What a program finds out itself; a run is read by its folder.
  using Paths = std::vector<std::filesystem::path>;
  CHECK(cli::check_outputs("--out", Paths{run + "/new/trajectory.tum"}, Paths{track, run}));
  CHECK(cli::check_outputs("--out", Paths{run + "/../run/trajectory.tum"}, Paths{config, run})
            .error()
            .message == "--out would overwrite " + track + ", which is read");
}
