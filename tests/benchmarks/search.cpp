// How long a relocalizer searches for a scan of a drive, and whether the scan's place is among its
// candidates: in simulated campuses, and on the recorded street.
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "arguments.hpp"
#include "drive.hpp"
#include "integrity_worlds.hpp"
#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "terminal/command_line.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/engine/prepared_scan.hpp"
#include "vantage/kit/map_in_memory.hpp"

namespace vantage::benchmarks {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::string relocalizer = "voxel_search", params;
  std::vector<double> sizes{250.0, 1000.0};  // [m]
  std::uint64_t seed = 77;
  std::size_t scans = 40, threads = 0;
  double tilt = 20.0;  // [deg]
};

/// A candidate is right if it is as near to the sensor as this [m], [deg].
constexpr double kRightMetres = 1.0, kNearMetres = 2.0, kRightDegrees = 5.0;

struct Case {
  std::string name;
  PointCloud map;
  std::vector<Frame> frames;
};

/// Every n-th, so that at most so many are left.
std::vector<Frame> spread(std::vector<Frame> frames, std::size_t most) {
  const std::size_t step = (frames.size() + most - 1) / std::max<std::size_t>(most, 1);
  std::vector<Frame> some;
  for (std::size_t k = 0; k < frames.size(); k += std::max<std::size_t>(step, 1)) {
    some.push_back(std::move(frames[k]));
  }
  return some;
}

/// A campus with five points a square metre of ground, and scans of a drive through it.
Result<Case> campus(double size, const Options& options) {
  VANTAGE_CHECK(check_seed(options.seed));
  VANTAGE_TRY(const auto params,
              simulation::load_world(
                  VANTAGE_SOURCE_DIR "/configs/simulate/campus500.toml",
                  {fmt::format("seed={}", options.seed), fmt::format("campus.size_x={:.1f}", size),
                   fmt::format("campus.size_y={:.1f}", size), "map.point_spacing=0.612",
                   "drive.length=400.0", "drive.scan_every=60"}));
  Case made{.name = fmt::format("campus of {:.0f} m", size), .map = {}, .frames = {}};
  VANTAGE_TRY(made.map, simulated_map(params));
  VANTAGE_TRY(const SimulatedDrive drive, simulated_drive(params, options.scans, options.seed));
  for (std::size_t i = 0; i < drive.scans.size(); ++i) {
    VANTAGE_TRY(PreparedScan scan, prepare_scan(drive.scan(i), nullptr, LocalizerParams{}));
    made.frames.push_back(
        {drive.reference[i].stamp, std::move(scan.points), drive.reference[i].pose});
  }
  return made;
}

/// How a scan is asked about.
struct Question {
  const char* name;
  double radius;  // around a place at 0.6 radii from the sensor [m]
  bool tilted = false;
};
constexpr Question kQuestions[]{
    {"everywhere", std::numeric_limits<double>::infinity()},
    {"within 50 m", 50.0},
    {"within 10 m", 10.0},
    {"everywhere, tilted, up unknown", std::numeric_limits<double>::infinity(), true}};

struct Answers {
  std::size_t scans = 0, right = 0, near = 0, first = 0, candidates = 0;
  std::vector<double> nominal_ms, elapsed_ms, cpu_ms;

  void add(const PoseCandidates& found, const Pose& truth) {
    const auto is_at = [&](const PoseCandidate& candidate, double metres) {
      const PoseError error = error_of(candidate.T_map_scan, truth);
      return error.centimetres <= 1e2 * metres && error.degrees <= kRightDegrees;
    };
    const auto any_at = [&](double metres) {
      return std::ranges::any_of(found.poses, [&](const auto& c) { return is_at(c, metres); });
    };
    ++scans;
    candidates += found.poses.size();
    if (any_at(kRightMetres)) ++right;
    if (any_at(kNearMetres)) ++near;
    if (!found.poses.empty() && is_at(found.poses.front(), kNearMetres)) ++first;
    nominal_ms.push_back(found.nominal_ms);
  }
};

