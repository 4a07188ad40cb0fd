// vantage-evaluate: the same scans with several configurations, side by side.
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>

#include "common/command_line.hpp"
#include "common/progress.hpp"
#include "common/table.hpp"
#include "evaluate/report.hpp"
#include "io/atomic_file.hpp"
#include "localize/run.hpp"

namespace vantage {
namespace {

struct Options {
  std::vector<std::filesystem::path> configs;
  std::filesystem::path out;
  InputOptions inputs;
  cli::CommonOptions common;
};

Result<EvaluatedRun> evaluate(const std::filesystem::path& file, const RunInputs& inputs,
                              const Options& options) {
  VANTAGE_TRY(const Config config, load_config(file, options.common.overrides));
  EvaluatedRun evaluated;
  evaluated.name = file.stem().string();
  {
    cli::Progress progress(evaluated.name + " (scans)", options.common.quiet);
    VANTAGE_TRY(evaluated.run, localize_scans(config, options.common.loader(), inputs,
                                              [&](std::size_t done, std::size_t total) {
                                                progress.update(done, total);
                                              }));
  }
  evaluated.summary = summarize(evaluated.run);
  std::vector<double> points;
  for (const RegionSummary& region : evaluated.run.index.regions) {
    points.push_back(static_cast<double>(region.points));
    evaluated.bundle_bytes += region.bytes;
  }
  evaluated.region_points = cli::statistics_of(points);
  return evaluated;
}

/// A bundle that is missing or damaged is told before any scan is localized.
Result<void> check_bundle(const std::filesystem::path& file, const Options& options) {
  VANTAGE_TRY(const Config config, load_config(file, options.common.overrides));
  VANTAGE_TRY(const StoreConfig choice, config.need(config.store, "store", "evaluating"));
  VANTAGE_TRY(const auto store, options.common.loader().load<MapStore>(choice.choice()));
  auto index = store->index();
  if (index) return {};
  Error error = std::move(index).error();
  if (error.code == ErrorCode::not_found) error.message += "; `vantage build` makes it";
  return fail(std::move(error));
}

Result<void> run(const Options& options) {
  const cli::ThreadLimit threads(options.common.jobs);
  std::set<std::string> names;
  for (const auto& config : options.configs) {
    if (!names.insert(config.stem().string()).second) {
      return cli::usage_error("two configurations are called '" + config.stem().string() +
                              "'; their results would overwrite each other");
    }
  }
  for (const auto& config : options.configs) {
    if (auto there = check_bundle(config, options); !there) {
      return fail(std::move(there).error().during("evaluating " + config.string()));
    }
  }
  VANTAGE_TRY(const auto inputs, options.inputs.open());
  std::vector<EvaluatedRun> runs;
  for (const auto& config : options.configs) {
    auto evaluated = evaluate(config, inputs, options);
    if (!evaluated)
      return fail(std::move(evaluated).error().during("evaluating " + config.string()));
    runs.push_back(*std::move(evaluated));
  }

  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const EvaluatedRun& r : runs) {
    VANTAGE_CHECK(write_run(r.run, r.summary, options.out / r.name));
    auto entry = to_json(r.run, r.summary);
    entry["name"] = r.name;
    entry["points_per_region"] = cli::to_json(r.region_points);
    entry["reduction"] = r.reduction();
    entry["bytes"] = r.bundle_bytes;
    json.push_back(std::move(entry));
  }
  VANTAGE_CHECK(io::write_text_atomically(options.out / "summary.json", json.dump(2) + "\n"));
  VANTAGE_CHECK(
      io::write_text_atomically(options.out / "report.html", to_html(runs, *inputs.reference)));

  if (options.common.json) {
    std::cout << json.dump(2) << '\n';
    return {};
  }
  const auto rows = comparison(runs);
  cli::TextTable table(rows.front());
  for (std::size_t i = 1; i < rows.size(); ++i) table.add(rows[i]);
  std::cout << table.to_string() << "\nreport: " << (options.out / "report.html").string() << '\n';
  return {};
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  CLI::App app("Localizes the same scans with several configurations and compares them.",
               "vantage evaluate");
  vantage::Options options;
  app.add_option("CONFIG", options.configs, "configurations (TOML) whose bundles are built")
      ->required();
  options.inputs.add_to(app, true);
  app.add_option("--out", options.out, "folder for report.html, summary.json and a folder a run")
      ->required();
  options.common.add_to(app);
  return vantage::cli::run_program(app, argc, argv, [&] { return vantage::run(options); });
}
