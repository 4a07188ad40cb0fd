#include "vantage/build/bundle_build.hpp"
#include "vantage/kit/map_parts.hpp"

#include <cmath>
#include <utility>

#include "bundle/content_config.hpp"
#include "bundle/find_store.hpp"

namespace vantage {

namespace {

/// The configuration with what its bundle stores. Prepared maps take a tenth of the bytes and need
/// no preparation on the robot. They are the default where the matcher makes them from a part of
/// the map at a time. Views and thinning concern points, a selector prepared maps: both are stored
/// where both are asked for.
Result<Config> with_content(Config config, const PluginLoader& plugins) {
  if (!config.store || config.store->content) return config;
  const bool needs_points = config.store->views || config.thinning;
  config.store->content = StoredContent::points;
  if (config.selector) {
    config.store->content = needs_points ? StoredContent::both : StoredContent::prepared;
    return config;
  }
  if (!config.matcher || needs_points) return config;
  VANTAGE_TRY(const auto matcher, plugins.load<ScanMatcher>(*config.matcher));
  if (std::isfinite(matcher->reach())) config.store->content = StoredContent::prepared;
  return config;
}

}  // namespace

Result<BundleBuild> BundleBuild::prepare(const Config& asked, const PluginLoader& plugins) {
  VANTAGE_TRY(const Config config, with_content(asked, plugins));
  VANTAGE_TRY(auto loaded, load_build_plugins(config, plugins));
  VANTAGE_CHECK(with_plugin_defaults(config, plugins));
  BuildParams params = BuildParams::from(config);
  VANTAGE_TRY(params.effective_config, effective_config(content_config(config), plugins));
  VANTAGE_TRY(const auto docs, plugins.parameters(PluginKind::store, config.store->choice()));
  return BundleBuild(std::move(loaded), std::move(params), place_in(config.store->params, docs));
}

Result<void> BundleBuild::may_begin() const { return plugins_.store->may_begin(); }

void BundleBuild::attach(std::string name, std::vector<std::byte> bytes) {
  params_.attachments.emplace_back(std::move(name), std::move(bytes));
}

Result<BuildReport> BundleBuild::run(PointsView map, PointsView trajectory,
                                     const std::function<void(const BuildProgress&)>& progress) {
  return build_region_maps(map, trajectory, plugins_, params_, progress);
}

Result<ShardedBuild> BundleBuild::sharded(const MapParts& map, PointsView trajectory,
                                          ShardedBuildOptions options) {
  return ShardedBuild::open(map, trajectory, plugins_, params_, std::move(options));
}

Result<Bundle> BundleBuild::bundle() const {
  VANTAGE_TRY(auto reader, plugins_.store->open());
  return Bundle::of(in_library_of(plugins_.store, std::move(reader)), "the bundle", place_);
}

}  // namespace vantage
