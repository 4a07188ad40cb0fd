// What a map's bytes buy on the recorded street: points, thinned points and stored cells, by their
// size, the error they give and the time until they can be matched against.
#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <iostream>
#include <limits>
#include <memory>
#include <numeric>
#include <random>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "arguments.hpp"
#include "drive.hpp"
#include "plot.hpp"
#include "ready_map.hpp"
#include "support/real_data.hpp"
#include "terminal/command_line.hpp"
#include "terminal/table.hpp"
#include "vantage/engine/viewpoints.hpp"
#include "vantage/evaluation/statistics.hpp"
#include "vantage/kit/atomic_file.hpp"

namespace vantage::benchmarks {
namespace {

constexpr std::size_t kBytesOfPoint = 12;  // three float32, as pcd_tiles stores them

// What cells must be beside all points.
constexpr double kLeastTimesSmaller = 15.0, kLeastTimesSooner = 10.0;
constexpr double kMostCentimetresWorse = 0.2;

struct Options {
  std::string matcher = "ndt";
  std::filesystem::path points, cells;  // configurations of built bundles; empty: L20 is built
  std::vector<double> voxels{0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5};  // [m]
  std::size_t repeats = 15;
  std::uint64_t seed = 1;
  double scan_voxel = 0.5;  // [m]
  std::filesystem::path svg;
};

struct Row {
  std::string name, content;  // content: "862,424 points"
  double bytes = 0.0;
  Statistics centimetres;
  std::size_t failed = 0;
  double seconds_ready = 0.0;
  std::string mark{};  // in the plot
};

/// What a store would read back.
PointCloud as_stored(PointCloud points) {
  for (Point& p : points) p = p.cast<float>().cast<double>();
  return points;
}

/// `count` of the points in their order, each set of them as likely as any other.
PointCloud at_random(const PointCloud& points, std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  count = std::min(count, points.size());
  std::vector<std::uint32_t> chosen(points.size());
  std::iota(chosen.begin(), chosen.end(), std::uint32_t{0});
  for (std::size_t i = 0; i < count; ++i) {  // % favours none by more than 2^-32
    std::swap(chosen[i], chosen[i + random() % (chosen.size() - i)]);
  }
  chosen.resize(count);
  std::ranges::sort(chosen);
  return select(points, chosen);
}

using MakeReady = std::function<Result<std::unique_ptr<MatchTarget>>()>;

/// Best of several: CPU time on one thread.
Result<double> seconds_ready(const MakeReady& make, std::size_t repeats) {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < repeats; ++i) {
    const double start = cpu_seconds();
    VANTAGE_TRY(const auto target, make());
    best = std::min(best, cpu_seconds() - start);
  }
  return best;
}

/// Matches and remembers in which regions.
DriveErrors follow_in(const ReadyMap& map, const Drive& drive, std::set<RegionId>& regions) {
  return follow(drive.frames, [&](PointsView scan, const Pose& guess) -> Result<Pose> {
    regions.insert(map.region_at(guess.translation));
    VANTAGE_TRY(const Alignment alignment, map.align(scan, guess));
    return alignment.T_map_scan;
  });
}

class Bench {
 public:
  Bench(const Drive& drive, const Options& options, const PluginPtr<ScanMatcher>& matcher)
      : drive_(drive), options_(options), matcher_(matcher) {}

  [[nodiscard]] Result<Row> of_points(std::string name, const PointCloud& points) const {
    VANTAGE_TRY(Row row, of_target([&] { return matcher_->prepare(points); }));
    row.name = std::move(name);
    row.content = cli::grouped(points.size()) + " points";
    row.bytes = static_cast<double>(kBytesOfPoint * points.size());
    return row;
  }

  [[nodiscard]] Result<Row> of_cells(std::string name, const PreparedMap& prepared) const {
    VANTAGE_TRY(Row row, of_target([&] { return matcher_->restore(prepared.bytes); }));
    row.name = std::move(name);
    row.content = cli::grouped(prepared.elements) + " cells";
    row.bytes = static_cast<double>(prepared.bytes.size());
    return row;
  }

