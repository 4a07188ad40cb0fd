// vantage-evaluate: localizes the same scans with several configurations and shows them side by
// side.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>

#include "checks/notes.hpp"
#include "evaluate/report.hpp"
#include "evaluate/route_options.hpp"
#include "evaluation/json.hpp"
#include "terminal/command_line.hpp"
#include "terminal/option_values.hpp"
#include "terminal/progress.hpp"
#include "terminal/table.hpp"
#include "vantage/evaluation/baselines.hpp"
#include "vantage/evaluation/evaluation.hpp"
#include "vantage/evaluation/run_files.hpp"
#include "vantage/kit/atomic_file.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::vector<fs::path> configs;
  fs::path out;
  std::vector<std::string> gates;
  std::string excess_over;
  bool no_baselines = false;
  RouteOptions routes;
  cli::CommonOptions common;
};

Result<std::vector<NamedConfig>> load_configs(const Options& options,
                                              const std::vector<Gate>& gates) {
  std::vector<NamedConfig> configs;
  std::set<std::string> names;
  for (const fs::path& file : options.configs) {
    if (!names.insert(file.stem().string()).second) {
      return cli::usage_error("two configurations are called '" + file.stem().string() +
                              "'; their results would overwrite each other");
    }
    VANTAGE_TRY(Config config, load_config(file, options.common.overrides));
    configs.push_back({file.stem().string(), std::move(config)});
    // Reports a bundle that is missing, damaged or out of date, or that a gate cannot be measured
    // on, before any scan is localized.
    const auto checked = [&]() -> Result<void> {
      VANTAGE_TRY(const Bundle bundle,
                  Bundle::open(configs.back().config, options.common.loader(), "evaluating"));
      VANTAGE_TRY(const auto index, bundle.index());
      return check_measurable(gates, configs.back().name, *index);
    };
    if (auto there = checked(); !there) {
      return fail(std::move(there).error().during("evaluating " + file.string()));
    }
  }
  return configs;
}

Result<std::vector<Gate>> read_gates(const Options& options) {
  std::vector<Gate> gates;
  for (const std::string& text : options.gates) {
    auto read = parse_gates(text);
    if (!read) return cli::usage_error(read.error().message);
    gates.insert(gates.end(), read->begin(), read->end());
  }
  return gates;
}

/// What `excess` is measured from: the configuration of that name, else the wide-area map.
const EvaluatedConfig* excess_over_of(const Evaluation& evaluation, const std::string& name) {
  if (name.empty()) return wide_area_config(evaluation);
  const auto named =
      std::find_if(evaluation.configs.begin(), evaluation.configs.end(),
                   [&](const EvaluatedConfig& config) { return config.name == name; });
  return &*named;
}

/// Checks that the configurations that options name exist.
Result<void> check_names(const Options& options, const std::vector<Gate>& gates,
                         const std::vector<NamedConfig>& configs) {
  const auto check = [&](const std::string& option, const std::string& name) -> Result<void> {
    const bool known = std::any_of(configs.begin(), configs.end(),
                                   [&](const NamedConfig& config) { return config.name == name; });
    if (name.empty() || known) return {};
    return cli::usage_error(option + ": no configuration is called '" + name + "'");
  };
  for (const Gate& gate : gates) VANTAGE_CHECK(check("--gate", gate.config));
  return check("--excess-over", options.excess_over);
}

/// A folder a run: <config>/<route>, and the baselines' in it.
Result<void> write_runs(const Evaluation& evaluation, const fs::path& out) {
  for (const EvaluatedConfig& config : evaluation.configs) {
    for (std::size_t r = 0; r < evaluation.routes.size(); ++r) {
      const fs::path folder = out / config.name / evaluation.routes[r].name;
      VANTAGE_CHECK(write_run(config.routes[r].run, config.routes[r].summary, folder));
      for (const Baseline& baseline : config.baselines) {
        VANTAGE_CHECK(
            write_run(baseline.routes[r].run, baseline.routes[r].summary, folder / baseline.name));
      }
    }
  }
  return {};
}

/// Checks that no file of write_runs and of the evaluation is one that is read, as the trajectory
/// of an earlier evaluation in the same folder.
Result<void> check_outputs(const Options& options, const std::vector<NamedConfig>& configs,
                           const std::vector<NamedInputs>& routes) {
  std::vector<fs::path> written{options.out / "summary.json", options.out / "report.html"};
  std::vector<fs::path> read = options.routes.paths();
  for (const auto& [name, config] : configs) {
    for (const NamedInputs& route : routes) {
      const fs::path folder = options.out / name / route.name;
      std::vector<fs::path> runs{folder};
      for (const Thinning baseline : kThinnings) runs.push_back(folder / to_string(baseline));
      for (const fs::path& of_run : runs) {
        for (const std::string_view file : cli::kFilesOfARun) {
          written.push_back(of_run / file);
        }
      }
    }
    const auto named = cli::files_named_in(config);
    read.insert(read.end(), named.begin(), named.end());
  }
  return cli::check_outputs("--out", written, read);
}

void print_gates(const Evaluation& evaluation, const cli::Style& style) {
  for (const EvaluatedConfig& config : evaluation.configs) {
    for (const GateResult& gate : config.gates) {
      std::cout << (gate.holds ? style.good("pass") : style.bad("FAIL")) << "  " << config.name
                << ": " << to_string(gate) << '\n';
    }
  }
  std::cout << '\n';
}

