#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/map_store.hpp"
#include "vantage/region_directory.hpp"
#include "vantage/result.hpp"

namespace vantage {

struct OpenBundle;

/// A bundle of region maps, open for reading: its regions, and the configuration that built it.
/// Copies share the reader. Thread safety: all methods may run on one object from many
/// threads at once.
class VANTAGE_API Bundle {
 public:
  /// Opens the bundle at a path with the store that made it. A folder names its store if it holds
  /// an `index.json` with the member `"format": "vantage <store>"`. Otherwise `open` tries all
  /// installed stores whose only required parameter is a path, in the order of their names.
  /// Errors: those of the store; `not_found` if no store finds a bundle; a store that is not
  /// installed; `unsupported` if the named store needs more than a path.
  [[nodiscard]] static Result<Bundle> open(const std::filesystem::path& place,
                                           const PluginLoader& plugins);
  /// Opens the bundle that [store] of a configuration names, and checks that it was built as the
  /// configuration says. The check skips what the configuration leaves out, all paths, the place of
  /// the bundle, [map], [localizer], [matcher] and [relocalizer]. A matcher itself checks a
  /// prepared map, and a relocalizer the index of places.
  /// @param job  what needs the bundle, for the error if there is no [store]: "exporting"
  /// Errors: a missing table or plugin, or a wrong parameter; those of the store; `invalid_config`
  /// for a bundle that was built differently, with the key and both values.
  [[nodiscard]] static Result<Bundle> open(const Config& config, const PluginLoader& plugins,
                                           std::string_view job);
  /// A bundle that was opened elsewhere.
  /// @param name   the bundle's name in errors
  /// @param place  the path at which its store keeps it, if there is one
  /// Errors: those of MapReader::directory.
  [[nodiscard]] static Result<Bundle> of(PluginPtr<const MapReader> reader, std::string name,
                                         std::optional<std::filesystem::path> place = {});

  /// The path or configuration file from which the bundle was opened, or the name given to `of`.
  [[nodiscard]] const std::string& name() const noexcept;
  /// The regions, each read when it is asked for.
  [[nodiscard]] const std::shared_ptr<const RegionDirectory>& directory() const noexcept;
  /// All regions at once, read when they are first asked for. Of a large bundle, that takes time
  /// and memory. Errors: those of MapReader::index.
  [[nodiscard]] Result<std::shared_ptr<const MapIndex>> index() const;
  /// Its size in storage: of all its files; of a store that has no path for them, of its regions.
  [[nodiscard]] std::uint64_t bytes() const;
  /// For as long as a copy of the bundle lives.
  [[nodiscard]] const MapReader& reader() const noexcept;
  /// The configuration that built the bundle, without the settings that may differ at run time.
  /// None if the bundle holds no configuration that this version can read.
  [[nodiscard]] const std::optional<Config>& built_with() const noexcept;

  /// What is kept beside the regions under a name; none if nothing is.
  /// Errors: those of MapReader::attachment, except `not_found`.
  [[nodiscard]] Result<std::optional<std::vector<std::byte>>> attachment(
      std::string_view name) const;
  /// The name of the index of places, in which a relocalizer searches, among the attachments.
  static constexpr const char* kPlaceIndex = "places";
  /// The relocalizer that made the index of places, with all its parameters; none if the bundle
  /// keeps no index. Errors: those of `attachment`.
  [[nodiscard]] Result<std::optional<PluginChoice>> indexed_by() const;

  /// The map of one region. Errors: those of MapReader::get.
  [[nodiscard]] Result<RegionMap> get(RegionId region) const;
  /// The region with this label; otherwise, if `id` is a number, the region with this id.
  /// Errors: `not_found`, with a suggestion.
  [[nodiscard]] Result<RegionId> find_region(const std::string& id) const;

  /// Called with the number of regions done so far, with or without points, and of all regions.
  using Progress = std::function<void(std::size_t, std::size_t)>;
  /// Calls `take(region, map)` for each region that holds points, in the order of the ids.
  /// Errors: those of the store and of `take`.
  [[nodiscard]] Result<void> for_each_region(
      const std::function<Result<void>(RegionId, const RegionMap&)>& take,
      const Progress& progress = {}) const;

  [[nodiscard]] std::uint64_t regions_without_points() const noexcept;
  /// Whether the bundle stores how many viewpoints see each point.
  [[nodiscard]] bool has_views() const noexcept;
  /// Whether any region holds points.
  [[nodiscard]] bool has_points() const noexcept;
  /// Errors: `unsupported` if no region holds points.
  /// @param purpose  completes "no points to ..." in the message: "export", "show"
  [[nodiscard]] Result<void> need_points(std::string_view purpose) const;

 private:
  struct State;
  explicit Bundle(std::shared_ptr<const State> state);
  [[nodiscard]] static Result<Bundle> from(OpenBundle&& opened, std::string name,
                                           std::optional<std::filesystem::path> place);
  std::shared_ptr<const State> state_;
};

}  // namespace vantage
