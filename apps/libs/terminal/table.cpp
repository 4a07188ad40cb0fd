#include "terminal/table.hpp"

#include <algorithm>

namespace vantage::cli {
namespace {

constexpr std::size_t kGap = 2;  // spaces between columns

}  // namespace

std::vector<std::size_t> TextTable::widths() const {
  std::vector<std::size_t> widths(rows_.front().size(), 0);
  for (const auto& row : rows_) {
    for (std::size_t c = 0; c < row.size(); ++c) {
      widths[c] = std::max(widths[c], display_width(row[c]));
    }
  }
  return widths;
}

std::string TextTable::block(std::size_t first, std::size_t last,
                             const std::vector<std::size_t>& widths, const Style& style) const {
  std::vector<std::size_t> columns;
  for (std::size_t c = 0; c < widths.size(); ++c) {
    if (c < name_columns_ || (first <= c && c < last)) columns.push_back(c);
  }
  std::string text;
  std::size_t total = 0;
  for (const std::size_t c : columns) total += widths[c] + (c == columns.front() ? 0 : kGap);
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    std::string line;
    for (const std::size_t c : columns) {
      if (c != columns.front()) line += std::string(kGap, ' ');
      const std::string space(widths[c] - display_width(rows_[r][c]), ' ');
      line += c < name_columns_ ? rows_[r][c] + space : space + rows_[r][c];
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += (r == 0 ? style.bold(line) : line) + '\n';
    if (r == 0) text += style.dim(std::string(total, '-')) + '\n';
  }
  return text;
}

std::string TextTable::to_string(const Style& style) const {
  const std::vector<std::size_t> width = widths();
  const std::size_t names = std::min(name_columns_, width.size());
  std::size_t names_width = 0;
  for (std::size_t c = 0; c < names; ++c) names_width += width[c] + (c == 0 ? 0 : kGap);

  std::string text;
  std::size_t first = names;
  do {
    std::size_t last = first, taken = names_width;
    while (last < width.size()) {
      const std::size_t more = width[last] + (last == 0 ? 0 : kGap);
      if (style.columns() > 0 && last > first && taken + more > style.columns()) break;
      taken += more;
      ++last;
    }
    if (!text.empty()) text += '\n';
    text += block(first, last, width, style);
    first = last;
  } while (first < width.size());
  return text;
}

std::string one_line(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  }
  return text;
}

}  // namespace vantage::cli
