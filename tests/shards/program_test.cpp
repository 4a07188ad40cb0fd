// Shards as a user runs them: continued, refused, and merged.
#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "shards/small_town.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;
using test::must_run;
using test::run;
using test::SmallTown;

/// Starts a program of the build folder and ends it with SIGKILL after a while, or lets it end.
/// @return  whether it was killed
bool run_and_kill(const std::string& program, const std::vector<std::string>& arguments,
                  std::chrono::microseconds after) {
  std::vector<std::string> words{std::string(VANTAGE_PROGRAM_DIR) + "/" + program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    const int nowhere = ::open("/dev/null", O_WRONLY);
    ::dup2(nowhere, STDOUT_FILENO);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  std::this_thread::sleep_for(after);
  ::kill(child, SIGKILL);
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFSIGNALED(status);
}

TEST_CASE("shards: what kill -9 interrupts at any moment is continued, to the same bytes") {
  const SmallTown town;
  const std::string config = town.config({});
  must_run("vantage-build", {config, "-q"});
  const auto whole = test::bytes_of(town.path("bundle"));
  const std::vector<std::string> command{
      config, "-q", "--memory", "3MiB", "--set", "store.params.root=" + town.path("killed")};
  std::mt19937 random(11);
  std::uniform_int_distribution<int> milliseconds(1, 150);
  int kills = 0;
  for (int round = 0; round < 3; ++round) {
    fs::remove_all(town.path("killed"));
    while (!fs::exists(town.path("killed")) && kills < 40 * (round + 1)) {
      const std::chrono::milliseconds after(milliseconds(random));
      if (run_and_kill("vantage-build", command, after)) ++kills;
    }
    if (!fs::exists(town.path("killed"))) must_run("vantage-build", command);
    CHECK(test::bytes_of(town.path("killed")) == whole);
    fs::remove_all(town.path("killed.parts"));  // of a process that was killed after the commit
  }
  CHECK(kills > 5);
}

TEST_CASE(
    "shards: all at once and without a plan, some of them killed, and some on another machine") {
  const SmallTown town;
  const std::string config = town.config({});
  must_run("vantage-build", {config, "-q", "--set", "store.params.root=" + town.path("whole")});
  const auto whole = test::bytes_of(town.path("whole"));
  // Another machine has the same files at other places, but for the folder of parts.
  const fs::path there = town.path("there");
  fs::create_directory(there);
  for (const char* name : {"tiles", "driven.tum", "town.toml"}) {
    fs::copy(town.path(name), there / name, fs::copy_options::recursive);
  }
  constexpr int kShards = 6;
  const auto words = [&](int k) {
    return std::vector<std::string>{k % 2 == 0 ? config : (there / "town.toml").string(),
                                    "-q",
                                    "-j",
                                    "1",
                                    "--memory",
                                    k % 3 == 0 ? "3MiB" : "64MiB",
                                    "--parts",
                                    town.path("parts"),
                                    "--shard",
                                    std::to_string(k + 1) + "/" + std::to_string(kShards)};
  };
  std::vector<test::Finished> finished(kShards);
  std::vector<std::thread> processes;
  for (int k = 0; k < kShards; ++k) {
    processes.emplace_back([&, k] {
      if (k % 3 == 1) run_and_kill("vantage-build", words(k), std::chrono::milliseconds(20 * k));
      finished[static_cast<std::size_t>(k)] = run("vantage-build", words(k));
    });
  }
  for (std::thread& process : processes) process.join();
  for (const auto& one : finished) CHECK_MESSAGE(one.exit_code == 0, one.err);
  must_run("vantage-merge", {config, "-q", "--parts", town.path("parts")});
  CHECK(test::bytes_of(town.path("bundle")) == whole);
  CHECK_FALSE(fs::exists(town.path("parts")));
}

TEST_CASE("shards: an assessment that kill -9 ends leaves the bundle, with a whole atlas or none") {
  const SmallTown town;
  const std::string config = town.config({.more = "[atlas]\nmax_sites = 9\n"});
  must_run("vantage-build", {config, "-q"});
  const auto built = test::bytes_of(town.path("bundle"));
  const std::vector<std::string> command{config, "-q"};
  must_run("vantage-assess", command);
  const std::string atlas = test::bytes_of(town.path("bundle"))["atlas.dat"];
  std::mt19937 random(12);
  std::uniform_int_distribution<int> milliseconds(1, 300);
  int kills = 0;
  for (int round = 0; round < 12; ++round) {
    fs::remove(town.path("bundle/atlas.dat"));
    if (run_and_kill("vantage-assess", command, std::chrono::milliseconds(milliseconds(random)))) {
      ++kills;
    }
    auto files = test::bytes_of(town.path("bundle"));
    if (const auto kept = files.find("atlas.dat"); kept != files.end())
      CHECK(kept->second == atlas);
    // What was about to become the atlas does no harm: a build replaces it with the bundle.
    std::erase_if(files, [](const auto& file) {
      return file.first == "atlas.dat" || file.first.starts_with(".vantage-");
    });
    CHECK(files == built);
  }
  CHECK(kills > 3);
  test::write_text(town.path("bundle/.vantage-1-0.tmp"), "vant");
  must_run("vantage-build", {config, "-q", "--overwrite"});
  CHECK(test::bytes_of(town.path("bundle")) == built);
}

TEST_CASE("shards: a finished region is not built again") {
  const SmallTown town;
  const std::string config = town.config({});
  const auto built = [&](const char* shard) {
    const auto finished =
        run("vantage-build", {config, "-q", "--memory", "3MiB", "--shard", shard, "--json"});
    REQUIRE_MESSAGE(finished.exit_code == 0, finished.err);
    return nlohmann::json::parse(finished.out);
  };
  const auto first = built("1/2");
  CHECK(first["built"] == first["regions"]);
  CHECK(first["regions"] > 2);
  CHECK(built("1/2")["built"] == 0);
  // Regions count whichever shard they were built in.
  const auto all = built("1/1");
  CHECK(all["built"] == std::size_t(all["regions"]) - std::size_t(first["regions"]));
  CHECK(built("2/2")["built"] == 0);
}

TEST_CASE("shards: a bundle is replaced only if that is wanted, and other files stay") {
  const SmallTown town;
  const std::string config = town.config({});
  const std::vector<std::string> build{config, "-q",      "--memory",
                                       "3MiB", "--parts", town.path("work")};
  must_run("vantage-plan", build);
  test::write_text(town.path("work/notes.txt"), "mine");
  must_run("vantage-build", build);
  CHECK(test::read_text(town.path("work/notes.txt")) == "mine");
  CHECK_FALSE(fs::exists(town.path("work/plan")));
  CHECK(std::distance(fs::directory_iterator(town.path("work")), fs::directory_iterator()) == 2);
  const auto before = test::bytes_of(town.path("bundle"));
  for (const char* program : {"vantage-build", "vantage-plan", "vantage-merge"}) {
    const auto refused = run(program, build);
    CHECK(refused.exit_code == 1);
    CHECK_MESSAGE(refused.err.find("--overwrite") != std::string::npos, refused.err);
  }
  auto again = build;
  again.emplace_back("--overwrite");
  must_run("vantage-build", again);
  CHECK(test::bytes_of(town.path("bundle")) == before);
}

TEST_CASE(
    "shards: merge says what is missing, and builds that do not belong together are refused") {
  const SmallTown town;
  const std::string config = town.config({});
  const auto fails = [](const std::string& program, const std::vector<std::string>& arguments,
                        const char* why, int code = 1) {
    const auto finished = run(program, arguments);
    CHECK(finished.exit_code == code);
    CHECK_MESSAGE(finished.err.find(why) != std::string::npos, finished.err);
  };
  fails("vantage-build", {config, "-q", "--shard", "0/3"}, "--shard takes", 2);
  fails("vantage-build", {config, "-q", "--shard", "4/3"}, "--shard takes", 2);
  fails("vantage-build", {config, "-q", "--shard", "1"}, "--shard takes", 2);
  fails("vantage-build", {config, "-q", "--memory", "3"}, "--memory takes", 2);
  fails("vantage-build", {config, "-q", "--memory", "1MiB"}, "allow more memory");
  must_run("vantage-build", {config, "-q", "--shard", "2/3"});
  fails("vantage-merge", {config, "-q"}, "regions are not built yet");
  CHECK_FALSE(fs::exists(town.path("bundle")));
  fails("vantage-build", {config, "-q", "--shard", "1/3", "--set", "viewpoints.voxel_size=9"},
        "another build");
  fails("vantage-merge", {config, "-q", "--set", "visibility.max_range=14"}, "another build");
  fails("vantage-build",
        {config, "-q", "--shard", "1/3", "--set", "map.files=[\"" + town.path("town.pcd") + "\"]"},
        "vantage tile");

  // A plan or parts that are damaged are refused, and what is not there is built again.
  const fs::path parts = town.path("bundle.parts");
  const std::string plan = test::read_text(parts / "plan");
  std::string wrong = plan;
  wrong[wrong.size() / 2] ^= 1;
  test::write_text(parts / "plan", wrong);
  fails("vantage-build", {config, "-q", "--shard", "1/3"}, "damaged");
  test::write_text(parts / "plan", plan);
  const fs::path file = parts / "shard_2_of_3.parts";
  const std::string whole = test::read_text(file);
  test::write_text(file, whole.substr(0, whole.size() - 10));  // as a disk that was full leaves it
  must_run("vantage-build", {config, "-q", "--shard", "2/3"});
  // The region that was cut off is in a file of the process that built it.
  const std::string last = test::read_text(parts / "shard_2_of_3-2.parts");
  CHECK(last.substr(0, 16) == whole.substr(0, 16));
  CHECK(whole.ends_with(last.substr(16)));
  fs::remove(parts / "shard_2_of_3-2.parts");
  test::write_text(file, whole);
  must_run("vantage-build", {config, "-q", "--shard", "1/1"});
  wrong = whole;
  wrong[wrong.size() / 2] ^= 1;
  test::write_text(file, wrong);
  fails("vantage-merge", {config, "-q"}, "damaged");
  CHECK_FALSE(fs::exists(town.path("bundle")));
}

}  // namespace
}  // namespace vantage
