#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "checks/map_facts.hpp"
#include "checks/scan_facts.hpp"
#include "init/cells.hpp"
#include "init/imu.hpp"
#include "vantage/result.hpp"

namespace vantage::init {

/// All that a configuration is decided by.
struct Known {
  checks::MapFacts map;
  CellCount cells;
  std::optional<checks::ScanFacts> scans;  ///< none without a recording
  std::optional<UsableImu> imu;
  std::string files;                      ///< of [map], as the configuration is to name it
  std::optional<std::string> trajectory;  ///< likewise
  std::string trajectory_why = "The path of the sensor during mapping.";
  std::string root;          ///< of the bundle, likewise
  std::uint64_t memory = 0;  ///< that region maps may take on the robot [bytes]
};

/// A key of the configuration, and why it has its value.
struct Decision {
  std::string table;  ///< "viewpoints"
  std::string key;    ///< "sensor_height"
  std::string value;  ///< in TOML: "1.75"
  std::string why;    ///< a sentence or two, with what was measured
};

/// The name of a bundle: that of the configuration or the map, without suffix; "map" for what is no
/// name, as a pattern.
[[nodiscard]] std::string bundle_name(const std::filesystem::path& of);

/// Whether the map has its ground.
[[nodiscard]] bool has_ground(const checks::MapFacts& map) noexcept;
/// The edge of a cell of the matcher that the map's density allows [m].
[[nodiscard]] double resolution_for(double spacing) noexcept;
/// The reach of the sensor, in steps of 10 m [m].
[[nodiscard]] double reach_of(const std::optional<checks::ScanFacts>& scans) noexcept;

/// The whole configuration, in the order of the file; the decisions on a table follow each other.
/// Errors: `invalid_input` for memory in which no region map is useful, and for a map without
/// ground that does not fit into it if there is no trajectory.
[[nodiscard]] Result<std::vector<Decision>> decide(const Known& known);

/// The text of the file: a comment with the reason above each key.
/// @param head  lines for the beginning, without comment signs
[[nodiscard]] std::string to_toml(const std::vector<Decision>& decisions,
                                  const std::vector<std::string>& head);

}  // namespace vantage::init
