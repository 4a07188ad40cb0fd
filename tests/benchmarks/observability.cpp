// Visibility operators against truth: how much of what is really seen from a viewpoint they select,
// by the share of the map that they select for it. On the recorded street and on a simulated
// campus, clean and with what vehicles left that drove past while it was mapped.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "arguments.hpp"
#include "drive.hpp"
#include "io/scan_sequence.hpp"
#include "plot.hpp"
#include "recall.hpp"
#include "simulate/drive.hpp"
#include "simulate/map_sampler.hpp"
#include "simulate/world.hpp"
#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "terminal/command_line.hpp"
#include "terminal/table.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "vantage/kit/atomic_file.hpp"
#include "vantage/visibility.hpp"

namespace vantage::benchmarks {
namespace {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

constexpr double kNearScan = 0.05;  // [m]

constexpr double kCampusReach = 100.0;  // of the simulated sensor [m]
constexpr std::size_t kCampusViewpoints = 6;
constexpr int kVehicles = 12;

constexpr std::array kRecalls{0.5, 0.8, 0.9, 0.95};  // of the summary
constexpr const char* kRangeImage = "range_image";
constexpr const char* kReference = "hpr";  // with which the others are compared

struct Options {
  std::vector<std::string> truths{"street", "campus", "vehicles"};
  std::vector<std::string> families;  // none: all
  std::vector<std::string> with;
  /// Of the street's 77, evenly over the drive: 000001.pcd to 000151.pcd.
  std::vector<std::size_t> scans{0, 12, 24, 37, 50, 62, 75};
  double campus_size = 120.0;         // [m]
  std::optional<std::uint64_t> seed;  // of the campus; none: its own
  std::filesystem::path svg;
};

// ---- what is compared

struct Setting {
  std::string label, params;  // params: TOML
  double max_range = kUnlimited;
};

/// An operator and the parameter that makes it select more or less of a map.
struct Family {
  std::string name, plugin;
  std::vector<Setting> settings;
};

std::vector<Setting> each(const std::string& key, const std::vector<double>& values) {
  std::vector<Setting> settings;
  for (const double value : values) {
    const std::string setting = fmt::format("{} = {:g}", key, value);
    settings.push_back({setting, setting});
  }
  return settings;
}

std::vector<Setting> each_range(const std::vector<double>& metres) {
  std::vector<Setting> settings;
  for (const double range : metres) {
    settings.push_back({fmt::format("max_range = {:g}", range), "", range});
  }
  return settings;
}

std::vector<Family> all_families() {
  return {
      {kReference, "hpr", each("alpha", {1e1, 3e1, 1e2, 3e2, 1e3, 3e3, 1e4, 3e4, 1e5, 3e5, 1e6})},
      {"hpr, inversion", "hpr", {{"kernel = inversion", "kernel = \"inversion\""}}},
      {"surface", "surface",
       each("faintest", {10.0, 5.0, 0.0, -5.0, -10.0, -15.0, -20.0, -25.0, -30.0, -35.0, -40.0,
                         -50.0, -60.0, -80.0, -110.0, -150.0, -200.0})},
      {kRangeImage, kRangeImage, each("tolerance", {0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0})},
      {"keep_all", "keep_all", each_range({10.0, 20.0, 30.0, 45.0, 60.0, 100.0})},
  };
}

/// "hpr: alpha = 1e6; kernel = ..." as a family of one setting.
Family family_of(const std::string& text) {
  const std::size_t colon = text.find(':');
  std::string params = colon == std::string::npos ? "" : text.substr(colon + 1);
  std::ranges::replace(params, ';', '\n');
  return {text, text.substr(0, colon), {{"", std::move(params)}}};
}

std::vector<Family> families(const Options& options) {
  std::vector<Family> chosen;
  for (Family& family : all_families()) {
    if (options.families.empty() ||
        std::ranges::find(options.families, family.plugin) != options.families.end()) {
      chosen.push_back(std::move(family));
    }
  }
  for (const std::string& text : options.with) chosen.push_back(family_of(text));
  return chosen;
}

// ---- truth

struct View {
  Point viewpoint;  // map frame [m]
  IndexList seen;   // strictly ascending
};

/// A map, and what of it is truly seen from where.
struct Truth {
  std::string name, title;
  PointCloud map{};
  std::vector<View> views{};
  double max_range = kUnlimited;  // of the sensor, which the operators are told [m]
  std::string field_of_view{};    // of the sensor, parameters of range_image; empty: its defaults
};

/// A point within 5 cm of one that a scan measured was seen from where that scan was taken.
Result<Truth> street(const std::filesystem::path& folder, std::span<const std::size_t> scans) {
  Truth truth{"street", "kitti_street: seen is what lies within 5 cm of a point of the scan"};
  VANTAGE_TRY(auto map, io::read_point_cloud(folder / "map.pcd"));
  truth.map = std::move(map.points);
  VANTAGE_TRY(const auto reference, io::read_trajectory(folder / "ref_poses_tum.txt"));
  VANTAGE_TRY(const auto sequence, io::ScanSequence::open(folder / "scans", 10.0));
  for (const std::size_t i : scans) {
    VANTAGE_TRY(auto scan, sequence.read(i));
    const auto pose = io::pose_at(reference, scan.stamp);
    if (!pose) {
      return fail(ErrorCode::invalid_input, fmt::format("{} has no pose", scan.name));
    }
    for (Point& p : scan.points) p = *pose * p;
    truth.views.push_back({pose->translation, points_near(truth.map, scan.points, kNearScan)});
  }
  return truth;
}

/// A point is seen if no surface of the world is before its own.
/// @param points  map frame [m]
IndexList seen_in(const simulation::World& world, PointsView points, const Point& viewpoint) {
  IndexList seen;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const Point to_point = points[i] - viewpoint;
    const double distance = to_point.norm();
    if (distance == 0.0 || distance > kCampusReach) continue;
    const auto hit = world.cast(viewpoint - world.map_origin(), to_point / distance, distance);
    if (!hit || is_on_first_surface(distance, hit->range, hit->cos_incidence)) seen.push_back(i);
  }
  return seen;
}

/// The campus, and the same campus with moving vehicles: their trails are the last points of the
/// map and never seen, because nothing is there any more.
Result<std::vector<Truth>> campus(const Options& options) {
  const double size = options.campus_size;
  VANTAGE_TRY(auto params,
              simulation::load_world(VANTAGE_SOURCE_DIR "/configs/simulate/campus200.toml",
                                     {fmt::format("campus.size_x={:.1f}", size),
                                      fmt::format("campus.size_y={:.1f}", size)}));
  params.seed = options.seed.value_or(params.seed);
  VANTAGE_TRY(const auto world, simulation::World::create(params));
  VANTAGE_TRY(const auto drive, simulation::Drive::create(world, params));
  const auto sampled = [&](int vehicles) {
    params.map.moving_vehicles = vehicles;
    return simulation::sample_map(world, params.map, params.seed);
  };
  Truth clean{
      "campus",
      fmt::format("simulated campus, {:g} x {:g} m: seen is what a ray reaches", size, size),
      sampled(0),
      {},
      kCampusReach,
      // As fine as the defaults, but in all directions, as the rays.
      "lowest_elevation = -90.0\nhighest_elevation = 90.0\nrings = 430\n"};
  for (std::size_t i = 0; i < kCampusViewpoints; ++i) {
    const Point in_campus =
        drive.pose(drive.stamp(i * drive.scans() / kCampusViewpoints)).translation;
    const Point viewpoint = in_campus + world.map_origin();
    clean.views.push_back({viewpoint, seen_in(world, clean.map, viewpoint)});
  }
  Truth vehicles = clean;
  vehicles.name = "vehicles";
  vehicles.title =
      fmt::format("{}; {} vehicles drove past while it was mapped", clean.title, kVehicles);
  vehicles.map = sampled(kVehicles);
  if (!std::equal(clean.map.begin(), clean.map.end(), vehicles.map.begin())) {
    return fail(ErrorCode::internal, "a map with vehicles does not begin as the one without");
  }
  return std::vector{std::move(clean), std::move(vehicles)};
}

Result<std::vector<Truth>> truths(const Options& options) {
  std::vector<Truth> all;
  const auto wanted = [&](const std::string& name) {
    return std::ranges::find(options.truths, name) != options.truths.end();
  };
  if (wanted("street")) {
    if (const auto folder = test::real_data("kitti_street")) {
      VANTAGE_TRY(auto truth, street(*folder, options.scans));
      all.push_back(std::move(truth));
    }
  }
  if (wanted("campus") || wanted("vehicles")) {
    VANTAGE_TRY(auto both, campus(options));
    for (Truth& truth : both) {
      if (wanted(truth.name)) all.push_back(std::move(truth));
    }
  }
  return all;
}

// ---- measuring

struct Row {
  std::string setting;
  Score score;                                          // of all viewpoints
  double seconds_prepare = 0.0, seconds_visible = 0.0;  // visible: of a viewpoint
};

struct Measured {
  std::string family;
  std::vector<Row> rows;

