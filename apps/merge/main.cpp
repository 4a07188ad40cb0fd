// vantage-merge: makes the bundle of shards that were built.
#include <iostream>
#include <optional>

#include "building/input.hpp"
#include "building/summary.hpp"
#include "terminal/command_line.hpp"
#include "terminal/progress.hpp"

namespace vantage {
namespace {

Result<void> run(const building::Options& options) {
  const cli::ThreadLimit threads(options.common.jobs);
  VANTAGE_TRY(auto prepared, building::prepare(options, building::Reading::never));
  const io::TiledParts parts(*prepared.map.tiles);
  VANTAGE_TRY(ShardedBuild build, building::open_shards(prepared, parts));
  BuildReport report;
  {
    std::optional<cli::Progress> progress;
    VANTAGE_TRY(report, build.merge([&](const BuildProgress& now) {
      if (!progress) progress.emplace("merging (regions)", options.common.quiet);
      progress->update(now.regions_done, now.regions);
    }));
  }
  return building::print_summary(report, prepared, options.common);
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  CLI::App app("Merges the shards that `vantage build --shard` has built into a bundle.",
               "vantage merge");
  vantage::building::Options options;
  options.add_to(app);
  return vantage::cli::run_program(app, argc, argv, [&] { return vantage::run(options); });
}
