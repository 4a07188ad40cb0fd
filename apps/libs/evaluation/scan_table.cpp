#include "vantage/evaluation/scan_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "io/text.hpp"
#include "vantage/evaluation/metrics.hpp"
#include "vantage/kit/file_content.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;

auto corrupt(std::string message, const std::string& file, std::uint32_t line) {
  return fail(ErrorCode::corrupt_data, std::move(message), SourceLocation{file, line, 0});
}

/// Takes cells off the front of a text.
class CsvReader {
 public:
  CsvReader(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  [[nodiscard]] bool done() const { return at_ == text_.size(); }
  [[nodiscard]] std::uint32_t line() const { return line_; }

  /// The cells of a record, which may span several lines.
  Result<std::vector<std::string>> record() {
    std::vector<std::string> cells;
    while (true) {
      VANTAGE_TRY(std::string cell, next() == '"' ? quoted_cell() : bare_cell());
      cells.push_back(std::move(cell));
      if (done()) return cells;
      const char end = text_[at_++];
      if (end == ',') continue;
      if (end == '\r' && next() == '\n') ++at_;
      ++line_;
      return cells;
    }
  }

 private:
  [[nodiscard]] char next() const { return done() ? '\0' : text_[at_]; }

  Result<std::string> bare_cell() {
    const std::size_t start = at_;
    while (!done() && next() != ',' && next() != '\n' && next() != '\r') {
      if (next() == '"') return corrupt("a quote inside a cell without quotes", file_, line_);
      ++at_;
    }
    return std::string(text_.substr(start, at_ - start));
  }

  Result<std::string> quoted_cell() {
    const std::uint32_t first = line_;
    std::string cell;
    for (++at_; !done(); ++at_) {
      if (next() == '\n') ++line_;
      if (next() != '"') {
        cell += next();
        continue;
      }
      ++at_;
      if (next() == '"') {
        cell += '"';
        continue;
      }
      if (!done() && next() != ',' && next() != '\n' && next() != '\r') {
        return corrupt("text after the closing quote of a cell", file_, line_);
      }
      return cell;
    }
    return corrupt("a quote that is never closed", file_, first);
  }

  std::string_view text_;
  const std::string& file_;
  std::size_t at_ = 0;
  std::uint32_t line_ = 1;
};

/// "; its folders a, b hold one", for a folder without a table.
std::string folders_below(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error)) {
    if (it.depth() > 2) it.disable_recursion_pending();
    if (it->path().filename() == "scans.csv") {
      names.push_back(fs::relative(it->path().parent_path(), folder, error).string());
    }
  }
  if (names.empty()) return {};
  std::sort(names.begin(), names.end());
  constexpr std::size_t kMost = 5;
  std::string text = names.size() == 1 ? "; its folder " : "; its folders ";
  for (std::size_t i = 0; i < std::min(names.size(), kMost); ++i) {
    text += (i == 0 ? "" : ", ") + names[i];
  }
  return text + (names.size() > kMost ? ", ..." : "") +
         (names.size() == 1 ? " holds one" : " hold one");
}

Result<std::size_t> column(const CsvTable& table, const std::string& name,
                           const std::string& file) {
  const auto found = std::find(table.header.begin(), table.header.end(), name);
  if (found == table.header.end()) {
    return corrupt("no column '" + name +
                       "'; expected scans.csv of `vantage localize` of this version: localize "
                       "again if an earlier version wrote it",
                   file, 1);
  }
  return static_cast<std::size_t>(found - table.header.begin());
}

Result<std::optional<double>> number(const CsvTable::Row& row, std::size_t column,
                                     const std::string& name, const std::string& file) {
  const std::string& cell = row.cells[column];
  if (cell.empty()) return std::optional<double>{};
  const auto value = io::parse_number<double>(cell);
  if (!value || !std::isfinite(*value)) {
    return corrupt(io::quoted(cell) + " in column '" + name + "' is not a finite number", file,
                   row.line);
  }
  return value;
}

/// None if there is no such state.
std::optional<Tracking> tracking_of(std::string_view state) {
  constexpr std::array kStates{Tracking::tracked, Tracking::uncertain, Tracking::lost};
  const auto* found = std::find_if(kStates.begin(), kStates.end(),
                                   [&](Tracking known) { return to_string(known) == state; });
  return found == kStates.end() ? std::nullopt : std::optional(*found);
}