  [[nodiscard]] std::vector<RecallMark> curve() const {
    std::vector<RecallMark> marks;
    for (const Row& row : rows) marks.push_back({row.score.share(), row.score.recall()});
    return marks;
  }
};

Result<Row> measure(const Family& family, const Setting& setting, const Truth& truth) {
  const std::string sensor = family.plugin == kRangeImage ? truth.field_of_view : "";
  VANTAGE_TRY(const Table params, parse_toml(sensor + setting.params, family.name));
  VANTAGE_TRY(const auto visibility,
              test::built_plugins().load<VisibilityOperator>(PluginChoice{
                  .plugin = family.plugin, .library = {}, .params = params, .where = {}}));
  Row row{setting.label, {}};
  const double start = cpu_seconds();
  VANTAGE_TRY(
      const auto scene,
      visibility->prepare(truth.map, {.map_bounds = bounds_of(truth.map),
                                      .max_range = std::min(setting.max_range, truth.max_range)}));
  row.seconds_prepare = cpu_seconds() - start;
  for (const View& view : truth.views) {
    const double before = cpu_seconds();
    VANTAGE_TRY(const auto selected, scene->visible(view.viewpoint));
    row.seconds_visible += (cpu_seconds() - before) / static_cast<double>(truth.views.size());
    row.score += score_of(selected, view.seen, truth.map.size());
  }
  return row;
}

// ---- what is printed

std::string percent(double share) { return fmt::format("{:.1f}", 1e2 * share); }

void print_title(const Truth& truth) {
  Score ideal;
  for (const View& view : truth.views) ideal += score_of(view.seen, view.seen, truth.map.size());
  print_head(fmt::format("{}. {} points, {} viewpoints, {} % of the map seen from one; 1 thread, "
                         "CPU time",
                         truth.title, cli::grouped(truth.map.size()), truth.views.size(),
                         percent(ideal.share())),
             {"operator", "setting", "share [%]", "recall [%]", "precision [%]", "prepare [ms]",
              "a viewpoint [ms]"});
}

void print(const std::string& family, const Row& row) {
  print_row({family, row.setting, percent(row.score.share()), percent(row.score.recall()),
             percent(row.score.precision()), fmt::format("{:.0f}", 1e3 * row.seconds_prepare),
             fmt::format("{:.0f}", 1e3 * row.seconds_visible)});
}

void print_summary(const Truth& truth, const std::vector<Measured>& all) {
  std::vector<std::string> columns{"operator"};
  for (const double recall : kRecalls) columns.push_back(fmt::format("{:g} %", 1e2 * recall));
  print_head(fmt::format("{}: share of the map [%] at a recall of", truth.name), columns);
  for (const Measured& measured : all) {
    std::vector<std::string> cells{measured.family};
    for (const double recall : kRecalls) {
      const auto share = share_at(recall, measured.curve());
      cells.push_back(share ? percent(*share) : "-");
    }
    print_row(cells);
  }
}

std::string verdict(const Measured& measured, const Measured& reference) {
  std::vector<std::string> runs;
  for (const auto& [first, last] : recalls_with_less(measured.curve(), reference.curve())) {
    runs.push_back(fmt::format("{} to {} %", first, last));
  }
  return runs.empty() ? "nowhere" : fmt::format("at recalls of {}", fmt::join(runs, ", "));
}

void print_verdicts(const Truth& truth, const std::vector<Measured>& all) {
  const auto reference = std::ranges::find(all, kReference, &Measured::family);
  if (reference == all.end()) return;
  std::cout << '\n';
  for (const Measured& measured : all) {
    if (measured.family == kReference) continue;
    std::cout << fmt::format("{}: {} selects less of the map than {} {}\n", truth.name,
                             measured.family, kReference, verdict(measured, *reference));
  }
}

Panel panel(const Truth& truth, const std::vector<Measured>& all) {
  const std::vector<Tick> percents = ticks({0, 20, 40, 60, 80, 100});
  Panel panel{truth.name, {"selected of the map [%]", percents}, {"recall [%]", percents}, {}};
  for (const Measured& measured : all) {
    if (panel.curves.size() == kMostCurves) break;
    Curve curve{measured.family, {}};
    for (const RecallMark& mark : measured.curve()) {
      curve.marks.push_back({1e2 * mark.share, 1e2 * mark.recall});
    }
    panel.curves.push_back(std::move(curve));
  }
  return panel;
}

Result<void> run(const Options& options) {
  const auto compared = families(options);
  VANTAGE_TRY(const auto measured_on, truths(options));
  const cli::ThreadLimit one_thread(1);
  std::vector<Panel> panels;
  for (const Truth& truth : measured_on) {
    print_title(truth);
    std::vector<Measured> all;
    for (const Family& family : compared) {
      all.push_back({family.name, {}});
      for (const Setting& setting : family.settings) {
        VANTAGE_TRY(Row row, measure(family, setting, truth));
        print(family.name, row);
        all.back().rows.push_back(std::move(row));
      }
    }
    print_summary(truth, all);
    print_verdicts(truth, all);
    panels.push_back(panel(truth, all));
  }
  if (options.svg.empty() || panels.empty()) return {};
  return io::write_text_atomically(options.svg, to_svg(panels, 1200.0));
}

void declare(Arguments& arguments, Options& options) {
  arguments.program(
      "./dev bench observability",
      "What visibility operators find of what is truly seen, by the share of the map that they "
      "select, as markdown tables and a plot.");
  arguments
      .shown("--truths", options.truths,
             "street: recorded scans; campus: rays in a simulated world; vehicles: the same "
             "after vehicles drove past",
             "A,B,...", CLI::IsMember({"street", "campus", "vehicles"}))
      ->delimiter(',');
  arguments
      .add("--families", options.families,
           "only these operators: hpr, surface, range_image, keep_all", "A,B,...",
           CLI::IsMember({"hpr", "surface", "range_image", "keep_all"}))
      ->delimiter(',');
  arguments.add("--with", options.with,
                "also an operator with parameters of its own: 'hpr: alpha = 1e6'",
                "PLUGIN[:PARAMS]");
  arguments
      .shown("--scans", options.scans,
             "which of the street's 77 scans, the first being 0: each is a viewpoint", "N,N,...")
      ->delimiter(',');
  arguments.shown("--campus-size", options.campus_size, "edge of the simulated campus", "M",
                  CLI::PositiveNumber);
  arguments.add("--seed", options.seed,
                "of the campus, another makes another campus; if left out, that of "
                "configs/simulate/campus200.toml",
                "N");
  arguments.svg(options.svg);
}

const auto program = table(declare, run);

}  // namespace
}  // namespace vantage::benchmarks

int main(int argc, char** argv) { return vantage::benchmarks::program(argc, argv); }
