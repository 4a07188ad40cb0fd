#include "io/imu_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <system_error>
#include <utility>
#include <vector>

#include "io/ros/messages.hpp"
#include "io/text.hpp"
#include "vantage/kit/file_content.hpp"

namespace vantage::io {
namespace {

namespace fs = std::filesystem;

constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

/// The numbers of a sample in the order of Vantage's own header: t, wx, wy, wz, ax, ay, az.
constexpr std::size_t kQuantities = 7;
using Row = std::array<double, kQuantities>;

struct ColumnName {
  std::string_view own, euroc;
};
constexpr std::array<ColumnName, kQuantities> kColumns{{{"t", "timestamp"},
                                                        {"wx", "w_RS_S_x"},
                                                        {"wy", "w_RS_S_y"},
                                                        {"wz", "w_RS_S_z"},
                                                        {"ax", "a_RS_S_x"},
                                                        {"ay", "a_RS_S_y"},
                                                        {"az", "a_RS_S_z"}}};
constexpr std::string_view kBothHeaders =
    "t,wx,wy,wz,ax,ay,az or EuRoC's #timestamp [ns],w_RS_S_x [rad s^-1],...";

ImuSample sample_of(const Row& row) {
  return {.stamp = row[0],
          .angular_velocity = {row[1], row[2], row[3]},
          .specific_force = {row[4], row[5], row[6]}};
}

std::string_view trimmed(std::string_view text) noexcept {
  constexpr std::string_view kBlanks = " \t";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  for (;;) {
    const std::size_t comma = line.find(',');
    cells.push_back(trimmed(line.substr(0, comma)));
    if (comma == std::string_view::npos) return cells;
    line.remove_prefix(comma + 1);
  }
}

struct Heading {
  std::string_view name, unit;
};

Heading heading_of(std::string_view cell) {
  const std::size_t bracket = cell.find('[');
  if (bracket == std::string_view::npos) return {cell, {}};
  std::string_view unit = cell.substr(bracket + 1);
  return {trimmed(cell.substr(0, bracket)), unit.substr(0, unit.find(']'))};
}

/// The line without the '#' that EuRoC puts before its names.
std::vector<std::string_view> headings_in(std::string_view line) {
  line = trimmed(line);
  if (line.starts_with('#')) line.remove_prefix(1);
  return cells_of(line);
}

std::optional<std::size_t> quantity_of(std::string_view name) {
  const auto found = std::find_if(kColumns.begin(), kColumns.end(), [&](const ColumnName& column) {
    return name == column.own || name == column.euroc;
  });
  if (found == kColumns.end()) return std::nullopt;
  return static_cast<std::size_t>(found - kColumns.begin());
}

/// Where the columns of a CSV file are.
struct CsvLayout {
  std::size_t columns = 0;
  std::array<std::size_t, kQuantities> places{};
  std::int64_t stamps_per_second = 0;  // of whole numbers; 0 for stamps in seconds
};

// Either a value, or what was wrong with it; the caller knows the file and the line.
template <class T>
using Checked = tl::expected<T, std::string>;

Checked<std::int64_t> stamp_unit(std::string_view unit) {
  if (unit.empty() || unit == "s") return 0;
  if (unit == "ns") return 1'000'000'000;
  if (unit == "us") return 1'000'000;
  return tl::unexpected(fmt::format("stamps are in {}, expected s, us or ns", quoted(unit)));
}

Checked<CsvLayout> layout_of(std::string_view line) {
  CsvLayout layout;
  std::array<bool, kQuantities> found{};
  for (const std::string_view cell : headings_in(line)) {
    const Heading heading = heading_of(cell);
    const auto quantity = quantity_of(heading.name);
    const std::size_t place = layout.columns++;
    if (!quantity) continue;
    if (found[*quantity]) {
      return tl::unexpected(fmt::format("two columns are named {}", quoted(heading.name)));
    }
    found[*quantity] = true;
    layout.places[*quantity] = place;
    const bool is_rate = *quantity >= 1 && *quantity <= 3;
    if (is_rate && heading.unit.starts_with("deg")) {
      return tl::unexpected(
          fmt::format("{} is in {}, expected rad/s", quoted(heading.name), quoted(heading.unit)));
    }
    if (*quantity == 0) {
      auto unit = stamp_unit(heading.unit);
      if (!unit) return tl::unexpected(std::move(unit).error());
      layout.stamps_per_second = *unit;
    }
  }
  const auto missing = std::find(found.begin(), found.end(), false);
  if (missing == found.end()) return layout;
  return tl::unexpected(fmt::format("no column {} in the first line {}, expected {}",
                                    kColumns[static_cast<std::size_t>(missing - found.begin())].own,
                                    quoted(line), kBothHeaders));
}

/// A number; an empty cell is a quantity that was not measured.
Checked<double> number_in(std::string_view cell, std::size_t column) {
  if (cell.empty()) return kNotANumber;
  if (const auto number = parse_number<double>(cell)) return *number;
  return tl::unexpected(
      fmt::format("expected a number in column {}, found {}", column + 1, quoted(cell)));
}

Checked<double> stamp_in(std::string_view cell, std::size_t column, std::int64_t per_second) {
  if (per_second == 0) return number_in(cell, column);
  constexpr std::int64_t kNanoseconds = 1'000'000'000;
  const auto count = parse_number<std::int64_t>(cell);
  std::int64_t nanoseconds = 0;
  if (!count || __builtin_mul_overflow(*count, kNanoseconds / per_second, &nanoseconds)) {
    return tl::unexpected(
        fmt::format("expected a whole number in column {}, found {}", column + 1, quoted(cell)));
  }
  return ros::seconds_from(nanoseconds);
}

Checked<Row> row_in(std::string_view line, const CsvLayout& layout) {
  const auto cells = cells_of(line);
  if (cells.size() != layout.columns) {
    return tl::unexpected(fmt::format("expected {} columns as in the first line, found {}",
                                      layout.columns, cells.size()));
  }
  Row row{};
  for (std::size_t i = 0; i < kQuantities; ++i) {
    const std::size_t column = layout.places[i];
    auto number = i == 0 ? stamp_in(cells[column], column, layout.stamps_per_second)
                         : number_in(cells[column], column);
    if (!number) return tl::unexpected(std::move(number).error());
    if (i == 0 && std::isfinite(*number)) {
      if (auto problem = problem_of_stamp(*number)) return tl::unexpected(*std::move(problem));
    }
    row[i] = *number;
  }
  return row;
}

/// "2011-09-26 13:04:32.349659964", as seconds since 1970.
std::optional<double> oxts_stamp(std::string_view line) {
  // The place, the length and the least and the greatest value of each whole number.
  struct Part {
    std::size_t place, size;
    int least, most;
  };
  constexpr std::array<Part, 5> kParts{
      {{0, 4, 1970, 9999}, {5, 2, 1, 12}, {8, 2, 1, 31}, {11, 2, 0, 23}, {14, 2, 0, 59}}};
  constexpr std::size_t kSeconds = 17;
  if (line.size() <= kSeconds + 1 || line[4] != '-' || line[7] != '-' || line[10] != ' ' ||
      line[13] != ':' || line[16] != ':') {
    return std::nullopt;
  }
  std::array<int, kParts.size()> numbers{};
  for (std::size_t i = 0; i < kParts.size(); ++i) {
    const auto& [place, size, least, most] = kParts[i];
    const auto number = parse_number<int>(line.substr(place, size));
    if (!number || *number < least || *number > most) return std::nullopt;
    numbers[i] = *number;
  }
  const auto seconds = parse_number<double>(trimmed(line.substr(kSeconds)));
  if (!seconds || !(*seconds >= 0.0 && *seconds < 61.0)) return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year(numbers[0]),
                                         std::chrono::month(static_cast<unsigned>(numbers[1])),
                                         std::chrono::day(static_cast<unsigned>(numbers[2]))};
  if (!date.ok()) return std::nullopt;
  const auto days = std::chrono::sys_days(date).time_since_epoch().count();
  return static_cast<double>(days * 86'400LL + numbers[3] * 3600 + numbers[4] * 60) + *seconds;
}

Result<std::vector<double>> read_oxts_stamps(const fs::path& file) {
  VANTAGE_TRY(const auto content, read_file(file, "the stamps of KITTI's oxts"));
  std::vector<double> stamps;
  LineReader lines(content.view());
  while (const auto line = lines.next()) {
    if (trimmed(*line).empty()) continue;
    const auto stamp = oxts_stamp(*line);
    if (!stamp) {
      return fail(ErrorCode::corrupt_data,
                  fmt::format("expected a time as in 2011-09-26 13:04:32.349659964, found {}",
                              quoted(*line)),
                  SourceLocation{file.string(), lines.line(), 0});
    }
    stamps.push_back(*stamp);
  }
  return stamps;
}

/// The files of data/ by their numbers.
Result<std::map<std::uint32_t, fs::path>> oxts_frames(const fs::path& folder) {
  std::map<std::uint32_t, fs::path> frames;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const auto frame = parse_number<std::uint32_t>(entry->path().stem().string());
    if (entry->path().extension() == ".txt" && frame) frames.emplace(*frame, entry->path());
  }
  if (error) {
    return fail(ErrorCode::io_failure, fmt::format("cannot be listed ({})", error.message()),
                SourceLocation{folder.string(), 0, 0});
  }
  return frames;
}

Result<ImuSample> read_oxts_frame(const fs::path& file, double stamp) {
  // dataformat.txt: lat lon alt roll pitch yaw vn ve vf vl vu ax ay az af al au wx wy wz wf wl wu
  // and seven more.
  constexpr std::size_t kForce = 11, kRate = 17, kAll = 30;
  VANTAGE_TRY(const auto content, read_file(file, "a frame of KITTI's oxts"));
  const auto error = [&](std::string message) {
    return fail(ErrorCode::corrupt_data, std::move(message), SourceLocation{file.string(), 1, 0});
  };
  WordReader words(content.view().substr(0, content.view().find('\n')));
  std::array<double, kAll> numbers{};
  for (std::size_t i = 0; i < kAll; ++i) {
    const std::string_view word = words.next();
    const auto number = parse_number<double>(word);
    if (!number) {
      return error(fmt::format("expected a number in column {} of {}, found {}", i + 1, kAll,
                               word.empty() ? "the end of the line" : quoted(word)));
    }
    numbers[i] = *number;
  }
  return sample_of({stamp, numbers[kRate], numbers[kRate + 1], numbers[kRate + 2], numbers[kForce],
                    numbers[kForce + 1], numbers[kForce + 2]});
}

fs::path stamps_in(const fs::path& folder) { return folder / "timestamps.txt"; }

}  // namespace

