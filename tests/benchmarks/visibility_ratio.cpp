// hpr beside Open3D in one run, as tables: one viewpoint, all viewpoints of a map, and how the cost
// of a viewpoint grows with the map.
#include <fmt/format.h>
#include <malloc.h>
#include <open3d/geometry/PointCloud.h>
#include <open3d/geometry/TriangleMesh.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "arguments.hpp"
#include "maps.hpp"
#include "support/plugins.hpp"
#include "terminal/command_line.hpp"
#include "terminal/table.hpp"
#include "vantage/visibility.hpp"

namespace vantage::benchmarks {
namespace {

using cli::grouped;

constexpr double kUnlimited = std::numeric_limits<double>::infinity();
constexpr double kSensorRange = 100.0;        // of the paper's sensor [m]
constexpr std::size_t kSingleViewpoints = 3;  // of a map without named ones

struct Options {
  bool single = false, whole = false, growth = false;  // none: single and whole
  std::filesystem::path map;                           // empty: the campus
  double campus_size = 200.0;                          // [m]
  double alpha = 100.0;
  std::optional<double> max_range;  // [m]
  std::optional<double> cell;       // [m]
  ViewpointParams viewpoints;
  std::size_t sample = 40;  // 0: all
  std::size_t open3d_sample = 5;
  std::vector<double> sizes{82.0, 141.0, 258.0, 447.0};  // [m]

  [[nodiscard]] double range() const { return max_range.value_or(kUnlimited); }
};

// ---- measuring

/// [s]. What others do on the machine tells in `wall`, so one thread is measured by `cpu`, the time
/// of the whole process.
struct Seconds {
  double wall = 0.0, cpu = 0.0;
  Seconds& operator+=(const Seconds& more) {
    wall += more.wall;
    cpu += more.cpu;
    return *this;
  }
};

class Stopwatch {
 public:
  [[nodiscard]] Seconds elapsed() const {
    const Seconds end = now();
    return {.wall = end.wall - start_.wall, .cpu = end.cpu - start_.cpu};
  }

 private:
  [[nodiscard]] static Seconds now() {
    timespec cpu{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &cpu);
    const auto wall = std::chrono::steady_clock::now().time_since_epoch();
    return {.wall = std::chrono::duration<double>(wall).count(),
            .cpu = static_cast<double>(cpu.tv_sec) + 1e-9 * static_cast<double>(cpu.tv_nsec)};
  }
  Seconds start_ = now();
};

/// Runs until half a second is spent, at least once. @return  the median of the CPU times [s]
template <class F>
double median_cpu(const F& run) {
  constexpr double kEnough = 0.5;  // [s]
  std::vector<double> times;
  for (double spent = 0.0; spent < kEnough; spent += times.back()) {
    const Stopwatch stopwatch;
    run();
    times.push_back(stopwatch.elapsed().cpu);
  }
  const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
  std::nth_element(times.begin(), middle, times.end());
  return *middle;
}

/// From now on `peak_megabytes` counts anew, where the system lets it.
void forget_peak() {
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << 5;
}

std::uint64_t megabytes(std::uint64_t bytes) { return bytes / 1'000'000; }

std::uint64_t peak_megabytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return megabytes(static_cast<std::uint64_t>(usage.ru_maxrss) * 1024);
}

// ---- the two operators

/// The points that Open3D is handed where its call is timed: those in reach, in the map's order. So
/// the time is that of the bare call; the plugin hpr_open3d costs more.
open3d::geometry::PointCloud in_reach(PointsView map, const Point& viewpoint, double max_range) {
  open3d::geometry::PointCloud cloud;
  cloud.points_.reserve(map.size() + 1);  // it reads one element behind the last
  std::copy_if(map.begin(), map.end(), std::back_inserter(cloud.points_), [&](const Point& p) {
    const double distance = (p - viewpoint).norm();
    return distance > 0.0 && distance <= max_range;
  });
  return cloud;
}

struct Prepared {
  PluginPtr<VisibilityOperator> visibility;
  std::unique_ptr<VisibilityScene> scene;  // goes before its library
};

Result<Prepared> prepare(const char* plugin, PointsView map, double alpha, double max_range) {
  auto visibility = test::plugin<VisibilityOperator>(plugin, fmt::format("alpha = {}", alpha));
  VANTAGE_TRY(auto scene,
              visibility->prepare(map, {.map_bounds = bounds_of(map), .max_range = max_range}));
  return Prepared{std::move(visibility), std::move(scene)};
}

std::size_t differing(const IndexList& a, const IndexList& b) {
  IndexList difference;
  std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(),
                                std::back_inserter(difference));
  return difference.size();
}

