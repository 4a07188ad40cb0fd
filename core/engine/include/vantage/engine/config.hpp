#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/engine/build_params.hpp"
#include "vantage/engine/localizer_params.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/engine/toml.hpp"
#include "vantage/params.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// [map]: the wide-area map P.
struct MapSource {
  std::vector<std::filesystem::path> files;
  std::optional<std::filesystem::path> trajectory;

  static constexpr auto schema() {
    return std::tuple{
        required("files", &MapSource::files, "",
                 "point clouds that together are the map: files, folders, patterns",
                 Source{"Eq. 1"}),
        optional("trajectory", &MapSource::trajectory, "",
                 "TUM file: path of the sensor during mapping, for viewpoints along it and for "
                 "partitioners that use it; if left out, partitioners get no trajectory"),
    };
  }
  [[nodiscard]] VANTAGE_API Result<void> validate() const;
};

/// [ground]: the ground filter, and which points it gets.
struct GroundConfig {
  std::string plugin;
  std::optional<std::filesystem::path> library;
  std::optional<OutlierParams> outliers;
  Table params;
  SourceLocation where;

  static constexpr auto schema() {
    return std::tuple{
        required("plugin", &GroundConfig::plugin, "", "name of the ground filter"),
        optional("library", &GroundConfig::library, "", "plugin file, instead of searching"),
        optional("outliers", &GroundConfig::outliers, "",
                 "statistical outliers, which the filter does not get; they stay in the map. The "
                 "filter gets all points if left out"),
        optional("params", &GroundConfig::params, "", "parameters of the plugin"),
    };
  }
  [[nodiscard]] PluginChoice choice() const { return {plugin, library, params, where}; }
};

/// The points among which a viewpoint's visibility is decided.
enum class VisibilityScope : std::uint8_t {
  map,     ///< all of P, as the text of Sec. 2.3 says
  region,  ///< P_ij only, as Eq. 9 is printed
};
constexpr auto enum_names(VisibilityScope) {
  return std::array{std::pair{std::string_view("map"), VisibilityScope::map},
                    std::pair{std::string_view("region"), VisibilityScope::region}};
}

/// [visibility]: the operator, and how the build uses it.
struct VisibilityConfig {
  std::string plugin;
  std::optional<std::filesystem::path> library;
  VisibilityScope scope = VisibilityScope::map;
  std::optional<double> max_range;
  std::uint32_t min_views = 1;
  Table params;
  SourceLocation where;

  static constexpr auto schema() {
    return std::tuple{
        required("plugin", &VisibilityConfig::plugin, "", "name of the visibility operator"),
        optional("library", &VisibilityConfig::library, "", "plugin file, instead of searching"),
        optional("scope", &VisibilityConfig::scope, "",
                 "decide visibility among all points of the map, or those of the region",
                 Source{"Eq. 9", "Yagi et al. 2026, Sec. 2.3"}),
        optional("max_range", &VisibilityConfig::max_range, "m",
                 "reach of the sensor; unlimited if left out", positive),
        optional("min_views", &VisibilityConfig::min_views, "",
                 "a point is kept if at least this many viewpoints of its region see it, or all of "
                 "them if the region has fewer",
                 at_least(1)),
        optional("params", &VisibilityConfig::params, "", "parameters of the plugin"),
    };
  }
  [[nodiscard]] PluginChoice choice() const { return {plugin, library, params, where}; }
};

/// What a bundle stores for each region.
enum class StoredContent : std::uint8_t {
  points,    ///< V_ij
  prepared,  ///< what the matcher makes of the whole map, around V_ij
  both,
};
constexpr auto enum_names(StoredContent) {
  return std::array{std::pair{std::string_view("points"), StoredContent::points},
                    std::pair{std::string_view("prepared"), StoredContent::prepared},
                    std::pair{std::string_view("both"), StoredContent::both}};
}