Result<void> read_stamps(const CsvTable& csv, const std::string& file, ScanTable& table) {
  VANTAGE_TRY(const std::size_t stamp, column(csv, "stamp", file));
  VANTAGE_TRY(const std::size_t tracking, column(csv, "tracking", file));
  for (const CsvTable::Row& row : csv.rows) {
    VANTAGE_TRY(const auto value, number(row, stamp, "stamp", file));
    if (!value) return corrupt("no stamp", file, row.line);
    if (!table.stamps.empty() && *value <= table.stamps.back()) {
      return corrupt(
          fmt::format("the stamp {} is not after the one before, {}", *value, table.stamps.back()),
          file, row.line);
    }
    const std::string& text = row.cells[tracking];
    const auto state = tracking_of(text);
    if (!state) {
      return corrupt(
          io::quoted(text) + " in column 'tracking'; expected tracked, uncertain or lost", file,
          row.line);
    }
    table.stamps.push_back(*value);
    table.tracking.push_back(*state);
    table.lines.push_back(row.line);
  }
  return {};
}

Result<void> read_numbers(const CsvTable& csv, const std::string& file, const std::string& wanted,
                          ScanTable& table) {
  VANTAGE_TRY(const std::size_t at, column(csv, wanted, file));
  auto& values = table.columns[wanted];
  for (const CsvTable::Row& row : csv.rows) {
    VANTAGE_TRY(values.emplace_back(), number(row, at, wanted, file));
  }
  return {};
}

/// The alert limit in a run's summary.json. A summary without one gets the default.
Result<AlertLimit> read_alert_limit(const fs::path& summary) {
  std::error_code error;
  if (!fs::exists(summary, error)) return AlertLimit{};
  const std::string file = summary.string();
  VANTAGE_TRY(const io::FileContent content, io::read_file(summary, "summary.json of a run"));
  VANTAGE_TRY(const auto json, parse_json<nlohmann::json>(content.view(), file,
                                                          "the summary of the run is damaged"));
  if (!json.is_object()) return corrupt("the summary of the run is no JSON object", file, 0);
  const auto stated = json.find("alert_limit");
  if (stated == json.end()) return AlertLimit{};
  const auto limit = [&](const char* key) {
    const auto found = stated->is_object() ? stated->find(key) : stated->end();
    const bool is_there = stated->is_object() && found != stated->end() && found->is_number();
    return is_there ? found->get<double>() : 0.0;
  };
  const AlertLimit read{.metres = limit("m"), .degrees = limit("deg")};
  if (read.metres > 0.0 && read.degrees > 0.0) return read;
  return corrupt("'alert_limit' must have the numbers 'm' and 'deg' above 0", file, 0);
}

}  // namespace

Result<CsvTable> parse_csv(std::string_view content, const std::string& file) {
  CsvReader reader(content, file);
  if (reader.done()) return corrupt("no header", file, 1);
  CsvTable table;
  VANTAGE_TRY(table.header, reader.record());
  std::set<std::string> names;
  for (const std::string& name : table.header) {
    if (!names.insert(name).second) return corrupt("column '" + name + "' is there twice", file, 1);
  }
  while (!reader.done()) {
    const std::uint32_t line = reader.line();
    VANTAGE_TRY(auto cells, reader.record());
    if (cells.size() != table.header.size()) {
      return corrupt(fmt::format("{} cells; the header has {}", cells.size(), table.header.size()),
                     file, line);
    }
    table.rows.push_back({std::move(cells), line});
  }
  return table;
}

Result<ScanTable> read_scans(const fs::path& path) {
  std::error_code error;
  const bool folder = fs::is_directory(path, error);
  const fs::path file = folder ? path / "scans.csv" : path;
  if (folder && !fs::exists(file, error)) {
    return fail(ErrorCode::not_found, "no scans.csv in this folder" + folders_below(path),
                SourceLocation{path.string(), 0, 0});
  }
  const std::string name = file.string();
  VANTAGE_TRY(const io::FileContent content,
              io::read_file(file, "scans.csv of `vantage localize`"));
  VANTAGE_TRY(const CsvTable csv, parse_csv(content.view(), name));
  ScanTable table{.file = file, .stamps = {}, .tracking = {}, .lines = {}, .columns = {}};
  VANTAGE_TRY(table.alert_limit, read_alert_limit(file.parent_path() / "summary.json"));
  VANTAGE_CHECK(read_stamps(csv, name, table));
  if (csv.rows.empty()) return corrupt("no scan", name, 1);
  VANTAGE_CHECK(read_numbers(csv, name, "distance_m", table));
  for (const Metric& metric : metrics()) {
    if (metric.is(kNotInFiles)) continue;
    std::string key(metric.key);
    const bool there = std::find(csv.header.begin(), csv.header.end(), key) != csv.header.end();
    if (!there && metric.is(kNotInOldFiles)) {
      table.columns[std::move(key)].resize(table.size());
      continue;
    }
    VANTAGE_CHECK(read_numbers(csv, name, key, table));
  }
  return table;
}

}  // namespace vantage
