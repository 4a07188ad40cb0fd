#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace vantage::report {

/// Makes text of any origin safe as HTML or SVG text or as an attribute value. Markup is escaped;
/// control characters, which neither language allows, become spaces.
[[nodiscard]] std::string escaped(std::string_view text);

/// A cell of a table.
struct Cell {
  std::string text;
  /// For programs: ` data-<first>="<second>"`.
  std::vector<std::pair<std::string, std::string>> data = {};
  bool best = false;  ///< of its column
};

/// A heading above several columns.
struct HeadGroup {
  std::string text;
  std::size_t columns = 1;
};

struct TableRow {
  std::vector<Cell> cells;
  bool beneath = false;  ///< belongs to the last row above it for which this is false
  bool heading = false;  ///< one cell, over all columns
};

struct Table {
  std::string caption;
  std::vector<HeadGroup> groups = {};  ///< over the header; may be empty
  std::vector<std::string> header;     ///< with units
  std::size_t name_columns = 1;        ///< aligned left; the others are numbers
  std::vector<TableRow> rows = {};
};

/// Precondition: all rows except headings have as many cells as the header.
[[nodiscard]] std::string to_html(const Table& table);

/// A coloured word of a verdict: "holds", "fails".
[[nodiscard]] std::string badge(bool good, std::string_view words);

/// A picture with its caption, and buttons to save the picture.
/// @param svg      one `<svg>` or several side by side
/// @param caption  HTML
/// @param file     name of a saved file, without suffix
[[nodiscard]] std::string figure(const std::vector<std::string>& svg, std::string_view caption,
                                 std::string_view file);

/// Puts figures side by side if each has only one panel, and the page is wide enough.
[[nodiscard]] std::string side_by_side(const std::string& figures);

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

/// One page that needs no other file, and whose content security policy forbids loading any. It has
/// a light and a dark style, fits narrow and wide screens and paper, and lists its sections.
[[nodiscard]] std::string to_html(const Page& page);

}  // namespace vantage::report
