#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <random>

#include "arguments.hpp"
#include "drive.hpp"
#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/engine/localizer.hpp"

// How long a bundle of very many regions takes to open, what it holds in memory, and whether a
// drive through it has to wait. The city is made up: blocks of 20 m, each with a house.
namespace vantage::benchmarks {
namespace {

namespace fs = std::filesystem;

constexpr double kBlock = 20.0;   // of the city, and width of a region [m]
constexpr double kSpacing = 2.0;  // of the points on walls [m]
constexpr double kRange = 25.0;   // of the sensor [m]
constexpr double kSpeed = 15.0;   // [m/s]
constexpr double kPeriod = 0.1;   // of the scans [s]
constexpr double kHeight = 1.8;   // of the sensor [m]

struct Options {
  fs::path bundle;
  std::uint32_t side = 300;
  std::string store = "shared_tiles";
  std::uint32_t scans = 2000;
  std::uint32_t opens = 20;
};

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// Points of a block: its ground, and the walls of its house.
PointCloud block(std::uint32_t x, std::uint32_t y) {
  std::mt19937 random(x * 7919 + y);
  std::uniform_real_distribution<double> offset(4.0, 6.0);
  const Point corner(kBlock * x, kBlock * y, 0.0);
  const Eigen::Vector2d house(offset(random), offset(random));
  PointCloud points;
  for (double u = 1.0; u < kBlock; u += 5.0) {
    for (double v = 1.0; v < kBlock; v += 5.0) points.push_back(corner + Point(u, v, 0.0));
  }
  constexpr double kWidth = 10.0;
  for (double z = 0.5; z < 6.0; z += kSpacing) {
    for (double u = 0.0; u < kWidth; u += kSpacing) {
      points.push_back(corner + Point(house.x() + u, house.y(), z));
      points.push_back(corner + Point(house.x() + kWidth, house.y() + u, z));
      points.push_back(corner + Point(house.x() + u + kSpacing, house.y() + kWidth, z));
      points.push_back(corner + Point(house.x(), house.y() + u + kSpacing, z));
    }
  }
  return points;
}

/// Points of a block and of the eight around it.
PointCloud around(std::uint32_t x, std::uint32_t y, std::uint32_t side) {
  PointCloud points;
  for (std::uint32_t v = y == 0 ? 0 : y - 1; v <= std::min(y + 1, side - 1); ++v) {
    for (std::uint32_t u = x == 0 ? 0 : x - 1; u <= std::min(x + 1, side - 1); ++u) {
      const PointCloud more = block(u, v);
      points.insert(points.end(), more.begin(), more.end());
    }
  }
  return points;
}

PluginChoice store_in(const Options& options, const fs::path& root) {
  return {.plugin = options.store,
          .library = {},
          .params = test::table(fmt::format("root = '{}'", root.string())),
          .where = {}};
}

Result<void> make(const Options& options, const fs::path& root) {
  VANTAGE_TRY(const auto store, test::built_plugins().load<MapStore>(store_in(options, root)));
  std::vector<Region> regions;
  for (std::uint32_t y = 0; y < options.side; ++y) {
    for (std::uint32_t x = 0; x < options.side; ++x) {
      const Eigen::Vector2d min(kBlock * x, kBlock * y);
      regions.push_back({fmt::format("x{}_y{}", x, y),
                         HalfOpenBox{min, min + Eigen::Vector2d::Constant(kBlock)},
                         {}});
    }
  }
  MapIndex index;
  const double width = kBlock * options.side;
  index.map_bounds = {Point::Zero(), Point(width, width, 6.0)};
  index.map_points = block(0, 0).size() * regions.size();
  index.config = "# made up";
  VANTAGE_TRY(index.partition, Partition::from(std::move(regions)));
  index.regions.resize(index.partition.size());
  VANTAGE_TRY(const auto writer, store->begin(index));
  for (std::uint32_t r = 0; r < index.partition.size(); ++r) {
    const RegionMap map{around(r % options.side, r / options.side, options.side), {}, {}};
    VANTAGE_CHECK(writer->put(RegionId{r}, map));
  }
  return std::move(*writer).commit();
}

/// The same, in a process of its own: what it needs of memory does not count here.
Result<void> make_apart(const Options& options, const fs::path& root) {
  std::cout << std::flush;
  const pid_t child = fork();
  if (child < 0) return fail(ErrorCode::io_failure, "no process for making the bundle");
  if (child == 0) {
    const auto made = make(options, root);
    if (!made) std::cerr << to_string(made.error()) << '\n';
    _exit(made ? 0 : 1);
  }
  int status = 0;
  if (waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0) {
    return {};
  }
  return fail(ErrorCode::io_failure, "the bundle was not made");
}

/// The sensor drives along a street, turns into the next one after a third of the city, and so on.
std::vector<Pose> drive_through(double width, std::uint32_t scans) {
  std::vector<Pose> poses;
  Eigen::Vector2d at(0.3 * width, 0.3 * width);
  at = (at / kBlock).array().floor() * kBlock + 2.0;  // between the houses
  Eigen::Vector2d ahead(1.0, 0.0);
  double since_turn = 0.0;
  while (poses.size() < scans) {
    Pose pose;
    pose.translation = {at.x(), at.y(), kHeight};
    pose.rotation = Eigen::AngleAxisd(std::atan2(ahead.y(), ahead.x()), Point::UnitZ());
    poses.push_back(pose);
    at += kSpeed * kPeriod * ahead;
    since_turn += kSpeed * kPeriod;
    if (since_turn < 10.0 * kBlock) continue;
    since_turn = 0.0;
    ahead = {ahead.y(), ahead.x()};
  }
  return poses;
}

PointCloud scan_at(const Pose& T_map_scan, std::uint32_t side) {
  const auto x = static_cast<std::uint32_t>(T_map_scan.translation.x() / kBlock);
  const auto y = static_cast<std::uint32_t>(T_map_scan.translation.y() / kBlock);
  const Pose T_scan_map = T_map_scan.inverse();
  PointCloud scan;
  for (const Point& p : around(x, y, side)) {
    const Point seen = T_scan_map * p;
    if (seen.norm() < kRange) scan.push_back(seen);
  }
  return scan;
}

double share(std::vector<double> sorted, double q) {
  return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))];
}

