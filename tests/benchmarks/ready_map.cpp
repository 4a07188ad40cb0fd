#include "ready_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "support/plugins.hpp"
#include "vantage/build/bundle_build.hpp"
#include "vantage/kit/regions.hpp"

namespace vantage::benchmarks {

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

std::vector<std::string> MatcherOption::overrides() const {
  std::string inline_table = params;
  std::ranges::replace(inline_table, '\n', ',');
  return {"matcher.plugin=" + name, fmt::format("matcher.params={{{}}}", inline_table)};
}

ReadyMap ReadyMap::everywhere(PluginPtr<MatchTarget> target) {
  auto ready = std::make_shared<ReadyRegion>();
  ready->target = std::move(target);
  ReadyMap map;
  map.regions_.push_back(std::move(ready));
  return map;
}

Result<ReadyMap> ReadyMap::of_bundle(const MapReader& bundle,
                                     const PluginPtr<ScanMatcher>& matcher) {
  ReadyMap map;
  VANTAGE_TRY(map.index_, bundle.index());
  for (std::uint32_t r = 0; r < map.index_.partition.size(); ++r) {
    map.regions_.emplace_back();
    if (map.index_.regions[r].empty()) continue;
    auto ready = make_ready(bundle, matcher, RegionId{r});
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
  return nearest_region(index_.partition, place.head<2>()).value_or(RegionId{0});
}

Result<Alignment> ReadyMap::align(PointsView scan, const Pose& T_map_scan_guess) const {
  const auto& region = regions_[region_at(T_map_scan_guess.translation).value];
  if (!region) return fail(ErrorCode::too_few_matches, "the region's map is empty");
  return region->target->align(scan, T_map_scan_guess);
}

Result<BuildReport> build_bundle(const Config& config, PointsView map) {
  VANTAGE_TRY(BundleBuild build, BundleBuild::prepare(config, test::built_plugins()));
  return build.run(map, {});
}

}  // namespace vantage::benchmarks