/// Points of `a` that are not in `b`.
std::size_t missing(const IndexList& a, const IndexList& b) {
  IndexList difference;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(difference));
  return difference.size();
}

IndexList joined(const IndexList& a, const IndexList& b) {
  IndexList all;
  std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(all));
  return all;
}

Result<void> none_differ(std::size_t number) {
  if (number == 0) return {};
  return fail(ErrorCode::internal, fmt::format("{} points differ; see the tables", number));
}

// ---- printing

void print_row(const std::vector<std::string>& cells) {
  std::cout << fmt::format("| {} |\n", fmt::join(cells, " | ")) << std::flush;
}

void print_head(const std::string& title, const std::vector<std::string>& columns) {
  std::cout << fmt::format("\n{}\n\n", title);
  print_row(columns);
  print_row(std::vector<std::string>(columns.size(), "---"));
}

std::string milliseconds(double seconds) { return fmt::format("{:.1f} ms", 1e3 * seconds); }
std::string ratio(double of, double to) { return fmt::format("{:.1f}", of / to); }
std::string metres(double range) {
  return std::isinf(range) ? "unlimited" : fmt::format("{:g} m", range);
}
std::string text(const Point& p) {
  return fmt::format("{:.1f}, {:.1f}, {:.1f}", p.x(), p.y(), p.z());
}

// ---- one viewpoint

Result<std::size_t> single_rows(const std::string& name, PointsView map,
                                std::span<const Point> viewpoints, double alpha) {
  std::size_t different = 0;
  const double radius = alpha * bounds_of(map).diagonal();
  for (const double max_range : {kUnlimited, kSensorRange}) {
    VANTAGE_TRY(const auto hpr, prepare("hpr", map, alpha, max_range));
    VANTAGE_TRY(const auto open3d, prepare("hpr_open3d", map, alpha, max_range));
    for (const Point& viewpoint : viewpoints) {
      VANTAGE_TRY(const auto seen, hpr.scene->visible(viewpoint));
      VANTAGE_TRY(const auto expected, open3d.scene->visible(viewpoint));
      const std::size_t here = differing(seen, expected);
      different += here;
      const double ours = median_cpu([&] { (void)hpr.scene->visible(viewpoint); });
      const auto cloud = in_reach(map, viewpoint, max_range);
      const double theirs = median_cpu([&] { (void)cloud.HiddenPointRemoval(viewpoint, radius); });
      print_row({name, grouped(map.size()), text(viewpoint), metres(max_range),
                 grouped(expected.size()), milliseconds(ours), milliseconds(theirs),
                 ratio(theirs, ours), grouped(here)});
    }
  }
  return different;
}

Result<void> single(const std::string& name, PointsView map, const PointCloud& viewpoints,
                    const Options& options) {
  const cli::ThreadLimit one_thread(1);
  print_head(
      fmt::format("One viewpoint, alpha = {:g}, 1 thread, CPU time", options.alpha),
      {"map", "points", "viewpoint", "range", "seen", "hpr", "Open3D", "ratio", "differing"});
  std::size_t different = 0;
  if (options.map.empty()) {
    VANTAGE_TRY(const auto recorded, street());
    if (recorded) {
      VANTAGE_TRY(different,
                  single_rows("kitti_street", *recorded, kStreetViewpoints, options.alpha));
    }
  }
  VANTAGE_TRY(const std::size_t more,
              single_rows(name, map, thinned(viewpoints, kSingleViewpoints), options.alpha));
  return none_differ(different + more);
}

// ---- all viewpoints of a map

/// The viewpoints of each L x L m cell, in which a build asks for them.
std::vector<PointCloud> by_cells(const PointCloud& viewpoints, double cell) {
  std::map<std::pair<double, double>, PointCloud> cells;
  for (const Point& q : viewpoints) {
    cells[{std::floor(q.x() / cell), std::floor(q.y() / cell)}].push_back(q);
  }
  std::vector<PointCloud> all;
  for (auto& [where, inside] : cells) all.push_back(std::move(inside));
  return all;
}

/// What hpr is asked: the viewpoints of each call of `visible_from_any`.
struct Questions {
  std::vector<PointCloud> calls;
  PointCloud viewpoints;  // of all calls
  std::string sampling, how;
};

