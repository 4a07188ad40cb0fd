// vantage-submit: the scripts, and GNU parallel for real; slurm_test.sh is the same for Slurm.
#include <doctest/doctest.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "shards/small_town.hpp"
#include "submit/script.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;
using test::must_run;
using test::run;
using test::SmallTown;

TEST_CASE("submit: the shell reads quoted words as they are") {
  for (const std::string word : {"plain", "two words", "it's", "$HOME `x` \"y\" \\z", ""}) {
    CAPTURE(word);
    CHECK(run("/bin/sh", {"-c", "printf %s " + quoted(word)}).out == word);
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
  CHECK(parallel.find("--resume-failed") != std::string::npos);
  CHECK(parallel.find("--shard {}/12") != std::string::npos);
  const std::string slurm = printed("slurm");
  CHECK(slurm.find("--array=1-12 --cpus-per-task=2 --mem=515M") != std::string::npos);
  CHECK(slurm.find("--shard ${SLURM_ARRAY_TASK_ID}/12") != std::string::npos);
  CHECK(slurm.find("--dependency=afterok:${array}") != std::string::npos);
  CHECK_FALSE(fs::exists(town.path("bundle")));
  CHECK(run("vantage-submit", {config, "-q", "--engine", "mpi"}).exit_code == 2);
  CHECK(run("vantage-submit", {config, "-q"}).exit_code == 2);
}

TEST_CASE("submit: GNU parallel makes the bundle of a build in memory, and continues") {
  if (run("/bin/sh", {"-c", "command -v parallel"}).exit_code != 0) {
    MESSAGE("skipped: GNU parallel is not installed");
    return;
  }
  const SmallTown town;
  const std::string config = town.config({});
  must_run("vantage-build", {config, "-q", "--set", "store.params.root=" + town.path("whole")});
  const std::vector<std::string> submit{config,     "-q", "--engine", "parallel",
                                        "--shards", "5",  "--memory", "3MiB"};
  // A shard that fails: its file belongs to another process.
  must_run("vantage-plan", {config, "-q", "--no-estimate"});
  fs::create_directory(town.path("bundle.parts/shard_3_of_5.parts"));
  const auto failed = run("vantage-submit", submit);
  CHECK(failed.exit_code == 1);
  CHECK(failed.err.find("run the same command again") != std::string::npos);
  CHECK_FALSE(fs::exists(town.path("bundle")));
  fs::remove(town.path("bundle.parts/shard_3_of_5.parts"));
  must_run("vantage-submit", submit);
  CHECK(test::bytes_of(town.path("bundle")) == test::bytes_of(town.path("whole")));
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
