#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "vantage/api.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/map_store.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// A bundle of region maps, open for reading: its store, its index and the configuration that it
/// was built with. Copies share the store.
/// Thread safety: all methods may run on one object from many threads at once.
class VANTAGE_API Bundle {
 public:
  /// Opens what lies at a path with the store that made it. A folder names its store if it holds an
  /// `index.json` with the member `"format": "vantage <store>"`. Otherwise every installed store
  /// whose only required parameter is a path is asked, in the order of their names.
  /// Errors: those of the store, `not_found` among them where no store finds its bundle; a store
  /// that is not installed.
  [[nodiscard]] static Result<Bundle> open(const std::filesystem::path& place,
                                           const PluginLoader& plugins);
  /// Opens the bundle that [store] of a configuration names.
  /// @param job  what needs it, for the error if there is no [store]: "exporting"
  /// Errors: a missing table or plugin, a wrong parameter; those of the store.
  [[nodiscard]] static Result<Bundle> open(const Config& config, const PluginLoader& plugins,
                                           std::string_view job);
  /// Takes a store that was opened elsewhere.
  /// @param name  what errors call the bundle
  /// Errors: those of MapStore::index; `corrupt_data` for an index that contradicts itself.
  [[nodiscard]] static Result<Bundle> of(PluginPtr<MapStore> store, std::string name);

  /// The path or the configuration file by which it was opened.
  [[nodiscard]] const std::string& name() const noexcept;
  [[nodiscard]] const MapIndex& index() const noexcept;
  [[nodiscard]] const PluginPtr<MapStore>& store() const noexcept;
  /// What it was built with, without what may differ at run time; none if the bundle keeps no
  /// configuration that this version reads.
  [[nodiscard]] const std::optional<Config>& built_with() const noexcept;

  /// The map of one region. Errors: those of MapStore::get.
  [[nodiscard]] Result<RegionMap> get(RegionId region) const;
  /// The region with a label; else, if `id` is a number, the region with that id.
  /// Errors: `not_found` with what was probably meant.
  [[nodiscard]] Result<RegionId> find_region(const std::string& id) const;

  /// Called with the number of region maps read so far, and of all.
  using Progress = std::function<void(std::size_t, std::size_t)>;
  /// Calls `take` with every region and its map in the order of the ids, without the regions that
  /// hold no points. Errors: those of the store and of `take`.
  [[nodiscard]] Result<void> for_each_region(
      const std::function<Result<void>(RegionId, const RegionMap&)>& take,
      const Progress& progress = {}) const;

  [[nodiscard]] std::uint64_t regions_without_points() const noexcept;
  /// Whether it says how many viewpoints see a point.
  [[nodiscard]] bool has_views() const noexcept;
  /// Whether any region holds points.
  [[nodiscard]] bool has_points() const noexcept;
  /// Error: `unsupported` where no region holds points.
  /// @param purpose  what they are for: "export", "show"
  [[nodiscard]] Result<void> need_points(std::string_view purpose) const;

 private:
  struct State;
  explicit Bundle(std::shared_ptr<const State> state);
  [[nodiscard]] static Result<Bundle> from(PluginPtr<MapStore> store, MapIndex index,
                                           std::string name);
  std::shared_ptr<const State> state_;
};

}  // namespace vantage