/// [store]: where bundles are stored, and what they contain.
struct StoreConfig {
  std::string plugin;
  std::optional<std::filesystem::path> library;
  std::optional<StoredContent> content;
  bool views = false;
  Table params;
  SourceLocation where;

  static constexpr auto schema() {
    return std::tuple{
        required("plugin", &StoreConfig::plugin, "", "name of the map store"),
        optional("library", &StoreConfig::library, "", "plugin file, instead of searching"),
        optional("content", &StoreConfig::content, "",
                 "what a build stores for each region: its points, the map that the [matcher] "
                 "prepares from the whole map around them, or both; if left out, prepared maps if "
                 "the [matcher] makes them from a part of the map at a time (ndt), and points if "
                 "not, or with views or [thinning]"),
        optional("views", &StoreConfig::views, "",
                 "each point is stored with the number of viewpoints of its region that see it"),
        optional("params", &StoreConfig::params, "", "parameters of the plugin"),
    };
  }
  [[nodiscard]] VANTAGE_API Result<void> validate() const;
  [[nodiscard]] PluginChoice choice() const { return {plugin, library, params, where}; }
};

/// [selector]: which elements of prepared maps are kept, and how many.
struct SelectorConfig {
  std::string plugin;
  std::optional<std::filesystem::path> library;
  std::optional<std::uint32_t> max_bytes;
  std::optional<double> share;
  std::optional<double> target_error;
  std::uint32_t places = 16;
  std::optional<std::filesystem::path> scans, poses;
  double lowest = -23.0, highest = 15.0;
  Table params;
  SourceLocation where;

  static constexpr auto schema() {
    return std::tuple{
        required("plugin", &SelectorConfig::plugin, "", "name of the selector"),
        optional("library", &SelectorConfig::library, "", "plugin file, instead of searching"),
        optional("max_bytes", &SelectorConfig::max_bytes, "bytes",
                 "the most that the prepared map of a region may take; one element is always kept",
                 at_least(1)),
        optional("share", &SelectorConfig::share, "",
                 "instead of max_bytes: the share of a region's elements that is kept",
                 Range{.min = 0.0, .max = 1.0, .min_open = true}),
        optional("target_error", &SelectorConfig::target_error, "m",
                 "no more elements are kept than it takes for this error of the position, as the "
                 "build predicts it, at 95 % of the places of its scans",
                 positive),
        optional("places", &SelectorConfig::places, "",
                 "scans in and around a region that the choice is made with", at_least(1)),
        optional("scans", &SelectorConfig::scans, "",
                 "the recording that the map was made of; without it, scans are virtual"),
        optional("poses", &SelectorConfig::poses, "",
                 "of the sensor during `scans`, TUM, map frame; without it, the [map]'s "
                 "trajectory"),
        optional("lowest", &SelectorConfig::lowest, "deg",
                 "elevation of the sensor's lowest ray: what it cannot see does not count",
                 between(-90, 90)),
        optional("highest", &SelectorConfig::highest, "deg",
                 "elevation of the sensor's highest ray", between(-90, 90)),
        optional("params", &SelectorConfig::params, "", "parameters of the plugin"),
    };
  }
  [[nodiscard]] VANTAGE_API Result<void> validate() const;
  [[nodiscard]] PluginChoice choice() const { return {plugin, library, params, where}; }
};

/// A whole configuration file. A program asks for the tables that it needs with `need`.
struct Config {
  std::int64_t schema_version = 1;
  std::optional<MapSource> map;
  std::optional<PluginChoice> partitioner;
  std::optional<GroundConfig> ground;
  std::optional<ViewpointParams> viewpoints;
  std::optional<VisibilityConfig> visibility;
  std::optional<ThinningParams> thinning;
  std::optional<StoreConfig> store;
  std::optional<SelectorConfig> selector;
  std::optional<PluginChoice> matcher, relocalizer;
  std::optional<LocalizerParams> localizer;
  std::optional<AtlasParams> atlas;
  std::optional<Table> live;  ///< what a live localizer is connected to; core does not read it
  std::string file;           ///< path from which it was read
  Table written;  ///< the text, including `--set`; empty if a program made the configuration

