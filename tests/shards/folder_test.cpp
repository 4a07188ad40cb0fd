// Disks that cannot do everything.
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "shards/small_town.hpp"
#include "support/text.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;
using test::failing_disk;
using test::Finished;
using test::has;
using test::must_run;
using test::run;
using test::SmallTown;

/// Runs a program with these variables.
Finished run_with(const std::vector<std::string>& variables, const std::string& program,
                  const std::vector<std::string>& arguments) {
  std::vector<std::string> words = variables;
  words.push_back(std::string(VANTAGE_PROGRAM_DIR) + "/" + program);
  words.insert(words.end(), arguments.begin(), arguments.end());
  return run("/usr/bin/env", words);
}

TEST_CASE("shards: a bundle whose name is not on the disk keeps its parts") {
  const SmallTown town;
  const std::string config = town.config({});
  must_run("vantage-build", {config, "-q", "--memory", "3MiB", "--shard", "1/1"});
  const auto parts = test::bytes_of(town.path("bundle.parts"));
  const std::string above = fs::path(town.path("bundle")).parent_path().filename().string();
  const auto failed = run_with(failing_disk("no_flush:/" + above), "vantage-merge",
                               {config, "-q", "--memory", "3MiB"});
  CHECK(failed.exit_code == 1);
  CHECK(test::bytes_of(town.path("bundle.parts")) == parts);
}

TEST_CASE("export: a file system that renames only plainly gets the export") {
  const SmallTown town;
  const std::string config = town.config({});
  must_run("vantage-build", {config, "-q"});
  const std::vector<std::string> words{"regions", config,          "-q", "--format", "pcd",
                                       "--out",   town.path("out")};
  const auto exported = run_with(failing_disk("no_flags"), "vantage-export", words);
  CHECK_MESSAGE(exported.exit_code == 0, exported.err);
  const auto files = test::bytes_of(town.path("out"));
  CHECK(files.size() > 5);
  auto again = words;
  again.emplace_back("--overwrite");
  const auto replaced = run_with(failing_disk("no_flags"), "vantage-export", again);
  CHECK_MESSAGE(replaced.exit_code == 0, replaced.err);
  CHECK(test::bytes_of(town.path("out")) == files);
  for (const auto& entry : fs::directory_iterator(fs::path(town.path("out")).parent_path())) {
    CHECK_FALSE(entry.path().filename().string().starts_with(".vantage-"));
  }
}

}  // namespace
}  // namespace vantage