/// Of cells whole ones are sampled: what neighbouring viewpoints share is shared then, too.
Questions questions_for(const PointCloud& viewpoints, const Options& options) {
  const std::size_t wanted = options.sample == 0 ? viewpoints.size() : options.sample;
  Questions asked;
  if (options.cell) {
    const auto cells = by_cells(viewpoints, *options.cell);
    const std::size_t share = (wanted * cells.size() + viewpoints.size() - 1) / viewpoints.size();
    asked.calls = thinned(cells, std::max<std::size_t>(1, share));
    asked.how =
        fmt::format("{} of {} cells of {:g} m", asked.calls.size(), cells.size(), *options.cell);
  } else {
    asked.calls = {thinned(viewpoints, wanted)};
    asked.how = "1";
  }
  for (const PointCloud& call : asked.calls) {
    asked.viewpoints.insert(asked.viewpoints.end(), call.begin(), call.end());
  }
  asked.sampling = asked.viewpoints.size() == viewpoints.size()
                       ? "all"
                       : grouped(asked.viewpoints.size()) + ", evenly sampled" +
                             (options.cell ? " by whole cells" : "");
  return asked;
}

struct Union {
  IndexList seen;
  Seconds prepare, visible;
  std::uint64_t peak_megabytes = 0;
};

Result<Union> union_of(PointsView map, const std::vector<PointCloud>& calls, const Options& options,
                       std::size_t threads) {
  const cli::ThreadLimit limit(threads);
  forget_peak();
  Union result;
  const Stopwatch preparing;
  VANTAGE_TRY(const auto hpr, prepare("hpr", map, options.alpha, options.range()));
  result.prepare = preparing.elapsed();
  for (const PointCloud& viewpoints : calls) {
    const Stopwatch seeing;
    VANTAGE_TRY(const auto seen, hpr.scene->visible_from_any(viewpoints));
    result.visible += seeing.elapsed();
    result.seen = result.seen.empty() ? seen : joined(result.seen, seen);
  }
  result.peak_megabytes = peak_megabytes();
  return result;
}

/// What Open3D says of some viewpoints, and how often hpr says something else.
struct Reference {
  double open3d_each = 0.0, hpr_each = 0.0;  // CPU time of a viewpoint, mean [s]
  IndexList seen;                            // from any of them
  std::size_t differing = 0;                 // one by one
  std::size_t union_differing = 0;
};

Result<Reference> reference_of(PointsView map, const PointCloud& viewpoints,
                               const Options& options) {
  const cli::ThreadLimit one_thread(1);
  VANTAGE_TRY(const auto hpr, prepare("hpr", map, options.alpha, options.range()));
  VANTAGE_TRY(const auto open3d, prepare("hpr_open3d", map, options.alpha, options.range()));
  const double radius = options.alpha * bounds_of(map).diagonal();
  const double share = 1.0 / static_cast<double>(viewpoints.size());
  Reference result;
  for (const Point& viewpoint : viewpoints) {
    const auto cloud = in_reach(map, viewpoint, options.range());
    const Stopwatch theirs;
    (void)cloud.HiddenPointRemoval(viewpoint, radius);
    result.open3d_each += share * theirs.elapsed().cpu;
    const Stopwatch ours;
    VANTAGE_TRY(const auto got, hpr.scene->visible(viewpoint));
    result.hpr_each += share * ours.elapsed().cpu;
    VANTAGE_TRY(const auto expected, open3d.scene->visible(viewpoint));
    result.differing += differing(expected, got);
    result.seen = joined(result.seen, expected);
  }
  VANTAGE_TRY(const auto any, hpr.scene->visible_from_any(viewpoints));
  result.union_differing = differing(result.seen, any);
  return result;
}

