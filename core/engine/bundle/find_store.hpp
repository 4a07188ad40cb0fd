#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/map_store.hpp"
#include "vantage/region_directory.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// A store with a bundle in it.
struct FoundStore {
  PluginPtr<MapStore> store;
  std::shared_ptr<const RegionDirectory> directory;
};

/// The store's directory, or one of its whole index. The error says what to do if there is no
/// bundle.
[[nodiscard]] Result<std::shared_ptr<const RegionDirectory>> directory_in(
    const PluginPtr<MapStore>& store);

/// The store that made the bundle at a path; see Bundle::open.
[[nodiscard]] Result<FoundStore> find_store(const std::filesystem::path& place,
                                            const PluginLoader& plugins);

/// Where a store keeps its bundle: the value of its only required parameter, if that is a path,
/// without a slash at its end. None for a store that needs more than a path.
[[nodiscard]] VANTAGE_API std::optional<std::filesystem::path> place_in(
    const Table& params, const std::vector<ParameterDoc>& docs);

}  // namespace vantage
