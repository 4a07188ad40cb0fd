// What a configuration says about a build.
#include <string>
#include <string_view>

#include "vantage/build/build.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {
namespace {

constexpr std::string_view kJob = "building region maps";

/// The ground filter; none for viewpoints along a trajectory, which [map] then has to name.
Result<PluginPtr<GroundFilter>> ground_for(const Config& config, const PluginLoader& loader) {
  if (config.viewpoints.value_or(ViewpointParams{}).source == ViewpointSource::ground) {
    VANTAGE_TRY(const auto ground, config.need(config.ground, "ground", kJob));
    return loader.load<GroundFilter>(ground.choice());
  }
  if (!config.map || config.map->trajectory) return PluginPtr<GroundFilter>();
  return fail(ErrorCode::invalid_config,
              "missing key 'trajectory' in [map], which viewpoints.source = \"trajectory\" needs",
              SourceLocation{config.file, 0, 0});
}

/// A square metre of level ground.
PointCloud made_ground() {
  constexpr int kPoints = 20;     // a side
  constexpr double kStep = 0.05;  // [m]
  PointCloud ground;
  for (int row = 0; row < kPoints; ++row) {
    for (int i = 0; i < kPoints; ++i) ground.emplace_back(kStep * i, kStep * row, 0.0);
  }
  return ground;
}

/// Refuses a matcher that does not offer what a build stores, before a map is read: it has to
/// prepare made ground. If it cannot, the build finds out.
Result<void> check_offer(const ScanMatcher& matcher, const PluginChoice& choice, bool selects) {
  const auto target = matcher.prepare(made_ground());
  if (!target) return {};
  const auto offered = selects ? (*target)->excerpt_of({}, {}) : (*target)->excerpt({});
  if (offered || offered.error().code != ErrorCode::unsupported) return {};
  const std::string named = "[matcher] plugin = \"" + choice.plugin + "\" ";
  return fail(ErrorCode::invalid_config,
              named + (selects ? "cannot store some of its elements, which [selector] asks for: "
                                 "leave [selector] out, or name a matcher that can, as ndt"
                               : "cannot store prepared maps, which [store] content asks for: set "
                                 "it to \"points\", or name a matcher that can, as ndt"),
              choice.where);
}

}  // namespace

BuildParams BuildParams::from(const Config& config) {
  BuildParams params;
  params.viewpoints = config.viewpoints.value_or(ViewpointParams{});
  if (config.ground) params.outliers = config.ground->outliers;
  if (config.visibility) {
    params.scope = config.visibility->scope;
    params.max_range = config.visibility->max_range.value_or(params.max_range);
    params.min_views = config.visibility->min_views;
  }
  params.thinning = config.thinning;
  if (config.store) {
    params.content = config.store->content.value_or(StoredContent::points);
    params.views = config.store->views;
  }
  if (const auto& s = config.selector) {
    params.selection = {.max_bytes = s->max_bytes,
                        .share = s->share,
                        .target_error = s->target_error,
                        .places = s->places,
                        .scans = {},
                        .lowest = s->lowest,
                        .highest = s->highest};
  }
  return params;
}

Result<BuildPlugins> load_build_plugins(const Config& config, const PluginLoader& loader) {
  VANTAGE_TRY(const auto partitioner, config.need(config.partitioner, "partitioner", kJob));
  VANTAGE_TRY(const auto visibility, config.need(config.visibility, "visibility", kJob));
  VANTAGE_TRY(const StoreConfig store, config.need(config.store, "store", kJob));
  BuildPlugins plugins;
  VANTAGE_TRY(plugins.partitioner, loader.load<Partitioner>(partitioner));
  VANTAGE_TRY(plugins.ground, ground_for(config, loader));
  VANTAGE_TRY(plugins.visibility, loader.load<VisibilityOperator>(visibility.choice()));
  VANTAGE_TRY(plugins.store, loader.load<MapStore>(store.choice()));
  const auto may = plugins.store->may_begin();
  if (!may && may.error().code == ErrorCode::unsupported) {
    return fail(ErrorCode::invalid_config,
                "[store] plugin = \"" + store.plugin +
                    "\" only reads bundles: name a store that a build can write, as pcd_tiles",
                store.where);
  }
  if (store.content.value_or(StoredContent::points) != StoredContent::points) {
    VANTAGE_TRY(const auto matcher,
                config.need(config.matcher, "matcher", "storing prepared region maps"));
    VANTAGE_TRY(plugins.matcher, loader.load<ScanMatcher>(matcher));
    VANTAGE_CHECK(check_offer(*plugins.matcher, matcher, config.selector.has_value()));
  }
  if (config.selector) {
    VANTAGE_TRY(plugins.selector, loader.load<Selector>(config.selector->choice()));
  }
  VANTAGE_TRY(plugins.relocalizer, loader.load<Relocalizer>(config.relocalizer_in_use()));
  return plugins;
}

}  // namespace vantage
