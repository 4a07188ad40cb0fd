#include "submit/script.hpp"

#include <fmt/format.h>

namespace vantage {
namespace {

std::string command(const Job& job, const char* program) {
  std::string line = quoted((job.programs / program).string());
  for (const std::string& argument : job.arguments) line += " " + quoted(argument);
  return line + fmt::format(" --quiet --jobs {} --memory {}MiB", job.threads, job.memory >> 20U);
}

/// GNU parallel reads the command as a line of the shell, so its words are quoted.
std::string for_parallel(const Job& job) {
  const std::string at_once =
      job.at_once > 0 ? std::to_string(job.at_once)
                      : fmt::format("$(( ($(nproc) + {}) / {} ))", job.threads - 1, job.threads);
  return fmt::format(
      "seq {} | parallel --jobs {} --joblog {} --resume-failed --halt soon,fail=1 {}\n{}\n",
      job.shards, at_once, quoted((job.parts / "joblog").string()),
      quoted(command(job, "vantage-build") + fmt::format(" --shard {{}}/{}", job.shards)),
      command(job, "vantage-merge"));
}

std::string for_slurm(const Job& job) {
  // What the program takes beside its --memory.
  constexpr std::uint64_t kBeside = 512;
  const std::string limits =
      fmt::format("--cpus-per-task={} --mem={}M --output={}", job.threads,
                  (job.memory >> 20U) + kBeside, quoted((job.parts / "slurm-%A_%a.log").string()));
  return fmt::format(
      "array=$(sbatch --parsable --job-name=vantage-build --array=1-{0} {1} \\\n    --wrap {2})\n"
      "merge=$(sbatch --parsable --job-name=vantage-merge --dependency=afterok:${{array}} "
      "--kill-on-invalid-dep=yes {1} \\\n    --wrap {3})\n"
      "echo \"shards: job ${{array}}, merge: job ${{merge}}\"\n",
      job.shards, limits,
      quoted(command(job, "vantage-build") +
             fmt::format(" --shard ${{SLURM_ARRAY_TASK_ID}}/{}", job.shards)),
      quoted(command(job, "vantage-merge")));
}

}  // namespace

std::string quoted(const std::string& text) {
  std::string word = "'";
  for (const char c : text) {
    if (c == '\'') {
      word += "'\\''";
    } else {
      word += c;
    }
  }
  return word + "'";
}

std::string script_of(const Job& job) {
  return "#!/bin/sh\nset -eu\ncd " + quoted(job.folder.string()) + "\n" +
         (job.engine == Engine::parallel ? for_parallel(job) : for_slurm(job));
}

}  // namespace vantage
