#pragma once

#include <optional>
#include <span>
#include <vector>

#include "building/input.hpp"
#include "checks/map_facts.hpp"
#include "checks/note.hpp"
#include "checks/scan_facts.hpp"
#include "checks/trials.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/evaluation/run.hpp"
#include "vantage/io/scan_source.hpp"
#include "vantage/result.hpp"
#include "vantage/track/samples.hpp"

namespace vantage::building {

/// What the points of a map say; of a tiled map that is not in memory, those of a sample.
/// Errors: those of TiledMap::read.
[[nodiscard]] Result<checks::MapFacts> facts_of(const WideAreaMap& map);

/// The beginning of a recording.
struct FirstScans {
  std::vector<io::StampedScan> scans;  ///< up to checks::kScansToTry
  checks::ScanFacts facts;             ///< of some of the first ScanSurvey::kAmong
  std::optional<Error> stamps;         ///< see check_stamps
};
/// Adds damage of the scans to that of the inputs. Errors: those of the recording.
[[nodiscard]] Result<FirstScans> read_first_scans(RunInputs& inputs);

/// What is suspicious about a map, a recording and a configuration.
struct Findings {
  std::vector<checks::Note> notes;
  std::optional<checks::Fit> fit;  ///< of the first scans in the whole map, if they were tried
};

/// Without scans: what a map and its configuration show.
[[nodiscard]] Findings look_at(const checks::MapFacts& map, const Config& config);

/// With scans. If nothing else is suspicious, they are localized in the whole map, which is not
/// done for a map of tiles or without a [matcher]; a line on stderr says so.
/// @param config  with the defaults of its plugins, as with_plugin_defaults returns it
/// @param imu     its samples, in order of time; empty without one
/// Errors: those of a build of the map, and of the localizer.
[[nodiscard]] Result<Findings> look_at(const checks::MapFacts& map_facts, const Config& config,
                                       const WideAreaMap& map, const FirstScans& first,
                                       std::span<const ImuSample> imu, const PluginLoader& plugins,
                                       bool quiet);

}  // namespace vantage::building