Result<void> drive(Bundle bundle, const Options& options, double before) {
  const double width = bundle.directory()->summary().map_bounds.max.x();
  const auto side = static_cast<std::uint32_t>(std::lround(width / kBlock));
  const auto poses = drive_through(width, options.scans);
  VANTAGE_TRY(Localizer localizer,
              Localizer::open(std::move(bundle), test::plugin<ScanMatcher>("icp"),
                              test::plugin<Relocalizer>("voxel_search"), {}));
  VANTAGE_CHECK(localizer.start(poses.front()));
  std::vector<double> stalls, loads;
  std::size_t blocked = 0, tracked = 0;
  double farthest = 0.0;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const PointCloud points = scan_at(poses[k], side);
    const double stamp = kPeriod * static_cast<double>(k);
    VANTAGE_CHECK(localizer.add(OdometrySample{stamp, poses[k]}));
    VANTAGE_TRY(const ScanReport report, localizer.localize({.stamp = stamp, .points = points}));
    stalls.push_back(1e3 * report.seconds_stall);
    if (report.switched) loads.push_back(1e3 * report.seconds_load);
    blocked += report.blocked ? 1U : 0U;
    tracked += report.tracking == Tracking::tracked ? 1U : 0U;
    farthest = std::max(farthest, (report.T_map_scan.translation - poses[k].translation).norm());
  }
  const std::size_t switches = loads.size();
  std::sort(stalls.begin(), stalls.end());
  std::sort(loads.begin(), loads.end());
  print_head("The drive, as fast as the scans are matched",
             {"scans", "tracked", "worst error", "switches", "blocking loads", "stall p99",
              "largest", "load p50", "p99", "memory at the end"});
  print_row({std::to_string(poses.size()), std::to_string(tracked),
             fmt::format("{:.2f} m", farthest), std::to_string(switches), std::to_string(blocked),
             fmt::format("{:.3f} ms", share(stalls, 0.99)), fmt::format("{:.3f} ms", stalls.back()),
             fmt::format("{:.2f} ms", share(loads, 0.5)),
             fmt::format("{:.2f} ms", share(loads, 0.99)),
             fmt::format("{:.1f} MB more", resident_megabytes() - before)});
  return {};
}

Result<void> run(const Options& options) {
  std::optional<test::TemporaryFolder> temporary;
  fs::path root = options.bundle;
  if (root.empty()) root = temporary.emplace().path() / "bundle";
  if (!fs::exists(root)) {
    const auto start = Clock::now();
    VANTAGE_CHECK(make_apart(options, root));
    std::cout << fmt::format("{} regions written in {:.1f} s\n",
                             std::uint64_t{options.side} * options.side,
                             1e-3 * milliseconds_since(start));
  }
  const PluginLoader plugins = test::built_plugins();
  (void)test::plugin<MapStore>(options.store, "root = '/nowhere'");  // its library is loaded now
  std::vector<double> opens;
  const double before = resident_megabytes();
  std::optional<Bundle> bundle;
  for (std::uint32_t k = 0; k < options.opens; ++k) {
    const auto start = Clock::now();
    VANTAGE_TRY(bundle, Bundle::open(root, plugins));
    opens.push_back(milliseconds_since(start));
  }
  const double opened = resident_megabytes();
  print_head("The bundle", {"regions", "opened in, first",
                            "median of " + std::to_string(options.opens), "memory"});
  const double first = opens.front();
  std::sort(opens.begin(), opens.end());
  print_row({std::to_string(bundle->directory()->summary().regions),
             fmt::format("{:.2f} ms", first), fmt::format("{:.2f} ms", share(opens, 0.5)),
             fmt::format("{:.1f} MB more", opened - before)});
  return drive(*std::move(bundle), options, before);
}

void declare(Arguments& arguments, Options& options) {
  arguments.program(
      "./dev bench regions",
      "Opens a bundle of very many regions and drives through it: times, waits and memory. The "
      "city is made up.");
  arguments.add("--bundle", options.bundle,
                "where the bundle is; it is written there if nothing is. If left out, it is "
                "temporary",
                "FOLDER");
  arguments.shown("--side", options.side, "regions along each side of the city", "N",
                  CLI::Range(4, 4000));
  arguments.shown("--store", options.store, "plugin that writes it", "PLUGIN");
  arguments.shown("--scans", options.scans, "of the drive", "N", CLI::PositiveNumber);
  arguments.shown("--opens", options.opens, "how often it is opened", "N", CLI::PositiveNumber);
}

const auto program = table(declare, run);

}  // namespace
}  // namespace vantage::benchmarks

int main(int argc, char** argv) { return vantage::benchmarks::program(argc, argv); }
