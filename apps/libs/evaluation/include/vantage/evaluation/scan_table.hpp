#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

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
  std::vector<bool> tracked;
  std::vector<std::uint32_t> lines;  ///< line of each scan in the file
  /// One number per scan; none if the cell is empty.
  std::map<std::string, std::vector<std::optional<double>>> columns;

  [[nodiscard]] std::size_t size() const { return stamps.size(); }
};

/// The columns of scans.csv that are read as numbers.
[[nodiscard]] const std::vector<std::string>& number_columns();

/// Reads DIR/scans.csv, or the file itself.
/// Errors (`where` is the file and line): `not_found`, which names the folders below that hold such
/// a file; `io_failure`; those of parse_csv; `corrupt_data` for a missing column, a cell that is
/// not a finite number, stamps that do not ascend, or a table without scans.
[[nodiscard]] Result<ScanTable> read_scans(const std::filesystem::path& path);

}  // namespace vantage