bool looks_like_imu_csv(std::string_view head) noexcept {
  LineReader lines(head);
  while (const auto line = lines.next()) {
    if (trimmed(*line).empty()) continue;
    return layout_of(*line).has_value();
  }
  return false;
}

Result<RawImu> parse_imu_csv(std::string_view content, const std::string& file) {
  LineReader lines(content);
  const auto error = [&](std::string message) {
    return fail(ErrorCode::corrupt_data, std::move(message), SourceLocation{file, lines.line(), 0});
  };
  RawImu found;
  std::optional<CsvLayout> layout;
  while (const auto line = lines.next()) {
    if (trimmed(*line).empty() || (layout && is_blank_or_comment(*line))) continue;
    if (!layout) {
      auto named = layout_of(*line);
      if (!named) return error(std::move(named).error());
      layout = *named;
      continue;
    }
    const auto row = row_in(*line, *layout);
    if (!row) return error(row.error());
    found.samples.push_back(sample_of(*row));
  }
  if (!layout) return error(fmt::format("no line, expected {}", kBothHeaders));
  found.stamp_rule = fmt::format("stamps are in column {}", layout->places[0] + 1);
  return found;
}

bool looks_like_oxts(const fs::path& folder) noexcept {
  std::error_code ignored;
  return fs::is_directory(folder / "data", ignored) &&
         (fs::exists(stamps_in(folder), ignored) || fs::exists(folder / "dataformat.txt", ignored));
}

