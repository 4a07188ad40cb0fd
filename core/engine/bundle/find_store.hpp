#pragma once

#include <filesystem>

#include "vantage/engine/plugin_loader.hpp"
#include "vantage/map_store.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// A store with a bundle in it.
struct FoundStore {
  PluginPtr<MapStore> store;
  MapIndex index;
};

/// What MapStore::index returns; its error says what to do if there is no bundle.
[[nodiscard]] Result<MapIndex> index_of(const MapStore& store);

/// The store that made the bundle at a path; see Bundle::open.
[[nodiscard]] Result<FoundStore> find_store(const std::filesystem::path& place,
                                            const PluginLoader& plugins);

}  // namespace vantage
