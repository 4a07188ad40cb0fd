// vantage-init: writes a configuration for a map and a recording, with a reason beside each value.
#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "building/findings.hpp"
#include "building/input.hpp"
#include "checks/notes.hpp"
#include "init/decisions.hpp"
#include "terminal/command_line.hpp"
#include "terminal/counts.hpp"
#include "terminal/input_options.hpp"
#include "terminal/shell_word.hpp"
#include "terminal/size.hpp"
#include "vantage/evaluation/run.hpp"
#include "vantage/io/formats.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "vantage/kit/atomic_file.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;

/// What a map may take in this program's memory: beyond it, a tiled map is looked at in parts.
constexpr std::uint64_t kReading = 4ULL << 30U;  // [bytes]

struct Options {
  std::string map, memory = "40MiB";
  fs::path out, trajectory;
  bool overwrite = false, anyway = false, quiet = false, json = false;
  std::size_t jobs = 0;
  std::string color = "auto";
  std::vector<fs::path> plugin_dirs;
  InputOptions inputs;
};

/// A path as the configuration names it: relative paths of the command line are relative to the
/// configuration, or absolute if that goes to standard output.
std::string named_in_config(const fs::path& path, const Options& options) {
  if (path.is_absolute()) return path.lexically_normal().string();
  const fs::path absolute = fs::absolute(path).lexically_normal();
  if (options.out.empty()) return absolute.string();
  const fs::path folder = fs::absolute(options.out).lexically_normal().parent_path();
  return absolute.lexically_proximate(folder).string();
}

/// "maps/campus" of "campus.toml", or of the map "campus.pcd".
std::string bundle_of(const Options& options) {
  const fs::path root =
      fs::path("maps") /
      init::bundle_name(options.out.empty() ? fs::path(options.map) : options.out);
  return options.out.empty() ? fs::absolute(root).string() : root.string();
}

/// The commands that come next.
std::vector<std::string> next_commands(const Options& options,
                                       const std::optional<init::UsableImu>& imu) {
  const std::string config = options.out.empty() ? "CONFIG" : cli::shell_word(options.out.string());
  std::vector<std::string> commands{"vantage build " + config};
  const InputOptions& in = options.inputs;
  if (in.scans.empty()) {
    commands.push_back("vantage localize " + config +
                       " --scans RECORDING --initial-pose auto --out run");
    return commands;
  }
  std::string line = "vantage localize " + config;
  const auto add = [&](std::string_view option, const std::string& value) {
    if (!value.empty()) line += fmt::format(" {} {}", option, cli::shell_word(value));
  };
  add("--scans", in.scans.string());
  add("--topic", in.topic);
  if (in.choice.stamped) {
    add("--stamp", *in.choice.stamped == io::StampedPoint::first    ? "first"
                   : *in.choice.stamped == io::StampedPoint::middle ? "middle"
                                                                    : "last");
  }
  if (in.choice.tags == io::Tags::normal) add("--livox-tags", "normal");
  if (in.rate_hz != InputOptions{}.rate_hz) add("--rate", fmt::format("{:g}", in.rate_hz));
  if (imu) {
    add("--imu", imu->option);
    add("--imu-topic", imu->topic);
    if (in.imu_by_frame) line += " --imu-by-frame";
  }
  add("--odometry", in.odometry.string());
  add("--odometry-topic", in.odometry_topic);
  add("--prior", in.prior);
  add("--prior-topic", in.prior_topic);
  add("--prior-sigma", in.prior_sigma);
  add("--map-projector", in.map_projector.string());
  add("--reference", in.reference.string());
  add("--reference-topic", in.reference_topic);
  add("--mount", in.mount);
  if (in.prior.empty() && in.reference.empty()) line += " --initial-pose auto";
  commands.push_back(line + " --out run");
  return commands;
}

/// The trajectory of a map without ground: --trajectory, or else the positions of --prior if they
/// are a file of poses.
fs::path trajectory_for(const checks::MapFacts& map, const Options& options) {
  if (!options.trajectory.empty() || init::has_ground(map)) return options.trajectory;
  std::error_code ignored;
  if (!fs::is_regular_file(options.inputs.prior, ignored)) return {};
  return io::read_trajectory(options.inputs.prior) ? fs::path(options.inputs.prior) : fs::path();
}

/// What was looked at.
struct Seen {
  init::Known known;
  std::optional<building::FirstScans> first;
  std::optional<RunInputs> inputs;
  std::vector<std::string> remarks;
  PointCloud trajectory;
};