Result<Answers> ask(const RelocalizerIndex& index, const Case& in, const Question& question,
                    double tilt) {
  Answers answers;
  for (std::size_t k = 0; k < in.frames.size(); ++k) {
    Pose truth = in.frames[k].T_map_scan;
    PointCloud scan = in.frames[k].scan;
    const double direction = 2.4 * static_cast<double>(k);
    PlaceQuery query;
    if (question.tilted) {
      const Pose held{.rotation = rotation_from_vector(
                          tilt * std::numbers::pi / 180.0 *
                          Eigen::Vector3d(std::cos(direction), std::sin(direction), 0.0)),
                      .translation = Eigen::Vector3d::Zero()};
      for (Point& p : scan) p = held.inverse() * p;
      truth = truth * held;
      query.up.reset();
    }
    query.area.radius = question.radius;
    if (std::isfinite(question.radius)) {
      query.area.centre =
          truth.translation.head<2>() +
          0.6 * question.radius * Eigen::Vector2d(std::cos(direction), std::sin(direction));
    }
    const auto begin = std::chrono::steady_clock::now();
    const double cpu = cpu_seconds();
    VANTAGE_TRY(const PoseCandidates found, index.find(scan, query));
    answers.cpu_ms.push_back(1e3 * (cpu_seconds() - cpu));
    answers.elapsed_ms.push_back(
        1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    answers.add(found, truth);
  }
  return answers;
}

Result<void> measure(const PluginPtr<Relocalizer>& relocalizer, const Case& in,
                     const Options& options) {
  double cpu = cpu_seconds();
  VANTAGE_TRY(const auto bytes, relocalizer->index(MapInMemory(in.map)));
  const double made = cpu_seconds() - cpu;
  cpu = cpu_seconds();
  VANTAGE_TRY(auto opened, relocalizer->open(bytes));
  const double open = cpu_seconds() - cpu;
  const auto index = in_library_of(relocalizer, std::move(opened));
  print_head(fmt::format("{}: {:.2f} M points; index of {:.1f} kB, made in {:.0f} ms, opened in "
                         "{:.0f} ms (CPU)",
                         in.name, static_cast<double>(in.map.size()) / 1e6,
                         static_cast<double>(bytes.size()) / 1e3, 1e3 * made, 1e3 * open),
             {"search", "scans", "candidates", "one within 1 m, 5 deg", "within 2 m", "the first",
              "nominal ms, p50", "p95", "CPU ms, p50", "elapsed ms, p50", "p95"});
  for (const Question& question : kQuestions) {
    VANTAGE_TRY(const Answers a, ask(*index, in, question, options.tilt));
    const auto share = [&](std::size_t n) {
      return fmt::format("{:.1f} %", 100.0 * static_cast<double>(n) / static_cast<double>(a.scans));
    };
    const auto at = [](const std::vector<double>& all, double q) {
      std::vector<double> sorted = all;
      std::ranges::sort(sorted);
      return fmt::format(
          "{:.1f}", sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))]);
    };
    print_row({question.name, std::to_string(a.scans),
               fmt::format("{:.1f}", static_cast<double>(a.candidates) / double(a.scans)),
               share(a.right), share(a.near), share(a.first), at(a.nominal_ms, 0.5),
               at(a.nominal_ms, 0.95), at(a.cpu_ms, 0.5), at(a.elapsed_ms, 0.5),
               at(a.elapsed_ms, 0.95)});
  }
  return {};
}

void declare(Arguments& arguments, Options& options) {
  arguments.program("./dev bench search",
                    "Searches for scans of drives in their maps, and checks the candidates.");
  arguments.shown("--relocalizer", options.relocalizer,
                  "of the project's, or from $VANTAGE_PLUGIN_PATH", "NAME");
  arguments.add("--params", options.params, "its parameters, TOML", "TEXT");
  arguments
      .shown("--sizes", options.sizes, "edges of the campuses", "M,M,...", CLI::PositiveNumber)
      ->delimiter(',');
  arguments.shown("--seed", options.seed, "of the campuses", "N");
  arguments.shown("--scans", options.scans, "of each drive at most", "N", CLI::PositiveNumber);
  arguments.shown("--tilt", options.tilt, "of the tilted sensor", "DEG", CLI::NonNegativeNumber);
  arguments.shown("--threads", options.threads, "0 for all cores", "N");
}

Result<void> run(const Options& options) {
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                    options.threads > 0 ? options.threads : std::size_t{1024});
  const auto plugins = PluginLoader::with_default_folders(test::built_plugins().folders());
  VANTAGE_TRY(const Table params, parse_toml(options.params, "--params"));
  VANTAGE_TRY(const auto relocalizer,
              plugins.load<Relocalizer>(PluginChoice{
                  .plugin = options.relocalizer, .library = {}, .params = params, .where = {}}));
  for (const double size : options.sizes) {
    VANTAGE_TRY(const Case made, campus(size, options));
    VANTAGE_CHECK(measure(relocalizer, made, options));
  }
  if (const auto street = test::real_data("kitti_street")) {
    VANTAGE_TRY(Drive drive, load_drive(*street, LocalizerParams{}.scan_voxel_size));
    VANTAGE_CHECK(measure(relocalizer,
                          {.name = "recorded street",
                           .map = std::move(drive.map),
                           .frames = spread(std::move(drive.frames), options.scans)},
                          options));
  }
  return {};
}

const auto program = table(declare, run);

}  // namespace
}  // namespace vantage::benchmarks

int main(int argc, char** argv) { return vantage::benchmarks::program(argc, argv); }
