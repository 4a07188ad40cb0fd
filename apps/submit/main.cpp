// vantage-submit: hands the shards of a build to GNU parallel or to Slurm.
#include <fmt/format.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <map>

#include "building/input.hpp"
#include "submit/script.hpp"
#include "terminal/command_line.hpp"
#include "terminal/size.hpp"
#include "vantage/kit/atomic_file.hpp"

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

Result<void> run(const Options& options) {
  const cli::ThreadLimit threads(options.common.jobs);
  VANTAGE_TRY(auto prepared, building::prepare(options, building::Reading::never));
  prepared.parts = fs::absolute(prepared.parts);
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
          .at_once = options.at_once,
          .memory = prepared.memory,
          .programs = fs::read_symlink("/proc/self/exe").parent_path(),
          .arguments = arguments_of(options, prepared.parts),
          .folder = fs::current_path(),
          .parts = prepared.parts};
  const std::string script = script_of(job);
  if (options.print) {
    std::cout << script;
    return {};
  }
  const fs::path file = prepared.parts / "submit.sh";
  VANTAGE_CHECK(io::write_text_atomically(file, script));
  const int status = std::system(("/bin/sh " + quoted(file.string())).c_str());
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
      "are "
      "queued.",
      "vantage submit");
  vantage::Options options;
  options.add_to(app);
  app.add_option("--engine", options.engine, "what runs the shards")
      ->transform(
          CLI::CheckedTransformer(
              std::map<std::string, vantage::Engine>{{"parallel", vantage::Engine::parallel},
                                                     {"slurm", vantage::Engine::slurm}},
              CLI::ignore_case)
              .description(""))
      ->type_name("parallel|slurm")
      ->required();
  app.add_option("--shards", options.shards,
                 "number of shards; if left out, one for every 64 regions")
      ->check(CLI::Range(1, 1'000'000));
  app.add_option("--at-once", options.at_once,
                 "with parallel: number of shards that run at a time; if left out, as many as the "
                 "cores allow")
      ->check(CLI::Range(1, 100'000));
  app.add_flag("--print", options.print, "plan the build and print the script, but do not run it");
  return vantage::cli::run_program(app, argc, argv, [&] { return vantage::run(options); });
}
