// vantage-simulate: makes, from a world file, a campus as a map and as a LiDAR sees it on a drive.
#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "simulate/simulation.hpp"
#include "terminal/command_line.hpp"
#include "terminal/progress.hpp"
#include "terminal/table.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage {
namespace {

struct Options {
  std::filesystem::path world, out;
  std::vector<std::string> overrides;
  std::size_t jobs = 0;
  bool map_only = false, overwrite = false, quiet = false, json = false;
  std::string color = "auto";
};

void print(const simulation::Summary& summary, const std::filesystem::path& out) {
  const Point size = summary.map_bounds.max - summary.map_bounds.min;
  const Point &low = summary.map_bounds.min, &high = summary.map_bounds.max;
  std::cout << fmt::format("{}: {}\n", out.string(), cli::counted(summary.triangles, "triangle"))
            << fmt::format("map        {} ({}), {:.1f} x {:.1f} x {:.1f} m\n",
                           cli::counted(summary.map_points, "point"),
                           summary.precision == io::Precision::float32 ? "float32" : "float64",
                           size.x(), size.y(), size.z())
            << fmt::format(
                   "extent     x {:.2f} .. {:.2f}, y {:.2f} .. {:.2f}, z {:.2f} .. {:.2f} m\n",
                   low.x(), high.x(), low.y(), high.y(), low.z(), high.z());
  if (summary.scans == 0) return;
  std::cout << fmt::format("scans      {}, {} each\n", cli::grouped(summary.scans),
                           cli::counted(summary.scan_points / summary.scans, "point"))
            << fmt::format("drive      {:.1f} m in {:.1f} s\n", summary.distance, summary.seconds);
  if (summary.odometry_poses != summary.scans) {
    std::cout << fmt::format("odometry   {}\n", cli::counted(summary.odometry_poses, "pose"));
  }
  if (summary.imu_samples > 0) {
    std::cout << fmt::format("imu        {}\n", cli::counted(summary.imu_samples, "sample"));
  }
  if (summary.kidnaps + summary.holes > 0) {
    std::cout << fmt::format("events     {}, {} in the map\n",
                             cli::counted(summary.kidnaps, "kidnap"),
                             cli::counted(summary.holes, "hole"));
  }
}

nlohmann::ordered_json to_json(const simulation::Summary& summary) {
  const auto list = [](const Point& p) { return std::array{p.x(), p.y(), p.z()}; };
  return {{"triangles", summary.triangles},
          {"map_points", summary.map_points},
          {"precision", summary.precision == io::Precision::float32 ? "float32" : "float64"},
          {"map_bounds",
           {{"min", list(summary.map_bounds.min)}, {"max", list(summary.map_bounds.max)}}},
          {"scans", summary.scans},
          {"scan_points", summary.scan_points},
          {"odometry_poses", summary.odometry_poses},
          {"imu_samples", summary.imu_samples},
          {"distance", summary.distance},
          {"seconds", summary.seconds},
          {"kidnaps", summary.kidnaps},
          {"holes", summary.holes}};
}

Result<void> run(const Options& options) {
  const cli::ThreadLimit threads(options.jobs);
  VANTAGE_TRY(const auto world, simulation::load_world(options.world, options.overrides));
  std::optional<cli::Progress> progress;
  std::string current;
  const auto show = [&](std::string_view stage, std::size_t done, std::size_t total) {
    if (stage != current) {
      current = stage;
      progress.emplace(current, options.quiet);
    }
    progress->update(done, total);
  };
  auto summary = simulation::simulate(
      world, options.out, options.overwrite,
      options.map_only ? simulation::Extent::map : simulation::Extent::drive, show);
  progress.reset();
  if (!summary) return fail(std::move(summary).error());
  if (options.json) {
    std::cout << json_text(to_json(*summary));
  } else {
    print(*summary, options.out);
  }
  return {};
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  CLI::App app("Simulates a campus and a drive with a LiDAR: map, scans, reference, odometry.",
               "vantage simulate");
  vantage::Options options;
  app.add_option("WORLD", options.world, "world file (TOML)")->required();
  app.add_option("--out,-o", options.out, "new directory for the results")
      ->type_name("DIR")
      ->required();
  app.add_flag("--map-only", options.map_only,
               "only the map, no drive: takes much less memory in a large world");
  app.add_flag("--overwrite", options.overwrite, "replace the results of an earlier simulation");
  app.add_option("--set", options.overrides, "override a key of the world: table.key=value")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  app.add_option("--jobs,-j", options.jobs, "threads; 0 for all cores")->capture_default_str();
  app.add_flag("--quiet,-q", options.quiet, "no progress on stderr");
  app.add_flag("--json", options.json, "results as JSON on stdout");
  vantage::cli::add_color_option(app, options.color);
  return vantage::cli::run_program(app, argc, argv, [&] { return vantage::run(options); });
}