Result<init::CellCount> cells_of(const building::WideAreaMap& map, double resolution) {
  if (!map.tiles) return init::count_cells(map.points, resolution);
  VANTAGE_TRY(const PointCloud sample, building::sample_of(*map.tiles));
  init::CellCount count = init::count_cells(sample, resolution);
  const double share = static_cast<double>(map.tiles->points()) /
                       static_cast<double>(std::max<std::size_t>(1, sample.size()));
  count.cells = static_cast<std::uint64_t>(share * static_cast<double>(count.cells));
  count.area *= share;
  return count;
}

Result<Seen> look(const Options& options, const building::WideAreaMap& map, std::uint64_t memory) {
  Seen seen;
  VANTAGE_TRY(seen.known.map, building::facts_of(map));
  if (map.tiles) seen.known.map.points = map.tiles->points();
  seen.known.memory = memory;
  seen.known.files = named_in_config(options.map, options);
  seen.known.root = bundle_of(options);
  if (const fs::path path = trajectory_for(seen.known.map, options); !path.empty()) {
    VANTAGE_TRY(const io::Trajectory moments, io::read_trajectory(path));
    for (const auto& moment : moments) seen.trajectory.push_back(moment.pose.translation);
    seen.known.trajectory = named_in_config(path, options);
    if (options.trajectory.empty()) {
      seen.known.trajectory_why = "The positions of --prior, for want of the path during mapping.";
    }
  }
  if (!notes_on(seen.known.map).empty()) return seen;  // the rest would be measured in vain
  VANTAGE_TRY(seen.known.cells, cells_of(map, init::resolution_for(seen.known.map.spacing)));
  if (options.inputs.scans.empty()) return seen;
  VANTAGE_TRY(seen.inputs, options.inputs.open(std::vector<fs::path>{options.map}));
  VANTAGE_TRY(seen.first, building::read_first_scans(*seen.inputs));
  seen.known.scans = seen.first->facts;
  if (seen.first->scans.empty()) return seen;
  VANTAGE_TRY(auto imu, init::choose_imu(options.inputs, *seen.inputs, seen.first->facts,
                                         seen.first->scans.front().stamp));
  seen.known.imu = std::move(imu.imu);
  seen.remarks = std::move(imu.remarks);
  for (const checks::Note& note : checks::notes_on_damage(seen.inputs->damaged)) {
    seen.remarks.push_back(note.what + ": " + note.advice + '.');
  }
  return seen;
}

/// The first lines of the file.
std::vector<std::string> head_of(const Options& options, const Seen& seen,
                                 const building::Findings& findings,
                                 const std::vector<std::string>& commands) {
  const checks::MapFacts& map = seen.known.map;
  const Eigen::Vector3d extent = map.bulk.max - map.bulk.min;
  std::vector<std::string> head{
      "Written by `vantage init`, which says above each value where it comes from.",
      "Lines marked YOURS have a value that nothing shows: check it.", "",
      fmt::format("Map: {}, {} over {:.0f} x {:.0f} x {:.0f} m.", options.map,
                  cli::counted(map.points, "point"), extent.x(), extent.y(), extent.z())};
  if (seen.inputs) {
    const io::ScanDescription& scans = seen.inputs->opened->describe();
    head.push_back(fmt::format("Recording: {}, {}{}, about {:.0f} points a scan.",
                               options.inputs.scans.string(), scans.format,
                               scans.topic.empty() ? "" : ", topic " + scans.topic,
                               seen.known.scans->points));
  }
  if (seen.known.imu) {
    head.push_back(
        fmt::format("IMU: {}, {}.", seen.known.imu->option, seen.known.imu->description));
  }
  for (const std::string& remark : seen.remarks) head.push_back(remark);
  if (findings.fit) {
    head.push_back(
        fmt::format("Tried: {} of the first {} scans are found in the map, from an "
                    "unknown start; {:.0f} % of their points have map around.",
                    findings.fit->found, findings.fit->scans, 100.0 * findings.fit->coverage));
  }
  for (const checks::Note& note : findings.notes) {
    head.push_back(fmt::format("NOTE: {}: {}.", note.what, note.advice));
  }
  head.emplace_back("");
  head.emplace_back("Next:");
  for (const std::string& command : commands) head.push_back("  " + command);
  return head;
}

nlohmann::ordered_json to_json(const std::vector<init::Decision>& decisions,
                               const std::vector<std::string>& commands,
                               const building::Findings& findings, const std::string& text) {
  auto values = nlohmann::ordered_json::array();
  for (const init::Decision& d : decisions) {
    values.push_back({{"key", d.table.empty() ? d.key : d.table + "." + d.key},
                      {"value", d.value},
                      {"why", d.why}});
  }
  return {{"notes", checks::to_json(findings.notes)},
          {"values", std::move(values)},
          {"next", commands},
          {"configuration", text}};
}

