// vantage-submit: the scripts, and GNU parallel for real; slurm_test.sh is the same for Slurm.
#include <doctest/doctest.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "shards/small_town.hpp"
#include "submit/script.hpp"
#include "terminal/shell_word.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;
using test::must_run;
using test::run;
using test::SmallTown;

bool has_parallel() {
  const bool there = run("/bin/sh", {"-c", "command -v parallel"}).exit_code == 0;
  if (!there) MESSAGE("skipped: GNU parallel is not installed");
  return there;
}

/// Runs vantage-submit, and all that it runs, with a disk on which some calls fail.
test::Finished submit_on(std::vector<std::string> arguments, const std::string& words) {
  const auto variables = test::failing_disk(words);
  arguments.insert(arguments.begin(), std::string(VANTAGE_PROGRAM_DIR) + "/vantage-submit");
  arguments.insert(arguments.begin(), variables.begin(), variables.end());
  return run("/usr/bin/env", arguments);
}

TEST_CASE("submit: the shell reads quoted words as they are") {
  for (const std::string word : {"plain", "two words", "it's", "$HOME `x` \"y\" \\z", ""}) {
    CAPTURE(word);
    CHECK(run("/bin/sh", {"-c", "printf %s " + cli::shell_quoted(word)}).out == word);
  }
}

TEST_CASE("submit: a script runs every shard, and merges when all are there") {
  const SmallTown town;
  const std::string config = town.config({});
  const auto printed = [&](const char* engine) {
    const auto finished =
        run("vantage-submit", {config, "-q", "--engine", engine, "--shards", "12", "--memory",
                               "3MiB", "--jobs", "2", "--print", "--set", "thinning.voxel_size=1"});
    REQUIRE_MESSAGE(finished.exit_code == 0, finished.err);
    CHECK(finished.out.starts_with("#!/bin/sh\n"));
    CHECK(run("/bin/sh", {"-n", "-c", finished.out}).exit_code == 0);  // the syntax alone
    CHECK(finished.out.find("thinning.voxel_size=1") != std::string::npos);
    return finished.out;
  };
  const std::string parallel = printed("parallel");
  CHECK(parallel.find("seq 12 | parallel ") != std::string::npos);
  CHECK(parallel.find("--shard \"$1\"/12") != std::string::npos);
  const std::string slurm = printed("slurm");
  CHECK(slurm.find("--array=1-12 --cpus-per-task=2 --mem=515M") != std::string::npos);
  CHECK(slurm.find("--shard ${SLURM_ARRAY_TASK_ID}/12") != std::string::npos);
  CHECK(slurm.find("--dependency=afterok:${array}") != std::string::npos);
  // In a federation, sbatch prints the cluster, too; a dependency names the number alone.
  fs::create_directory(town.path("bin"));
  test::write_text(town.path("bin/sbatch"), "#!/bin/sh\nprintf '%s\\n' \"$*\" >> " +
                                                cli::shell_quoted(town.path("calls")) +
                                                "\necho '123;north'\n");
  fs::permissions(town.path("bin/sbatch"), fs::perms::owner_all);
  const auto ran =
      run("/bin/sh", {"-c", "PATH=" + cli::shell_quoted(town.path("bin")) + ":$PATH; " + slurm});
  CHECK_MESSAGE(ran.exit_code == 0, ran.err);
  CHECK(test::read_text(town.path("calls")).find("--dependency=afterok:123 ") != std::string::npos);
  CHECK_FALSE(fs::exists(town.path("bundle")));
  CHECK(run("vantage-submit", {config, "-q", "--engine", "mpi"}).exit_code == 2);
  CHECK(run("vantage-submit", {config, "-q"}).exit_code == 2);
}

TEST_CASE("submit: GNU parallel makes the bundle of a build in memory, and continues") {
  if (!has_parallel()) return;
  const SmallTown town;
  const std::string config = town.config({});
  must_run("vantage-build", {config, "-q", "--set", "store.params.root=" + town.path("whole")});
  const std::vector<std::string> submit{config,     "-q", "--engine", "parallel",
                                        "--shards", "5",  "--memory", "3MiB"};
  // A shard that fails: its file cannot be written to the disk.
  const auto failed = submit_on(submit, "no_flush:shard_3_of_5.parts");
  CHECK(failed.exit_code == 1);
  CHECK(failed.err.find("run the same command again") != std::string::npos);
  CHECK_FALSE(fs::exists(town.path("bundle")));
  must_run("vantage-submit", submit);
  CHECK(test::bytes_of(town.path("bundle")) == test::bytes_of(town.path("whole")));
  CHECK_FALSE(fs::exists(town.path("bundle.parts")));
  CHECK_FALSE(fs::exists(town.path("bundle.parts.submit")));
}

TEST_CASE("submit: another number of shards, or a part that was removed, is continued") {
  if (!has_parallel()) return;
  const SmallTown town;
  const std::string config = town.config({});
  must_run("vantage-build", {config, "-q", "--set", "store.params.root=" + town.path("whole")});
  const auto submit = [&](const char* shards) {
    return std::vector<std::string>{config,     "-q",   "--engine", "parallel",
                                    "--shards", shards, "--memory", "3MiB"};
  };
  for (const bool removed : {false, true}) {
    CAPTURE(removed);
    fs::remove_all(town.path("bundle"));
    CHECK(submit_on(submit("4"), "no_flush:shard_4_of_4.parts").exit_code == 1);
    if (removed) fs::remove(town.path("bundle.parts/shard_1_of_4.parts"));
    const auto again = run("vantage-submit", submit(removed ? "4" : "2"));
    CHECK_MESSAGE(again.exit_code == 0, again.err);
    REQUIRE(fs::exists(town.path("bundle")));
    CHECK(test::bytes_of(town.path("bundle")) == test::bytes_of(town.path("whole")));
  }
}

