#pragma once

#include <filesystem>
#include <string>
#include <utility>

#include "vantage/evaluation/run.hpp"
#include "vantage/evaluation/summary.hpp"
#include "vantage/kit/atomic_file.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// The header of scans.csv, and the line of a scan; times in ms, lengths in m, angles in degrees.
/// @param way  the distance travelled [m], see Odometer
[[nodiscard]] std::string csv_header();
[[nodiscard]] std::string csv_line(const RunScan& scan, double way);

/// Writes a run into a folder, scan by scan: scans.csv, trajectory.tum and summary.json. The
/// trajectory has the tracked poses alone, because the others are not reliable. The three files
/// appear when the run is complete.
class RunWriter {
 public:
  /// Creates the folder if needed. Errors: those of OutputFile.
  [[nodiscard]] static Result<RunWriter> create(const std::filesystem::path& folder);

  /// Errors: those of OutputFile, and of io::to_tum.
  [[nodiscard]] Result<void> add(const RunScan& scan);
  /// Call once, at the end. Errors: those of OutputFile; older files then are as they were.
  [[nodiscard]] Result<void> commit(const RunInfo& run, const RunSummary& summary);

 private:
  RunWriter(std::filesystem::path folder, io::OutputFile scans, io::OutputFile trajectory)
      : folder_(std::move(folder)), scans_(std::move(scans)), trajectory_(std::move(trajectory)) {}

  std::filesystem::path folder_;
  io::OutputFile scans_, trajectory_;
  Odometer odometer_;
};

/// Writes a run that is in memory. Errors: those of RunWriter.
[[nodiscard]] Result<void> write_run(const Run& run, const RunSummary& summary,
                                     const std::filesystem::path& folder);

}  // namespace vantage
