#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace vantage::report {

/// Text of any author as HTML or SVG text or attribute value: markup is disarmed, control
/// characters, which neither language can hold, become spaces.
[[nodiscard]] std::string escaped(std::string_view text);

/// A cell of a table.
struct Cell {
  std::string text;
  /// Read by programs: ` data-<first>="<second>"`.
  std::vector<std::pair<std::string, std::string>> data = {};
  bool best = false;  ///< of its column
};

/// A head over some columns.
struct HeadGroup {
  std::string text;
  std::size_t columns = 1;
};

struct TableRow {
  std::vector<Cell> cells;
  bool beneath = false;  ///< it belongs to the row above that is not
  bool heading = false;  ///< one cell, over all columns
};

struct Table {
  std::string caption;
  std::vector<HeadGroup> groups = {};  ///< over the header; may be empty
  std::vector<std::string> header;     ///< with units
  std::size_t name_columns = 1;        ///< flush left; the others are numbers
  std::vector<TableRow> rows = {};
};

/// Precondition: rows have as many cells as the header, but for headings.
[[nodiscard]] std::string to_html(const Table& table);

/// Coloured words of a verdict: "holds", "fails".
[[nodiscard]] std::string badge(bool good, std::string_view words);

/// A picture with its caption and buttons to save it.
/// @param svg      one `<svg>` or several side by side
/// @param caption  HTML
/// @param file     name of a saved file, without suffix
[[nodiscard]] std::string figure(const std::vector<std::string>& svg, std::string_view caption,
                                 std::string_view file);

struct Section {
  std::string id;     ///< letters
  std::string title;  ///< as text
  std::string body;   ///< HTML
};

struct Page {
  std::string title, subtitle;  ///< as text
  std::vector<Section> sections;
  std::string scripts = {};  ///< HTML before the end of the body
};

/// One page that needs nothing but itself and is forbidden to ask for more (by its content security
/// policy): light and dark, for narrow and wide screens and for paper, with the sections' names at
/// hand.
[[nodiscard]] std::string to_html(const Page& page);

}  // namespace vantage::report