  static constexpr auto schema() {
    return std::tuple{
        required("schema", &Config::schema_version, "", "version of this file's format, 1",
                 between(1, 1)),
        optional("map", &Config::map, "", "the wide-area map P", Source{"Eq. 1"}),
        optional("partitioner", &Config::partitioner, "", "how the map is cut into regions",
                 Source{"Eqs. 2-3", "Yagi et al. 2026, Sec. 2.1"}),
        optional("ground", &Config::ground, "", "how the ground is found",
                 Source{{}, "Yagi et al. 2026, Sec. 2.2"}),
        optional("viewpoints", &Config::viewpoints, "", "where virtual viewpoints stand",
                 Source{"Eqs. 4-5", "Yagi et al. 2026, Sec. 2.2"}),
        optional("visibility", &Config::visibility, "", "what is seen from a viewpoint",
                 Source{"Eqs. 6-10", "Yagi et al. 2026, Sec. 2.3"}),
        optional("thinning", &Config::thinning, "",
                 "how region maps are thinned after that; no thinning if left out"),
        optional("store", &Config::store, "", "where the bundle of region maps is kept",
                 Source{{}, "Yagi et al. 2026, Sec. 2.3"}),
        optional("selector", &Config::selector, "",
                 "which elements of prepared maps are kept; all if left out"),
        optional("matcher", &Config::matcher, "", "how scans are matched",
                 Source{{}, "Yagi et al. 2026, Sec. 3.3"}),
        optional(
            "relocalizer", &Config::relocalizer, "",
            "how a lost sensor is searched for; if left out, a build takes voxel_search, and a "
            "run what made the bundle's index"),
        optional("localizer", &Config::localizer, "", "how scans are prepared and maps switched",
                 Source{"Eq. 11", "Yagi et al. 2026, Sec. 2.4"}),
        optional("atlas", &Config::atlas, "",
                 "where vantage assess measures how well a sensor can be localized"),
        optional("live", &Config::live, "",
                 "what `vantage live` is connected to; other programs do not read it"),
    };
  }

  [[nodiscard]] VANTAGE_API Result<void> validate() const;

  /// The [relocalizer] of a build; without that table, `voxel_search`.
  [[nodiscard]] VANTAGE_API PluginChoice relocalizer_in_use() const;

  /// Returns a table that `job` needs. Error: `invalid_config` if it is missing; the message names
  /// the table and the job.
  template <class T>
  [[nodiscard]] Result<T> need(const std::optional<T>& section, std::string_view name,
                               std::string_view job) const {
    if (section) return *section;
    return fail(ErrorCode::invalid_config,
                "missing table [" + std::string(name) + "], which " + std::string(job) + " needs",
                SourceLocation{file, 0, 0});
  }
};

/// Errors: those of `load_toml`; `invalid_config` for anything that the schema does not allow.
[[nodiscard]] VANTAGE_API Result<Config> load_config(
    const std::filesystem::path& file, const std::vector<std::string>& overrides = {});
[[nodiscard]] VANTAGE_API Result<Config> parse_config(const Table& table);

/// The configuration with the defaults of its plugins.
/// Errors: a plugin that cannot be loaded or that refuses its params.
[[nodiscard]] VANTAGE_API Result<Config> with_plugin_defaults(const Config& config,
                                                              const PluginLoader& plugins);

/// The configuration as TOML with all defaults filled in, including those of the plugins.
/// Errors: those of with_plugin_defaults; `invalid_config` for a path that is not UTF-8, which TOML
/// cannot hold.
[[nodiscard]] VANTAGE_API Result<std::string> effective_config(const Config& config,
                                                               const PluginLoader& plugins);

}  // namespace vantage
