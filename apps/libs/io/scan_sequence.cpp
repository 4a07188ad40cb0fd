#include "io/scan_sequence.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <system_error>
#include <utility>

#include "io/formats.hpp"
#include "io/made_scan.hpp"
#include "io/scan_names.hpp"
#include "io/text.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/kit/file_content.hpp"

namespace vantage::io {
namespace {

namespace fs = std::filesystem;

bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }

bool is_scan(const fs::path& path) {
  return !path.filename().string().starts_with('.') && has_extension_of(kScan, path);
}

Result<std::vector<fs::path>> scans_in(const fs::path& directory) {
  const SourceLocation where{directory.string(), 0, 0};
  std::vector<fs::path> files;
  std::error_code error;
  fs::directory_iterator entry(directory, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    std::error_code unreadable;
    if (!is_scan(entry->path()) || entry->is_directory(unreadable)) continue;
    files.push_back(entry->path());  // also a link that leads nowhere: reading it says so
  }
  if (error) {
    return fail(ErrorCode::io_failure,
                fmt::format("the directory cannot be listed ({})", error.message()), where);
  }
  if (files.empty()) {
    return fail(ErrorCode::not_found,
                fmt::format("the directory holds no {} file", extension_list(kScan)), where);
  }
  sort_scans(files);
  return files;
}

std::optional<fs::path> times_file(const fs::path& directory) {
  // Lexically, so that the parent of a link is the folder that contains the link.
  std::error_code ignored;
  fs::path folder = fs::absolute(directory, ignored).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();
  for (const fs::path& candidate : {directory / "times.txt", folder.parent_path() / "times.txt"}) {
    if (fs::exists(candidate, ignored)) return candidate;
  }
  return std::nullopt;
}

Result<ScanStamps> read_times(const fs::path& path, std::size_t scans) {
  VANTAGE_TRY(const auto content, read_file(path, "one stamp [s] a line"));
  ScanStamps stamps;
  LineReader lines(content.view());
  const auto error = [&](std::uint32_t line, std::string message) {
    return fail(ErrorCode::corrupt_data, std::move(message),
                SourceLocation{path.string(), line, 0});
  };
  while (const auto line = lines.next()) {
    if (is_blank_or_comment(*line)) continue;
    WordReader words(*line);
    const auto stamp = parse_number<double>(words.next());
    if (!stamp || !std::isfinite(*stamp) || !words.next().empty()) {
      return error(lines.line(), fmt::format("expected one stamp [s], found {}", quoted(*line)));
    }
    if (auto problem = problem_of_stamp(*stamp)) return error(lines.line(), *std::move(problem));
    if (!stamps.values.empty() && *stamp <= stamps.values.back()) {
      return error(lines.line(), fmt::format("stamp {} s does not follow {} s, expected strictly "
                                             "increasing stamps",
                                             *stamp, stamps.values.back()));
    }
    stamps.values.push_back(*stamp);
  }
  if (stamps.values.size() != scans) {
    return error(lines.line(), fmt::format("{} stamps for {} scans, expected one for each",
                                           stamps.values.size(), scans));
  }
  stamps.rule = fmt::format("stamps are the lines of {}", path.string());
  return stamps;
}

}  // namespace

bool less_by_natural_order(std::string_view a, std::string_view b) noexcept {
  const auto digits_at = [](std::string_view text, std::size_t from) {
    std::size_t end = from;
    while (end < text.size() && is_digit(text[end])) ++end;
    return text.substr(from, end - from);
  };
  const auto value = [](std::string_view digits) {
    digits.remove_prefix(std::min(digits.find_first_not_of('0'), digits.size()));
    return digits;
  };
  std::size_t i = 0;
  std::size_t k = 0;
  while (i < a.size() && k < b.size()) {
    if (is_digit(a[i]) && is_digit(b[k])) {
      const std::string_view run_a = digits_at(a, i);
      const std::string_view run_b = digits_at(b, k);
      const std::string_view value_a = value(run_a);
      const std::string_view value_b = value(run_b);
      if (value_a.size() != value_b.size()) return value_a.size() < value_b.size();
      if (value_a != value_b) return value_a < value_b;
      i += run_a.size();
      k += run_b.size();
      continue;
    }
    if (a[i] != b[k]) return static_cast<unsigned char>(a[i]) < static_cast<unsigned char>(b[k]);
    ++i;
    ++k;
  }
  if (a.size() - i != b.size() - k) return a.size() - i < b.size() - k;
  // Equal except for leading zeros: the one with fewer zeros comes first.
  return a.size() != b.size() ? a.size() < b.size() : a < b;
}

Result<ScanSequence> ScanSequence::open(const fs::path& path, double rate_hz,
                                        std::optional<StampedPoint> stamped) {
  const SourceLocation where{path.string(), 0, 0};
  if (!(rate_hz > 0.0) || !std::isfinite(rate_hz)) {
    return fail(ErrorCode::invalid_input,
                fmt::format("the scan rate is {} Hz, expected a number above 0", rate_hz), where);
  }
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) {
    return fail(ErrorCode::not_found, "no such file or directory, expected scans", where);
  }
  if (error) {
    return fail(ErrorCode::io_failure, fmt::format("cannot be examined ({})", error.message()),
                where);
  }

  ScanSequence sequence;
  sequence.stamped_ = stamped;
  std::vector<fs::path> files{path};
  std::optional<fs::path> times;
  sequence.folder_ = path.parent_path();
  if (fs::is_directory(status)) {
    VANTAGE_TRY(files, scans_in(path));
    times = times_file(path);
    sequence.folder_ = path;
  }
  sequence.names_.reserve(files.size());
  for (const fs::path& file : files) sequence.names_.push_back(file.filename().string());
  VANTAGE_TRY(auto stamps,
              times ? read_times(*times, files.size()) : stamps_from_names(files, rate_hz));
  sequence.stamps_ = std::move(stamps.values);
  sequence.stamp_rule_ = std::move(stamps.rule);
  return sequence;
}

Result<StampedScan> ScanSequence::read(std::size_t i) const {
  if (i >= size()) {
    return fail(ErrorCode::invalid_input,
                fmt::format("scan {} of a sequence of {} scans", i, size()));
  }
  const fs::path path = file(i);
  VANTAGE_TRY(auto cloud, read_point_cloud(path, ReadTimes::yes));
  return made_scan(std::move(cloud), stamps_[i], {.path = {}, .topic = {}, .stamped = stamped_},
                   path.string());
}

}  // namespace vantage::io
