#include "vantage/engine/bundle.hpp"

#include <algorithm>
#include <charconv>
#include <utility>
#include <vector>

#include "bundle/built_as_asked.hpp"
#include "bundle/find_store.hpp"

namespace vantage {
namespace {

SourceLocation at(const std::string& name) { return {name, 0, 0}; }

std::optional<std::uint32_t> number_in(const std::string& text) {
  std::uint32_t number = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc{} || stop != end) return std::nullopt;
  return number;
}

/// The configuration in an index. Its paths stay as they were written; they start at no folder.
std::optional<Config> config_of(const MapIndex& index, const std::string& name) {
  auto config = parse_toml(index.config, "").and_then(parse_config);
  if (!config) return std::nullopt;
  config->file = name;
  return *std::move(config);
}

}  // namespace

struct Bundle::State {
  std::string name;
  PluginPtr<MapStore> store;
  MapIndex index;
  std::optional<Config> built_with;
};

Bundle::Bundle(std::shared_ptr<const State> state) : state_(std::move(state)) {}

Result<Bundle> Bundle::from(PluginPtr<MapStore> store, MapIndex index, std::string name) {
  if (index.partition.size() == 0) {
    return fail(ErrorCode::corrupt_data, "the bundle's index has no region", at(name));
  }
  if (index.regions.size() != index.partition.size()) {
    return fail(ErrorCode::corrupt_data,
                "the bundle's index has " + std::to_string(index.regions.size()) +
                    " summaries for " + std::to_string(index.partition.size()) + " regions");
  }
  auto config = config_of(index, name);
  return Bundle(std::make_shared<const State>(
      State{std::move(name), std::move(store), std::move(index), std::move(config)}));
}

Result<Bundle> Bundle::of(PluginPtr<MapStore> store, std::string name) {
  VANTAGE_TRY(MapIndex index, index_of(*store));
  return from(std::move(store), std::move(index), std::move(name));
}

Result<Bundle> Bundle::open(const std::filesystem::path& place, const PluginLoader& plugins) {
  VANTAGE_TRY(FoundStore found, find_store(place, plugins));
  return from(std::move(found.store), std::move(found.index), place.string());
}

Result<Bundle> Bundle::open(const Config& config, const PluginLoader& plugins,
                            std::string_view job) {
  VANTAGE_TRY(const StoreConfig store, config.need(config.store, "store", job));
  VANTAGE_TRY(auto opened, plugins.load<MapStore>(store.choice()));
  VANTAGE_TRY(Bundle bundle, of(std::move(opened), config.file));
  if (auto checked = check_built_as_asked(config, bundle.index(), plugins); !checked) {
    return fail(std::move(checked).error().during(
        config.file.empty() ? "opening the bundle" : "opening the bundle of " + config.file));
  }
  return bundle;
}

const std::string& Bundle::name() const noexcept { return state_->name; }
const MapIndex& Bundle::index() const noexcept { return state_->index; }
const PluginPtr<MapStore>& Bundle::store() const noexcept { return state_->store; }
const std::optional<Config>& Bundle::built_with() const noexcept { return state_->built_with; }

Result<RegionMap> Bundle::get(RegionId region) const { return state_->store->get(region); }

Result<RegionId> Bundle::find_region(const std::string& id) const {
  const auto& regions = index().partition.regions();
  std::vector<std::string> labels;
  for (std::uint32_t r = 0; r < regions.size(); ++r) {
    if (regions[r].label == id) return RegionId{r};
    labels.push_back(regions[r].label);
  }
  if (const auto number = number_in(id); number && *number < regions.size()) {
    return RegionId{*number};
  }
  return fail(ErrorCode::not_found,
              "no region '" + id + "'" + did_you_mean(id, labels) + "; there are " +
                  std::to_string(regions.size()) + " regions, 0 ('" + labels.front() + "') to " +
                  std::to_string(regions.size() - 1) + " ('" + labels.back() + "')",
              at(name()));
}

Result<void> Bundle::for_each_region(
    const std::function<Result<void>(RegionId, const RegionMap&)>& take,
    const Progress& progress) const {
  const auto& regions = index().regions;
  for (std::uint32_t r = 0; r < regions.size(); ++r) {
    if (regions[r].points > 0) {
      VANTAGE_TRY(const RegionMap map, get(RegionId{r}));
      VANTAGE_CHECK(take(RegionId{r}, map));
    }
    if (progress) progress(r + 1, regions.size());
  }
  return {};
}

std::uint64_t Bundle::regions_without_points() const noexcept {
  const auto& regions = index().regions;
  return static_cast<std::uint64_t>(
      std::count_if(regions.begin(), regions.end(),
                    [](const RegionSummary& region) { return region.points == 0; }));
}

bool Bundle::has_views() const noexcept {
  const auto& regions = index().regions;
  return std::any_of(regions.begin(), regions.end(),
                     [](const RegionSummary& region) { return region.max_views > 0; });
}

bool Bundle::has_points() const noexcept {
  return regions_without_points() < index().regions.size();
}

Result<void> Bundle::need_points(std::string_view purpose) const {
  if (has_points()) return {};
  std::uint64_t elements = 0;
  for (const RegionSummary& region : index().regions) elements += region.elements;
  if (elements == 0) {
    return fail(ErrorCode::unsupported, "the maps of all regions are empty", at(name()));
  }
  return fail(ErrorCode::unsupported,
              "the bundle holds prepared maps only (" + std::to_string(elements) +
                  " elements of a matcher for " + std::to_string(index().regions.size()) +
                  " regions) and no points to " + std::string(purpose) +
                  "; store.content = \"both\" keeps them",
              at(name()));
}

}  // namespace vantage
