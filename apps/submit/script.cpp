#include "submit/script.hpp"

#include <fmt/format.h>

#include "terminal/shell_word.hpp"

namespace vantage {
namespace {

std::string command(const Job& job, const char* program, std::uint64_t memory) {
  std::string line = cli::shell_quoted((job.programs / program).string());
  for (const std::string& argument : job.arguments) line += " " + cli::shell_quoted(argument);
  return line + fmt::format(" --quiet --jobs {} --memory {}MiB", job.threads, memory >> 20U);
}

/// Removes what the script has left, when the bundle is there. The folder stays if it holds
/// anything else.
std::string clean_up(const Job& job) {
  const std::string own = cli::shell_quoted(job.own.string());
  return fmt::format(
      "rm -f -- {0}/{1} {0}/{2} {0}/shard-*.log {0}/merge-*.log && {{ rmdir -- {0} 2> /dev/null || "
      ":; }}",
      own, kMarker, kScript);
}

/// GNU parallel replaces {}, {= =} and more in its command, so no path may be in it: the command
/// of a shard is in a variable, which only the shell reads.
std::string for_parallel(const Job& job) {
  return fmt::format(
      "VANTAGE_SHARD={}\nPARALLEL_SHELL=/bin/sh\nexport VANTAGE_SHARD PARALLEL_SHELL\n"
      "seq {} | parallel --jobs {} --halt soon,fail=1 'sh -c \"$VANTAGE_SHARD\" sh {{}}'\n{}\n{}\n",
      cli::shell_quoted(command(job, "vantage-build", job.memory) +
                        fmt::format(" --shard \"$1\"/{}", job.shards)),
      job.shards, job.at_once, command(job, "vantage-merge", job.merge_memory), clean_up(job));
}

/// The name of a file as Slurm reads it, for which '%' begins a pattern and '\' ends all patterns.
std::string for_output(const std::filesystem::path& folder, const char* name) {
  std::string pattern;
  for (const char c : folder.string()) pattern += c == '%' ? std::string("%%") : std::string(1, c);
  return cli::shell_quoted(pattern + "/" + name);
}

std::string for_slurm(const Job& job) {
  // What a program takes beside its --memory.
  constexpr std::uint64_t kBeside = 512;
  const auto limits = [&](std::uint64_t memory, const char* log) {
    return fmt::format("--cpus-per-task={} --mem={}M --output={}", job.threads,
                       (memory >> 20U) + kBeside, for_output(job.own, log));
  };
  return fmt::format(
      "array=$(sbatch --parsable --job-name=vantage-build --array=1-{0} {1} \\\n    --wrap {2})\n"
      "array=${{array%%;*}}  # a federation prints the name of the cluster behind the number\n"
      "merge=$(sbatch --parsable --job-name=vantage-merge --dependency=afterok:${{array}} "
      "--kill-on-invalid-dep=yes {3} \\\n    --wrap {4})\n"
      "echo \"shards: job ${{array}}, merge: job ${{merge}}\"\n",
      job.shards, limits(job.memory, "shard-%A_%a.log"),
      cli::shell_quoted(command(job, "vantage-build", job.memory) +
                        fmt::format(" --shard ${{SLURM_ARRAY_TASK_ID}}/{}", job.shards)),
      limits(job.merge_memory, "merge-%j.log"),
      cli::shell_quoted(command(job, "vantage-merge", job.merge_memory) + " && " + clean_up(job)));
}

}  // namespace

std::string script_of(const Job& job) {
  return "#!/bin/sh\nset -eu\ncd " + cli::shell_quoted(job.folder.string()) + "\n" +
         (job.engine == Engine::parallel ? for_parallel(job) : for_slurm(job));
}

}  // namespace vantage
