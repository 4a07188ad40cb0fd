#include "localize/place_index.hpp"

#include <cstddef>
#include <span>
#include <string>
#include <utility>

#include "vantage/engine/toml.hpp"
#include "vantage/kit/map_in_memory.hpp"

namespace vantage {
namespace {

Result<PointCloud> points_of(const Bundle& bundle) {
  PointCloud points;
  VANTAGE_CHECK(bundle.for_each_region([&](RegionId, const RegionMap& map) -> Result<void> {
    points.insert(points.end(), map.points.begin(), map.points.end());
    return {};
  }));
  return points;
}

/// Errors: those of Relocalizer::open; `internal` for a relocalizer that breaks its contract.
Result<PluginPtr<RelocalizerIndex>> opened_by(const PluginPtr<Relocalizer>& relocalizer,
                                              std::span<const std::byte> bytes) {
  VANTAGE_TRY(auto index, relocalizer->open(bytes));
  if (index != nullptr) return in_library_of(relocalizer, std::move(index));
  return fail(ErrorCode::internal,
              "the relocalizer plugin broke its contract: open gave nothing and no error");
}

}  // namespace

Result<BundleRelocalizer> relocalizer_for(const Bundle& bundle, const Config& config,
                                          const PluginLoader& plugins) {
  VANTAGE_TRY(const auto made_by, bundle.indexed_by());
  const PluginChoice choice =
      !config.relocalizer && made_by ? *made_by : config.relocalizer_in_use();
  BundleRelocalizer relocalizer;
  VANTAGE_TRY(relocalizer.plugin, plugins.load<Relocalizer>(choice));
  if (!made_by) return relocalizer;
  VANTAGE_TRY(const Table params, plugins.effective_params(PluginKind::relocalizer, choice));
  const bool is_maker = made_by->plugin == choice.plugin;
  if (is_maker && to_toml(made_by->params) == to_toml(params)) return relocalizer;
  std::string reason;
  if (is_maker) {
    VANTAGE_TRY(const auto bytes, bundle.reader().attachment(Bundle::kPlaceIndex));
    const auto index = opened_by(relocalizer.plugin, bytes);
    if (index) return relocalizer;
    if (index.error().code != ErrorCode::invalid_input) return fail(index.error());
    reason = ": " + index.error().message;
  }
  relocalizer.reads_index = false;
  if (bundle.has_points()) return relocalizer;
  return fail(ErrorCode::invalid_config,
              "[relocalizer] plugin = \"" + choice.plugin +
                  "\" cannot read the bundle's index of places, which '" + made_by->plugin +
                  "' made" + reason +
                  "; there are no points to make another one from: name that plugin with its "
                  "parameters, or build the bundle again",
              choice.where.file.empty() ? SourceLocation{bundle.name(), 0, 0} : choice.where);
}

Result<PluginPtr<RelocalizerIndex>> open_index(const Bundle& bundle,
                                               const BundleRelocalizer& relocalizer) {
  if (!relocalizer.plugin) return PluginPtr<RelocalizerIndex>();
  if (relocalizer.reads_index) {
    VANTAGE_TRY(const auto kept, bundle.attachment(Bundle::kPlaceIndex));
    if (kept) return opened_by(relocalizer.plugin, *kept);
  }
  VANTAGE_TRY(const PointCloud points, points_of(bundle));
  if (points.empty()) return PluginPtr<RelocalizerIndex>();
  const auto made = relocalizer.plugin->index(MapInMemory(points));
  if (made) return opened_by(relocalizer.plugin, *made);
  if (made.error().code == ErrorCode::unsupported) return PluginPtr<RelocalizerIndex>();
  return fail(made.error());
}

}  // namespace vantage
