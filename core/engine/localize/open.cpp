// The ways to open a localizer.
#include <string_view>
#include <utility>

#include "localize/place_index.hpp"
#include "localize/share_model.hpp"
#include "vantage/engine/localizer.hpp"

namespace vantage {
namespace {

constexpr std::string_view kLocalization = "localization";  // what a missing table would be for

}  // namespace

Result<Localizer> Localizer::open(Bundle bundle, PluginPtr<ScanMatcher> matcher,
                                  PluginPtr<Relocalizer> relocalizer,
                                  const LocalizerParams& params) {
  return open(std::move(bundle), std::move(matcher),
              BundleRelocalizer{.plugin = std::move(relocalizer)}, params, ShareModel{});
}

Result<Localizer> Localizer::open(Bundle bundle, const Config& config,
                                  const PluginLoader& plugins) {
  VANTAGE_TRY(const PluginChoice choice, config.need(config.matcher, "matcher", kLocalization));
  VANTAGE_TRY(auto matcher, plugins.load<ScanMatcher>(choice));
  VANTAGE_TRY(BundleRelocalizer relocalizer, relocalizer_for(bundle, config, plugins));
  VANTAGE_TRY(const ShareModel model, share_model_of(bundle, choice, plugins));
  return open(std::move(bundle), std::move(matcher), std::move(relocalizer),
              config.localizer.value_or(LocalizerParams{}), model);
}

Result<Localizer> Localizer::open(const Config& config, const PluginLoader& plugins) {
  VANTAGE_TRY(Bundle bundle, Bundle::open(config, plugins, kLocalization));
  return open(std::move(bundle), config, plugins);
}

}  // namespace vantage
