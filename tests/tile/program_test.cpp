// vantage-tile as a user runs it, and what other programs make of its result.
#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "support/process.hpp"
#include "support/real_data.hpp"
#include "support/small_config.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/tiled_map.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;
using test::run;

/// A street with a wall beside it, 60 m long, as two LAS files in a folder.
class TiledStreet {
 public:
  TiledStreet() {
    fs::create_directory(path("maps"));
    for (int part = 0; part < 2; ++part) {
      PointCloud half;
      for (int i = 120 * part; i < 120 * part + 120; ++i) {
        for (int j = 0; j < 40; ++j) half.emplace_back(0.25 * i - 30.0, 0.25 * j, 0.01 * (j % 2));
        for (int k = 1; k < 12; ++k) half.emplace_back(0.25 * i - 30.0, 10.0, 0.25 * k);
      }
      REQUIRE(io::write_las(path("maps/part_" + std::to_string(part) + ".las"), half));
      points += half.size();
    }
  }
  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder_.path() / name).string();
  }

  std::size_t points = 0;

 private:
  test::TemporaryFolder folder_;
};

std::map<std::string, std::string> contents(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    files[entry.path().filename().string()] = test::read_text(entry.path());
  }
  return files;
}

TEST_CASE("vantage tile: a folder becomes a tiled map, which is described and built from") {
  const TiledStreet street;
  const auto made = run("vantage", {"tile", street.path("maps"), "--out", street.path("tiled"),
                                    "--tile-size", "10", "--json"});
  REQUIRE_MESSAGE(made.exit_code == 0, made.err);
  CHECK(made.err.find("MB needed") != std::string::npos);
  CHECK(made.err.find("placing (points)") != std::string::npos);
  const auto report = nlohmann::json::parse(made.out);
  CHECK(report["points"] == street.points);
  CHECK(report["precision"] == "float64");
  CHECK(report["tiles"] == 12);

  const auto info = run("vantage-info", {street.path("tiled"), "--json", "-q"});
  REQUIRE_MESSAGE(info.exit_code == 0, info.err);
  CHECK(nlohmann::json::parse(info.out)["points"] == street.points);

  test::write_text(street.path("b.toml"),
                   to_text(test::SmallConfig{.files = "[\"tiled\"]",
                                             .partitioner_params = "cell_width = 20.0",
                                             .viewpoints = "voxel_size = 5.0\n",
                                             .matcher = ""}));
  const auto built = run("vantage-build", {street.path("b.toml"), "--json", "-q"});
  REQUIRE_MESSAGE(built.exit_code == 0, built.err);
  CHECK(nlohmann::json::parse(built.out)["map_points"] == street.points);
}

TEST_CASE("vantage tile: quiet is quiet, an older map is replaced only with --overwrite") {
  const TiledStreet street;
  const std::vector<std::string> command{street.path("maps"), "--out", street.path("tiled"), "-q"};
  const auto first = run("vantage-tile", command);
  CHECK(first.exit_code == 0);
  CHECK(first.err.empty());
  CHECK(first.out.find("tiles of 25 m") != std::string::npos);
  const auto before = contents(street.path("tiled"));
  const auto second = run("vantage-tile", command);
  CHECK(second.exit_code == 1);
  CHECK(second.err.find("--overwrite") != std::string::npos);
  auto again = command;
  again.emplace_back("--overwrite");
  CHECK(run("vantage-tile", again).exit_code == 0);
  CHECK(contents(street.path("tiled")) == before);
  CHECK_FALSE(fs::exists(street.path("tiled.partial")));
}

TEST_CASE("vantage tile: wrong usage is an error that says what was expected") {
  const TiledStreet street;
  const auto refused = [&](const std::vector<std::string>& more, int code,
                           const std::string& expected) {
    std::vector<std::string> arguments{street.path("maps"), "--out", street.path("tiled")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto done = run("vantage-tile", arguments);
    CHECK(done.exit_code == code);
    CHECK_MESSAGE(done.err.find(expected) != std::string::npos, done.err);
    CHECK(std::count(done.err.begin(), done.err.end(), '\n') == 1);
    CHECK_FALSE(fs::exists(street.path("tiled")));
    CHECK_FALSE(fs::exists(street.path("tiled.partial")));
  };
  refused({"--memory", "1000"}, 2, "512MiB or 2GiB, not '1000'");
  refused({"--memory", "1MiB"}, 1, "expected 4 MiB or more");
  refused({"--tile-size", "12"}, 1, "multiple of 5 m");
  refused({"--tile-size", "0"}, 2, "--tile-size");
  refused({street.path("none.pcd")}, 1, "there is no such file");
}

/// Starts the program, ends it with SIGKILL when a file exists, or lets it end.
void run_and_kill(const std::vector<std::string>& arguments, const fs::path& when) {
  const pid_t child = ::fork();
  if (child == 0) {
    const std::string program = (fs::path(VANTAGE_PROGRAM_DIR) / "vantage-tile").string();
    std::vector<char*> argv{const_cast<char*>(program.c_str())};
    for (const std::string& argument : arguments)
      argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    ::execv(program.c_str(), argv.data());
    ::_exit(127);
  }
  int status = 0;
  while (::waitpid(child, &status, WNOHANG) == 0) {
    if (fs::exists(when)) {
      ::kill(child, SIGKILL);
      ::waitpid(child, &status, 0);
      break;
    }
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
}

TEST_CASE("vantage tile: the program continues what kill -9 has interrupted") {
  const TiledStreet street;
  std::vector<std::string> command{street.path("maps"), "-q", "--out", street.path("whole")};
  REQUIRE(run("vantage-tile", command).exit_code == 0);
  for (const std::string when : {"state.vtiles", "points_0000.pack", "index.vtiles"}) {
    CAPTURE(when);
    command.back() = street.path("killed_" + when);
    run_and_kill(command, fs::path(command.back() + ".partial") / when);
    if (!fs::exists(command.back())) {  // it may have been too late
      const auto resumed = run("vantage-tile", command);
      REQUIRE_MESSAGE(resumed.exit_code == 0, resumed.err);
    }
    CHECK(io::TiledMap::open(command.back()));
    for (const auto& [name, content] : contents(street.path("whole"))) {
      CHECK(test::read_text(fs::path(command.back()) / name) == content);
    }
    CHECK_FALSE(fs::exists(command.back() + ".partial"));
  }
}

}  // namespace
}  // namespace vantage