Result<RawImu> read_oxts(const fs::path& folder, std::optional<double> frame_rate_hz) {
  if (frame_rate_hz && (!(*frame_rate_hz > 0.0) || !std::isfinite(*frame_rate_hz))) {
    return fail(ErrorCode::invalid_input,
                fmt::format("the rate is {} Hz, expected a number above 0", *frame_rate_hz),
                SourceLocation{folder.string(), 0, 0});
  }
  std::vector<double> stamps;
  if (!frame_rate_hz) {
    VANTAGE_TRY(stamps, read_oxts_stamps(stamps_in(folder)));
  }
  VANTAGE_TRY(const auto frames, oxts_frames(folder / "data"));
  RawImu found;
  found.stamp_rule = frame_rate_hz ? fmt::format("stamps are frame numbers / {} Hz", *frame_rate_hz)
                                   : "stamps are those of timestamps.txt, as if they were in UTC";
  for (const auto& [frame, file] : frames) {
    if (!frame_rate_hz && frame >= stamps.size()) {
      return fail(ErrorCode::corrupt_data,
                  fmt::format("there are {} stamps, expected one for the frame {}", stamps.size(),
                              file.filename().string()),
                  SourceLocation{stamps_in(folder).string(), 0, 0});
    }
    const double stamp = frame_rate_hz ? frame / *frame_rate_hz : stamps[frame];
    VANTAGE_TRY(auto sample, read_oxts_frame(file, stamp));
    found.samples.push_back(sample);
  }
  return found;
}

}  // namespace vantage::io
