#pragma once

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "vantage/engine/plugin_loader.hpp"
#include "vantage/map_store.hpp"

/// Bundles of stores, as tests write and read them. What fails ends the test with an exception.
namespace vantage::test {

inline void done(const Result<void>& result) {
  if (!result) throw std::runtime_error(to_string(result.error()));
}

[[nodiscard]] inline PluginPtr<MapWriter> begun(const PluginPtr<MapStore>& store,
                                                const MapIndex& index) {
  auto writer = store->begin(index);
  if (!writer) throw std::runtime_error(to_string(writer.error()));
  return in_library_of(store, *std::move(writer));
}

inline void commit(PluginPtr<MapWriter> writer) { done(std::move(*writer).commit()); }

/// Puts the maps of all regions, and commits.
inline void finish(PluginPtr<MapWriter> writer, const std::vector<RegionMap>& maps) {
  for (std::uint32_t r = 0; r < maps.size(); ++r) done(writer->put(RegionId{r}, maps[r]));
  commit(std::move(writer));
}

inline void write_bundle(const PluginPtr<MapStore>& store, const MapIndex& index,
                         const std::vector<RegionMap>& maps) {
  finish(begun(store, index), maps);
}

[[nodiscard]] inline Result<PluginPtr<const MapReader>> open(const PluginPtr<MapStore>& store) {
  VANTAGE_TRY(auto reader, store->open());
  return in_library_of(store, std::move(reader));
}

[[nodiscard]] inline PluginPtr<const MapReader> opened(const PluginPtr<MapStore>& store) {
  auto reader = open(store);
  if (!reader) throw std::runtime_error(to_string(reader.error()));
  return *std::move(reader);
}

/// The index of the bundle that is there now.
[[nodiscard]] inline Result<MapIndex> index_in(const PluginPtr<MapStore>& store) {
  VANTAGE_TRY(const auto reader, store->open());
  return reader->index();
}

/// A region of the bundle that is there now.
[[nodiscard]] inline Result<RegionMap> map_in(const PluginPtr<MapStore>& store,
                                              std::uint32_t region) {
  VANTAGE_TRY(const auto reader, store->open());
  return reader->get(RegionId{region});
}

}  // namespace vantage::test
