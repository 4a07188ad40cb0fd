#include "ready_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <string_view>
#include <utility>

#include "support/plugins.hpp"
#include "support/process.hpp"

namespace vantage::benchmarks {
namespace {

std::string_view name_of(StoredContent content) {
  for (const auto& [name, value] : enum_names(content)) {
    if (value == content) return name;
  }
  return {};
}

}  // namespace

MatcherOption MatcherOption::from(const std::string& text) {
  const std::size_t colon = text.find(':');
  std::string params = colon == std::string::npos ? "" : text.substr(colon + 1);
  std::ranges::replace(params, ';', '\n');
  return {.name = text.substr(0, colon), .params = std::move(params)};
}

Result<PluginPtr<ScanMatcher>> MatcherOption::load() const {
  VANTAGE_TRY(const Table table, parse_toml(params, "--matcher"));
  return test::built_plugins().load<ScanMatcher>(
      PluginChoice{.plugin = name, .library = {}, .params = table, .where = {}});
}

ReadyMap ReadyMap::everywhere(PluginPtr<MatchTarget> target) {
  auto ready = std::make_shared<ReadyRegion>();
  ready->target = std::move(target);
  ReadyMap map;
  map.regions_.push_back(std::move(ready));
  return map;
}

Result<ReadyMap> ReadyMap::of_bundle(const PluginPtr<MapStore>& store,
                                     const PluginPtr<ScanMatcher>& matcher) {
  ReadyMap map;
  VANTAGE_TRY(map.index_, store->index());
  for (std::uint32_t r = 0; r < map.index_.partition.size(); ++r) {
    map.regions_.emplace_back();
    if (map.index_.regions[r].empty()) continue;
    auto ready = make_ready(store, matcher, RegionId{r});
    if (ready) {
      map.regions_.back() = *std::move(ready);
    } else if (ready.error().code != ErrorCode::too_few_matches) {
      return fail(std::move(ready).error());
    }
  }
  return map;
}

RegionId ReadyMap::region_at(const Point& place) const {
  if (const auto owner = index_.partition.locate(place)) return *owner;
  return index_.partition.nearest(place.head<2>()).value_or(RegionId{0});
}

Result<Alignment> ReadyMap::align(PointsView scan, const Pose& T_map_scan_guess) const {
  const auto& region = regions_[region_at(T_map_scan_guess.translation).value];
  if (!region) return fail(ErrorCode::too_few_matches, "the region's map is empty");
  return region->target->align(scan, T_map_scan_guess);
}

Result<void> check_content(const MapIndex& index, StoredContent content) {
  std::uint64_t points = 0, elements = 0;
  for (const RegionSummary& region : index.regions) {
    points += region.points;
    elements += region.elements;
  }
  const bool wants_points = content == StoredContent::points;
  if ((points > 0) == wants_points && (elements > 0) == !wants_points) return {};
  return fail(
      ErrorCode::invalid_input,
      fmt::format("the bundle keeps {} points and {} prepared elements; wanted is one built "
                  "with store.content = \"{}\"",
                  points, elements, name_of(content)));
}

Result<PluginPtr<MapStore>> open_bundle(const std::filesystem::path& config,
                                        const std::vector<std::string>& overrides,
                                        StoredContent content) {
  VANTAGE_TRY(const Config loaded, load_config(config, overrides));
  VANTAGE_TRY(const StoreConfig chosen, loaded.need(loaded.store, "store", "the benchmark"));
  VANTAGE_TRY(auto store, test::built_plugins().load<MapStore>(chosen.choice()));
  VANTAGE_TRY(const MapIndex index, store->index());
  if (auto checked = check_content(index, content); !checked) {
    return fail(std::move(checked).error().during("opening the bundle of " + config.string()));
  }
  return store;
}

Result<std::vector<std::string>> build_L20(const std::filesystem::path& map,
                                           const std::filesystem::path& bundle,
                                           StoredContent content, const MatcherOption& matcher) {
  std::string params = matcher.params;
  std::ranges::replace(params, '\n', ',');
  std::vector<std::string> overrides{fmt::format("map.files=[\"{}\"]", map.string()),
                                     fmt::format("store.params.root={}", bundle.string()),
                                     fmt::format("store.content={}", name_of(content)),
                                     "matcher.plugin=" + matcher.name,
                                     fmt::format("matcher.params={{{}}}", params)};
  std::vector<std::string> arguments{kL20, "--quiet"};
  for (const std::string& override : overrides) {
    arguments.insert(arguments.end(), {"--set", override});
  }
  std::cerr << fmt::format("building {} with store.content = \"{}\"\n", kL20, name_of(content));
  const test::Finished built = test::run("vantage-build", arguments);
  if (built.exit_code != 0) return fail(ErrorCode::internal, "vantage-build: " + built.err);
  return overrides;
}

}  // namespace vantage::benchmarks
