#pragma once

#include <nlohmann/json.hpp>

#include "building/input.hpp"
#include "terminal/style.hpp"
#include "vantage/engine/build.hpp"
#include "vantage/map_store.hpp"

namespace vantage::building {

/// Prints what a build made and what it cost.
/// @param index  of the bundle
void print_report(const BuildReport& report, const MapIndex& index, const WideAreaMap& map,
                  const cli::Style& style);

/// The same as JSON.
[[nodiscard]] nlohmann::ordered_json to_json(const BuildReport& report, const MapIndex& index,
                                             const WideAreaMap& map);

}  // namespace vantage::building
