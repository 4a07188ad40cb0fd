// vantage-info: what a recording, a map or a bundle holds.
#include <fmt/format.h>
#include <unistd.h>

#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "info/bundle_info.hpp"
#include "info/recording_info.hpp"
#include "info/tiled_info.hpp"
#include "terminal/command_line.hpp"
#include "terminal/option_values.hpp"
#include "terminal/progress.hpp"
#include "vantage/io/formats.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage {
namespace {

struct Options {
  io::ScanOptions scans;
  std::vector<std::filesystem::path> plugin_dirs;
  bool regions = false;
  bool quiet = false;
  bool json = false;
  std::string color = "auto";
};

template <class Info>
void print(const Info& info, const Options& options) {
  if (options.json) {
    std::cout << json_text(to_json(info));
  } else {
    std::cout << to_text(info, cli::Style::of(STDOUT_FILENO, options.color));
  }
}

Result<std::optional<TiledInfo>> read_tiled_map(const Options& options) {
  std::optional<cli::Progress> progress;
  return inspect_tiled_map(options.scans.path, [&](std::size_t done, std::size_t total) {
    if (!progress) progress.emplace("reading (points)", options.quiet);
    progress->update(done, total);
  });
}

Result<void> run(const Options& options) {
  const auto takes_a_bundle = [&]() -> Result<void> {
    if (!options.regions) return {};
    return cli::usage_error("--regions takes a bundle of region maps, and " +
                            options.scans.path.string() + " is not one");
  };
  VANTAGE_TRY(const auto tiled, read_tiled_map(options));
  if (tiled) {
    VANTAGE_CHECK(takes_a_bundle());
    print(*tiled, options);
    return {};
  }
  VANTAGE_TRY(
      const auto bundle,
      inspect_bundle(options.scans.path, PluginLoader::with_default_folders(options.plugin_dirs),
                     options.regions));
  if (bundle) {
    print(*bundle, options);
    return {};
  }
  VANTAGE_CHECK(takes_a_bundle());
  RecordingInfo info;
  {
    cli::Progress progress("reading (scans)", options.quiet);
    VANTAGE_TRY(info, inspect(options.scans, [&](std::size_t done, std::size_t total) {
                  progress.update(done, total);
                }));
  }
  print(info, options);
  if (info.damage) return fail(Error(*info.damage).during("describing what comes before"));
  return {};
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  CLI::App app(
      "Prints what a recording, a map or a bundle contains.\n"
      "Of recordings: format, topics, scans, points, fields, extent, rate, gaps, and the IMU's "
      "rate, "
      "unit, gravity and bias. Of bundles: regions, and how well a sensor can be localized in "
      "them.",
      "vantage info");
  vantage::Options options;
  app.add_option("PATH", options.scans.path,
                 fmt::format("folder of scans, map tiles, a tiled map or a bundle, {}, {}; IMU CSV "
                             "or KITTI oxts",
                             vantage::io::format_names(vantage::io::FormatUse::recording, ", "),
                             vantage::io::format_names(vantage::io::FormatUse::cloud)))
      ->required();
  app.add_option("--topic", options.scans.topic, "topic of the scans, if a bag has several");
  app.add_option("--rate", options.scans.rate_hz, "scans per second, if files contain no stamps")
      ->check(vantage::cli::positive_number())
      ->capture_default_str();
  vantage::cli::add_plugin_folders_option(app, options.plugin_dirs);
  app.add_flag("--regions", options.regions,
               "of a bundle: also each region, with its label, place, points, viewpoints, elements "
               "and bytes");
  app.add_flag("-q,--quiet", options.quiet, "no progress on stderr");
  app.add_flag("--json", options.json, "results as JSON on stdout");
  app.add_flag_callback(
      "--formats",
      [&] {
        std::cout << vantage::formats_text(vantage::cli::Style::of(STDOUT_FILENO, options.color));
        throw CLI::Success();
      },
      "list the formats that are read, and exit");
  vantage::cli::add_color_option(app, options.color);
  return vantage::cli::run_program(app, argc, argv, [&] { return vantage::run(options); });
}
