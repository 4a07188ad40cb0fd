// vantage-view: shows a bundle or a point cloud in a window, or writes a picture of it.
#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "terminal/command_line.hpp"
#include "terminal/progress.hpp"
#include "terminal/table.hpp"
#include "vantage/io/formats.hpp"
#include "vantage/io/tiled_map.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "vantage/kit/atomic_file.hpp"
#include "view/window.hpp"

namespace vantage {
namespace {

using view::Coloring;

struct Options {
  std::filesystem::path what, trajectory, png;
  std::string region, color = "height", size;
  std::vector<std::filesystem::path> plugin_dirs;
  std::size_t max_points = 5'000'000;
  int point_size = 0;
  bool quiet = false, json = false;
};

bool is_bundle(const Options& options) {
  std::error_code ignored;
  return std::filesystem::is_directory(options.what, ignored) && !io::is_tiled_map(options.what);
}

Coloring coloring_of(const std::string& name) {
  for (const Coloring coloring : {Coloring::region, Coloring::views, Coloring::localizability}) {
    if (name == view::to_string(coloring)) return coloring;
  }
  return Coloring::height;
}

/// Checks what can be checked before anything is read.
Result<view::Size> check(const Options& options) {
  if (!is_bundle(options)) {
    if (!options.region.empty()) {
      return cli::usage_error("--region takes a bundle of region maps, and " +
                              options.what.string() + " is not a folder");
    }
    if (options.color != "height") {
      return cli::usage_error("--color " + options.color + " takes a bundle of region maps, and " +
                              options.what.string() + " is not a folder");
    }
  }
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

Result<view::Lines> read_lines(const Options& options, const Point& origin) {
  view::Lines lines;
  if (options.trajectory.empty()) return lines;
  VANTAGE_TRY(const auto trajectory, io::read_trajectory(options.trajectory));
  for (const auto& moment : trajectory) {
    lines.trajectory.push_back(moment.pose.translation - origin);
  }
  return lines;
}

std::string label_of(const view::Scene& scene, const view::Controls& controls) {
  return controls.region ? scene.index().partition[*controls.region].label : std::string();
}

std::string legend(const view::Drawing& drawing, const view::Controls& controls,
                   const view::Scales& scales, const view::Scene& scene) {
  switch (controls.coloring) {
    case Coloring::height:
      return fmt::format("height, {:.1f} m (blue) to {:.1f} m (yellow)",
                         scales.height.low + scene.origin().z(),
                         scales.height.high + scene.origin().z());
    case Coloring::region: return "the region that a point is in, light is high";
    case Coloring::views: {
      const auto most = std::max_element(drawing.views.begin(), drawing.views.end());
      return fmt::format(
          "{} a point, 1 (dark) to {:.0f} (light){}",
          scene.bundle()->has_views() ? "viewpoints that see" : "region maps that hold",
          scales.views.high,
          *most > scales.views.high ? fmt::format(" and more, {} at most", cli::grouped(*most))
                                    : std::string());
    }
    case Coloring::localizability:
      return fmt::format(
          "expected error at the nearest site, {:g} m (blue) to {:g} m and more, or no match "
          "(red)\n"
          "sites      {} of the atlas for {}; white line: weak direction, longer if weaker; "
          "violet: "
          "alike places",
          view::kLeastError, view::kLargestError, cli::grouped(scene.atlas()->sites.size()),
          scene.atlas()->calibration.matcher.plugin);
  }
  return {};
}

/// A few lines about what is drawn.
std::string description(const view::Scene& scene, const view::Drawing& drawing,
                        const view::Controls& controls, const view::Scales& scales,
                        std::size_t max_points) {
  const Point& o = scene.origin();
  std::string text =
      fmt::format("shown      {}{}\n", scene.name(),
                  controls.region ? ", region '" + label_of(scene, controls) + "'" : "");
  text += fmt::format("points     {} drawn of a map of {}{}\n", cli::grouped(drawing.points.size()),
                      cli::grouped(scene.total_points()),
                      drawing.thinned
                          ? fmt::format("; thinned to --max-points {}", cli::grouped(max_points))
                          : std::string());
  if (scene.dropped_points() > 0) {
    text += fmt::format("dropped    {} with NaN or infinite coordinates\n",
                        cli::counted(scene.dropped_points(), "point"));
  }
  text += fmt::format("origin     drawn around x {:.0f}, y {:.0f}, z {:.0f} m of the map\n", o.x(),
                      o.y(), o.z());
  return text + "colour     " + legend(drawing, controls, scales, scene) + "\n";
}

nlohmann::ordered_json to_json(const view::Scene& scene, const view::Drawing& drawing,
                               const view::Controls& controls, const view::Scales& scales) {
  const Point& o = scene.origin();
  nlohmann::ordered_json json{{"shown", scene.name()},
                              {"map_points", scene.total_points()},
                              {"dropped_points", scene.dropped_points()},
                              {"drawn_points", drawing.points.size()},
                              {"thinned", drawing.thinned},
                              {"origin", {o.x(), o.y(), o.z()}},
                              {"color", view::to_string(controls.coloring)},
                              {"height", {scales.height.low + o.z(), scales.height.high + o.z()}}};
  if (scene.bundle()) json["regions"] = scene.index().partition.size();
  if (controls.region) {
    json["region"] = label_of(scene, controls);
    json["viewpoints"] = drawing.viewpoints.size();
  }
  if (controls.coloring == Coloring::localizability) {
    json["sites"] = scene.atlas()->sites.size();
    json["expected_error"] = {view::kLeastError, view::kLargestError};
  }
  if (!drawing.views.empty()) {
    json["views"] = *std::max_element(drawing.views.begin(), drawing.views.end());
  }
  return json;
}

Result<view::Scene> open(const Options& options) {
  if (!is_bundle(options)) return view::Scene::open_cloud(options.what, options.max_points);
  return view::Scene::open_bundle(
      options.what, PluginLoader::with_default_folders(options.plugin_dirs), options.max_points);
}

void tell(const Options& options, const view::Scene& scene, const view::Drawing& drawing,
          const view::Controls& controls, const view::Scales& scales) {
  if (options.json) {
    std::cout << to_json(scene, drawing, controls, scales).dump(2) << '\n';
  } else if (!options.quiet) {
    std::cout << description(scene, drawing, controls, scales, options.max_points);
  }
  std::cout.flush();
}

Result<void> run(const Options& options) {
  VANTAGE_TRY(const view::Size size, check(options));
  VANTAGE_TRY(view::Scene scene, open(options));
  view::Show show{
      .scene = scene, .lines = {}, .controls = {}, .size = size, .progress = {}, .tell = {}};
  show.controls.coloring = coloring_of(options.color);
  if (show.controls.coloring == Coloring::localizability) VANTAGE_CHECK(scene.need_atlas());
  show.controls.point_size = options.point_size;
  if (!options.region.empty()) {
    VANTAGE_TRY(show.controls.region, scene.bundle()->find_region(options.region));
  }
  VANTAGE_TRY(show.lines, read_lines(options, scene.origin()));
  VANTAGE_CHECK(view::check_display());
  std::optional<io::OutputFile> file;  // opened now, so that a missing folder is reported at once
  if (!options.png.empty()) {
    VANTAGE_TRY(file, io::OutputFile::create(options.png));
  }
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
                                 !show.lines.trajectory.empty(), scene.atlas().has_value()});
  }
  show.tell = [&](const view::Drawing& now, const view::Controls& controls,
                  const view::Scales& scales) { tell(options, scene, now, controls, scales); };
  return view::run_window(show, std::move(drawing));
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
  app.add_option("--trajectory", options.trajectory, "a line along these poses (TUM, KITTI)")
      ->type_name("FILE");
  app.add_option(
         "--color", options.color,
         "colour points by height, by region, by the number of viewpoints that see them (of "
         "region maps that contain them, if the bundle has no views), or by localizability: "
         "the expected error at the nearest site of the atlas")
      ->check(CLI::IsMember({"height", "region", "views", "localizability"}))
      ->capture_default_str();
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
  app.add_option("--plugin-dir", options.plugin_dirs,
                 "look for plugins here first (then $VANTAGE_PLUGIN_PATH, then beside the library)")
      ->type_name("DIR")
      ->check(CLI::ExistingDirectory)
      ->allow_extra_args(false);
  app.add_flag("--quiet,-q", options.quiet, "no progress, no description and no help at the start");
  app.add_flag("--json", options.json, "what is drawn as JSON on stdout");
  return vantage::cli::run_program(app, argc, argv, [&] { return vantage::run(options); });
}
