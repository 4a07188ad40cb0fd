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

/// A bundle that a store has opened.
struct OpenBundle {
  PluginPtr<const MapReader> reader;
  std::shared_ptr<const RegionDirectory> directory;
};

/// A bundle with the directory of its reader. Errors: those of MapReader::directory.
[[nodiscard]] Result<OpenBundle> with_directory(PluginPtr<const MapReader> reader);

/// Opens the bundle of a store. Where no bundle is, the error says how to make one.
[[nodiscard]] Result<OpenBundle> open_in(const PluginPtr<MapStore>& store);

/// The bundle at a path, opened by the store that made it; see Bundle::open.
[[nodiscard]] Result<OpenBundle> find_bundle(const std::filesystem::path& place,
                                             const PluginLoader& plugins);

/// Where a store keeps its bundle: the value of its only required parameter, if that is a path,
/// without a slash at its end. None for a store that needs more than a path.
[[nodiscard]] VANTAGE_API std::optional<std::filesystem::path> place_in(
    const Table& params, const std::vector<ParameterDoc>& docs);

}  // namespace vantage
