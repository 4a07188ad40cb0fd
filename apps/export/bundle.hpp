#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "vantage/engine/plugin_loader.hpp"
#include "vantage/map_store.hpp"

namespace vantage::exporting {

/// A bundle of region maps that is read.
struct Bundle {
  std::string name;
  PluginPtr<MapStore> store;
  MapIndex index;
};

/// @param what  a configuration, whose [store] is taken, or the folder of a bundle (pcd_tiles)
/// Errors: those of the configuration and the store; `unsupported` for a bundle without points
/// (only with what a matcher has made of them).
[[nodiscard]] Result<Bundle> open_bundle(const std::filesystem::path& what,
                                         const std::vector<std::string>& overrides,
                                         const PluginLoader& loader);

/// Called with the number of region maps read so far, and of all.
using Progress = std::function<void(std::size_t, std::size_t)>;

/// Calls `take` with every region and its map, in their order, and leaves out those without points.
/// Errors: those of the store and of `take`.
[[nodiscard]] Result<void> for_each_region(
    const Bundle& bundle, const Progress& progress,
    const std::function<Result<void>(RegionId, const RegionMap&)>& take);

[[nodiscard]] std::uint64_t regions_without_points(const MapIndex& index);

}  // namespace vantage::exporting
