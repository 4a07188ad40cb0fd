// The region maps of the program that the paper's authors have published beside ours, of one map:
// which points they have in common. Their program runs elsewhere; its folder is read here.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "arguments.hpp"
#include "drive.hpp"
#include "support/plugins.hpp"
#include "terminal/command_line.hpp"
#include "vantage/build/build.hpp"
#include "vantage/ground_filter.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/map_store.hpp"

namespace vantage::benchmarks {
namespace {

namespace fs = std::filesystem;

struct Options {
  fs::path map = "out/demo/campus/map.pcd";
  fs::path folder;
  fs::path ground;
  double cell_width = 20.0;
  double voxel_size = 5.0;
  std::size_t jobs = 1;
};

using Triple = std::array<double, 3>;
Triple triple_of(const Point& p) { return {p.x(), p.y(), p.z()}; }

std::vector<Triple> sorted(const PointCloud& points) {
  std::vector<Triple> triples;
  triples.reserve(points.size());
  for (const Point& p : points) triples.push_back(triple_of(p));
  std::ranges::sort(triples);
  return triples;
}

/// The ground is what another program took for it: points of the same map.
class GivenGround final : public GroundFilter {
 public:
  explicit GivenGround(const PointCloud& ground) {
    for (const Point& p : ground) points_.insert(triple_of(p));
  }
  [[nodiscard]] Result<IndexList> ground(PointsView cloud) const noexcept override {
    IndexList found;
    for (std::uint32_t k = 0; k < cloud.size(); ++k) {
      if (points_.contains(triple_of(cloud[k]))) found.push_back(k);
    }
    return found;
  }

 private:
  std::set<Triple> points_;
};

struct Maps {
  Partition partition;
  std::map<std::uint32_t, PointCloud> points;  // by RegionId
};

/// Keeps the points of the region maps in memory.
class Keeper final : public MapWriter {
 public:
  explicit Keeper(std::shared_ptr<Maps> maps) : maps_(std::move(maps)) {}
  [[nodiscard]] Result<void> put(RegionId region, const RegionMap& map) noexcept override {
    maps_->points[region.value] = map.points;
    return {};
  }
  [[nodiscard]] Result<void> commit() && noexcept override { return {}; }

 private:
  std::shared_ptr<Maps> maps_;
};

class MemoryStore final : public MapStore {
 public:
  explicit MemoryStore(std::shared_ptr<Maps> maps) : maps_(std::move(maps)) {}
  [[nodiscard]] Result<std::unique_ptr<MapWriter>> begin(
      const MapIndex& index) const noexcept override {
    maps_->partition = index.partition;
    return std::make_unique<Keeper>(maps_);
  }
  [[nodiscard]] Result<std::unique_ptr<const MapReader>> open() const noexcept override {
    return fail(ErrorCode::unsupported, "is not read");
  }

