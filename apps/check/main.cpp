// vantage-check: says what is suspicious about a map, recorded scans and their configuration.
#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "building/findings.hpp"
#include "building/input.hpp"
#include "checks/notes.hpp"
#include "evaluation/degrees.hpp"
#include "info/map_lines.hpp"
#include "terminal/command_line.hpp"
#include "terminal/input_options.hpp"
#include "terminal/table.hpp"
#include "vantage/evaluation/run.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage {
namespace {

struct Options : building::Options {
  InputOptions inputs;
};

Lines lines_of(const checks::MapFacts& map, const std::optional<building::FirstScans>& first,
               const building::Findings& findings) {
  const Eigen::Vector3d extent = map.bulk.max - map.bulk.min;
  Lines lines{{"map", fmt::format("{} points over {:.1f} x {:.1f} x {:.1f} m",
                                  cli::grouped(map.points), extent.x(), extent.y(), extent.z())}};
  for (auto& line : map_lines(map)) lines.push_back(std::move(line));
  if (!first) return lines;
  const checks::ScanFacts& scans = first->facts;
  lines.emplace_back("ranges", fmt::format("half within {:.1f} m, 90 % within {:.1f} m",
                                           scans.range_at(0.5), scans.range_at(0.9)));
  lines.emplace_back("times of points",
                     scans.timed ? fmt::format("yes, {:.3f} s a sweep", scans.sweep)
                                 : std::string("none: sweeps of a moving sensor stay distorted"));
  lines.emplace_back("ground below",
                     scans.below
                         ? fmt::format("{:.2f} m, tilted by {:.1f} degrees, {:.0f} % of the "
                                       "square metres around",
                                       scans.below->distance, scans.below->tilt * kDegrees,
                                       100.0 * scans.below->share)
                         : std::string("none seen"));
  if (findings.fit) {
    lines.emplace_back(
        "in the map",
        fmt::format("{} of the first {} scans are found, from an unknown start; coverage {:.2f}",
                    findings.fit->found, findings.fit->scans, findings.fit->coverage));
  }
  return lines;
}

Result<int> run(const Options& options) {
  const cli::ThreadLimit threads(options.common.jobs);
  VANTAGE_TRY(const auto prepared, building::prepare(options, building::Reading::if_they_fit));
  VANTAGE_TRY(const Config config, with_plugin_defaults(prepared.config, options.common.loader()));
  VANTAGE_TRY(const checks::MapFacts map, building::facts_of(prepared.map));
  building::Findings findings = building::look_at(map, config);
  std::optional<building::FirstScans> first;
  if (!options.inputs.scans.empty()) {
    VANTAGE_TRY(RunInputs inputs, options.inputs.open(config.map->files));
    VANTAGE_TRY(first, building::read_first_scans(inputs));
    VANTAGE_TRY(findings, building::look_at(map, config, prepared.map, *first, samples_of(inputs),
                                            options.common.loader(), options.common.quiet));
    const auto damage = checks::notes_on_damage(inputs.damaged);
    findings.notes.insert(findings.notes.end(), damage.begin(), damage.end());
  }
  const Lines lines = lines_of(map, first, findings);
  if (options.common.json) {
    nlohmann::ordered_json result{{"notes", to_json(findings.notes)}};
    for (const auto& [name, value] : lines) result[name] = value;
    std::cout << json_text(result);
  } else {
    std::cout << to_text(lines, options.common.style());
    print(std::cout, findings.notes);
    if (findings.notes.empty()) std::cout << "nothing suspicious\n";
  }
  return findings.notes.empty() ? 0 : 1;
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  CLI::App app(
      "Says what is suspicious about a map, recorded scans and their configuration: units, up, "
      "mirrored axes, rounding, spacing, the sensor's height, ranges, times. Exit code 1 if "
      "anything is.",
      "vantage check");
  vantage::Options options;
  options.add_to(app);
  options.inputs.add_to(app, false);
  app.get_option("--scans")->required(false);
  int code = 0;
  const int failed = vantage::cli::run_program(app, argc, argv, [&]() -> vantage::Result<void> {
    VANTAGE_TRY(code, vantage::run(options));
    return {};
  });
  return failed != 0 ? failed : code;
}
