// vantage-plan: what the build of a tiled map takes, and how far it has come.
#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>

#include "building/input.hpp"
#include "terminal/command_line.hpp"
#include "terminal/size.hpp"
#include "terminal/table.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage {
namespace {

struct Options : building::Options {
  std::size_t shards = 1;
  bool no_estimate = false;
};

Result<void> run(const Options& options) {
  const cli::ThreadLimit threads(options.common.jobs);
  VANTAGE_TRY(auto prepared, building::prepare(options, building::Reading::never));
  const io::TiledParts parts(*prepared.map.tiles);
  if (!options.common.quiet) std::cerr << "planning\n";
  VANTAGE_TRY(const ShardedBuild build, building::open_shards(prepared, parts));
  BuildEstimate estimate;
  if (!options.no_estimate) {
    VANTAGE_CHECK(building::read_scans(prepared, options.common.quiet));
    if (!options.common.quiet) std::cerr << "building a sample\n";
    VANTAGE_TRY(estimate, build.estimate());
  }
  cli::TextTable table({"shard", "regions", "finished", "viewpoints", "cost"});
  nlohmann::ordered_json shards = nlohmann::ordered_json::array();
  std::size_t finished = 0;
  std::uint64_t viewpoints = 0;
  double cost = 0.0;
  std::vector<ShardStatus> all;
  for (std::size_t k = 1; k <= options.shards; ++k) {
    VANTAGE_TRY(all.emplace_back(), build.status({k, options.shards}));
    finished += all.back().finished;
    viewpoints += all.back().viewpoints;
    cost += all.back().points_times_viewpoints;
  }
  for (std::size_t k = 0; k < all.size(); ++k) {
    const ShardStatus& of = all[k];
    const double share = cost > 0.0 ? of.points_times_viewpoints / cost : 0.0;
    table.add({std::to_string(k + 1), cli::grouped(of.regions), cli::grouped(of.finished),
               cli::grouped(of.viewpoints), fmt::format("{:.4f}", share)});
    shards.push_back({{"regions", of.regions},
                      {"finished", of.finished},
                      {"viewpoints", of.viewpoints},
                      {"cost", share}});
  }
  if (options.common.json) {
    nlohmann::ordered_json json{{"map_points", build.map_points()},
                                {"ground_points", build.ground_points()},
                                {"regions", build.partition().size()},
                                {"finished", finished},
                                {"viewpoints", viewpoints},
                                {"least_memory_bytes", build.least_memory()},
                                {"shards", std::move(shards)}};
    if (!options.no_estimate) {
      json["sampled_regions"] = estimate.sampled;
      json["core_hours_left"] = estimate.core_seconds / 3600.0;
    }
    std::cout << json_text(json);
    return {};
  }
  std::cout << table.to_string(options.common.style())
            << fmt::format("\n{}, {}; {} of {} {} finished\n",
                           cli::counted(build.map_points(), "map point"),
                           cli::counted(viewpoints, "viewpoint"), cli::grouped(finished),
                           cli::counted(build.partition().size(), "region"),
                           cli::form(build.partition().size(), "is", "are"));
  std::cout << fmt::format("a process needs --memory {}MiB at least",
                           (build.least_memory() >> 20U) + 1);
  if (!options.no_estimate) {
    std::cout << fmt::format(
        "; about {:.3g} core-hours are left, without the merge (estimated from {})",
        estimate.core_seconds / 3600.0, cli::counted(estimate.sampled, "region"));
  }
  std::cout << '\n';
  return {};
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  CLI::App app(
      "Plans the build of a tiled map and estimates what it takes.\n"
      "The table has the shards, their share of the work, and how many of their regions are "
      "finished.",
      "vantage plan");
  vantage::Options options;
  options.add_to(app);
  app.add_option("--shards", options.shards, "number of shards to show")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  app.add_flag("--no-estimate", options.no_estimate,
               "show no estimate, for which a sample would be built");
  return vantage::cli::run_program(app, argc, argv, [&] { return vantage::run(options); });
}
