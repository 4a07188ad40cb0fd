// vantage-view: shows a bundle or a point cloud in a window, or writes a picture of it.
#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <optional>

#include "terminal/command_line.hpp"
#include "terminal/input_options.hpp"
#include "terminal/option_values.hpp"
#include "terminal/progress.hpp"
#include "vantage/io/formats.hpp"
#include "vantage/io/tiled_map.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "vantage/kit/atomic_file.hpp"
#include "vantage/kit/json_text.hpp"
#include "view/description.hpp"
#include "view/window.hpp"

namespace vantage {
namespace {

using view::Coloring;

struct Options {
  std::filesystem::path what, trajectory, png;
  std::string region, color = "height", size;
  std::vector<std::filesystem::path> plugin_dirs;
  InputOptions inputs;  ///< with --color contribution
  std::size_t max_points = 5'000'000;
  int point_size = 0;
  bool quiet = false, json = false;
};

bool is_bundle(const Options& options) {
  std::error_code ignored;
  return std::filesystem::is_directory(options.what, ignored) && !io::is_tiled_map(options.what);
}

Coloring coloring_of(const std::string& name) {
  for (const Coloring coloring :
       {Coloring::region, Coloring::views, Coloring::localizability, Coloring::contribution}) {
    if (name == view::to_string(coloring)) return coloring;
  }
  return Coloring::height;
}

/// The options of scans belong to a colour.
Result<void> check_inputs(const Options& options) {
  const InputOptions& inputs = options.inputs;
  if (options.color == "contribution") {
    if (!inputs.scans.empty() && !inputs.reference.empty()) return {};
    return cli::usage_error(
        "--color contribution takes scans and their poses: give --scans and --reference");
  }
  for (const auto& [option, given] : {std::pair("--scans", !inputs.scans.empty()),
                                      {"--topic", !inputs.topic.empty()},
                                      {"--reference", !inputs.reference.empty()},
                                      {"--reference-topic", !inputs.reference_topic.empty()},
                                      {"--mount", !inputs.mount.empty()}}) {
    if (given) {
      return cli::usage_error(fmt::format("{} is given without --color contribution", option));
    }
  }
  return {};
}

/// Checks what can be checked before anything is read.
Result<view::Size> check(const Options& options) {
  if (!is_bundle(options)) {
    if (!options.region.empty()) {
      return cli::usage_error("--region takes a bundle of region maps, and " +
                              options.what.string() + " is not one");
    }
    if (options.color != "height") {
      return cli::usage_error("--color " + options.color + " takes a bundle of region maps, and " +
                              options.what.string() + " is not one");
    }
  }
  VANTAGE_CHECK(check_inputs(options));
  if (!options.png.empty() && options.png.extension() != ".png") {
    return cli::usage_error("--png takes a name that ends in .png, not '" + options.png.string() +
                            "'");
  }
  if (options.size.empty()) return view::Size{};
  const auto size = view::parse_size(options.size);
  if (!size) {
    return cli::usage_error("--size takes WxH, sides of 64 to 8192 pixels, not '" + options.size +
                            "'");
  }
  return *size;
}

Result<view::Lines> read_lines(const Options& options, const std::optional<RunInputs>& inputs,
                               const Point& origin) {
  view::Lines lines;
  io::Trajectory trajectory;
  if (!options.trajectory.empty()) {
    VANTAGE_TRY(trajectory, io::read_trajectory(options.trajectory));
  } else if (inputs) {
    trajectory = *inputs->reference;
  }
  for (const auto& moment : trajectory) {
    lines.trajectory.push_back(moment.pose.translation - origin);
  }
  return lines;
}

PluginLoader loader_of(const Options& options) {
  return PluginLoader::with_default_folders(options.plugin_dirs);
}

Result<view::Scene> open(const Options& options) {
  if (!is_bundle(options)) return view::Scene::open_cloud(options.what, options.max_points);
  return view::Scene::open_bundle(options.what, loader_of(options), options.max_points);
}

/// Has the scene draw what the elements of its bundle contribute.
Result<void> measure(const Options& options, const RunInputs& inputs, view::Scene& scene) {
  VANTAGE_TRY(const PluginChoice matcher, view::matcher_of(*scene.bundle(), scene.atlas()));
  cli::Progress progress("measuring (scans)", options.quiet);
  VANTAGE_TRY(auto found,
              view::contributions_to(
                  inputs, *scene.bundle(), matcher, loader_of(options),
                  [&](std::size_t done, std::size_t total) { progress.update(done, total); }));
  scene.show(std::move(found));
  return {};
}

void tell(const Options& options, const view::Scene& scene, const view::Drawing& drawing,
          const view::Controls& controls, const view::Scales& scales) {
  if (options.json) {
    std::cout << json_text(view::to_json(scene, drawing, controls, scales));
  } else if (!options.quiet) {
    std::cout << view::description(scene, drawing, controls, scales, options.max_points);
  }
  std::cout.flush();
}

Result<void> run(const Options& options) {
  VANTAGE_TRY(const view::Size size, check(options));
  VANTAGE_TRY(view::Scene scene, open(options));
  view::Show show{
      .scene = scene, .lines = {}, .controls = {}, .size = size, .progress = {}, .tell = {}};
  show.controls.coloring = coloring_of(options.color);
  const bool elements = show.controls.coloring == Coloring::contribution;
  if (!elements) VANTAGE_CHECK(scene.need_points());
  if (show.controls.coloring == Coloring::localizability) VANTAGE_CHECK(scene.need_atlas());
  show.controls.point_size = options.point_size;
  if (!options.region.empty()) {
    VANTAGE_TRY(show.controls.region, scene.bundle()->find_region(options.region));
  }
  std::optional<RunInputs> inputs;
  if (elements) {
    VANTAGE_TRY(inputs, options.inputs.open());
  }
  VANTAGE_TRY(show.lines, read_lines(options, inputs, scene.origin()));
  VANTAGE_CHECK(view::check_display());
  std::optional<io::OutputFile> file;  // opened now, so that a missing folder is reported at once
  if (!options.png.empty()) {
    VANTAGE_TRY(file, io::OutputFile::create(options.png));
  }
  if (inputs) VANTAGE_CHECK(measure(options, *inputs, scene));
  const auto draw = [&]() -> Result<view::Drawing> {
    std::optional<cli::Progress> progress;
    return scene.draw(show.controls.region, show.controls.coloring == Coloring::views,
                      [&](std::size_t done, std::size_t total) {
                        if (!progress) progress.emplace("reading (region maps)", options.quiet);
                        progress->update(done, total);
                      });
  };
  VANTAGE_TRY(auto drawing, draw());
  if (file) {
    VANTAGE_TRY(const view::Picture picture, view::render(show, drawing));
    VANTAGE_TRY(const std::string png, view::to_png(picture));
    VANTAGE_CHECK(file->write(png));
    VANTAGE_CHECK(file->commit());
    tell(options, scene, drawing, show.controls, view::scales_of(drawing));
    return {};
  }
  if (!options.quiet) {
    const auto regions = scene.bundle() ? scene.index().partition.size() : 0;
    std::cerr << view::key_help({static_cast<std::uint32_t>(regions),
                                 !show.lines.trajectory.empty(), scene.atlas().has_value(),
                                 scene.contributions().has_value()});
  }
  show.tell = [&](const view::Drawing& now, const view::Controls& controls,
                  const view::Scales& scales) { tell(options, scene, now, controls, scales); };
  return view::run_window(show, std::move(drawing));
}

/// Those inputs of a localization that say where scans were taken.
void add_inputs(CLI::App& app, InputOptions& inputs) {
  app.add_option("--scans", inputs.scans,
                 fmt::format("with --color contribution: folder of {} scans, {}",
                             io::format_names(io::FormatUse::scan),
                             io::format_names(io::FormatUse::recording)));
  app.add_option("--topic", inputs.topic, "topic of the scans, if a bag has several");
  app.add_option("--reference", inputs.reference,
                 fmt::format("their poses in the map frame ({}); scans without one are left out",
                             io::format_names(io::FormatUse::trajectory)));
  app.add_option("--reference-topic", inputs.reference_topic, kPoseTopicHelp);
  app.add_option("--mount", inputs.mount, kMountHelp)->type_name("POSE");
  inputs.choice.add_to(app);
  app.add_option("--rate", inputs.rate_hz, "scans per second, if files contain no stamps")
      ->check(vantage::cli::positive_number())
      ->capture_default_str();
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  CLI::App app("Shows a bundle of region maps, or a point cloud, in a window or as a picture.",
               "vantage view");
  vantage::Options options;
  app.add_option("WHAT", options.what,
                 fmt::format("folder of a bundle, or a cloud ({})",
                             vantage::io::format_names(vantage::io::FormatUse::cloud, ", ")))
      ->required()
      ->check(CLI::ExistingPath);
  app.add_option("--region", options.region,
                 "only the map of this region and its viewpoints: label, or number from 0")
      ->type_name("ID");
  app.add_option("--trajectory", options.trajectory,
                 "a line along these poses (TUM, KITTI); along those of --reference if left out")
      ->type_name("FILE");
  app.add_option(
         "--color", options.color,
         "colour points by height, by region, by the number of viewpoints that see them (of "
         "region maps that contain them, if the bundle has no views), or by localizability: "
         "the expected error at the nearest site of the atlas; contribution: the matcher's "
         "elements instead of points, by how much they do to fix the poses of --scans")
      ->check(CLI::IsMember({"height", "region", "views", "localizability", "contribution"}))
      ->capture_default_str();
  vantage::add_inputs(app, options.inputs);
  app.add_option("--png", options.png, "write a picture and open no window")->type_name("FILE");
  app.add_option("--size", options.size,
                 "size of the window or picture [pixels] (default 1600x1000)")
      ->type_name("WxH");
  app.add_option("--point-size", options.point_size,
                 "size of a point [pixels]; depends on the number of points if left out")
      ->check(CLI::Range(1, 15));
  app.add_option("--max-points", options.max_points,
                 "draw at most this many points; more are thinned")
      ->check(CLI::Range(std::size_t{1}, std::size_t{100'000'000}))
      ->capture_default_str();
  vantage::cli::add_plugin_folders_option(app, options.plugin_dirs);
  app.add_flag("--quiet,-q", options.quiet, "no progress, no description and no help at the start");
  app.add_flag("--json", options.json, "what is drawn as JSON on stdout");
  return vantage::cli::run_program(app, argc, argv, [&] { return vantage::run(options); });
}