  /// Bytes and seconds are the mean of the regions that the drive needs.
  [[nodiscard]] Result<Row> of_bundle(std::string name, const PluginPtr<MapStore>& store) const {
    VANTAGE_TRY(const auto map, ReadyMap::of_bundle(store, matcher_));
    std::set<RegionId> regions;
    Row row = row_of(follow_in(map, drive_, regions));
    row.name = std::move(name);
    double points = 0.0, cells = 0.0;
    const double share = 1.0 / static_cast<double>(regions.size());
    for (const RegionId region : regions) {
      VANTAGE_TRY(const RegionMap stored, store->get(region));
      VANTAGE_TRY(const double seconds, seconds_ready(
                                            [&] {
                                              return stored.prepared.bytes.empty()
                                                         ? matcher_->prepare(stored.points)
                                                         : matcher_->restore(stored.prepared.bytes);
                                            },
                                            options_.repeats));
      const RegionSummary& summary = map.index().regions[region.value];
      row.bytes += share * static_cast<double>(summary.bytes);
      row.seconds_ready += share * seconds;
      points += share * static_cast<double>(summary.points);
      cells += share * static_cast<double>(summary.elements);
    }
    row.content = cells > 0.0 ? cli::grouped(static_cast<std::uint64_t>(cells + 0.5)) + " cells"
                              : cli::grouped(static_cast<std::uint64_t>(points + 0.5)) + " points";
    row.content += fmt::format(" ({} of {} regions)", regions.size(), map.index().regions.size());
    return row;
  }

 private:
  static Row row_of(const DriveErrors& errors) {
    Row row;
    row.centimetres = statistics_of(errors.centimetres);
    row.failed = errors.failed;
    return row;
  }

  [[nodiscard]] Result<Row> of_target(const MakeReady& make) const {
    VANTAGE_TRY(auto target, make());
    std::set<RegionId> everywhere;
    const auto map = ReadyMap::everywhere(in_library_of(matcher_, std::move(target)));
    Row row = row_of(follow_in(map, drive_, everywhere));
    VANTAGE_TRY(row.seconds_ready, seconds_ready(make, options_.repeats));
    return row;
  }

