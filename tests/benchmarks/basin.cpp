// The basin of a matcher on the recorded street: from how far off it finds the reference, against
// the whole map, region maps of points, of cells, and of the cells that contribute.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "arguments.hpp"
#include "drive.hpp"
#include "plot.hpp"
#include "ready_map.hpp"
#include "starts.hpp"
#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "terminal/command_line.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/kit/atomic_file.hpp"

namespace vantage::benchmarks {
namespace {

struct Options {
  std::string matcher = "ndt";
  std::vector<double> kilobytes{20, 80};  // of a region's chosen cells
  std::size_t every = 4, directions = 8;
  std::vector<double> metres{0.25, 0.5, 1.0, 1.5, 2.0, 3.0};
  std::vector<double> degrees{1.0, 2.0, 5.0, 10.0, 15.0, 20.0};
  double centimetres_arrived = 10.0, degrees_arrived = 1.0;
  double scan_voxel = 0.5;  // [m]
  std::filesystem::path svg;
  std::size_t jobs = 0;  // 0: all cores
};

struct NamedMap {
  std::string name;
  ReadyMap map;
};

struct Share {
  std::size_t arrived = 0, of = 0;
  [[nodiscard]] double value() const {
    return static_cast<double>(arrived) / static_cast<double>(of);
  }
};

/// By metres, then by degrees; both begin with 0.
using Grid = std::vector<std::vector<Share>>;

bool arrives(const ReadyMap& map, const Frame& frame, const Pose& start, const Options& options) {
  const auto alignment = map.align(frame.scan, start);
  if (!alignment) return false;
  const PoseError error = error_of(alignment->T_map_scan, frame.T_map_scan);
  return error.centimetres <= options.centimetres_arrived &&
         error.degrees <= options.degrees_arrived;
}

Share share(const ReadyMap& map, const std::vector<Frame>& frames, const Off& off,
            const Options& options) {
  std::vector<Share> each(frames.size());
  tbb::parallel_for(std::size_t{0}, frames.size(), [&](std::size_t i) {
    for (const Pose& start : starts(frames[i].T_map_scan, off, options.directions)) {
      ++each[i].of;
      if (arrives(map, frames[i], start, options)) ++each[i].arrived;
    }
  });
  Share all;
  for (const Share& one : each) {
    all.arrived += one.arrived;
    all.of += one.of;
  }
  return all;
}

Grid grid(const ReadyMap& map, const std::vector<Frame>& frames, const Options& options) {
  Grid result;
  for (const double metres : options.metres) {
    result.emplace_back();
    for (const double degrees : options.degrees) {
      result.back().push_back(share(map, frames, {metres, degrees}, options));
    }
  }
  return result;
}

// ---- times

/// The first is how far off tracking is.
constexpr std::array kTimed{Off{0.05, 0.1}, Off{0.3, 1.0}, Off{1.0, 2.0}, Off{2.0, 5.0},
                            Off{3.0, 10.0}};

/// Mean CPU time of an alignment [ms], for each of kTimed. The starts take turns, so that all of
/// them meet the same load. What a map makes for its first far start is made before.
std::vector<double> times(const ReadyMap& map, const std::vector<Frame>& frames,
                          const Options& options) {
  const cli::ThreadLimit one(1);
  std::vector<double> seconds(kTimed.size(), 0.0);
  std::vector<std::size_t> of(kTimed.size(), 0);
  for (const Frame& frame : frames) {
    (void)map.align(frame.scan, starts(frame.T_map_scan, kTimed.back(), 2).front());
    for (std::size_t k = 0; k < kTimed.size(); ++k) {
      for (const Pose& start : starts(frame.T_map_scan, kTimed[k], options.directions)) {
        const double begin = cpu_seconds();
        (void)map.align(frame.scan, start);
        seconds[k] += cpu_seconds() - begin;
        ++of[k];
      }
    }
  }
  for (std::size_t k = 0; k < seconds.size(); ++k) {
    seconds[k] *= 1e3 / static_cast<double>(of[k]);
  }
  return seconds;
}

void print_times(const std::vector<NamedMap>& maps, const std::vector<Frame>& frames,
                 const Options& options) {
  std::vector<std::string> columns{"off by"};
  std::vector<std::vector<double>> of_maps;
  for (const NamedMap& map : maps) {
    columns.push_back(map.name);
    of_maps.push_back(times(map.map, frames, options));
  }
  print_head("Mean time of an alignment, one thread, CPU time, and its ratio to the first row:",
             columns);
  for (std::size_t k = 0; k < kTimed.size(); ++k) {
    std::vector<std::string> row{fmt::format("{:g} m, {:g}°", kTimed[k].metres, kTimed[k].degrees)};
    for (const auto& ms : of_maps) {
      row.push_back(fmt::format("{:.2f} ms, {:.2f}", ms[k], ms[k] / ms.front()));
    }
    print_row(row);
  }
}

// ---- maps

/// The region maps that a configuration of the street makes of it.
/// @param file       in configs/kitti_street
/// @param overrides  of it
Result<ReadyMap> regions(const char* file, std::vector<std::string> overrides,
                         const MatcherOption& option, const PluginPtr<ScanMatcher>& matcher,
                         const PointCloud& map) {
  const test::TemporaryFolder folder;
  for (std::string& more : option.overrides()) overrides.push_back(std::move(more));
  overrides.push_back("store.params.root=" + (folder.path() / "bundle").string());
  VANTAGE_TRY(const Config config,
              load_config(std::filesystem::path(VANTAGE_SOURCE_DIR) / "configs/kitti_street" / file,
                          overrides));
  VANTAGE_CHECK(build_bundle(config, map));
  VANTAGE_TRY(const Bundle bundle, Bundle::open(config, test::built_plugins(), "the benchmark"));
  return ReadyMap::of_bundle(bundle.reader(), matcher);
}

Result<std::vector<NamedMap>> maps(const PointCloud& map, const Options& options) {
  const MatcherOption option = MatcherOption::from(options.matcher);
  VANTAGE_TRY(const auto matcher, option.load());
  VANTAGE_TRY(auto target, matcher->prepare(map));
  const auto excerpt = target->excerpt(PointsView(map).first(1));
  const bool stores_cells = excerpt || excerpt.error().code != ErrorCode::unsupported;

  std::vector<NamedMap> all;
  all.push_back({"whole map", ReadyMap::everywhere(in_library_of(matcher, std::move(target)))});
  const auto add = [&](std::string name, const char* file,
                       std::vector<std::string> overrides) -> Result<void> {
    std::cerr << fmt::format("building {}: {}\n", file, name);
    VANTAGE_TRY(auto made, regions(file, std::move(overrides), option, matcher, map));
    all.push_back({std::move(name), std::move(made)});
    return {};
  };
  VANTAGE_CHECK(add("region map, points", "L20.toml", {"store.content=points"}));
  if (!stores_cells) return all;
  VANTAGE_CHECK(add("region map, cells", "L20.toml", {"store.content=prepared"}));
  for (const double kilobytes : options.kilobytes) {
    VANTAGE_CHECK(add(fmt::format("contribution, {:g} kB", kilobytes), "small.toml",
                      {fmt::format("selector.max_bytes={:.0f}", 1e3 * kilobytes)}));
  }
  return all;
}

// ---- what is printed

std::string percent(const Share& share) { return fmt::format("{:.0f} %", 100.0 * share.value()); }

std::vector<std::string> header(const std::string& first, const std::vector<double>& values,
                                const char* unit) {
  std::vector<std::string> columns{first};
  for (const double value : values) columns.push_back(fmt::format("{:g}{}", value, unit));
  return columns;
}

void print(const std::vector<NamedMap>& maps, const std::vector<Grid>& grids,
           const Options& options) {
  print_head("Moved by so many metres, not turned:", header("map", options.metres, " m"));
  for (std::size_t m = 0; m < maps.size(); ++m) {
    std::vector<std::string> row{maps[m].name};
    for (const auto& by_degrees : grids[m]) row.push_back(percent(by_degrees.front()));
    print_row(row);
  }
  print_head("Turned by so many degrees, not moved:", header("map", options.degrees, "°"));
  for (std::size_t m = 0; m < maps.size(); ++m) {
    std::vector<std::string> row{maps[m].name};
    for (const Share& share : grids[m].front()) row.push_back(percent(share));
    print_row(row);
  }
  for (std::size_t m = 0; m < maps.size(); ++m) {
    print_head(fmt::format("Moved and turned, {}:", maps[m].name),
               header("off by", options.degrees, "°"));
    for (std::size_t i = 0; i < options.metres.size(); ++i) {
      std::vector<std::string> row{fmt::format("{:g} m", options.metres[i])};
      for (const Share& share : grids[m][i]) row.push_back(percent(share));
      print_row(row);
    }
  }
}

std::string plotted(const std::vector<NamedMap>& maps, const std::vector<Grid>& grids,
                    const Options& options) {
  const Axis percents{fmt::format("ends within {:g} cm and {:g}° [%]", options.centimetres_arrived,
                                  options.degrees_arrived),
                      ticks({0, 20, 40, 60, 80, 100})};
  Panel by_metres{"Moved, not turned", {"start off by [m]", ticks(options.metres)}, percents, {}};
  Panel by_degrees{"Turned, not moved", {"start off by [°]", ticks(options.degrees)}, percents, {}};
  for (std::size_t m = 0; m < maps.size(); ++m) {
    Curve moved{maps[m].name, {}}, turned{maps[m].name, {}};
    for (std::size_t i = 0; i < options.metres.size(); ++i) {
      moved.marks.push_back({options.metres[i], 100.0 * grids[m][i].front().value()});
    }
    for (std::size_t i = 0; i < options.degrees.size(); ++i) {
      turned.marks.push_back({options.degrees[i], 100.0 * grids[m].front()[i].value()});
    }
    by_metres.curves.push_back(std::move(moved));
    by_degrees.curves.push_back(std::move(turned));
  }
  return to_svg({std::move(by_metres), std::move(by_degrees)});
}

void keep_every(std::size_t n, std::vector<Frame>& frames) {
  std::vector<Frame> kept;
  for (std::size_t i = 0; i < frames.size(); i += n) kept.push_back(std::move(frames[i]));
  frames = std::move(kept);
}

/// Ascending, from 0: so that an axis and a grid begin where nothing is off.
std::vector<double> from_zero(std::vector<double> values) {
  values.push_back(0.0);
  std::ranges::sort(values);
  values.erase(std::ranges::unique(values).begin(), values.end());
  return values;
}

Result<void> run(Options options) {
  const auto folder = test::real_data("kitti_street");
  if (!folder) return {};
  const cli::ThreadLimit threads(options.jobs);
  options.metres = from_zero(std::move(options.metres));
  options.degrees = from_zero(std::move(options.degrees));
  VANTAGE_TRY(Drive drive, load_drive(*folder, options.scan_voxel));
  keep_every(options.every, drive.frames);
  VANTAGE_TRY(const auto all, maps(drive.map, options));
  std::vector<Grid> grids;
  for (const NamedMap& map : all) grids.push_back(grid(map.map, drive.frames, options));

  std::cout << fmt::format(
      "\nkitti_street, {}: {} scans, {} directions; share of the alignments that end within {:g} "
      "cm and {:g}° of the reference\n",
      options.matcher, drive.frames.size(), options.directions, options.centimetres_arrived,
      options.degrees_arrived);
  print(all, grids, options);
  print_times(all, drive.frames, options);
  if (options.svg.empty()) return {};
  return io::write_text_atomically(options.svg, plotted(all, grids, options));
}

void declare(Arguments& arguments, Options& options) {
  arguments.program(
      "./dev bench basin",
      "From how far off a matcher finds the pose, on the recorded street, against the whole map "
      "and against its region maps of points, of cells and of the cells that contribute; and how "
      "long an alignment takes: markdown tables and a plot.");
  const CLI::Validator even(
      [](const std::string& text) {
        return (text.back() - '0') % 2 == 0 ? std::string() : std::string("it must be even");
      },
      "", "EVEN");
  arguments.shown("--matcher", options.matcher,
                  "which, and with which parameters: 'ndt: resolution = 2.0; neighbours = ...'",
                  "PLUGIN[:PARAMS]");
  arguments
      .shown("--kilobytes", options.kilobytes,
             "sizes of a region's map of the cells that contribute", "KB,...", CLI::PositiveNumber)
      ->delimiter(',');
  arguments.shown("--every", options.every, "every N-th of the 77 scans", "N", CLI::PositiveNumber);
  arguments
      .shown("--metres", options.metres, "how far starts are moved", "M,M,...", CLI::PositiveNumber)
      ->delimiter(',');
  arguments
      .shown("--degrees", options.degrees, "how far they are turned, to either side", "DEG,DEG,...",
             CLI::Range(0.01, 180.0))
      ->delimiter(',');
  arguments.shown("--directions", options.directions,
                  "in how many directions they are moved, evenly round; even", "N",
                  CLI::Range(std::size_t{2}, std::size_t{360}) & even);
  arguments.shown("--within-cm", options.centimetres_arrived, "how near the reference counts", "CM",
                  CLI::PositiveNumber);
  arguments.shown("--within-deg", options.degrees_arrived, "and how near in rotation", "DEG",
                  CLI::PositiveNumber);
  arguments.scan_voxel(options.scan_voxel);
  arguments.svg(options.svg);
  arguments.shown("-j,--jobs", options.jobs, "threads; the results do not depend on it; 0: all",
                  "N");
}

const auto program = table(declare, run);

}  // namespace
}  // namespace vantage::benchmarks

int main(int argc, char** argv) { return vantage::benchmarks::program(argc, argv); }
