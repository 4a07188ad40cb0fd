#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace vantage::cli {

/// Text in aligned columns: names flush left, numbers flush right.
class TextTable {
 public:
  /// @param name_columns  how many columns, from the left, hold names
  explicit TextTable(std::vector<std::string> header, std::size_t name_columns = 1)
      : rows_{std::move(header)}, name_columns_(name_columns) {}
  /// Precondition: as many cells as the header has.
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  [[nodiscard]] std::string to_string() const;

 private:
  std::vector<std::vector<std::string>> rows_;
  std::size_t name_columns_;
};

/// 1234567 as "1,234,567".
[[nodiscard]] std::string grouped(std::uint64_t number);

/// Text of any author on one line: control characters become spaces. A comment must not end before
/// its text does.
[[nodiscard]] std::string one_line(std::string text);

}  // namespace vantage::cli
