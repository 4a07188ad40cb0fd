#include "export/bundle.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "vantage/engine/config.hpp"

namespace vantage::exporting {
namespace {

namespace fs = std::filesystem;

Result<PluginChoice> store_of(const fs::path& what, const std::vector<std::string>& overrides) {
  std::error_code ignored;
  if (fs::is_directory(what, ignored)) {
    PluginChoice choice{.plugin = "pcd_tiles", .library = {}, .params = {}, .where = {}};
    choice.params.entries.push_back({"root", {what.string(), {}}, {}});
    return choice;
  }
  VANTAGE_TRY(const Config config, load_config(what, overrides));
  VANTAGE_TRY(const StoreConfig store, config.need(config.store, "store", "exporting"));
  return store.choice();
}

Result<void> check_points_are_there(const MapIndex& index, const std::string& name) {
  std::uint64_t elements = 0;
  for (const RegionSummary& region : index.regions) {
    if (region.points > 0) return {};
    elements += region.elements;
  }
  const SourceLocation where{name, 0, 0};
  if (elements == 0) {
    return fail(ErrorCode::unsupported, "the maps of all regions are empty", where);
  }
  return fail(ErrorCode::unsupported,
              fmt::format("the bundle holds prepared maps only ({} elements of a matcher for {} "
                          "regions) and no points to export; store.content = \"both\" keeps them",
                          elements, index.regions.size()),
              where);
}

}  // namespace

Result<Bundle> open_bundle(const fs::path& what, const std::vector<std::string>& overrides,
                           const PluginLoader& loader) {
  Bundle bundle;
  bundle.name = what.string();
  VANTAGE_TRY(const PluginChoice choice, store_of(what, overrides));
  VANTAGE_TRY(bundle.store, loader.load<MapStore>(choice));
  auto index = bundle.store->index();
  if (!index) {
    Error error = std::move(index).error();
    if (error.code == ErrorCode::not_found) error.message += "; `vantage build` makes it";
    return fail(std::move(error));
  }
  bundle.index = *std::move(index);
  VANTAGE_CHECK(check_points_are_there(bundle.index, bundle.name));
  return bundle;
}

Result<void> for_each_region(const Bundle& bundle, const Progress& progress,
                             const std::function<Result<void>(RegionId, const RegionMap&)>& take) {
  const std::size_t count = bundle.index.regions.size();
  for (std::uint32_t r = 0; r < count; ++r) {
    if (bundle.index.regions[r].points > 0) {
      VANTAGE_TRY(const RegionMap map, bundle.store->get(RegionId{r}));
      VANTAGE_CHECK(take(RegionId{r}, map));
    }
    if (progress) progress(r + 1, count);
  }
  return {};
}

std::uint64_t regions_without_points(const MapIndex& index) {
  return static_cast<std::uint64_t>(
      std::count_if(index.regions.begin(), index.regions.end(),
                    [](const RegionSummary& region) { return region.points == 0; }));
}

}  // namespace vantage::exporting
