// vantage-check: says what is suspicious about a map, recorded scans and their configuration.
#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "building/input.hpp"
#include "checks/notes.hpp"
#include "checks/trials.hpp"
#include "evaluation/degrees.hpp"
#include "info/map_lines.hpp"
#include "terminal/command_line.hpp"
#include "terminal/input_options.hpp"
#include "terminal/table.hpp"
#include "vantage/evaluation/run.hpp"
#include "vantage/kit/atomic_folder.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;

struct Options : building::Options {
  InputOptions inputs;
};

struct Findings {
  checks::MapFacts map;
  std::optional<checks::ScanFacts> scans;
  std::optional<checks::Fit> fit;
  std::vector<checks::Note> notes;

  void add(std::vector<checks::Note> more) {
    notes.insert(notes.end(), std::make_move_iterator(more.begin()),
                 std::make_move_iterator(more.end()));
  }
};

/// A bundle of the whole map, for the time of a check.
class WholeMap {
 public:
  static Result<WholeMap> build(const Options& options, const building::WideAreaMap& map) {
    const fs::path place = fs::temp_directory_path() / fmt::format("vantage-check-{}", getpid());
    VANTAGE_TRY(io::OutputFolder folder,
                io::OutputFolder::create(place, io::OutputFolder::Existing::refuse));
    auto overrides = options.common.overrides;
    const std::string root = (folder.path() / "bundle").string();
    overrides.insert(
        overrides.end(),
        {"partitioner={plugin=\"whole_map\"}", "visibility={plugin=\"keep_all\"}",
         fmt::format("store={{plugin=\"pcd_tiles\",params={{root={}}}}}", quoted(root))});
    VANTAGE_TRY(Config config, load_config(options.config, overrides));
    config.thinning.reset();
    config.selector.reset();
    const PluginLoader plugins = options.common.loader();
    VANTAGE_TRY(BundleBuild build, BundleBuild::prepare(config, plugins));
    VANTAGE_CHECK(build.run(map.points, map.trajectory));
    VANTAGE_TRY(Bundle bundle, Bundle::open(config, plugins, "the check"));
    return WholeMap(std::move(folder), std::move(config), std::move(bundle));
  }
  [[nodiscard]] const Config& config() const { return config_; }
  [[nodiscard]] const Bundle& bundle() const { return bundle_; }

 private:
  static std::string quoted(const std::string& text) { return nlohmann::json(text).dump(); }
  WholeMap(io::OutputFolder folder, Config config, Bundle bundle)
      : folder_(std::move(folder)), config_(std::move(config)), bundle_(std::move(bundle)) {}

  io::OutputFolder folder_;
  Config config_;
  Bundle bundle_;
};

/// Takes the map for one in feet. Its cells are too wide for sparse scans to fit, so that scaled
/// scans show nothing.
Result<std::optional<checks::Note>> try_feet(const Options& options,
                                             const building::WideAreaMap& map,
                                             std::span<const io::StampedScan> scans,
                                             const checks::Fit& as_they_are) {
  constexpr double kFoot = 0.3048;  // [m]
  building::WideAreaMap metric;
  for (const Point& p : map.points) metric.points.push_back(kFoot * p);
  for (const Point& p : map.trajectory) metric.trajectory.push_back(kFoot * p);
  VANTAGE_TRY(const WholeMap whole, WholeMap::build(options, metric));
  VANTAGE_TRY(const checks::Fit fit,
              checks::fit_of(whole.bundle(), whole.config(), options.common.loader(), scans, {}));
  if (!finds_more(fit, as_they_are)) return std::optional<checks::Note>();
  return std::optional<checks::Note>(
      {fmt::format("{} of {} scans are found if the map is taken as feet, and {} if it is not",
                   fit.found, fit.scans, as_they_are.found),
       "scans and map are in metres: multiply the map by 0.3048"});
}

/// Localizes the scans in the map, and says what that shows.
Result<std::optional<checks::Note>> compare(const Options& options,
                                            const building::WideAreaMap& map,
                                            std::span<const io::StampedScan> scans,
                                            std::span<const ImuSample> imu, Findings& findings) {
  const PluginLoader plugins = options.common.loader();
  VANTAGE_TRY(const WholeMap whole, WholeMap::build(options, map));
  VANTAGE_TRY(const checks::Fit fit,
              checks::fit_of(whole.bundle(), whole.config(), plugins, scans, imu));
  findings.fit = fit;
  VANTAGE_TRY(auto note, checks::try_changes(whole.bundle(), whole.config(), plugins, scans, fit));
  if (note) return note;
  if (2 * fit.found >= scans.size()) {
    return checks::try_scales(whole.bundle(), whole.config(), plugins, scans, imu, fit);
  }
  VANTAGE_TRY(note, try_feet(options, map, scans, fit));
  return note ? note : checks::note_on_place(fit);
}

Result<void> check_scans(const Options& options, const Config& config,
                         const building::WideAreaMap& map, Findings& findings) {
  VANTAGE_TRY(const auto inputs,
              options.inputs.open(config.map ? config.map->files : std::vector<fs::path>()));
  VANTAGE_TRY(auto scans, first_scans(inputs, checks::ScanSurvey::kAmong));
  checks::ScanSurvey survey;
  for (const io::StampedScan& scan : scans) survey.offer(scan);
  if (scans.size() > checks::kScansToTry) scans.resize(checks::kScansToTry);
  findings.scans = survey.facts();
  const bool imu = inputs.imu.has_value(), suspected = !findings.notes.empty();
  auto notes = notes_on(*findings.scans, config, imu);
  if (!suspected && notes.empty() && config.matcher && !map.tiles) {
    if (!options.common.quiet) std::cerr << "comparing scans with the map\n";
    VANTAGE_TRY(auto note, compare(options, map, scans, samples_of(inputs), findings));
    if (note) notes.push_back(*std::move(note));
  }
  // Wrong axes make heights wrong, and feet also ranges.
  if (!findings.fit || notes.empty()) findings.add(notes_on_sensor(*findings.scans, config, imu));
  findings.add(std::move(notes));
  return {};
}

Lines lines_of(const Findings& findings) {
  const checks::MapFacts& map = findings.map;
  const Eigen::Vector3d extent = map.bulk.max - map.bulk.min;
  Lines lines{{"map", fmt::format("{} points over {:.1f} x {:.1f} x {:.1f} m",
                                  cli::grouped(map.points), extent.x(), extent.y(), extent.z())}};
  for (auto& line : map_lines(map)) lines.push_back(std::move(line));
  if (!findings.scans) return lines;
  const checks::ScanFacts& scans = *findings.scans;
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
  VANTAGE_TRY(const Config config, checks::with_defaults(prepared.config, options.common.loader()));
  Findings findings;
  if (prepared.map.tiles) {
    VANTAGE_TRY(const PointCloud sample, building::sample_of(*prepared.map.tiles));
    findings.map = checks::measure_map(sample);
  } else {
    findings.map = checks::measure_map(prepared.map.points);
  }
  findings.add(notes_on(findings.map, config));
  if (!options.inputs.scans.empty()) {
    VANTAGE_CHECK(check_scans(options, config, prepared.map, findings));
  }
  if (options.common.json) {
    nlohmann::ordered_json result{{"notes", to_json(findings.notes)}};
    for (const auto& [name, value] : lines_of(findings)) result[name] = value;
    std::cout << result.dump(2) << '\n';
  } else {
    std::cout << to_text(lines_of(findings), options.common.style());
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
