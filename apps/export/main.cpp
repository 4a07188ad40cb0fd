// vantage-export: writes region maps for other programs.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "export/autoware.hpp"
#include "export/grid.hpp"
#include "export/regions.hpp"
#include "export/sidecar.hpp"
#include "io/text.hpp"
#include "terminal/command_line.hpp"
#include "terminal/progress.hpp"
#include "terminal/table.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;

struct Options {
  fs::path what, out;
  bool overwrite = false;
  exporting::AutowareOptions autoware;
  std::string origin = "0,0,0", format;
  cli::CommonOptions common;
};

/// "x,y,z", or nothing for "auto".
Result<std::optional<Point>> parse_origin(const std::string& text) {
  if (text == "auto") return std::nullopt;
  Point origin = Point::Zero();
  std::string_view rest = text;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const std::size_t end = axis < 2 ? rest.find(',') : rest.size();
    const auto number = io::parse_number<double>(rest.substr(0, end));
    if (end == std::string_view::npos || !number || !std::isfinite(*number)) {
      return cli::usage_error("--origin takes X,Y,Z in metres or auto, not '" + text + "'");
    }
    origin[axis] = *number;
    rest.remove_prefix(std::min(rest.size(), end + 1));
  }
  return origin;
}

/// Tiles and their list contain file names, so a prefix must be a plain word.
Result<void> check_prefix(const std::string& prefix) {
  constexpr std::string_view kAllowed =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-";
  if (!prefix.empty() && prefix.size() <= 100 && prefix.front() != '-' &&
      prefix.find_first_not_of(kAllowed) == std::string::npos) {
    return {};
  }
  return cli::usage_error("--prefix takes up to 100 letters, digits, '_' and '-', not '" + prefix +
                          "'");
}

/// Whether an earlier export may be replaced. This is checked first, because an export may take
/// long. Errors: those of OutputFolder::check.
Result<io::OutputFolder::Existing> existing(const Options& options) {
  const auto existing = io::OutputFolder::existing(options.overwrite);
  VANTAGE_CHECK(io::OutputFolder::check(exporting::kind_of_export(), options.out, existing));
  return existing;
}

/// Opens the bundle in a folder, or the bundle that a configuration names.
Result<Bundle> open_bundle(const Options& options) {
  const PluginLoader plugins = options.common.loader();
  std::error_code ignored;
  if (fs::is_directory(options.what, ignored)) return Bundle::open(options.what, plugins);
  VANTAGE_TRY(const Config config, load_config(options.what, options.common.overrides));
  return Bundle::open(config, plugins, "exporting");
}

/// Opens the bundle and exports it. @param write  Result<Report>(bundle, existing, progress)
template <class Write>
auto export_with(const Options& options, const Write& write)
    -> decltype(write(std::declval<Bundle>(), io::OutputFolder::Existing::refuse,
                      Bundle::Progress())) {
  const cli::ThreadLimit threads(options.common.jobs);
  VANTAGE_TRY(const auto over, existing(options));
  VANTAGE_TRY(const Bundle bundle, open_bundle(options));
  VANTAGE_CHECK(bundle.need_points("export"));
  std::optional<cli::Progress> progress;
  return write(bundle, over, [&](std::size_t done, std::size_t total) {
    if (!progress) progress.emplace("reading (region maps)", options.common.quiet);
    progress->update(done, total);
  });
}

void print_regions_without_points(std::uint64_t regions) {
  if (regions == 0) return;
  std::cout << fmt::format("{} without points {} left out\n", cli::counted(regions, "region"),
                           cli::form(regions, "was", "were"));
}

/// What float32 changes, and what was subtracted from all coordinates, if anything was.
void print_accuracy(double rounding, const Point& o) {
  std::cout << fmt::format("float32 moves a coordinate by {:.2g} mm at most\n", 1e3 * rounding);
  if (o.isZero(0.0)) return;
  std::cout << fmt::format("subtracted x {}, y {}, z {} m: see {}\n", o.x(), o.y(), o.z(),
                           exporting::kSidecar);
}

Result<void> run_autoware(const Options& options) {
  exporting::AutowareOptions autoware = options.autoware;
  VANTAGE_TRY(autoware.origin, parse_origin(options.origin));
  VANTAGE_CHECK(check_prefix(autoware.prefix));
  VANTAGE_TRY(const exporting::AutowareReport report,
              export_with(options, [&](const auto& bundle, auto over, const auto& progress) {
                return exporting::export_autoware(bundle, autoware, options.out, over, progress);
              }));
  const Point& o = report.origin;
  if (options.common.json) {
    const nlohmann::ordered_json json{{"points", report.points},
                                      {"repeated_points", report.repeated},
                                      {"tiles", report.tiles},
                                      {"resolution", autoware.resolution},
                                      {"origin", {o.x(), o.y(), o.z()}},
                                      {"largest_rounding", report.rounding},
                                      {"regions_without_points", report.regions_without_points}};
    std::cout << json_text(json);
    return {};
  }
  std::cout << fmt::format("{} in {} of {} m; {} more {} in several region maps\n",
                           cli::counted(report.points, "point"), cli::counted(report.tiles, "tile"),
                           autoware.resolution, cli::grouped(report.repeated),
                           cli::form(report.repeated, "was", "were"));
  print_accuracy(report.rounding, o);
  print_regions_without_points(report.regions_without_points);
  return {};
}