 private:
  std::shared_ptr<Maps> maps_;
};

/// A ground filter, what it gets, and where the grid begins.
struct Ground {
  std::string name;
  PluginPtr<GroundFilter> filter;
  std::optional<OutlierParams> outliers;
  std::string origin = "\"ground\"";
};

struct Built {
  Maps maps;
  std::uint64_t ground_points = 0;
  double seconds = 0.0;
};

Result<Built> build(const PointCloud& map, Ground ground, const Options& options) {
  const auto maps = std::make_shared<Maps>();
  BuildPlugins plugins;
  plugins.partitioner = test::plugin<Partitioner>(
      "uniform_grid",
      fmt::format("cell_width = {}\norigin = {}", options.cell_width, ground.origin));
  plugins.ground = std::move(ground.filter);
  plugins.visibility = test::plugin<VisibilityOperator>("hpr", "alpha = 100.0");
  plugins.store = PluginPtr<MapStore>(new MemoryStore(maps), {});
  BuildParams params;
  params.viewpoints.voxel_size = options.voxel_size;
  params.outliers = ground.outliers;
  const auto start = std::chrono::steady_clock::now();
  VANTAGE_TRY(const BuildReport report, build_region_maps(map, {}, plugins, params));
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  return Built{.maps = *maps, .ground_points = report.ground_points, .seconds = taken.count()};
}

struct Agreement {
  std::size_t regions = 0, only_ours = 0;      // regions in both; with points, but not in theirs
  std::size_t theirs = 0, ours = 0, both = 0;  // points
  double least = 1.0;                          // intersection over union of a region
};

double iou(std::size_t a, std::size_t b, std::size_t both) {
  return static_cast<double>(both) / static_cast<double>(a + b - both);
}

Result<Agreement> compare(const MapReader& bundle, const MapIndex& theirs, const Maps& ours) {
  Agreement all;
  std::set<std::uint32_t> met;
  for (std::uint32_t r = 0; r < theirs.partition.size(); ++r) {
    const Bounds2 box = bounds_of(theirs.partition[RegionId{r}].footprint);
    const auto here = ours.partition.locate(Eigen::Vector2d(0.5 * (box.min + box.max)));
    VANTAGE_TRY(const RegionMap map, bundle.get(RegionId{r}));
    const std::vector<Triple> a = sorted(map.points);
    std::vector<Triple> b, common;
    if (here) {
      met.insert(here->value);
      b = sorted(ours.points.at(here->value));
    }
    std::ranges::set_intersection(a, b, std::back_inserter(common));
    if (!b.empty()) ++all.regions;
    all.theirs += a.size();
    all.ours += b.size();
    all.both += common.size();
    all.least = std::min(all.least, iou(a.size(), b.size(), common.size()));
  }
  for (const auto& [region, points] : ours.points) {
    if (!points.empty() && !met.contains(region)) ++all.only_ours;
  }
  return all;
}

/// PCL's parameters in their program, as far as `pmf` has them.
constexpr const char* kPmf =
    "max_window = 20.0\nschedule = \"exponential\"\nslope = 1.0\ninitial_distance = 0.5\n"
    "max_distance = 3.0";

Result<void> run(const Options& options) {
  const cli::ThreadLimit threads(options.jobs);
  VANTAGE_TRY(const auto read, io::read_point_clouds(std::vector{options.map}));
  const PointCloud& map = read.points;
  const auto store = test::plugin<MapStore>("grid_pcd", "root = '" + options.folder.string() + "'");
  VANTAGE_TRY(const auto bundle, store->open());
  VANTAGE_TRY(const MapIndex theirs, bundle->index());
  std::vector<Ground> grounds;
  const fs::path file =
      options.ground.empty() ? options.folder / "debug/ground_global.pcd" : options.ground;
  if (fs::exists(file)) {
    VANTAGE_TRY(const auto ground, io::read_point_clouds(std::vector{file}));
    grounds.push_back(
        {"theirs", PluginPtr<GroundFilter>(new GivenGround(ground.points), {}), std::nullopt});
  }
  const auto& first = std::get<HalfOpenBox>(theirs.partition[RegionId{0}].footprint);
  const std::string corner = fmt::format("[{}, {}]", first.min.x(), first.min.y());
  const auto pmf = [&] { return test::plugin<GroundFilter>("pmf", kPmf); };
  grounds.push_back({"pmf without outliers", pmf(), OutlierParams{}});
  grounds.push_back({"pmf", pmf(), std::nullopt});
  grounds.push_back({"pmf, origin at their corner", pmf(), std::nullopt, corner});
  print_head(fmt::format("{} region maps of theirs, {} of ours beside them",
                         theirs.partition.size(), options.map.string()),
             {"ground", "ground points", "regions in both", "only ours", "points, theirs", "ours",
              "in both", "IoU", "least of a region", "seconds"});
  for (Ground& ground : grounds) {
    const std::string name = ground.name;
    VANTAGE_TRY(const Built built, build(map, std::move(ground), options));
    VANTAGE_TRY(const Agreement all, compare(*bundle, theirs, built.maps));
    print_row({name, std::to_string(built.ground_points), std::to_string(all.regions),
               std::to_string(all.only_ours), std::to_string(all.theirs), std::to_string(all.ours),
               std::to_string(all.both), fmt::format("{:.5f}", iou(all.theirs, all.ours, all.both)),
               fmt::format("{:.5f}", all.least), fmt::format("{:.1f}", built.seconds)});
  }
  return {};
}

void declare(Arguments& arguments, Options& options) {
  arguments.program("./dev bench authors",
                    "Compares the region maps in a folder of the authors' program with ours of the "
                    "same map: docs/authors_code.md says how to make the folder.");
  arguments.shown("--map", options.map, "the map that both read", "FILE", CLI::ExistingFile);
  arguments
      .add("--folder", options.folder, "what their program wrote", "FOLDER", CLI::ExistingDirectory)
      ->required();
  arguments.add("--ground", options.ground,
                "the ground that their program found, given to ours; debug/ground_global.pcd in "
                "the folder if left out",
                "FILE", CLI::ExistingFile);
  arguments.shown("--cell-width", options.cell_width, "their grid_size", "M", CLI::PositiveNumber);
  arguments.shown("--voxel-size", options.voxel_size, "their voxel_leaf_size", "M",
                  CLI::PositiveNumber);
  arguments.shown("--jobs", options.jobs, "threads of ours", "N", CLI::PositiveNumber);
}

const auto program = table(declare, run);

}  // namespace
}  // namespace vantage::benchmarks

int main(int argc, char** argv) { return vantage::benchmarks::program(argc, argv); }