/// Refuses inputs that are not what their user meant, unless they are to be used anyway.
Result<void> judge(const Options& options, const building::Findings& findings) {
  checks::print(std::cerr, findings.notes);
  if (findings.notes.empty() || options.anyway) return {};
  return fail(
      ErrorCode::invalid_input,
      "no configuration was written: the notes above say what is wrong; --anyway writes one "
      "all the same",
      SourceLocation{options.map, 0, 0});
}

Result<void> run(const Options& options) {
  const cli::ThreadLimit threads(options.jobs);
  const auto memory = cli::parse_memory(options.memory);
  if (!memory) return cli::usage_error(cli::not_memory(options.memory));
  std::error_code ignored;
  if (!options.out.empty() && !options.overwrite && fs::exists(options.out, ignored)) {
    return fail(ErrorCode::invalid_input, "exists already; --overwrite replaces it",
                SourceLocation{options.out.string(), 0, 0});
  }
  const PluginLoader plugins = PluginLoader::with_default_folders(options.plugin_dirs);
  const MapSource source{.files = {options.map}, .trajectory = {}};
  VANTAGE_TRY(auto map,
              building::read_map(Config{}, source, kReading, building::Reading::if_they_fit));
  VANTAGE_TRY(Seen seen, look(options, map, *memory));
  map.trajectory = std::move(seen.trajectory);

  building::Findings findings{.notes = notes_on(seen.known.map), .fit = {}};
  if (!findings.notes.empty()) VANTAGE_CHECK(judge(options, findings));
  VANTAGE_TRY(const auto decisions, init::decide(seen.known));
  VANTAGE_TRY(const Table table, parse_toml(init::to_toml(decisions, {}), "the configuration"));
  VANTAGE_TRY(Config config, parse_config(table));
  VANTAGE_TRY(config, with_plugin_defaults(config, plugins));
  if (seen.first) {
    VANTAGE_TRY(findings, building::look_at(seen.known.map, config, map, *seen.first,
                                            samples_of(*seen.inputs), plugins, options.quiet));
    VANTAGE_CHECK(judge(options, findings));
  }

  const auto commands = next_commands(options, seen.known.imu);
  const std::string text = init::to_toml(decisions, head_of(options, seen, findings, commands));
  if (options.json) {
    std::cout << json_text(to_json(decisions, commands, findings, text));
  } else if (options.out.empty()) {
    std::cout << text;
  }
  if (options.out.empty()) return {};
  VANTAGE_CHECK(io::write_text_atomically(options.out, text));
  if (options.json) return {};
  for (const std::string& remark : seen.remarks) std::cout << remark << '\n';
  std::cout << "written to " << options.out.string() << "; next:\n";
  for (const std::string& command : commands) std::cout << "  " << command << '\n';
  return {};
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  CLI::App app(
      "Writes a configuration for a map and a recording, with what was measured and a reason "
      "beside each value. Refuses inputs that `vantage check` finds suspicious.",
      "vantage init");
  vantage::Options options;
  app.add_option("MAP", options.map,
                 fmt::format("the map: a folder, a tiled map, a pattern, {}",
                             vantage::io::format_names(vantage::io::FormatUse::map)))
      ->required();
  options.inputs.add_to(app, false, "RECORDING");
  app.get_option("RECORDING")->required(false);
  app.add_option("--out", options.out, "the configuration; printed if left out")->type_name("FILE");
  app.add_flag("--overwrite", options.overwrite, "replace a file of that name");
  app.add_option("--memory", options.memory,
                 "memory that region maps may take on the robot, in MiB or GiB; it decides how "
                 "wide regions are")
      ->capture_default_str();
  app.add_option("--trajectory", options.trajectory,
                 "path of the sensor during mapping (TUM, map frame): a map without ground needs "
                 "it, unless it fits into --memory")
      ->type_name("FILE");
  app.add_flag("--anyway", options.anyway,
               "write the configuration also if something is suspicious, with notes in it");
  vantage::cli::add_plugin_folders_option(app, options.plugin_dirs);
  app.add_option("--jobs,-j", options.jobs, "threads; 0 for all cores")->capture_default_str();
  app.add_flag("--quiet,-q", options.quiet, "no progress on stderr");
  app.add_flag("--json", options.json, "results as JSON on stdout");
  vantage::cli::add_color_option(app, options.color);
  return vantage::cli::run_program(app, argc, argv, [&] { return vantage::run(options); });
}
