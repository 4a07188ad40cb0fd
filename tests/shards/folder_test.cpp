// The folder of parts: what is in it that the program did not write, which builds may share it, and
// disks that cannot do everything.
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

/// The files that a user keeps in a folder, some with names that programs take.
const std::map<std::string, std::string> kMine{{"submit.sh", "echo mine"},
                                               {"slurm-7.log", "mine"},
                                               {"joblog", "mine"},
                                               {"short.parts", "mine"},
                                               {"lock", ""},
                                               {"notes.txt", "mine"}};

TEST_CASE("shards: a folder with a user's files is not taken for a folder of parts") {
  const SmallTown town;
  const std::string config = town.config({});
  const fs::path mine = town.path("mine");
  for (const bool with_plan : {false, true}) {
    CAPTURE(with_plan);
    fs::remove_all(mine);
    fs::create_directory(mine);
    auto files = kMine;
    if (with_plan) files["plan"] = "dig, plant, water";
    for (const auto& [name, text] : files) test::write_text(mine / name, text);
    for (const char* program : {"vantage-build", "vantage-plan", "vantage-merge"}) {
      const auto refused = run(program, {config, "-q", "--memory", "3MiB", "--parts", mine});
      CHECK(refused.exit_code == 1);
      CHECK_MESSAGE(has(refused.err, "this is not a folder of parts"), refused.err);
      CHECK_FALSE(has(refused.err, "remove"));
    }
    CHECK(test::bytes_of(mine) == files);
    CHECK_FALSE(fs::exists(town.path("bundle")));
  }
}

TEST_CASE("shards: a merge removes what the build wrote, and what a user put there stays") {
  const SmallTown town;
  const std::string config = town.config({});
  const fs::path work = town.path("work");
  fs::create_directory(work);  // an empty folder may be named
  const std::vector<std::string> common{config, "-q", "--memory", "3MiB", "--parts", work};
  auto first = common;
  first.insert(first.end(), {"--shard", "1/2"});
  must_run("vantage-build", first);
  for (const auto& [name, text] : kMine) test::write_text(work / name, text);
  test::write_text(work / ".vantage-1-0.tmp", "vplan");  // of a process that was killed
  must_run("vantage-build", common);
  auto left = test::bytes_of(work);
  left.erase(".vantage-parts");  // the folder remains one of parts
  CHECK(left == kMine);
  // The next build works there, too.
  auto again = common;
  again.emplace_back("--overwrite");
  must_run("vantage-build", again);
  left = test::bytes_of(work);
  left.erase(".vantage-parts");
  CHECK(left == kMine);
}

TEST_CASE("shards: the same map by another path is the same build") {
  const SmallTown town;
  const std::string config = town.config({});
  must_run("vantage-build", {config, "-q", "--set", "store.params.root=" + town.path("whole")});
  fs::create_symlink("tiles", town.path("link"));
  const auto shard = [&](const char* which, const std::string& map) {
    return run("vantage-build", {config, "-q", "--memory", "3MiB", "--shard", which, "--set",
                                 "map.files=[\"" + town.path(map) + "\"]", "--set",
                                 "map.trajectory=" + town.path("./driven.tum")});
  };
  for (const auto& [which, map] : {std::pair{"1/3", "tiles"}, std::pair{"2/3", "./tiles/../tiles"},
                                   std::pair{"3/3", "link"}}) {
    const auto built = shard(which, map);
    CHECK_MESSAGE(built.exit_code == 0, built.err);
  }
  must_run("vantage-merge", {config, "-q", "--memory", "3MiB"});
  CHECK(test::bytes_of(town.path("bundle")) == test::bytes_of(town.path("whole")));

  // Another map at the same place is another build, and the message says what differs.
  REQUIRE(shard("1/3", "tiles").exit_code == 1);  // the bundle is there
  fs::remove_all(town.path("bundle"));
  REQUIRE(shard("1/3", "tiles").exit_code == 0);
  fs::copy_file(town.path("town.pcd"), town.path("twice.pcd"));
  must_run("vantage-tile", {town.path("town.pcd"), town.path("twice.pcd"), "-o", town.path("tiles"),
                            "-q", "--overwrite"});
  const auto refused = shard("2/3", "tiles");
  CHECK(refused.exit_code == 1);
  CHECK_MESSAGE(has(refused.err, "another build, with another map:"), refused.err);
}

/// Copies a library, and adds a byte behind its end: another version that does the same.
void copy_as_another(const fs::path& from, const fs::path& to) {
  fs::copy_file(fs::canonical(from), to);
  std::ofstream(to, std::ios::binary | std::ios::app) << '\n';
}

