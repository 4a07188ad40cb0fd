// The matchers beside PCL's and Open3D's in one run, as a table: kitti_street, the whole map, each
// predicting with constant velocity from its own answers.
#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "arguments.hpp"
#include "drive.hpp"
#include "matching_peers.hpp"
#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "terminal/command_line.hpp"
#include "vantage/evaluation/statistics.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage::benchmarks {
namespace {

struct Options {
  std::vector<std::string> matchers;  // empty: all
  std::vector<std::string> with;      // "PLUGIN: KEY = VALUE; KEY = VALUE"
  std::size_t scans = 0;              // 0: all
  double scan_voxel = 0.5;            // [m]
  double map_voxel = 0.25;            // [m]
};

class Plugin final : public Competitor {
 public:
  Plugin(const std::string& name, const std::string& params)
      : matcher_(test::plugin<ScanMatcher>(name, params)) {}

  Result<void> prepare(PointsView map) override {
    VANTAGE_TRY(auto target, matcher_->prepare(map));
    target_ = in_library_of(matcher_, std::move(target));
    return {};
  }
  void take(PointsView scan) override { scan_ = scan; }
  Result<Answer> align(const Pose& T_map_scan_guess) override {
    VANTAGE_TRY(const Alignment alignment, target_->align(scan_, T_map_scan_guess));
    return Answer{.T_map_scan = alignment.T_map_scan, .iterations = alignment.iterations};
  }