  const Drive& drive_;
  const Options& options_;
  const PluginPtr<ScanMatcher>& matcher_;
};

/// The families of rows: each is a curve of the plot.
struct Rows {
  Row all;
  std::vector<Row> voxels, random, cells, regions;
};

Result<Row> of_regions(const Bench& bench, std::string name, StoredContent content,
                       const std::filesystem::path& config, const std::filesystem::path& map,
                       const MatcherOption& matcher) {
  const test::TemporaryFolder folder;
  std::vector<std::string> overrides;
  if (config.empty()) {
    VANTAGE_TRY(overrides, build_L20(map, folder.path() / "bundle", content, matcher));
  }
  VANTAGE_TRY(const auto store, open_bundle(config.empty() ? kL20 : config, overrides, content));
  return bench.of_bundle(std::move(name), store);
}

Result<Rows> measure(const Drive& drive, const std::filesystem::path& map_file,
                     const Options& options) {
  const MatcherOption option = MatcherOption::from(options.matcher);
  VANTAGE_TRY(const auto matcher, option.load());
  const Bench bench(drive, options, matcher);
  Rows rows;
  VANTAGE_TRY(rows.all, bench.of_points("all points", drive.map));

  std::vector<std::size_t> sizes;
  for (const double voxel : options.voxels) {
    VANTAGE_TRY(PointCloud centroids, voxel_centroids(drive.map, voxel));
    sizes.push_back(centroids.size());
    VANTAGE_TRY(Row row, bench.of_points(fmt::format("one point a voxel of {:g} m", voxel),
                                         as_stored(std::move(centroids))));
    row.mark = fmt::format("{:g} m", voxel);
    rows.voxels.push_back(std::move(row));
  }

  VANTAGE_TRY(const auto target, matcher->prepare(drive.map));
  VANTAGE_TRY(const PreparedMap cells, target->excerpt(drive.map));
  sizes.push_back(cells.bytes.size() / kBytesOfPoint);
  for (const std::size_t size : sizes) {
    VANTAGE_TRY(Row row,
                bench.of_points("random points", at_random(drive.map, size, options.seed)));
    rows.random.push_back(std::move(row));
  }

  VANTAGE_TRY(Row all_cells, bench.of_cells("cells of all points", cells));
  all_cells.mark = "all points";
  rows.cells.push_back(std::move(all_cells));
  VANTAGE_TRY(Row seen_cells, of_regions(bench, "a region's seen cells", StoredContent::prepared,
                                         options.cells, map_file, option));
  seen_cells.mark = "region map";
  rows.cells.push_back(std::move(seen_cells));
  VANTAGE_TRY(Row seen_points, of_regions(bench, "a region's seen points", StoredContent::points,
                                          options.points, map_file, option));
  seen_points.mark = "region map";
  rows.regions.push_back(std::move(seen_points));
  return rows;
}

// ---- what is printed

void print(const Row& row, const Row& all) {
  print_row({row.name, row.content, cli::grouped(static_cast<std::uint64_t>(row.bytes + 0.5)),
             fmt::format("1/{:.1f}", all.bytes / row.bytes),
             fmt::format("{:.2f} cm", row.centimetres.mean),
             fmt::format("{:.2f} cm", row.centimetres.p95), std::to_string(row.failed),
             fmt::format("{:.2f} ms", 1e3 * row.seconds_ready)});
}

std::string verdict(bool met) { return met ? "met" : "MISSED"; }

void print_verdict(const Row& row, const Row& all) {
  const double smaller = all.bytes / row.bytes;
  const double worse = row.centimetres.mean - all.centimetres.mean;
  const double sooner = all.seconds_ready / row.seconds_ready;
  const bool small = smaller >= kLeastTimesSmaller, soon = sooner >= kLeastTimesSooner,
             good = worse <= kMostCentimetresWorse;
  std::cout << fmt::format(
      "{}: {:.1f} times fewer bytes than all points, at least {:g}: {}; error {:+.2f} cm, at most "
      "{:g}: {}; ready {:.1f} times sooner, at least {:g}: {}\n",
      row.name, smaller, kLeastTimesSmaller, verdict(small), worse, kMostCentimetresWorse,
      verdict(good), sooner, kLeastTimesSooner, verdict(soon));
}

void print(const Rows& rows) {
  print(rows.all, rows.all);
  for (const auto* family : {&rows.voxels, &rows.random, &rows.cells, &rows.regions}) {
    for (const Row& row : *family) print(row, rows.all);
  }
}

Curve curve(std::string name, const std::vector<Row>& rows) {
  Curve result{std::move(name), {}};
  for (const Row& row : rows) {
    result.marks.push_back({row.bytes, row.centimetres.mean, row.mark});
  }
  return result;
}

std::string plotted(const Rows& rows) {
  std::vector<Row> voxels = rows.voxels;
  voxels.insert(voxels.begin(), rows.all);
  std::vector<Row> random = rows.random;
  random.insert(random.begin(), rows.all);
  random.front().mark = "all points";
  std::vector<Tick> bytes;
  for (const auto& [value, text] : {std::pair{5e4, "50 kB"},
                                    {1e5, "100 kB"},
                                    {2e5, "200 kB"},
                                    {5e5, "500 kB"},
                                    {1e6, "1 MB"},
                                    {2e6, "2 MB"},
                                    {5e6, "5 MB"},
                                    {1e7, "10 MB"},
                                    {2e7, "20 MB"}}) {
    bytes.push_back({value, text});
  }
  Curve even = curve("points: one a voxel", voxels);
  even.texts_below = true;
  return to_svg(
      {Panel{"Error against the size of the map",
             {"size of the map (logarithmic)", std::move(bytes), true},
             {"mean error [cm]", ticks({0, 1, 2, 3, 4, 5, 6})},
             {std::move(even), curve("points: random", random),
              curve("points: seen from a region", rows.regions), curve("cells", rows.cells)}}});
}

Result<void> run(const Options& options) {
  const auto folder = test::real_data("kitti_street");
  if (!folder) return {};
  const cli::ThreadLimit one_thread(1);
  VANTAGE_TRY(const Drive drive, load_drive(*folder, options.scan_voxel));
  VANTAGE_TRY(const Rows rows, measure(drive, *folder / "map.pcd", options));
  print_head(fmt::format("kitti_street, {}: {} scans, each guess predicted with constant velocity; "
                         "1 thread, best of {}",
                         options.matcher, drive.frames.size(), options.repeats),
             {"map", "", "bytes", "of all points'", "error mean", "p95", "failed", "ready in"});
  print(rows);
  std::cout << '\n';
  for (const Row& row : rows.cells) print_verdict(row, rows.all);
  if (!options.svg.empty()) return io::write_text_atomically(options.svg, plotted(rows));
  return {};
}

void declare(Arguments& arguments, Options& options) {
  arguments.program(
      "./dev bench bytes",
      "What a map's bytes buy on the recorded street: points, thinned points and stored cells by "
      "size, error and time to be ready, as a markdown table and a plot.");
  arguments.shown("--matcher", options.matcher,
                  "one that stores what it prepares, and its parameters: 'ndt: resolution = 2.0'",
                  "PLUGIN[:PARAMS]");
  arguments.bundles(options.points, options.cells);
  arguments
      .shown("--voxels", options.voxels, "the map is thinned to one point for each of these",
             "M,M,...", CLI::PositiveNumber)
      ->delimiter(',');
  arguments.shown("--repeats", options.repeats, "times are the best of so many", "N",
                  CLI::PositiveNumber);
  arguments.shown("--seed", options.seed, "of the random points", "N");
  arguments.scan_voxel(options.scan_voxel);
  arguments.svg(options.svg);
}

const auto program = table(declare, run);

}  // namespace
}  // namespace vantage::benchmarks

int main(int argc, char** argv) { return vantage::benchmarks::program(argc, argv); }
