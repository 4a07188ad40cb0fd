#pragma once

#include <filesystem>
#include <string>

#include "vantage/evaluation/run.hpp"
#include "vantage/evaluation/summary.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// One line per scan, with a header; times in ms, lengths in m, angles in degrees. `distance_m` is
/// the distance travelled along the reference, or along the estimates if there is no reference.
[[nodiscard]] std::string to_csv(const Run& run);

/// Writes trajectory.tum, scans.csv and summary.json into a folder, and creates the folder if
/// needed.
[[nodiscard]] Result<void> write_run(const Run& run, const RunSummary& summary,
                                     const std::filesystem::path& folder);

}  // namespace vantage