Result<void> check_verdict(const Evaluation& evaluation) {
  std::size_t failed = 0;
  for (const EvaluatedConfig& config : evaluation.configs) {
    if (config.passed() == false) ++failed;
  }
  if (failed == 0) return {};
  return fail(ErrorCode::invalid_input,
              cli::grouped(failed) + " of " +
                  cli::counted(evaluation.configs.size(), "configuration") + " failed a gate");
}

/// Says of each route whether its reference may be that of another frame.
void print_notes_on_references(const Evaluation& evaluation) {
  for (std::size_t r = 0; r < evaluation.routes.size(); ++r) {
    for (const EvaluatedConfig& config : evaluation.configs) {
      const Statistics error = config.routes[r].summary["error_m"];
      if (error.count == 0) continue;
      auto note = checks::note_on_reference(error.min, error.median, error.max);
      if (!note) continue;
      note->what = fmt::format("{}, {}: {}", config.name, evaluation.routes[r].name, note->what);
      checks::print(std::cerr, std::array{*std::move(note)});
    }
  }
}

ScanProgress progress_of(const std::string& label, bool quiet) {
  const auto bar = std::make_shared<cli::Progress>(label + " (scans)", quiet);
  return [bar](std::size_t done, std::size_t total) { bar->update(done, total); };
}

Result<void> run(const Options& options) {
  const cli::ThreadLimit threads(options.common.jobs);
  VANTAGE_TRY(const std::vector<Gate> gates, read_gates(options));
  VANTAGE_TRY(const auto configs, load_configs(options, gates));
  VANTAGE_CHECK(check_names(options, gates, configs));
  std::vector<fs::path> map_files;
  for (const NamedConfig& config : configs) {
    if (!config.config.map) continue;
    const auto& files = config.config.map->files;
    map_files.insert(map_files.end(), files.begin(), files.end());
  }
  VANTAGE_TRY(const auto routes, options.routes.open(map_files));
  VANTAGE_CHECK(check_outputs(options, configs, routes));
  for (const NamedInputs& route : routes) {
    checks::print(std::cerr, checks::notes_on_damage(damaged_besides_scans(route.inputs)));
  }

  const EvaluationOptions how{
      .loader = options.common.loader(),
      .baselines = !options.no_baselines,
      .progress = [&](const auto& label) { return progress_of(label, options.common.quiet); }};
  VANTAGE_TRY(Evaluation evaluation, evaluate(configs, routes, how));
  std::vector<std::string> names;
  for (const Route& route : evaluation.routes) names.push_back(route.name);
  const EvaluatedConfig* excess_over = excess_over_of(evaluation, options.excess_over);
  for (EvaluatedConfig& config : evaluation.configs) {
    config.gates = judge(gates, config, names, excess_over);
  }

  print_notes_on_references(evaluation);
  VANTAGE_CHECK(write_runs(evaluation, options.out));
  const nlohmann::ordered_json json = to_json(evaluation);
  VANTAGE_CHECK(io::write_text_atomically(options.out / "summary.json", json_text(json)));
  VANTAGE_TRY(const std::string page, to_html(evaluation));
  VANTAGE_CHECK(io::write_text_atomically(options.out / "report.html", page));

  if (options.common.json) {
    std::cout << json_text(json);
    return check_verdict(evaluation);
  }
  const auto rows = comparison(evaluation);
  cli::TextTable table(rows.front(), kComparisonNames);
  for (std::size_t i = 1; i < rows.size(); ++i) table.add(rows[i]);
  std::cout << table.to_string(options.common.style()) << '\n';
  for (const EvaluatedConfig& config : evaluation.configs) {
    if (!config.no_baselines.empty()) {
      std::cout << config.name << (config.baselines.empty() ? " has no baselines: " : ": ")
                << config.no_baselines << '\n';
    }
  }
  if (!gates.empty()) print_gates(evaluation, options.common.style());
  std::cout << "report: " << fs::absolute(options.out / "report.html").lexically_normal().string()
            << '\n';
  return check_verdict(evaluation);
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  CLI::App app(
      "Localizes the same scans with several configurations and compares them.\n"
      "It also compares them with baselines: maps of equal size that are made in simpler ways.",
      "vantage evaluate");
  vantage::Options options;
  app.add_option("CONFIG", options.configs, "configurations (TOML) whose bundles are built")
      ->required();
  options.routes.add_to(app);
  app.add_option("--out", options.out,
                 "folder for report.html, summary.json and one folder per run")
      ->required()
      ->type_name("DIR");
  app.add_option("--gate", options.gates,
                 "limits for every route, such as error=0.5cm,lost=0, or L20:error=0.5cm for one "
                 "configuration; exit code 1 if a limit is violated")
      ->allow_extra_args(false);
  app.add_option(
      "--excess-over,--baseline", options.excess_over,
      "configuration that the gate 'excess' compares with; the wide-area map's if left out");
  app.add_flag(
      "--no-baselines,--no-opponents", options.no_baselines,
      "leave out the baselines: maps of equal size by random thinning, voxel thinning and radius");
  options.common.add_to(app);
  app.footer("Gates, and what '=' means for each:\n" + vantage::gate_help());
  return vantage::cli::run_program(app, argc, argv, [&] { return vantage::run(options); });
}
