#pragma once

#include <optional>
#include <span>
#include <vector>

#include "checks/map_facts.hpp"
#include "checks/note.hpp"
#include "checks/scan_facts.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/result.hpp"

namespace vantage::checks {

/// What is suspicious about a map by itself: unit, up, rounding.
[[nodiscard]] std::vector<Note> notes_on(const MapFacts& map);
/// What cut off or damaged bags leave out.
/// @param damaged  the errors at which they end
[[nodiscard]] std::vector<Note> notes_on_damage(std::span<const Error> damaged);
/// An input that has nothing of the time of the scans. @param error  that of check_stamps
[[nodiscard]] Note note_on_stamps(const Error& error);
/// A reference that tracked scans are far from.
/// @param least, median, most  of the errors of tracked scans [m]
[[nodiscard]] std::optional<Note> note_on_reference(double least, double median, double most);
/// What of a configuration does not suit its map.
/// @param config  with the defaults of its plugins filled in, as `with_plugin_defaults` returns it
[[nodiscard]] std::vector<Note> notes_on(const MapFacts& map, const Config& config);
/// The part of it that needs no map.
[[nodiscard]] std::vector<Note> notes_on_reach(const Config& config);
/// What is suspicious about scans by themselves: unit, frame, up, times, what is missing.
/// @param imu  the sensor has an IMU, which knows where up is
[[nodiscard]] std::vector<Note> notes_on(const ScanFacts& scans, bool imu);
/// The same, or, if there is nothing, what keeps a configuration from using the scans.
[[nodiscard]] std::vector<Note> notes_on(const ScanFacts& scans, const Config& config, bool imu);
/// What the ranges and the ground of the scans say against the sensor that a configuration
/// describes. Scans with other axes or in feet show another sensor: rule that out first. Nothing
/// for scans that have notes.
[[nodiscard]] std::vector<Note> notes_on_sensor(const ScanFacts& scans, const Config& config,
                                                bool imu);

}  // namespace vantage::checks