 private:
  PluginPtr<ScanMatcher> matcher_;
  PluginPtr<MatchTarget> target_;
  PointsView scan_;
};

struct Entry {
  std::string name;
  std::function<std::unique_ptr<Competitor>()> make;
};

/// The first is what the others are compared with.
std::vector<Entry> entries(const Options& options) {
  std::vector<Entry> all;
  const auto plugin = [&](std::string label, std::string name, std::string params) {
    all.push_back({std::move(label), [name = std::move(name), params = std::move(params)] {
                     return std::make_unique<Plugin>(name, params);
                   }});
  };
  plugin("ndt", "ndt", "");
  for (const std::string mode : {"direct1", "direct26", "kdtree"}) {
    plugin("ndt_" + mode, "ndt", "neighbours = \"" + mode + "\"");
  }
  plugin("icp", "icp", "");
  plugin("gicp", "gicp", "");
  all.push_back({"pcl_ndt", [] { return pcl_ndt(); }});
  all.push_back({"pcl_gicp", [voxel = options.map_voxel] { return pcl_gicp(voxel); }});
  all.push_back({"open3d_icp", [voxel = options.map_voxel] { return open3d_icp(voxel); }});
  return all;
}

struct Figures {
  double prepare_ms = 0.0;
  std::vector<double> align_ms, iterations;
  DriveErrors errors;
};

Result<Figures> measure(Competitor& competitor, const Drive& drive) {
  Figures result;
  const double before = cpu_seconds();
  VANTAGE_CHECK(competitor.prepare(drive.map));
  result.prepare_ms = 1e3 * (cpu_seconds() - before);
  result.errors = follow(drive.frames, [&](PointsView scan, const Pose& guess) -> Result<Pose> {
    competitor.take(scan);
    const double start = cpu_seconds();
    const auto answer = competitor.align(guess);
    result.align_ms.push_back(1e3 * (cpu_seconds() - start));
    if (!answer) return fail(answer.error());
    result.iterations.push_back(answer->iterations);
    return answer->T_map_scan;
  });
  return result;
}

void print_head_of(const Drive& drive) {
  double points = 0.0;
  for (const Frame& frame : drive.frames) points += static_cast<double>(frame.scan.size());
  print_head(fmt::format("kitti_street: {} scans of {:.0f} points on the average, map of {} "
                         "points, 1 thread, CPU time",
                         drive.frames.size(), points / static_cast<double>(drive.frames.size()),
                         drive.map.size()),
             {"matcher", "prepare ms", "T_align mean ms", "median", "p99", "max", "ratio", "steps",
              "error mean", "p95", "deg", "failed"});
}

Result<std::vector<Entry>> chosen(const Options& options) {
  const std::vector<Entry> all = entries(options);
  std::vector<Entry> picked;
  if (options.matchers.empty()) picked = all;
  for (const std::string& name : options.matchers) {
    const auto entry = std::ranges::find(all, name, &Entry::name);
    if (entry == all.end()) {
      std::vector<std::string> names;
      for (const Entry& e : all) names.push_back(e.name);
      return cli::usage_error(
          fmt::format("there is no matcher '{}'; there are {}", name, fmt::join(names, ", ")));
    }
    picked.push_back(*entry);
  }
  for (const std::string& text : options.with) {
    const std::size_t colon = text.find(':');
    std::string params = colon == std::string::npos ? "" : text.substr(colon + 1);
    std::ranges::replace(params, ';', '\n');
    picked.push_back({text, [name = text.substr(0, colon), params = std::move(params)] {
                        return std::make_unique<Plugin>(name, params);
                      }});
  }
  return picked;
}

Result<void> run(const Options& options) {
  VANTAGE_TRY(const auto picked, chosen(options));
  const auto folder = test::real_data("kitti_street");
  if (!folder) return {};
  const cli::ThreadLimit one_thread(1);
  omp_set_num_threads(1);  // Open3D's and PCL's
  VANTAGE_TRY(const Drive drive, load_drive(*folder, options.scan_voxel, options.scans));
  print_head_of(drive);
  std::optional<double> first;
  for (const Entry& entry : picked) {
    const auto competitor = entry.make();
    VANTAGE_TRY(const Figures result, measure(*competitor, drive));
    const auto time = statistics_of(result.align_ms);
    const auto error = statistics_of(result.errors.centimetres);
    const double steps = statistics_of(result.iterations).mean;
    if (!first) first = time.mean;
    print_row({entry.name, fmt::format("{:.0f}", result.prepare_ms),
               fmt::format("{:.1f}", time.mean), fmt::format("{:.1f}", time.median),
               fmt::format("{:.1f}", time.p99), fmt::format("{:.1f}", time.max),
               fmt::format("{:.2f}", time.mean / *first),
               steps > 0.0 ? fmt::format("{:.1f}", steps) : "",
               fmt::format("{:.2f} cm", error.mean), fmt::format("{:.2f} cm", error.p95),
               fmt::format("{:.3f}", statistics_of(result.errors.degrees).mean),
               fmt::format("{}", result.errors.failed)});
  }
  return {};
}

void declare(Arguments& arguments, Options& options) {
  arguments.program(
      "./dev bench matching",
      "Scan matchers beside PCL's and Open3D's on the recorded street, as a markdown table.");
  arguments
      .add("--matchers", options.matchers,
           "only these, the first being what the others are compared with: ndt, ndt_direct1, "
           "ndt_direct26, ndt_kdtree, icp, gicp, pcl_ndt, pcl_gicp, open3d_icp",
           "A,B,...")
      ->delimiter(',');
  arguments.add("--with", options.with,
                "also a plugin with parameters of its own: 'ndt: resolution = 2.0; d1 = ...'",
                "PLUGIN[:PARAMS]");
  arguments.shown("--scans", options.scans, "only the first N scans; 0: all", "N");
  arguments.scan_voxel(options.scan_voxel);
  arguments.shown(
      "--map-voxel", options.map_voxel,
      "the map of pcl_gicp and open3d_icp is thinned to voxels of this edge, as icp and "
      "gicp thin theirs; 0: it is not",
      "M", CLI::NonNegativeNumber);
}

const auto program = table(declare, run);

}  // namespace
}  // namespace vantage::benchmarks

int main(int argc, char** argv) { return vantage::benchmarks::program(argc, argv); }
