// vantage-submit: hands the shards of a build to GNU parallel or to Slurm.
#include <fmt/format.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <thread>

#include "building/input.hpp"
#include "submit/script.hpp"
#include "terminal/command_line.hpp"
#include "terminal/counts.hpp"
#include "terminal/option_values.hpp"
#include "terminal/shell_word.hpp"
#include "terminal/size.hpp"
#include "vantage/kit/atomic_file.hpp"
#include "vantage/kit/marked_folder.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;

struct Options : building::Options {
  Engine engine = Engine::parallel;
  std::size_t shards = 0;
  std::size_t at_once = 0;
  bool print = false;
};

/// The arguments that every process of the build gets.
std::vector<std::string> arguments_of(const Options& options, const fs::path& parts) {
  // As it was given: a bundle keeps the paths of its configuration as they are read here.
  std::vector<std::string> words{options.config};
  for (const std::string& override_ : options.overrides()) {
    words.insert(words.end(), {"--set", override_});
  }
  for (const fs::path& folder : options.common.plugin_dirs) {
    words.insert(words.end(), {"--plugin-dir", fs::absolute(folder).string()});
  }
  words.insert(words.end(), {"--parts", parts.string()});
  return words;
}

/// How many shards run at once, and what each of them may take [bytes].
struct Share {
  std::size_t at_once = 1;
  std::uint64_t memory = 0;
};

/// On this machine, --memory is that of all shards together: as many run at once as have cores and
/// the memory that the largest region needs.
Result<Share> share_of(const Options& options, std::uint64_t memory, std::uint64_t least,
                       std::size_t threads, std::size_t shards) {
  constexpr std::uint64_t kMiB = std::uint64_t{1} << 20U;
  const std::uint64_t least_mib = least / kMiB + 1;
  const std::uint64_t mib = memory / kMiB;
  const bool apart = options.engine == Engine::slurm;
  const std::uint64_t room = mib / least_mib;
  const std::uint64_t wanted = apart ? 1 : std::max<std::size_t>(1, options.at_once);
  if (room < wanted) {
    return cli::usage_error(fmt::format(
        "--memory {}MiB is not enough for {}: each needs {} MiB for the largest region, so give "
        "--memory {}MiB{}",
        mib, cli::counted(wanted, "shard"), least_mib, wanted * least_mib,
        wanted > 1 ? " or a smaller --at-once" : ""));
  }
  if (apart) return Share{1, memory};
  const std::size_t all = std::max(1U, std::thread::hardware_concurrency());
  const std::size_t cores = (all + threads - 1) / threads;
  const std::size_t at_once = options.at_once > 0
                                  ? options.at_once
                                  : std::min({cores, shards, static_cast<std::size_t>(room)});
  return Share{at_once, memory / at_once};
}

Result<void> run(const Options& options) {
  const cli::ThreadLimit threads(options.common.jobs);
  VANTAGE_TRY(auto prepared, building::prepare(options, building::Reading::never));
  prepared.parts = fs::absolute(prepared.parts).lexically_normal();
  if (!prepared.parts.has_filename()) prepared.parts = prepared.parts.parent_path();
  // The plan is made here, so that shards do not wait for each other, and refusals come at once.
  const io::TiledParts map(*prepared.map.tiles);
  if (!options.common.quiet) std::cerr << "planning\n";
  VANTAGE_TRY(const ShardedBuild build, building::open_shards(prepared, map));
  constexpr std::size_t kRegionsAShard = 64;
  Job job{.engine = options.engine,
          .shards = options.shards > 0 ? options.shards
                                       : std::clamp<std::size_t>(
                                             build.partition().size() / kRegionsAShard, 1, 1000),
          .threads = options.common.jobs > 0 ? options.common.jobs : 1,
          .merge_memory = prepared.memory,
          .programs = fs::read_symlink("/proc/self/exe").parent_path(),
          .arguments = arguments_of(options, prepared.parts),
          .folder = fs::current_path(),
          .own = fs::path(prepared.parts.string() + ".submit")};
  VANTAGE_TRY(const Share share,
              share_of(options, prepared.memory, build.least_memory(), job.threads, job.shards));
  job.at_once = share.at_once;
  job.memory = share.memory;
  const std::string script = script_of(job);
  VANTAGE_CHECK(io::claim_folder(job.own, kMarker, "a folder of vantage submit"));
  if (options.print) {
    std::cout << script;
    return {};
  }
  const fs::path file = job.own / kScript;
  VANTAGE_CHECK(io::write_text_atomically(file, script));
  const int status = std::system(("/bin/sh " + cli::shell_quoted(file.string())).c_str());
  if (status == 0) return {};
  return fail(ErrorCode::io_failure,
              fmt::format("the script ended with status {}: run the same command again to continue",
                          WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status)),
              SourceLocation{file.string(), 0, 0});
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  CLI::App app(
      "Builds a tiled map in shards, with GNU parallel or Slurm.\n"
      "It plans the build, runs the shards and merges them. With Slurm it returns when the jobs "
      "are queued.",
      "vantage submit");
  vantage::Options options;
  options.add_to(app);
  app.add_option("--engine", options.engine, "what runs the shards")
      ->transform(vantage::cli::one_of<vantage::Engine>(
          {{"parallel", vantage::Engine::parallel}, {"slurm", vantage::Engine::slurm}}))
      ->type_name("parallel|slurm")
      ->required();
  app.add_option("--shards", options.shards,
                 "number of shards; if left out, one for every 64 regions")
      ->check(CLI::Range(1, 1'000'000));
  app.add_option("--at-once", options.at_once,
                 "with parallel: number of shards that run at a time and share --memory; if left "
                 "out, as many as cores and memory allow")
      ->check(CLI::Range(1, 100'000));
  app.add_flag("--print", options.print, "plan the build and print the script, but do not run it");
  return vantage::cli::run_program(app, argc, argv, [&] { return vantage::run(options); });
}
