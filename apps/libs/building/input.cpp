#include "building/input.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <iostream>
#include <limits>
#include <span>
#include <utility>
#include <variant>

#include "building/recorded_scans.hpp"
#include "checks/map_facts.hpp"
#include "io/text.hpp"
#include "terminal/counts.hpp"
#include "terminal/size.hpp"
#include "vantage/io/map_files.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "vantage/params.hpp"

namespace vantage::building {
namespace {

namespace fs = std::filesystem;

/// What a build in memory takes for each map point, at least [bytes].
constexpr std::uint64_t kBytesInMemory = 88;

/// An error about a file that [map] names, at the line that names it.
/// @param named  the key's value, or an element of it; none if a program made the configuration
tl::unexpected<Error> at_line(const Value* named, Error error) {
  if (named == nullptr || !error.where || error.code != ErrorCode::not_found) {
    return fail(std::move(error));
  }
  error.message = error.where->file + ": " + error.message;
  error.where = named->where;
  return fail(std::move(error));
}

/// What [map] says under a key; none if a program made the configuration.
const Value* in_map(const Config& config, std::string_view key) {
  const Value* const map = config.written.find("map");
  const auto* const table = map != nullptr ? std::get_if<Table>(&map->data) : nullptr;
  return table != nullptr ? table->find(key) : nullptr;
}

Result<io::MapFiles> map_files(const Config& config, const MapSource& source) {
  auto found = io::map_files(source.files);
  if (found) return found;
  const Value* named = in_map(config, "files");
  const auto* const names = named != nullptr ? std::get_if<Array>(&named->data) : nullptr;
  for (std::size_t i = 0; names != nullptr && i < source.files.size(); ++i) {
    if (io::map_files(std::span(source.files).subspan(i, 1))) continue;
    named = &names->at(i);
    break;
  }
  return at_line(named, std::move(found).error());
}

/// The spacing of a map, to two digits; 0 if it has too few points. What a tiled map is measured by
/// does not depend on how much of it is in memory.
Result<double> spacing_of(const WideAreaMap& map, const MapSource& source) {
  VANTAGE_TRY(const io::MapFiles found, io::map_files(source.files));
  double spacing = 0.0;
  if (found.files.size() == 1 && io::is_tiled_map(found.files.front())) {
    VANTAGE_TRY(const auto tiles, io::TiledMap::open(found.files.front()));
    VANTAGE_TRY(PointCloud sample, sample_of(tiles));
    io::into_canonical_order(sample);
    spacing = checks::spacing_of(sample);
  } else {
    spacing = checks::spacing_of(map.points);
  }
  return io::parse_number<double>(fmt::format("{:.2g}", spacing)).value_or(0.0);
}

/// The sections of plugins that work on the points of the map.
template <class F>
Result<void> for_each_map_plugin(Config& config, const F& f) {
  if (config.partitioner)
    VANTAGE_CHECK(f(PluginKind::partitioner, *config.partitioner, config.partitioner->params));
  if (config.ground)
    VANTAGE_CHECK(f(PluginKind::ground, config.ground->choice(), config.ground->params));
  if (config.visibility) {
    VANTAGE_CHECK(
        f(PluginKind::visibility, config.visibility->choice(), config.visibility->params));
  }
  return {};
}

/// Sets the parameters `point_spacing` that are left out.
/// @return  whether there was one
Result<bool> set_spacing(Config& config, const WideAreaMap& map, const MapSource& source,
                         const cli::CommonOptions& common) {
  const PluginLoader plugins = common.loader();
  double spacing = 0.0;
  bool set = false;
  const auto fill = [&](PluginKind kind, PluginChoice choice, Table& params) -> Result<void> {
    if (params.find(kMeasured) != nullptr) return {};
    VANTAGE_TRY(const auto docs, plugins.parameters(kind, choice));
    if (std::ranges::none_of(docs, [&](const ParameterDoc& doc) { return doc.key == kMeasured; })) {
      return {};
    }
    if (spacing == 0.0) {
      VANTAGE_TRY(spacing, spacing_of(map, source));
    }
    choice.params.entries.push_back({kMeasured, {spacing, params.where}, params.where});
    // A map in another unit has a spacing that no plugin takes, and a note of its own.
    if (spacing == 0.0 || !plugins.effective_params(kind, choice)) return {};
    params = std::move(choice.params);
    set = true;
    return {};
  };
  VANTAGE_CHECK(for_each_map_plugin(config, fill));
  if (set && !common.quiet) std::cerr << fmt::format("{} {:g} m, measured\n", kMeasured, spacing);
  return set;
}

/// The folder of the bundle with ".parts" behind its name.
Result<fs::path> parts_beside(const BundleBuild& build) {
  if (auto place = build.place()) return *place += ".parts";
  return cli::usage_error(
      "the store has no folder for its bundle, so --parts has to name one for the parts");
}

}  // namespace

bool fits_at_once(std::uint64_t points, std::uint64_t memory) {
  constexpr std::uint64_t kCannotBeIndexed = std::numeric_limits<std::uint32_t>::max();
  return points <= memory / kBytesInMemory && points < kCannotBeIndexed;
}

Result<WideAreaMap> read_map(const Config& config, const MapSource& source, std::uint64_t memory,
                             Reading reading) {
  WideAreaMap map;
  VANTAGE_TRY(const io::MapFiles found, map_files(config, source));
  map.unlisted_tiles = found.unlisted_tiles;
  if (source.trajectory) {
    auto trajectory = io::read_trajectory(*source.trajectory);
    if (!trajectory) return at_line(in_map(config, "trajectory"), std::move(trajectory).error());
    for (const auto& moment : *trajectory) map.trajectory.push_back(moment.pose.translation);
  }
  if (found.files.size() == 1 && io::is_tiled_map(found.files.front())) {
    VANTAGE_TRY(auto tiles, io::TiledMap::open(found.files.front()));
    if (reading == Reading::never || !fits_at_once(tiles.points(), memory)) {
      map.dropped = tiles.dropped();
      map.tiles = std::move(tiles);
      return map;
    }
  } else if (reading == Reading::never) {
    return fail(ErrorCode::invalid_input,
                "shards need a tiled map: make one with `vantage tile`, and name its folder in "
                "map.files",
                SourceLocation{source.files.front().string(), 0, 0});
  }
  VANTAGE_TRY(auto cloud, io::read_point_clouds(found.files));
  map.points = std::move(cloud.points);
  map.dropped = cloud.dropped;
  if (map.points.empty()) {
    return fail(ErrorCode::invalid_input,
                "the map holds no finite point (" + std::to_string(map.dropped) + " dropped)",
                SourceLocation{source.files.front().string(), 0, 0});
  }
  io::into_canonical_order(map.points);
  return map;
}

Result<PointCloud> sample_of(const io::TiledMap& tiles) {
  constexpr std::uint64_t kEnough = 4'000'000;
  const std::uint64_t step = tiles.points() / kEnough + 1;
  PointCloud points;
  for (std::size_t i = 0; i < tiles.tiles().size(); i += step) {
    VANTAGE_TRY(const PointCloud some, tiles.read(tiles.tiles()[i].index));
    points.insert(points.end(), some.begin(), some.end());
  }
  return points;
}

void Options::add_to(CLI::App& app) {
  app.add_option("CONFIG", config, "configuration (TOML)")->required();
  app.add_option(
         "--memory", memory,
         "memory limit of the build, in MiB or GiB; a tiled map that needs more is built part "
         "by part")
      ->capture_default_str();
  app.add_option(
         "--parts", parts,
         "folder for the finished regions of a tiled map until they are merged; if left out, "
         "'.parts' is appended to the bundle's name")
      ->type_name("DIR");
  app.add_flag("--overwrite", overwrite,
               "replace an earlier bundle: --set store.params.overwrite=true");
  common.add_to(app);
}

std::vector<std::string> Options::overrides() const {
  std::vector<std::string> all = common.overrides;
  if (overwrite) all.emplace_back("store.params.overwrite=true");
  return all;
}

Result<Prepared> prepare(const Options& options, Reading reading) {
  const auto memory = cli::parse_memory(options.memory);
  if (!memory) return cli::usage_error(cli::not_memory(options.memory));
  VANTAGE_TRY(Config config, load_config(options.config, options.overrides()));
  VANTAGE_TRY(const auto source, config.need(config.map, "map", "building region maps"));
  VANTAGE_TRY(BundleBuild build, BundleBuild::prepare(config, options.common.loader()));
  VANTAGE_TRY(WideAreaMap map, read_map(config, source, *memory, reading));
  VANTAGE_TRY(const bool measured, set_spacing(config, map, source, options.common));
  if (measured) {
    VANTAGE_TRY(build, BundleBuild::prepare(config, options.common.loader()));
  }
  fs::path parts = options.parts;
  // A build in parts begins its bundle last. That the store refuses it must show first.
  if (map.tiles) VANTAGE_CHECK(build.may_begin());
  if (parts.empty() && map.tiles) {
    VANTAGE_TRY(parts, parts_beside(build));
  }
  return Prepared{std::move(config), std::move(build), std::move(map), *memory, std::move(parts)};
}

Result<void> read_scans(Prepared& prepared, bool quiet) {
  VANTAGE_TRY(auto scans, recorded_scans(prepared.config));
  if (scans.empty()) return {};
  if (!quiet) {
    std::cerr << fmt::format("{} of {} for the selector, at least 2 m apart\n",
                             cli::counted(scans.size(), "scan"),
                             prepared.config.selector->scans->string());
  }
  prepared.build.choose_with(std::move(scans));
  return {};
}

Result<ShardedBuild> open_shards(Prepared& prepared, const io::TiledParts& parts) {
  return prepared.build.sharded(parts, prepared.map.trajectory,
                                {.parts = prepared.parts,
                                 .map_key = prepared.map.tiles->checksum(),
                                 .memory = prepared.memory});
}

Result<Shard> parse_shard(const std::string& text) {
  Shard shard{0, 0};
  const char* const end = text.data() + text.size();
  const auto [slash, bad_number] = std::from_chars(text.data(), end, shard.number);
  if (bad_number == std::errc{} && slash != end && *slash == '/') {
    const auto [stop, bad_count] = std::from_chars(slash + 1, end, shard.count);
    if (bad_count == std::errc{} && stop == end && shard.number >= 1 &&
        shard.number <= shard.count) {
      return shard;
    }
  }
  return cli::usage_error(
      fmt::format("--shard takes a number and a count, as 3/64, not '{}'", text));
}

}  // namespace vantage::building