TEST_CASE("shards: another version of a plugin or of the program does not continue a build") {
  const SmallTown town;
  const std::string config = town.config({});
  const std::vector<std::string> common{config, "-q", "--memory", "3MiB"};
  const auto shard = [&](const char* which, const std::vector<std::string>& variables,
                         const fs::path& plugins) {
    auto words = common;
    words.insert(words.end(), {"--shard", which, "--plugin-dir", plugins.string()});
    return run_with(variables, "vantage-build", words);
  };
  const fs::path plugins = VANTAGE_PLUGIN_DIR;
  REQUIRE(shard("1/3", {}, plugins).exit_code == 0);

  const fs::path others = town.path("plugins");
  fs::create_directory(others);
  copy_as_another(plugins / "vantage_visibility_surface.so",
                  others / "vantage_visibility_surface.so");
  const auto by_plugin = shard("2/3", {}, others);
  CHECK(by_plugin.exit_code == 1);
  CHECK_MESSAGE(
      has(by_plugin.err, "another build, with another version of the plugin of [visibility]:"),
      by_plugin.err);

  for (const std::string library : {"libvantage_build.so.0.1", "libvantage_engine.so.0.1"}) {
    const fs::path libraries = town.path("with_" + library);
    fs::create_directory(libraries);
    copy_as_another(plugins.parent_path() / library, libraries / library);
    const auto by_program = shard("2/3", {"LD_LIBRARY_PATH=" + libraries.string()}, plugins);
    CHECK(by_program.exit_code == 1);
    CHECK_MESSAGE(has(by_program.err, "another build, with another version of Vantage:"),
                  by_program.err);
  }

  // The same files elsewhere are the same build, and the merge may use another store.
  const fs::path copies = town.path("copies");
  fs::create_directory(copies);
  for (const auto& file : fs::directory_iterator(plugins)) {
    const fs::path copy = copies / file.path().filename();
    if (copy.filename() == "vantage_store_pcd_tiles.so") {
      copy_as_another(file.path(), copy);
    } else {
      fs::copy_file(file.path(), copy);
    }
  }
  for (const char* which : {"2/3", "3/3"}) {
    const auto built = shard(which, {}, copies);
    CHECK_MESSAGE(built.exit_code == 0, built.err);
  }
  auto merge = common;
  merge.insert(merge.end(), {"--plugin-dir", copies});
  must_run("vantage-merge", merge);
}

TEST_CASE("shards: two processes at the same shard, with a lock that locks nothing") {
  const SmallTown town;
  const std::string config = town.config({});
  must_run("vantage-build", {config, "-q", "--set", "store.params.root=" + town.path("whole")});
  const auto whole = test::bytes_of(town.path("whole"));
  must_run("vantage-plan", {config, "-q", "--no-estimate"});
  // With other blocks, regions are finished in another order.
  const std::vector<std::string> memory{"3MiB", "5MiB", "64MiB"};
  std::vector<Finished> finished(memory.size());
  std::vector<std::thread> processes;
  for (std::size_t k = 0; k < memory.size(); ++k) {
    processes.emplace_back([&, k] {
      finished[k] = run_with(failing_disk("no_locks"), "vantage-build",
                             {config, "-q", "-j", "1", "--memory", memory[k], "--shard", "1/1"});
    });
  }
  for (std::thread& process : processes) process.join();
  for (const Finished& one : finished) CHECK_MESSAGE(one.exit_code == 0, one.err);
  must_run("vantage-merge", {config, "-q", "--memory", "3MiB"});
  CHECK(test::bytes_of(town.path("bundle")) == whole);
  CHECK_FALSE(fs::exists(town.path("bundle.parts")));
}

TEST_CASE("shards: a shard is done when it is on the disk, and parts go when the bundle is") {
  const SmallTown town;
  const std::string config = town.config({});
  const std::string log = town.path("log");
  const std::string file = "shard_1_of_2.parts";
  for (const char* word : {"no_flush:", "no_close:"}) {
    CAPTURE(word);
    const auto failed = run_with(failing_disk(word + file), "vantage-build",
                                 {config, "-q", "--memory", "3MiB", "--shard", "1/2"});
    CHECK(failed.exit_code == 1);
    CHECK_MESSAGE(has(failed.err, file), failed.err);
    fs::remove_all(town.path("bundle.parts"));
  }
  for (const char* shard : {"1/2", "2/2"}) {
    const auto built = run_with(failing_disk("", log), "vantage-build",
                                {config, "-q", "--memory", "3MiB", "--shard", shard});
    REQUIRE_MESSAGE(built.exit_code == 0, built.err);
  }
  CHECK(has(test::read_text(log), "flush " + town.path("bundle.parts/" + file)));
  CHECK(has(test::read_text(log), "flush " + town.path("bundle.parts") + "\n"));

  fs::remove(log);
  const auto merged =
      run_with(failing_disk("", log), "vantage-merge", {config, "-q", "--memory", "3MiB"});
  REQUIRE_MESSAGE(merged.exit_code == 0, merged.err);
  std::vector<std::string> lines;
  std::istringstream text(test::read_text(log));
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  const auto first = [&](const std::string& start) {
    const auto line =
        std::ranges::find_if(lines, [&](const std::string& one) { return one.starts_with(start); });
    REQUIRE_MESSAGE(line != lines.end(), start);
    return line;
  };
  const std::string above = fs::path(town.path("bundle")).parent_path().string();
  const auto named = first("rename " + town.path("bundle.partial") + " " + town.path("bundle"));
  const auto removed = first("remove " + town.path("bundle.parts/"));
  CHECK(named < removed);
  // Its own entries, and its name in the folder above.
  CHECK(std::find(named, removed, "flush " + town.path("bundle")) != removed);
  CHECK(std::find(named, removed, "flush " + above) != removed);
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
  CHECK_FALSE(fs::exists(town.path("out.partial")));
}

}  // namespace
}  // namespace vantage
