#include "vantage/engine/bundle.hpp"

#include <algorithm>
#include <charconv>
#include <mutex>
#include <utility>
#include <vector>

#include "bundle/built_as_asked.hpp"
#include "bundle/find_store.hpp"
#include "vantage/kit/file_system.hpp"

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

/// The configuration of a bundle. Its paths stay as they were written; they start at no folder.
std::optional<Config> config_of(const BundleSummary& bundle, const std::string& name) {
  auto config = parse_toml(bundle.config, "").and_then(parse_config);
  if (!config) return std::nullopt;
  config->file = name;
  return *std::move(config);
}

}  // namespace

struct Bundle::State {
  std::string name;
  std::optional<std::filesystem::path> place;
  PluginPtr<const MapReader> reader;
  std::shared_ptr<const RegionDirectory> directory;
  std::optional<Config> built_with;

  mutable std::mutex mutex = {};
  mutable std::shared_ptr<const MapIndex> index = {};  // once it was asked for
};

Bundle::Bundle(std::shared_ptr<const State> state) : state_(std::move(state)) {}

Result<Bundle> Bundle::from(OpenBundle&& opened, std::string name,
                            std::optional<std::filesystem::path> place) {
  if (opened.directory->summary().regions == 0) {
    return fail(ErrorCode::corrupt_data, "the bundle's index has no region", at(name));
  }
  auto config = config_of(opened.directory->summary(), name);
  auto state = std::make_shared<State>();
  state->name = std::move(name);
  state->place = std::move(place);
  state->reader = std::move(opened.reader);
  state->directory = std::move(opened.directory);
  state->built_with = std::move(config);
  return Bundle(std::move(state));
}

Result<Bundle> Bundle::of(PluginPtr<const MapReader> reader, std::string name,
                          std::optional<std::filesystem::path> place) {
  VANTAGE_TRY(OpenBundle opened, with_directory(std::move(reader)));
  return from(std::move(opened), std::move(name), std::move(place));
}

Result<Bundle> Bundle::open(const std::filesystem::path& place, const PluginLoader& plugins) {
  VANTAGE_TRY(OpenBundle opened, find_bundle(place, plugins));
  return from(std::move(opened), place.string(), place);
}

Result<Bundle> Bundle::open(const Config& config, const PluginLoader& plugins,
                            std::string_view job) {
  VANTAGE_TRY(const StoreConfig store, config.need(config.store, "store", job));
  VANTAGE_TRY(OpenBundle opened, plugins.load<MapStore>(store.choice()).and_then(open_in));
  VANTAGE_TRY(const auto docs, plugins.parameters(PluginKind::store, store.choice()));
  VANTAGE_TRY(Bundle bundle, from(std::move(opened), config.file, place_in(store.params, docs)));
  if (auto checked = check_built_as_asked(config, bundle.directory()->summary(), plugins);
      !checked) {
    return fail(std::move(checked).error().during(
        config.file.empty() ? "opening the bundle" : "opening the bundle of " + config.file));
  }
  return bundle;
}

const std::string& Bundle::name() const noexcept { return state_->name; }
const std::shared_ptr<const RegionDirectory>& Bundle::directory() const noexcept {
  return state_->directory;
}
std::uint64_t Bundle::bytes() const {
  return state_->place ? io::bytes_of(*state_->place) : directory()->summary().sum.bytes;
}
const MapReader& Bundle::reader() const noexcept { return *state_->reader; }
const std::optional<Config>& Bundle::built_with() const noexcept { return state_->built_with; }

Result<std::optional<std::vector<std::byte>>> Bundle::attachment(std::string_view name) const {
  auto kept = reader().attachment(name);
  if (kept || kept.error().code != ErrorCode::not_found) return kept;
  return std::optional<std::vector<std::byte>>();
}

Result<std::optional<PluginChoice>> Bundle::indexed_by() const {
  VANTAGE_TRY(const auto index, attachment(kPlaceIndex));
  if (!index) return std::optional<PluginChoice>();
  PluginChoice maker = built_with().value_or(Config{}).relocalizer_in_use();
  maker.library.reset();  // that of the machine that built
  return std::optional(std::move(maker));
}

Result<RegionMap> Bundle::get(RegionId region) const { return reader().get(region); }

Result<std::shared_ptr<const MapIndex>> Bundle::index() const {
  const std::scoped_lock lock(state_->mutex);
  if (!state_->index) {
    VANTAGE_TRY(MapIndex all, reader().index());
    state_->index = std::make_shared<const MapIndex>(std::move(all));
  }
  return state_->index;
}

Result<RegionId> Bundle::find_region(const std::string& id) const {
  const std::uint64_t count = directory()->summary().regions;
  VANTAGE_TRY(const auto labelled, directory()->find(id));
  if (labelled) return *labelled;
  if (const auto number = number_in(id); number && *number < count) return RegionId{*number};
  VANTAGE_TRY(const auto all, index());
  std::vector<std::string> labels;
  for (const Region& region : all->partition.regions()) labels.push_back(region.label);
  return fail(ErrorCode::not_found,
              "no region '" + id + "'" + did_you_mean(id, labels) + "; there are " +
                  std::to_string(count) + " regions, 0 ('" + labels.front() + "') to " +
                  std::to_string(count - 1) + " ('" + labels.back() + "')",
              at(name()));
}

Result<void> Bundle::for_each_region(
    const std::function<Result<void>(RegionId, const RegionMap&)>& take,
    const Progress& progress) const {
  const std::uint64_t count = directory()->summary().regions;
  for (std::uint32_t r = 0; r < count; ++r) {
    VANTAGE_TRY(const DirectoryEntry entry, directory()->entry(RegionId{r}));
    if (entry.summary.points > 0) {
      VANTAGE_TRY(const RegionMap map, get(RegionId{r}));
      VANTAGE_CHECK(take(RegionId{r}, map));
    }
    if (progress) progress(r + 1, count);
  }
  return {};
}

std::uint64_t Bundle::regions_without_points() const noexcept {
  return directory()->summary().without_points;
}

bool Bundle::has_views() const noexcept { return directory()->summary().sum.max_views > 0; }

bool Bundle::has_points() const noexcept { return directory()->summary().sum.points > 0; }

Result<void> Bundle::need_points(std::string_view purpose) const {
  if (has_points()) return {};
  const std::uint64_t elements = directory()->summary().sum.elements;
  if (elements == 0) {
    return fail(ErrorCode::unsupported, "the maps of all regions are empty", at(name()));
  }
  return fail(ErrorCode::unsupported,
              "the bundle holds prepared maps only (" + std::to_string(elements) +
                  " elements of a matcher for " + std::to_string(directory()->summary().regions) +
                  " regions) and no points to " + std::string(purpose) +
                  "; store.content = \"both\" keeps them",
              at(name()));
}

}  // namespace vantage
