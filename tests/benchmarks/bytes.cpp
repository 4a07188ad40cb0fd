// What a region's bytes buy: the error of a drive against the size of the region maps that it is
// localized in, for several ways to make them smaller.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "arguments.hpp"
#include "drive.hpp"
#include "plot.hpp"
#include "ready_map.hpp"
#include "simulate/params.hpp"
#include "simulate/simulation.hpp"
#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "terminal/command_line.hpp"
#include "terminal/table.hpp"
#include "vantage/evaluation/run.hpp"
#include "vantage/evaluation/summary.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "vantage/kit/atomic_file.hpp"

namespace vantage::benchmarks {
namespace {

namespace fs = std::filesystem;

using Overrides = std::vector<std::string>;

Overrides operator+(Overrides a, const Overrides& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

struct Options {
  std::vector<std::string> recordings{"demo", "campus", "kitti_street"};
  std::vector<std::string> selectors{"contribution", "grid", "fullest", "random"};
  std::vector<double> kilobytes{2.5, 5, 10, 20, 40, 80, 160};
  std::vector<double> voxels{0.2, 0.25, 0.3, 0.4, 0.5, 0.6};  // [m]
  std::size_t seeds = 5;
  std::string matcher;  // empty: that of the configurations
  std::vector<std::string> set;
  bool quick = false, cells = false;
  fs::path rows, svg;
  std::size_t jobs = 0;  // 0: all cores
};

// ---- recordings

/// A drive and its map.
struct Recording {
  std::string name, title;
  fs::path configs = {};      // small.toml, surface.toml, ... for it
  Overrides of_surface = {};  // of those with the visibility operator `surface`
  PointCloud map = {};
  RunInputs inputs = {};
  std::shared_ptr<const test::TemporaryFolder> folder = {};
};

const fs::path kConfigs = fs::path(VANTAGE_SOURCE_DIR) / "configs";

Result<void> open(Recording& recording, const fs::path& folder, const char* reference) {
  VANTAGE_TRY(auto map, io::read_point_cloud(folder / "map.pcd"));
  recording.map = std::move(map.points);
  recording.inputs.scans.path = folder / "scans";
  VANTAGE_TRY(recording.inputs.reference, io::read_trajectory(folder / reference));
  return {};
}

/// A campus of configs/simulate and the drive through it.
Result<Recording> simulated(Recording recording, const char* world, const Overrides& overrides) {
  recording.configs = kConfigs / "demo";
  recording.folder = std::make_shared<test::TemporaryFolder>();
  const fs::path folder = recording.folder->path() / "campus";
  VANTAGE_TRY(const auto params, simulation::load_world(kConfigs / "simulate" / world, overrides));
  VANTAGE_CHECK(simulation::simulate(params, folder));
  VANTAGE_CHECK(open(recording, folder, "reference.tum"));
  VANTAGE_TRY(recording.inputs.odometry, io::read_trajectory(folder / "odometry.tum"));
  return recording;
}

/// Nothing where the recorded data is absent.
Result<std::optional<Recording>> load(const std::string& name) {
  if (name == "demo")
    return simulated({.name = name, .title = "demo's campus, exact truth"}, "demo.toml", {});
  if (name == "campus") {
    return simulated({.name = name,
                      .title = "another campus, exact truth",
                      .of_surface = {"visibility.params.point_spacing=0.2"}},
                     "paper.toml", {"campus.size_x=125.0", "campus.size_y=125.0"});
  }
  const auto folder = test::real_data("kitti_street");
  if (!folder) return std::nullopt;
  Recording street{.name = name, .title = "recorded street", .configs = kConfigs / "kitti_street"};
  VANTAGE_CHECK(open(street, *folder, "ref_poses_tum.txt"));
  return street;
}

// ---- ways

/// Region maps of one size: what is changed in a configuration, once or for each random draw.
struct Size {
  std::string text;
  std::vector<Overrides> draws{{}};
};

/// A way to make region maps: a file of Recording::configs, and how it is changed for each size.
struct Way {
  std::string name;
  const char* file;
  std::vector<Size> sizes{{}};
};

/// Cells of the regions that a selector chooses.
Way chosen_by(const std::string& selector, const Options& options) {
  Way way{selector, "small.toml", {}};
  for (const double kilobytes : options.kilobytes) {
    const Overrides chosen = Overrides{"selector.plugin=" + selector,
                                       fmt::format("selector.max_bytes={:.0f}", 1e3 * kilobytes)} +
                             options.set;
    Size size{fmt::format("{:g} kB", kilobytes), {chosen}};
    for (std::size_t seed = 1; selector == "random" && seed <= options.seeds; ++seed) {
      size.draws.resize(seed);
      size.draws.back() = chosen + Overrides{fmt::format("selector.params.seed={}", seed)};
    }
    way.sizes.push_back(std::move(size));
  }
  return way;
}

/// Points, all that a configuration keeps and thinned.
Way points_of(std::string name, const char* file, const Options& options) {
  Way way{std::move(name), file};
  for (const double voxel : options.voxels) {
    way.sizes.push_back(
        {fmt::format("{:g} m", voxel), {{fmt::format("thinning.voxel_size={:.3f}", voxel)}}});
  }
  return way;
}

/// @param cells  whether the matcher stores what it prepares
std::vector<Way> ways(const Options& options, bool cells) {
  std::vector<Way> all;
  if (!cells || !options.cells) {
    all = {points_of("points: whole map", "wide.toml", options),
           points_of("points: surface", "surface.toml", options),
           points_of("points: hpr", "L20.toml", options)};
  }
  if (!cells) return all;
  all.push_back(
      {"cells: surface", "surface.toml", {{.text = "", .draws = {{"store.content=prepared"}}}}});
  for (const std::string& selector : options.selectors) all.push_back(chosen_by(selector, options));
  return all;
}

// ---- measuring

struct Row {
  std::string recording, way, size;
  std::string settings = {};  // what else decides about it
  std::size_t draws = 0, scans = 0;
  std::size_t tracked = 0, lost = 0;                  // of the worst draw
  double bytes = 0.0, align_ms = 0.0, build_s = 0.0;  // means of the draws
  // Of the draws that tracked a scan: their number, the mean error and its range over them [cm].
  std::size_t draws_tracked = 0;
  double error = 0.0, least = 0.0, most = 0.0, p95 = 0.0;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Row, recording, way, size, settings, draws, scans,
                                                tracked, lost, bytes, align_ms, build_s,
                                                draws_tracked, error, least, most, p95)

/// Rows that were measured before, in a file of one JSON object a line; new ones are added to it.
class KnownRows {
 public:
  /// @param file  may be empty, or not there yet
  /// Errors: `corrupt_data` with the line.
  [[nodiscard]] static Result<KnownRows> of(const fs::path& file) {
    KnownRows known;
    known.file_ = file;
    std::ifstream in(file);
    std::uint32_t number = 0;
    for (std::string line; std::getline(in, line);) {
      ++number;
      const auto json = nlohmann::json::parse(line, nullptr, false);
      if (!json.is_object()) {
        return fail(ErrorCode::corrupt_data, "expected a JSON object, a row of ./dev bench bytes",
                    SourceLocation{file.string(), number, 0});
      }
      Row row = json.get<Row>();
      if (!json.contains("draws_tracked")) {
        if (row.tracked == 0) continue;  // which draws its error is of is not known
        row.draws_tracked = row.draws;
      }
      known.rows_.push_back(std::move(row));
    }
    return known;
  }

  [[nodiscard]] const Row* find(const Row& like) const {
    const auto key = [](const Row& row) {
      return std::tie(row.recording, row.way, row.size, row.settings, row.draws);
    };
    const auto found =
        std::ranges::find_if(rows_, [&](const Row& row) { return key(row) == key(like); });
    return found == rows_.end() ? nullptr : &*found;
  }

  /// Errors: `io_failure`.
  [[nodiscard]] Result<void> add(const Row& row) {
    rows_.push_back(row);
    if (file_.empty()) return {};
    std::ofstream out(file_, std::ios::app);
    out << nlohmann::json(row).dump() << std::endl;
    if (out) return {};
    return fail(ErrorCode::io_failure, "cannot write", SourceLocation{file_.string(), 0, 0});
  }

 private:
  fs::path file_;
  std::vector<Row> rows_;
};

struct Drawn {
  RunSummary summary;
  double build_seconds = 0.0;
};

void print(const Row& row) {
  std::string error = "-", p95 = "-";
  if (row.draws_tracked > 0) {
    error = fmt::format("{:.2f}", row.error);
    if (row.draws_tracked > 1) error += fmt::format(" ({:.2f} to {:.2f})", row.least, row.most);
    p95 = fmt::format("{:.2f}", row.p95);
  }
  print_row({row.way, row.size, cli::grouped(static_cast<std::uint64_t>(row.bytes + 0.5)),
             std::move(error), std::move(p95), fmt::format("{} of {}", row.tracked, row.scans),
             std::to_string(row.lost), fmt::format("{:.2f}", row.align_ms),
             fmt::format("{:.1f}", row.build_s)});
}

class Bench {
 public:
  Bench(const Recording& recording, const Options& options, KnownRows& known)
      : recording_(recording), options_(options), known_(known) {
    if (!options.matcher.empty()) matcher_ = MatcherOption::from(options.matcher).overrides();
  }

  /// Builds and localizes the drive, unless the row is known, and prints it.
  [[nodiscard]] Result<Row> measure(const Way& way, const Size& size) {
    Row row{.recording = recording_.name, .way = way.name, .size = size.text};
    row.settings = options_.matcher;
    if (way.file == std::string_view("small.toml")) {
      row.settings += fmt::format(" {}", fmt::join(options_.set, " "));
    }
    row.draws = size.draws.size();
    if (const Row* measured = known_.find(row)) {
      row = *measured;
    } else {
      VANTAGE_CHECK(measure_into(row, way, size));
      VANTAGE_CHECK(known_.add(row));
    }
    print(row);
    return row;
  }

 private:
  [[nodiscard]] Result<void> measure_into(Row& row, const Way& way, const Size& size) const {
    const double share = 1.0 / static_cast<double>(size.draws.size());
    for (const Overrides& overrides : size.draws) {
      VANTAGE_TRY(const Drawn drawn, draw(way.file, overrides));
      const RunSummary& run = drawn.summary;
      const bool first = row.scans == 0;
      if (run.tracked > 0) {
        const double error = 1e2 * run["error_m"].mean;
        row.least = row.draws_tracked == 0 ? error : std::min(row.least, error);
        row.most = std::max(row.most, error);
        const double weight = 1.0 / static_cast<double>(++row.draws_tracked);
        row.error = std::lerp(row.error, error, weight);
        row.p95 = std::lerp(row.p95, 1e2 * run["error_m"].p95, weight);
      }
      row.bytes += share * run["map_bytes"].mean;
      row.align_ms += share * run["align_ms"].mean;
      row.build_s += share * drawn.build_seconds;
      row.tracked = first ? run.tracked : std::min(row.tracked, run.tracked);
      row.lost = std::max(row.lost, run.count("lost"));
      row.scans = run.scans;
    }
    return {};
  }

  [[nodiscard]] Result<Drawn> draw(const std::string& file, const Overrides& overrides) const {
    const test::TemporaryFolder folder;
    Overrides own;
    if (file == "wide.toml") {
      // Its bytes are those of the map, not of places to look for a lost sensor.
      own = {"viewpoints.voxel_size=50.0", "viewpoints.sensor_height=1.0"};
    } else if (file != "L20.toml") {
      own = recording_.of_surface;
    }
    VANTAGE_TRY(const Config config,
                load_config(recording_.configs / file,
                            Overrides{"store.params.root=" + (folder.path() / "bundle").string()} +
                                matcher_ + own + overrides));
    VANTAGE_TRY(const BuildReport built, build_bundle(config, recording_.map));
    const cli::ThreadLimit one_thread(1);
    VANTAGE_TRY(const Run run, localize_scans(config, test::built_plugins(), recording_.inputs));
    if (run.failure) return fail(*run.failure);
    return Drawn{summarize(run), built.core_seconds_visibility + built.core_seconds_selection};
  }

  const Recording& recording_;
  const Options& options_;
  KnownRows& known_;
  Overrides matcher_;
};

/// The rows of a way, by size.
struct Line {
  std::string name;
  std::vector<Row> rows;
};

struct Measured {
  std::string title;
  Row whole = {};
  std::vector<Line> lines = {};
};

Result<Measured> measure(const Recording& recording, const Options& options, KnownRows& known) {
  print_head(recording.title, {"map", "size", "bytes a region", "error mean [cm]", "p95 [cm]",
                               "tracked", "lost", "align [ms]", "build [s]"});
  Bench bench(recording, options, known);
  Measured all{.title = recording.title};
  const Size kept_as_cells{"", {{"store.content=prepared"}}};
  const auto cells = bench.measure({"cells: whole map", "wide.toml"}, kept_as_cells);
  if (!cells && cells.error().code != ErrorCode::unsupported) return fail(cells.error());
  for (const Way& way : ways(options, cells.has_value())) {
    Line line{way.name, {}};
    for (const Size& size : way.sizes) {
      VANTAGE_TRY(line.rows.emplace_back(), bench.measure(way, size));
    }
    all.lines.push_back(std::move(line));
  }
  all.whole = options.cells && cells ? *cells : all.lines.front().rows.front();
  return all;
}

// ---- the figure

/// The ways that are drawn, in the order of the curves' looks, and what they are called there.
constexpr std::array<std::pair<std::string_view, const char*>, kMostCurves> kDrawn{
    {{"contribution", "cells that contribute"},
     {"points: surface", "points (surface)"},
     {"grid", "cells of a grid"},
     {"points: hpr", "points (hpr)"},
     {"fullest", "fullest cells"},
     {"random", "random cells"}}};

/// 1, 2 and 5 times powers of ten, from below the least to above the greatest.
std::vector<Tick> logarithmic(double least, double greatest,
                              const std::function<std::string(double)>& text) {
  std::vector<Tick> all;
  for (double power = std::pow(10.0, std::floor(std::log10(least)));; power *= 10.0) {
    for (const double value : {power, 2.0 * power, 5.0 * power}) {
      if (all.size() == 1 && value <= least) all.clear();
      all.push_back({value, text(value)});
      if (value >= greatest) return all;
    }
  }
}

std::string in_bytes(double bytes) {
  return bytes < 1e6 ? fmt::format("{:g} kB", 1e-3 * bytes) : fmt::format("{:g} MB", 1e-6 * bytes);
}

constexpr double kMostTimes = 20.0;  // the whole map's error; more is drawn on the border

Panel panel_of(const Measured& measured) {
  Panel panel{
      measured.title,
      {"bytes of a region's map", {}, true},
      {"mean error [cm]", {}, true},
      {},
      {{measured.whole.error, fmt::format("whole map ({:.1f} MB): {:.2f} cm",
                                          1e-6 * measured.whole.bytes, measured.whole.error)}},
      true};
  double least = measured.whole.error, most = 2.0 * least;
  const Row* all_cells = nullptr;  // nothing is chosen
  for (const Line& line : measured.lines) {
    if (line.name == "cells: surface" && line.rows.front().draws_tracked > 0) {
      all_cells = &line.rows.front();
    }
    for (const Row& row : line.rows) {
      if (row.draws_tracked == 0) continue;
      least = std::min(least, row.least);
      most = std::max(most, row.most);
    }
  }
  for (const auto& [name, shown] : kDrawn) {
    Curve curve{shown, {}, name == "contribution"};
    for (const Line& line : measured.lines) {
      if (line.name != name) continue;
      for (const Row& row : line.rows) {
        if (row.draws_tracked == 0) continue;
        curve.marks.push_back(
            {row.bytes, row.error, "", row.least, row.most, row.tracked < row.scans});
      }
      if (all_cells == nullptr || name.starts_with("points")) continue;
      curve.marks.push_back({all_cells->bytes, all_cells->error});
    }
    std::ranges::sort(curve.marks, {}, &Mark::x);
    panel.curves.push_back(std::move(curve));
  }
  panel.x.ticks = logarithmic(2e3, 1e7, in_bytes);
  std::erase_if(panel.x.ticks, [](const Tick& tick) {
    return in_bytes(tick.value).front() != '1' && tick.value > 2e3 && tick.value < 1e7;
  });
  panel.y.ticks = logarithmic(0.7 * least, std::min(most, kMostTimes * measured.whole.error),
                              [](double cm) { return fmt::format("{:g}", cm); });
  return panel;
}

std::string plotted(const std::vector<Measured>& all, const Options& options) {
  std::vector<Panel> panels;
  for (const Measured& measured : all) panels.push_back(panel_of(measured));
  return to_svg(
      panels, std::max(620.0, 340.0 * static_cast<double>(panels.size())), 440.0,
      fmt::format("Curves of cells end at all cells. Hollow: not all scans were tracked. Band: {} "
                  "draws of random cells.",
                  options.seeds));
}

Result<void> run(Options options) {
  const cli::ThreadLimit threads(options.jobs);
  if (options.quick) {
    options.recordings = {"demo"};
    options.kilobytes = {5, 20, 80};
    options.voxels = {0.3};
    options.seeds = 2;
  }
  VANTAGE_TRY(KnownRows known, KnownRows::of(options.rows));
  std::vector<Measured> all;
  for (const std::string& name : options.recordings) {
    VANTAGE_TRY(const auto recording, load(name));
    if (!recording) continue;
    VANTAGE_TRY(all.emplace_back(), measure(*recording, options, known));
  }
  if (options.svg.empty()) return {};
  return io::write_text_atomically(options.svg, plotted(all, options));
}

void declare(Arguments& arguments, Options& options) {
  arguments.program(
      "./dev bench bytes",
      "What a region's bytes buy: the error of a drive against the size of its region maps, for "
      "cells chosen by selectors, all cells, points thinned, and the whole map: a markdown table "
      "and a plot.");
  arguments
      .shown("--recordings", options.recordings, "which of demo, campus and kitti_street",
             "NAME,...", CLI::IsMember({"demo", "campus", "kitti_street"}))
      ->delimiter(',');
  arguments.shown("--selectors", options.selectors, "which choose cells", "NAME,...")
      ->delimiter(',');
  arguments
      .shown("--kilobytes", options.kilobytes, "sizes of a region's chosen cells", "KB,...",
             CLI::PositiveNumber)
      ->delimiter(',');
  arguments
      .shown("--voxels", options.voxels, "points are thinned to one for each of these", "M,...",
             CLI::PositiveNumber)
      ->delimiter(',');
  arguments.shown("--seeds", options.seeds, "draws of the selector random", "N",
                  CLI::PositiveNumber);
  arguments.add("--matcher", options.matcher,
                "instead of that of the configurations, and its parameters: "
                "'ndt: resolution = 2.0'",
                "PLUGIN[:PARAMS]");
  arguments.add("--set", options.set, "of the configurations with a selector", "KEY=VALUE");
  arguments.flag("--cells", options.cells, "no rows of points");
  arguments.flag("--quick", options.quick, "the demo's campus alone, few sizes, two draws");
  arguments.add(
      "--rows", options.rows,
      "keeps the rows, a line of JSON each, and takes those that are there from it: a run "
      "that was stopped goes on",
      "FILE");
  arguments.svg(options.svg);
  arguments.shown("-j,--jobs", options.jobs, "threads of the builds; drives have one; 0: all", "N");
}

const auto program = table(declare, run);

}  // namespace
}  // namespace vantage::benchmarks

int main(int argc, char** argv) { return vantage::benchmarks::program(argc, argv); }
