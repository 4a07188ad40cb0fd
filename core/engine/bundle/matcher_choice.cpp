#include "vantage/engine/matcher_choice.hpp"

#include "vantage/engine/toml.hpp"

namespace vantage {

Result<MatcherChoice> MatcherChoice::of(const PluginChoice& choice, const PluginLoader& plugins) {
  VANTAGE_TRY(const Table params, plugins.effective_params(PluginKind::matcher, choice));
  return MatcherChoice{.plugin = choice.plugin, .params = to_toml(params)};
}

}  // namespace vantage