Result<void> whole(const std::string& name, PointsView map, const PointCloud& viewpoints,
                   const Options& options) {
  const Questions asked = questions_for(viewpoints, options);
  const PointCloud& sample = asked.viewpoints;
  const PointCloud of_open3d = thinned(sample, options.open3d_sample);
  VANTAGE_TRY(const auto one, union_of(map, asked.calls, options, 1));
  VANTAGE_TRY(const auto two, union_of(map, asked.calls, options, 2));
  VANTAGE_TRY(const auto reference, reference_of(map, of_open3d, options));

  const auto all = static_cast<double>(viewpoints.size());
  const double millions = static_cast<double>(map.size()) / 1e6;
  const bool complete = sample.size() == viewpoints.size();
  const double each = one.visible.cpu / static_cast<double>(sample.size());
  const double of_all = one.prepare.cpu + each * all, of_all_open3d = reference.open3d_each * all;
  const double wall_one = one.prepare.wall + one.visible.wall;
  const double wall_two = two.prepare.wall + two.visible.wall;
  const std::size_t k = of_open3d.size();
  const auto seconds = [](double s) { return fmt::format("{:.2f} s", s); };

  print_head(fmt::format("All viewpoints of {}, alpha = {:g}, range {}", name, options.alpha,
                         metres(options.range())),
             {"what", "figure"});
  print_row({"points of the map", grouped(map.size())});
  print_row({fmt::format("viewpoints, every {:g} m", options.viewpoints.voxel_size),
             grouped(viewpoints.size())});
  print_row({"of these asked of hpr", asked.sampling});
  print_row({"calls of visible_from_any", asked.how});
  print_row({"points seen from any", grouped(one.seen.size())});
  print_row({"hpr, prepare: 1 thread, CPU time", seconds(one.prepare.cpu)});
  print_row({"hpr, visible_from_any: 1 thread, CPU time", seconds(one.visible.cpu)});
  print_row({"the same, a viewpoint", milliseconds(each)});
  print_row({"the same, core-seconds per (viewpoint x million points)",
             fmt::format("{:.6f}", each / millions)});
  print_row({fmt::format("hpr, visible, mean of {} viewpoints: 1 thread, CPU time", k),
             milliseconds(reference.hpr_each)});
  print_row({fmt::format("Open3D's call, mean of {} viewpoints: 1 thread, CPU time", k),
             milliseconds(reference.open3d_each)});
  print_row({"Open3D's call, times the number of viewpoints", seconds(of_all_open3d)});
  print_row({complete ? "hpr, prepare and visible_from_any"
                      : "hpr, prepare and visible_from_any, extrapolated to all viewpoints",
             seconds(of_all)});
  print_row({complete ? "ratio" : "ratio, hpr extrapolated", ratio(of_all_open3d, of_all)});
  print_row({"hpr, prepare and visible_from_any: 1 thread, wall clock", seconds(wall_one)});
  print_row({"hpr, prepare and visible_from_any: 2 threads, wall clock", seconds(wall_two)});
  print_row({"2 threads, times as fast as 1", fmt::format("{:.2f}", wall_one / wall_two)});
  print_row({"2 threads, CPU time", seconds(two.prepare.cpu + two.visible.cpu)});
  print_row({"the map in memory", fmt::format("{} MB", megabytes(map.size() * sizeof(Point)))});
  print_row({"peak memory of the process, 1 thread", fmt::format("{} MB", one.peak_megabytes)});

  const std::size_t threads_differ = differing(one.seen, two.seen);
  const std::size_t lacking = missing(reference.seen, one.seen);
  print_row({"points that differ: 1 and 2 threads", grouped(threads_differ)});
  print_row({fmt::format("points that differ from Open3D's: {} viewpoints, one by one", k),
             grouped(reference.differing)});
  print_row({fmt::format("points that differ from Open3D's: union of {} viewpoints", k),
             grouped(reference.union_differing)});
  print_row({"points that Open3D sees and the union of all lacks", grouped(lacking)});
  return none_differ(threads_differ + reference.differing + reference.union_differing + lacking);
}

// ---- how it grows

/// The viewpoints in the cell of width L in the middle of the map: a region as a build asks for it.
PointCloud in_the_middle(const PointCloud& viewpoints, const Bounds3& bounds, double width) {
  const Point middle = 0.5 * (bounds.min + bounds.max);
  PointCloud inside;
  for (const Point& q : viewpoints) {
    if ((q - middle).head<2>().cwiseAbs().maxCoeff() <= 0.5 * width) inside.push_back(q);
  }
  return inside;
}