TEST_CASE("submit: no name of a folder is a command or a pattern") {
  if (!has_parallel()) return;
  const SmallTown town;
  const std::string config = town.config({});
  for (const char* name : {"a {} b", "{= system(\"touch pwned\") =}", "{#}{%}{.}{1}",
                           "$(touch pwned)", "it's %j \\ \"x\""}) {
    CAPTURE(name);
    const fs::path folder = town.path(name);
    fs::create_directory(folder);
    const std::string bundle = (folder / "bundle").string();
    const auto built = run("vantage-submit",
                           {config, "-q", "--engine", "parallel", "--shards", "2", "--memory",
                            "3MiB", "--set", "store.params.root=" + nlohmann::json(bundle).dump()});
    CHECK_MESSAGE(built.exit_code == 0, built.err);
    CHECK(fs::exists(folder / "bundle"));
    CHECK_FALSE(fs::exists("pwned"));
    fs::remove("pwned");
    CHECK(std::distance(fs::directory_iterator(folder), {}) == 1);
  }
}

TEST_CASE("submit: the folder of its script is not one of a user, and only its own files go") {
  if (!has_parallel()) return;
  const SmallTown town;
  const std::string config = town.config({});
  const std::vector<std::string> submit{config,     "-q", "--engine", "parallel",
                                        "--shards", "2",  "--memory", "3MiB"};
  const fs::path own = town.path("bundle.parts.submit");
  fs::create_directory(own);
  test::write_text(own / "submit.sh", "mine");
  const auto refused = run("vantage-submit", submit);
  CHECK(refused.exit_code == 1);
  CHECK_MESSAGE(refused.err.find("not a folder of vantage submit") != std::string::npos,
                refused.err);
  CHECK(test::read_text(own / "submit.sh") == "mine");
  fs::remove(own / "submit.sh");
  must_run("vantage-plan", {config, "-q", "--no-estimate", "--memory", "3MiB"});
  test::write_text(town.path("bundle.parts/submit.sh"), "mine");
  test::write_text(town.path("bundle.parts/slurm-3.log"), "mine");
  must_run("vantage-submit", submit);
  CHECK_FALSE(fs::exists(own));
  CHECK(test::read_text(town.path("bundle.parts/submit.sh")) == "mine");
  CHECK(test::read_text(town.path("bundle.parts/slurm-3.log")) == "mine");
}

TEST_CASE("submit: the shards that run at once share the memory") {
  const SmallTown town;
  const std::string config = town.config({});
  const auto submit = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words{config,     "-q",  "--engine", "parallel",
                                   "--shards", "100", "--print"};
    words.insert(words.end(), more.begin(), more.end());
    return run("vantage-submit", words);
  };
  const auto planned = run("vantage-plan", {config, "-q", "--json", "--no-estimate"});
  REQUIRE_MESSAGE(planned.exit_code == 0, planned.err);
  const std::uint64_t least =
      (std::uint64_t(nlohmann::json::parse(planned.out)["least_memory_bytes"]) >> 20U) + 1;
  const auto mib = [](std::uint64_t number) { return std::to_string(number) + "MiB"; };
  const auto has = [](const test::Finished& finished, const std::string& text) {
    CHECK_MESSAGE(finished.out.find(text) != std::string::npos, finished.out, finished.err);
  };
  const auto four = submit({"--memory", "120MiB", "--at-once", "4"});
  has(four, "parallel --jobs 4 ");
  has(four, "--memory 30MiB --shard");
  has(four, "--memory 120MiB\n");  // the merge is alone
  // Left out, no more run than there is room for.
  const auto one = submit({"--memory", mib(2 * least - 1)});
  has(one, "parallel --jobs 1 ");
  has(one, "--memory " + mib(2 * least - 1) + " --shard");
  const auto refused = submit({"--memory", mib(3 * least - 1), "--at-once", "3"});
  CHECK(refused.exit_code == 2);
  CHECK_MESSAGE(refused.err.find("give --memory " + mib(3 * least)) != std::string::npos,
                refused.err);
  has(submit({"--memory", mib(3 * least), "--at-once", "3"}), "parallel --jobs 3 ");
}

TEST_CASE("plan: says what the shards are and how far they have come") {
  const SmallTown town;
  const std::string config = town.config({});
  const auto planned = [&] {
    const auto finished =
        run("vantage-plan", {config, "-q", "--shards", "3", "--json", "--memory", "3MiB"});
    REQUIRE_MESSAGE(finished.exit_code == 0, finished.err);
    return nlohmann::json::parse(finished.out);
  };
  const auto before = planned();
  CHECK(before["finished"] == 0);
  CHECK(before["shards"].size() == 3);
  CHECK(before["core_hours_left"] > 0.0);
  CHECK(before["least_memory_bytes"] > 100'000);
  CHECK(before["sampled_regions"] == 16);
  double cost = 0.0;
  std::size_t regions = 0;
  for (const auto& shard : before["shards"]) {
    cost += double(shard["cost"]);
    regions += std::size_t(shard["regions"]);
    CHECK(double(shard["cost"]) > 0.15);  // balanced, as far as regions can be
  }
  CHECK(cost == doctest::Approx(1.0));
  CHECK(before["regions"] == regions);
  must_run("vantage-build", {config, "-q", "--memory", "3MiB", "--shard", "2/3"});
  const auto after = planned();
  CHECK(after["shards"][1]["finished"] == after["shards"][1]["regions"]);
  CHECK(after["finished"] == after["shards"][1]["regions"]);
}

}  // namespace
}  // namespace vantage
