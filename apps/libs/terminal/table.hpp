#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "terminal/counts.hpp"
#include "terminal/style.hpp"

namespace vantage::cli {

/// Text in aligned columns: names aligned left, numbers aligned right. A unit stands in brackets
/// behind the name of a column, "error [cm]", and not in the cells. A column without a unit is a
/// count, or a share from 0 to 1. Cells may contain text of a Style.
class TextTable {
 public:
  /// @param name_columns  how many columns, counted from the left, contain names
  explicit TextTable(std::vector<std::string> header, std::size_t name_columns = 1)
      : rows_{std::move(header)}, name_columns_(name_columns) {}
  /// Precondition: as many cells as the header has.
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  /// The table with a bold header over a dim rule. A table wider than the style's columns is
  /// divided into several, below each other. Each has the columns of names and as many others as
  /// fit, but at least one.
  [[nodiscard]] std::string to_string(const Style& style = {}) const;

 private:
  [[nodiscard]] std::vector<std::size_t> widths() const;
  /// The columns of names, and those from `first` up to but not including `last`.
  [[nodiscard]] std::string block(std::size_t first, std::size_t last,
                                  const std::vector<std::size_t>& widths, const Style& style) const;

  std::vector<std::vector<std::string>> rows_;
  std::size_t name_columns_;
};

/// Text of any origin on one line: control characters become spaces. Otherwise a line end in the
/// text would end the comment that contains it.
[[nodiscard]] std::string one_line(std::string text);

}  // namespace vantage::cli
