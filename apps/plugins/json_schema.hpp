#pragma once

#include <nlohmann/json.hpp>

#include "vantage/engine/plugin_loader.hpp"

namespace vantage::documentation {

/// JSON Schema (draft 2020-12) of a plugin's `params` table. Units and sources are in the
/// annotations `x-unit`, `x-equation` and `x-citation`.
[[nodiscard]] nlohmann::ordered_json json_schema(const PluginInfo& plugin);

}  // namespace vantage::documentation
