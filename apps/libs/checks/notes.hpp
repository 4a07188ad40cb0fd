#pragma once

#include <vector>

#include "checks/map_facts.hpp"
#include "checks/note.hpp"
#include "checks/scan_facts.hpp"
#include "vantage/engine/config.hpp"

namespace vantage::checks {

/// What is suspicious about a map by itself: unit, up, rounding.
[[nodiscard]] std::vector<Note> notes_on(const MapFacts& map);
/// What of a configuration does not suit its map.
/// @param config  with the defaults of its plugins filled in, as `with_defaults` returns it
[[nodiscard]] std::vector<Note> notes_on(const MapFacts& map, const Config& config);
/// What is suspicious about scans, and about a configuration for them.
/// @param imu  the sensor has an IMU, which knows where up is
[[nodiscard]] std::vector<Note> notes_on(const ScanFacts& scans, const Config& config, bool imu);

/// The configuration with the defaults of its plugins. Errors: those of effective_config.
[[nodiscard]] Result<Config> with_defaults(const Config& config, const PluginLoader& plugins);

}  // namespace vantage::checks
