#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vantage/engine/localizer.hpp"
#include "vantage/evaluation/run.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// A table of comma-separated values (RFC 4180). A cell may stand in double quotes; inside them,
/// quotes are doubled, and commas and line ends are text.
struct CsvTable {
  struct Row {
    std::vector<std::string> cells;  ///< as many as the header has
    std::uint32_t line = 0;          ///< line on which the row begins, from 1
  };
  std::vector<std::string> header;
  std::vector<Row> rows;
};
/// @param file  for errors
/// Errors (`where` is the file and line): `corrupt_data` for a missing header, a name that occurs
/// twice in the header, a row with another number of cells, a quote inside a bare cell, text after
/// a closing quote, or a quote that is not closed.
[[nodiscard]] Result<CsvTable> parse_csv(std::string_view content, const std::string& file);

/// What `vantage localize` wrote about a run, scan by scan.
struct ScanTable {
  std::filesystem::path file;
  std::vector<double> stamps;  ///< [s], strictly ascending
  std::vector<Tracking> tracking;
  std::vector<std::uint32_t> lines;  ///< of the file
  /// `distance_m` and every metric that is in files, by its key: a number a scan; none where the
  /// cell is empty, or where the file is older than the metric.
  std::map<std::string, std::vector<std::optional<double>>, std::less<>> columns;
  /// From summary.json beside the file; the default if that says nothing.
  AlertLimit alert_limit = {};

  [[nodiscard]] std::size_t size() const { return stamps.size(); }
  [[nodiscard]] bool is_tracked(std::size_t at) const { return tracking[at] == Tracking::tracked; }
};

/// Reads DIR/scans.csv, or a file itself, and summary.json beside it if there is one.
/// Errors (`where` is the file and line): `not_found`, which names folders below that hold one;
/// `io_failure`; those of parse_csv; `corrupt_data` for a column that is missing, an unknown
/// state, a cell that is no finite number, stamps that do not ascend, or no scan; `corrupt_data`
/// for a summary.json that is no JSON, or with an alert limit that is not above 0.
[[nodiscard]] Result<ScanTable> read_scans(const std::filesystem::path& path);

}  // namespace vantage
