// vantage-tile: sorts clouds of any size into square tiles.
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "terminal/command_line.hpp"
#include "terminal/progress.hpp"
#include "terminal/size.hpp"
#include "terminal/table.hpp"
#include "vantage/io/formats.hpp"
#include "vantage/io/map_files.hpp"
#include "vantage/io/tiling.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage {
namespace {

struct Options {
  std::vector<std::filesystem::path> inputs;
  std::filesystem::path out;
  double tile_size = io::TilingOptions{}.tile_size;  // [m]
  std::string memory = "1GiB";
  bool overwrite = false, quiet = false, json = false;
  std::string color = "auto";
};

std::string_view name_of(io::Precision precision) {
  return precision == io::Precision::float32 ? "float32" : "float64";
}

void print(const io::TilingReport& report, const Options& options, const io::MapFiles& found) {
  const Point &low = report.bounds.min, &high = report.bounds.max;
  std::cout << fmt::format("{}: {} ({}), {} in {}\n", options.out.string(),
                           cli::counted(report.points, "point"), name_of(report.precision),
                           cli::size_text(report.bytes), cli::counted(report.packs, "pack"))
            << fmt::format("{} of {:g} m, {} of {:g} m\n", cli::counted(report.tiles, "tile"),
                           options.tile_size, cli::counted(report.cells, "cell"),
                           io::kCanonicalCell)
            << fmt::format("x {:.2f} .. {:.2f}, y {:.2f} .. {:.2f}, z {:.2f} .. {:.2f} m\n",
                           low.x(), high.x(), low.y(), high.y(), low.z(), high.z());
  if (report.dropped > 0) {
    std::cout << fmt::format("{} with NaN or infinite coordinates {} dropped\n",
                             cli::counted(report.dropped, "point"),
                             cli::form(report.dropped, "was", "were"));
  }
  if (found.unlisted_tiles > 0) {
    std::cout << fmt::format(
        "{} beside the input's tiles {} not in the tiles' metadata and {} left out\n",
        cli::counted(found.unlisted_tiles, "file"), cli::form(found.unlisted_tiles, "is", "are"),
        cli::form(found.unlisted_tiles, "was", "were"));
  }
}

nlohmann::ordered_json to_json(const io::TilingReport& report, const Options& options,
                               const io::MapFiles& found) {
  const auto list = [](const Point& p) { return std::array{p.x(), p.y(), p.z()}; };
  return {{"points", report.points},
          {"dropped_points", report.dropped},
          {"unlisted_tiles", found.unlisted_tiles},
          {"precision", name_of(report.precision)},
          {"tile_size", options.tile_size},
          {"tiles", report.tiles},
          {"cells", report.cells},
          {"packs", report.packs},
          {"bytes", report.bytes},
          {"bounds", {{"min", list(report.bounds.min)}, {"max", list(report.bounds.max)}}},
          {"counted_now", report.counted_now},
          {"placed_now", report.placed_now},
          {"buffer_bytes", report.buffers}};
}

void tell(const io::TilingStart& start) {
  if (start.resumed) {
    std::cerr << fmt::format("continuing an interrupted run: {} counted, {} placed\n",
                             cli::counted(start.counted, "point"), cli::grouped(start.placed));
  } else if (start.started_over) {
    std::cerr << "an interrupted run had other input or options: starting over\n";
  }
}

Result<void> run(const Options& options) {
  const auto memory = cli::parse_memory(options.memory);
  if (!memory) {
    return cli::usage_error(cli::not_memory(options.memory));
  }
  VANTAGE_TRY(const io::MapFiles found, io::map_files(options.inputs));
  std::optional<cli::Progress> progress;
  std::optional<io::TilingStage> stage;
  io::TilingOptions tiling{.out = options.out,
                           .tile_size = options.tile_size,
                           .memory = *memory,
                           .overwrite = options.overwrite};
  tiling.on_start = [&](const io::TilingStart& start) {
    if (!options.quiet) tell(start);
  };
  tiling.on_disk_use = [&](const io::TilingDiskUse& use) {
    progress.reset();
    if (options.quiet) return;
    std::cerr << fmt::format("disk: {} needed, {} free\n", cli::size_text(use.needed),
                             cli::size_text(use.free));
  };
  tiling.on_progress = [&](const io::TilingProgress& now) {
    if (!stage || *stage != now.stage) {
      stage = now.stage;
      progress.emplace(
          now.stage == io::TilingStage::counting ? "counting (points)" : "placing (points)",
          options.quiet);
    }
    progress->update(now.done, now.total);
  };
  const auto report = io::tile_clouds(found.files, tiling);
  progress.reset();
  if (!report) return fail(report.error());
  if (options.json) {
    std::cout << json_text(to_json(*report, options, found));
  } else {
    print(*report, options, found);
  }
  return {};
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  CLI::App app(
      "Sorts clouds of any size into square tiles, with bounded memory.\n"
      "A configuration may name the result as its map. The same command continues a run that was "
      "interrupted.",
      "vantage tile");
  vantage::Options options;
  app.add_option("INPUT", options.inputs,
                 fmt::format("files, patterns or folders: {}; Autoware's tiles, tiled maps",
                             vantage::io::format_names(vantage::io::FormatUse::map)))
      ->required();
  app.add_option("-o,--out", options.out, "folder to create; it must not exist yet")
      ->type_name("DIR")
      ->required();
  app.add_option("--tile-size", options.tile_size, "side of a tile [m], a multiple of 5")
      ->check(CLI::Range(vantage::io::kCanonicalCell, 1e5))
      ->capture_default_str();
  app.add_option("--memory", options.memory, "limit of all buffers, in MiB or GiB")
      ->type_name("SIZE")
      ->capture_default_str();
  app.add_flag("--overwrite", options.overwrite, "replace an earlier tiled map");
  app.add_flag("-q,--quiet", options.quiet, "no progress on stderr");
  app.add_flag("--json", options.json, "results as JSON on stdout");
  vantage::cli::add_color_option(app, options.color);
  return vantage::cli::run_program(app, argc, argv, [&] { return vantage::run(options); });
}
