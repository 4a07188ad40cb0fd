#pragma once

#include <string>

#include "vantage/api.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// The matcher that something was measured with. Equal texts: the same matcher with the same
/// parameters.
struct MatcherChoice {
  std::string plugin;  ///< its name, "ndt"
  std::string params;  ///< all its parameters, defaults filled in (TOML)

  /// Errors: those of PluginLoader::effective_params.
  [[nodiscard]] VANTAGE_API static Result<MatcherChoice> of(const PluginChoice& choice,
                                                            const PluginLoader& plugins);

  friend bool operator==(const MatcherChoice&, const MatcherChoice&) = default;
};

}  // namespace vantage