Result<void> run_grid(const Options& options) {
  VANTAGE_TRY(const std::optional<Point> origin, parse_origin(options.origin));
  VANTAGE_TRY(const exporting::GridReport report,
              export_with(options, [&](const auto& bundle, auto over, const auto& progress) {
                return exporting::export_grid(bundle, origin, options.out, over, progress);
              }));
  const Point& o = report.origin;
  if (options.common.json) {
    const nlohmann::ordered_json json{{"files", report.files},
                                      {"points", report.points},
                                      {"origin", {o.x(), o.y(), o.z()}},
                                      {"largest_rounding", report.rounding},
                                      {"regions_without_points", report.regions_without_points}};
    std::cout << json_text(json);
    return {};
  }
  std::cout << fmt::format("{} in {}, and grid_meta_data.yaml\n",
                           cli::counted(report.points, "point"),
                           cli::counted(report.files, "file"));
  print_accuracy(report.rounding, o);
  print_regions_without_points(report.regions_without_points);
  return {};
}

exporting::CloudFormat format_of(const std::string& name) {
  if (name == "pcd") return exporting::CloudFormat::pcd;
  return name == "las" ? exporting::CloudFormat::las : exporting::CloudFormat::ply;
}

Result<void> run_regions(const Options& options) {
  VANTAGE_TRY(const exporting::RegionsReport report,
              export_with(options, [&](const auto& bundle, auto over, const auto& progress) {
                return exporting::export_regions(bundle, format_of(options.format), options.out,
                                                 over, progress);
              }));
  if (options.common.json) {
    const nlohmann::ordered_json json{{"files", report.files},
                                      {"points", report.points},
                                      {"views", report.has_views},
                                      {"regions_without_points", report.regions_without_points}};
    std::cout << json_text(json);
    return {};
  }
  std::cout << fmt::format("{} in {}\n", cli::counted(report.points, "point"),
                           cli::counted(report.files, "file"));
  if (!report.has_views) {
    std::cout << "the bundle does not tell how many viewpoints see a point: build it with "
                 "store.views = true\n";
  }
  print_regions_without_points(report.regions_without_points);
  return {};
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  CLI::App app("Writes the region maps of a bundle for other programs.", "vantage export");
  vantage::Options options;
  app.require_subcommand(1);
  auto* autoware = app.add_subcommand(
      "autoware", "one map of all regions, each point once, as tiles that Autoware loads");
  auto* grid = app.add_subcommand(
      "grid", "the folder of grid_<i>_<j>.pcd that the program of the paper's authors writes");
  auto* regions =
      app.add_subcommand("regions", "one file per region, for CloudCompare and other programs");
  for (CLI::App* job : {autoware, grid, regions}) {
    job->add_option("BUNDLE", options.what, "configuration (TOML) of a bundle, or its folder")
        ->required()
        ->check(CLI::ExistingPath);
    job->add_option("--out", options.out, "folder to create; it must not exist yet")
        ->required()
        ->type_name("DIR");
    job->add_flag("--overwrite", options.overwrite, "replace an earlier export");
  }
  autoware
      ->add_option("--resolution", options.autoware.resolution, "side of a tile in whole metres")
      ->check(CLI::Range(1U, 100'000U))
      ->capture_default_str();
  for (CLI::App* job : {autoware, grid}) {
    job->add_option("--origin", options.origin,
                    "subtract X,Y,Z [m], for maps far from 0, where float32 is coarse; auto: the "
                    "lowest corner of the map")
        ->type_name("ORIGIN")
        ->capture_default_str();
  }
  autoware->add_option("--prefix", options.autoware.prefix, "prefix of the tiles' names")
      ->type_name("WORD")
      ->capture_default_str();
  regions
      ->add_option("--format", options.format,
                   "format of the files; if the bundle has views, they are a field")
      ->required()
      ->check(CLI::IsMember({"ply", "pcd", "las"}));
  for (CLI::App* job : {autoware, grid, regions}) options.common.add_to(*job);
  return vantage::cli::run_program(app, argc, argv, [&] {
    if (*autoware) return vantage::run_autoware(options);
    return *grid ? vantage::run_grid(options) : vantage::run_regions(options);
  });
}