Result<void> growth_row(double size, double width, const Options& options) {
  VANTAGE_TRY(const auto map, campus(size));
  VANTAGE_TRY(const auto all, viewpoints_over_ground(map, options.viewpoints));
  const PointCloud sample = thinned(all, options.sample == 0 ? all.size() : options.sample);
  const PointCloud region = in_the_middle(all, bounds_of(map), width);
  forget_peak();
  const Stopwatch preparing;
  VANTAGE_TRY(const auto hpr, prepare("hpr", map, options.alpha, options.range()));
  const double seconds_prepare = preparing.elapsed().cpu;
  const Stopwatch one_by_one;
  for (const Point& viewpoint : sample) {
    VANTAGE_CHECK(hpr.scene->visible(viewpoint));
  }
  const double each = one_by_one.elapsed().cpu / static_cast<double>(sample.size());
  const Stopwatch together;
  VANTAGE_CHECK(hpr.scene->visible_from_any(sample));
  const double each_together = together.elapsed().cpu / static_cast<double>(sample.size());
  const Stopwatch of_region;
  VANTAGE_CHECK(hpr.scene->visible_from_any(region));
  const double each_of_region = of_region.elapsed().cpu / static_cast<double>(region.size());
  print_row({fmt::format("{:g} m", size), grouped(map.size()), grouped(all.size()),
             fmt::format("{:.2f} s", seconds_prepare),
             fmt::format("{} ({})", milliseconds(each), sample.size()), milliseconds(each_together),
             fmt::format("{} ({})", milliseconds(each_of_region), region.size()),
             fmt::format("{} MB", megabytes(map.size() * sizeof(Point))),
             fmt::format("{} MB", peak_megabytes())});
  return {};
}

Result<void> growth(const Options& options) {
  const double width = options.cell.value_or(10.0);
  const cli::ThreadLimit one_thread(1);
  print_head(fmt::format("A viewpoint's cost on campuses of one density, alpha = {:g}, range {}, "
                         "1 thread, CPU time (in brackets: viewpoints asked)",
                         options.alpha, metres(options.range())),
             {"size", "points", "viewpoints", "prepare", "visible", "visible_from_any, the same",
              fmt::format("visible_from_any, the {:g} m cell in the middle", width), "map",
              "peak memory"});
  for (const double size : options.sizes) VANTAGE_CHECK(growth_row(size, width, options));
  return {};
}

Result<void> run(Options options) {
  if (!options.single && !options.whole && !options.growth) options.single = options.whole = true;
  if (options.single || options.whole) {
    const std::string name = options.map.empty() ? fmt::format("campus {:g} m", options.campus_size)
                                                 : options.map.filename().string();
    VANTAGE_TRY(const auto map,
                options.map.empty() ? campus(options.campus_size) : read_map(options.map));
    VANTAGE_TRY(const auto viewpoints, viewpoints_over_ground(map, options.viewpoints));
    if (viewpoints.empty()) return fail(ErrorCode::invalid_input, "the map has no ground");
    if (options.single) VANTAGE_CHECK(single(name, map, viewpoints, options));
    if (options.whole) VANTAGE_CHECK(whole(name, map, viewpoints, options));
  }
  if (options.growth) VANTAGE_CHECK(growth(options));
  return {};
}

void declare(Arguments& arguments, Options& options) {
  arguments.program("./dev bench visibility",
                    "Hidden point removal beside Open3D's, as markdown tables.");
  arguments.flag("--single", options.single, "the table of single viewpoints");
  arguments.flag("--whole", options.whole, "the table of all viewpoints of a map");
  arguments.flag(
      "--growth", options.growth,
      "how a viewpoint's cost grows with the map; without any of these three: the first two");
  arguments.add("--map", options.map, "point cloud instead of the simulated campus", "FILE",
                CLI::ExistingFile);
  arguments.shown("--campus", options.campus_size, "edge of the simulated campus", "M",
                  CLI::Range(60.0, 5000.0));
  arguments.shown("--alpha", options.alpha, "R in diagonals of the map", "FLOAT",
                  CLI::Range(1.0, 1e6));
  arguments.add("--max-range", options.max_range,
                "reach of the sensor; unlimited if left out (single viewpoints: both and 100 m)",
                "M", CLI::PositiveNumber);
  arguments.shown("--voxel", options.viewpoints.voxel_size, "s_voxel: one viewpoint each", "M",
                  CLI::PositiveNumber);
  arguments.shown("--viewpoints", options.sample,
                  "ask this many, evenly sampled, with --cell by whole cells; 0: all", "N");
  arguments.shown("--open3d", options.open3d_sample, "ask Open3D this many of them", "K",
                  CLI::PositiveNumber);
  arguments.add("--cell", options.cell,
                "one call of visible_from_any for each cell of this width, as a build does; one "
                "for all if left out (growth: 10)",
                "L", CLI::PositiveNumber);
  arguments
      .shown("--sizes", options.sizes, "campuses of --growth", "M,M,...", CLI::Range(60.0, 5000.0))
      ->delimiter(',');
}

const auto program = table(declare, run);

}  // namespace
}  // namespace vantage::benchmarks

int main(int argc, char** argv) { return vantage::benchmarks::program(argc, argv); }
