#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "terminal/command_line.hpp"
#include "vantage/build/bundle_build.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/io/tiled_map.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::building {

/// The options of every program that works on a build.
struct Options {
  std::string config;
  std::string memory = "4GiB";
  std::filesystem::path parts;  ///< empty: beside the bundle
  bool overwrite = false;       ///< a bundle that is there is replaced
  cli::CommonOptions common;

  void add_to(CLI::App& app);
  /// What is set on the command line: --set, and the flags that stand for a key.
  [[nodiscard]] std::vector<std::string> overrides() const;
};

/// The wide-area map: its points, or the tiles that a build reads part by part.
struct WideAreaMap {
  PointCloud points;
  std::optional<io::TiledMap> tiles;
  std::uint64_t dropped = 0;
  std::uint64_t unlisted_tiles = 0;
  PointCloud trajectory;
};

/// The parameter of plugins that is measured in the map if it is left out: the distance between
/// neighbouring points.
inline constexpr const char* kMeasured = "point_spacing";

/// The points of some tiles, evenly chosen: all of them up to 4 million. The same for every build
/// of the tiles. Errors: those of TiledMap::read.
[[nodiscard]] Result<PointCloud> sample_of(const io::TiledMap& tiles);

/// A build that is ready to run.
struct Prepared {
  Config config;
  BundleBuild build;
  WideAreaMap map;
  std::uint64_t memory = 0;  ///< [bytes]
  std::filesystem::path parts;
};

/// When the points of a tiled map are read as a whole.
enum class Reading : std::uint8_t {
  if_they_fit,  ///< into the memory that the options allow
  never,
};

/// Whether a build may have all points in memory at once: there is room, and an index can count
/// them. It reads a tiled map in parts if not.
/// @param memory  [bytes]
[[nodiscard]] bool fits_at_once(std::uint64_t points, std::uint64_t memory);

/// Reads the map, and the trajectory if there is one.
/// @param source  [map] of `config`
/// @param memory  [bytes]
/// Errors: those of the files, `not_found` at the line that names them; `invalid_input` for a map
/// without a point, and with Reading::never for a map that is not tiled.
[[nodiscard]] Result<WideAreaMap> read_map(const Config& config, const MapSource& source,
                                           std::uint64_t memory, Reading reading);

/// Loads configuration and plugins, and reads the map. A `point_spacing` that is left out of the
/// configuration, and that its plugin has, is measured in the map and set; a line on stderr says
/// so. It is the same whether a tiled map is read as a whole, in parts or in shards.
/// Errors: a usage error for a wrong --memory; those of the configuration and of the files;
/// `invalid_input` with Reading::never for a map that is not tiled.
[[nodiscard]] Result<Prepared> prepare(const Options& options, Reading reading);

/// Reads the scans that a selector chooses with, if the configuration names any. Call it before
/// regions are built. A line on stderr says how many they are. Errors: those of recorded_scans.
[[nodiscard]] Result<void> read_scans(Prepared& prepared, bool quiet);

/// Opens the sharded build of a tiled map. Errors: those of ShardedBuild::open.
[[nodiscard]] Result<ShardedBuild> open_shards(Prepared& prepared, const io::TiledParts& parts);

/// "3/64". Errors: a usage error.
[[nodiscard]] Result<Shard> parse_shard(const std::string& text);

}  // namespace vantage::building
