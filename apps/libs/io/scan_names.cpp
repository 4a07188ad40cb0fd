#include "io/scan_names.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>

#include "io/scan_sequence.hpp"
#include "io/text.hpp"

namespace vantage::io {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kNanosecondDigits = 9;  // of a second

bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }

enum class Form { frame, whole_seconds, milliseconds, microseconds, nanoseconds, seconds };

/// A name without its ending: a prefix, digits and, after a dot, more digits.
struct Name {
  std::string prefix, whole, fraction;  // the fraction without the dot; may be empty

  [[nodiscard]] Form form() const noexcept {
    if (!fraction.empty()) return Form::seconds;
    if (whole.size() >= 18) return Form::nanoseconds;
    if (whole.size() >= 16) return Form::microseconds;
    // Frame numbers of so many digits are filled up with zeros, as KITTI's are.
    if (whole.front() == '0') return Form::frame;
    if (whole.size() == 13) return Form::milliseconds;
    return whole.size() == 10 ? Form::whole_seconds : Form::frame;
  }
};

std::string_view described(Form form) noexcept {
  switch (form) {
    case Form::frame: return "a frame number (fewer than 16 digits; 10 or 13 begin with 0)";
    case Form::whole_seconds: return "seconds (10 digits)";
    case Form::milliseconds: return "milliseconds (13 digits)";
    case Form::microseconds: return "microseconds (16 or 17 digits)";
    case Form::nanoseconds: return "nanoseconds (18 digits or more)";
    case Form::seconds: return "seconds (digits, a dot, digits)";
  }
  return "";
}

/// Takes the digits at the end of a text away.
std::string take_digits(std::string& text) {
  std::size_t begin = text.size();
  while (begin > 0 && is_digit(text[begin - 1])) --begin;
  std::string digits = text.substr(begin);
  text.resize(begin);
  return digits;
}

/// Nothing if the name does not end with a number, or with more than one, as version 1.2.3 does.
std::optional<Name> name_of(const fs::path& file) {
  Name name{.prefix = file.stem().string(), .whole = {}, .fraction = {}};
  name.whole = take_digits(name.prefix);
  if (name.whole.empty()) return std::nullopt;
  if (name.prefix.size() < 2 || name.prefix.back() != '.') return name;
  if (!is_digit(name.prefix[name.prefix.size() - 2])) return name;
  name.prefix.pop_back();
  name.fraction = std::exchange(name.whole, take_digits(name.prefix));
  return name.prefix.ends_with('.') ? std::nullopt : std::optional(std::move(name));
}

/// Nothing unless all are numbers after an equal prefix.
std::optional<std::vector<Name>> names_of(const std::vector<fs::path>& files) {
  std::vector<Name> names;
  for (const fs::path& file : files) {
    auto name = name_of(file);
    if (!name || (!names.empty() && name->prefix != names.front().prefix)) return std::nullopt;
    names.push_back(std::move(*name));
  }
  return names;
}

/// Whether the digits after the dots are whole nanoseconds. ROS 2 writes them without leading
/// zeros. A program that writes decimal fractions leaves out zeros at the end instead.
bool fractions_are_nanoseconds(const std::vector<Name>& names) {
  std::size_t most = 0;
  bool padded = false;
  for (const Name& name : names) {
    const std::size_t digits = name.fraction.size();
    most = std::max(most, digits);
    padded |= digits > 1 && digits < kNanosecondDigits && name.fraction.front() == '0';
  }
  return most == kNanosecondDigits && !padded;
}

/// Decimal notation is read as a whole, so that the result is rounded only once.
double seconds_from(const std::string& whole, const std::string& fraction) {
  return parse_number<double>(whole + "." + fraction).value_or(0.0);
}

double seconds_of(const Name& name, bool nanoseconds) {
  const std::size_t digits = name.fraction.size();
  const std::size_t zeros =
      nanoseconds && digits < kNanosecondDigits ? kNanosecondDigits - digits : 0;
  return seconds_from(name.whole, std::string(zeros, '0') + name.fraction);
}

/// Of a whole number of units, of which a second has 10^digits.
double seconds_of(const Name& name, std::size_t digits) {
  const std::size_t seconds = name.whole.size() - digits;
  return seconds_from(name.whole.substr(0, seconds), name.whole.substr(seconds));
}

double stamp_of(const Name& name, bool nanoseconds, double rate_hz) {
  switch (name.form()) {
    case Form::frame:
      return static_cast<double>(parse_number<std::uint64_t>(name.whole).value_or(0)) / rate_hz;
    case Form::whole_seconds: return seconds_from(name.whole, "0");
    case Form::milliseconds: return seconds_of(name, std::size_t{3});
    case Form::microseconds: return seconds_of(name, std::size_t{6});
    case Form::nanoseconds: return seconds_of(name, kNanosecondDigits);
    case Form::seconds: return seconds_of(name, nanoseconds);
  }
  return 0.0;
}

std::string rule_of(Form form, bool nanoseconds, double rate_hz) {
  switch (form) {
    case Form::frame:
      return fmt::format("file names are frame numbers, so stamps are frame / {} Hz", rate_hz);
    case Form::whole_seconds:
      return "file names are numbers of 10 digits, so stamps are those numbers in seconds";
    case Form::milliseconds:
      return "file names are numbers of 13 digits, so stamps are those numbers in milliseconds";
    case Form::microseconds:
      return "file names are numbers of 16 or 17 digits, so stamps are those numbers in "
             "microseconds";
    case Form::nanoseconds:
      return "file names are numbers of 18 digits or more, so stamps are those numbers in "
             "nanoseconds";
    case Form::seconds:
      return nanoseconds ? "file names are stamps: seconds, a dot, nanoseconds"
                         : "file names are stamps: seconds with a decimal fraction";
  }
  return "";
}

ScanStamps stamps_by_position(std::size_t scans, double rate_hz) {
  ScanStamps stamps;
  for (std::size_t i = 0; i < scans; ++i) {
    stamps.values.push_back(static_cast<double>(i) / rate_hz);
  }
  stamps.rule = fmt::format(
      "file names are not all numbers, so stamps are the position in name order / {} Hz", rate_hz);
  return stamps;
}

/// After a prefix with digits, such as a date, what follows may be a time of day. Frames after a
/// prefix may be counted from 0 or 1.
bool may_be_stamps(const std::vector<Name>& names) {
  const std::string& prefix = names.front().prefix;
  const auto is_frame = [](const Name& name) { return name.form() == Form::frame; };
  return prefix.empty() || (std::none_of(prefix.begin(), prefix.end(), is_digit) &&
                            !std::all_of(names.begin(), names.end(), is_frame));
}

}  // namespace

void sort_scans(std::vector<fs::path>& files) {
  const auto names = names_of(files);
  const bool nanoseconds = names && fractions_are_nanoseconds(*names);
  const bool decimal = names && std::any_of(names->begin(), names->end(), [](const Name& name) {
                         return !name.fraction.empty();
                       });
  struct Sorted {
    double number;
    std::string name;
    fs::path file;
  };
  std::vector<Sorted> all;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const double number = decimal ? seconds_of((*names)[i], nanoseconds) : 0.0;
    all.push_back({number, files[i].filename().string(), std::move(files[i])});
  }
  std::sort(all.begin(), all.end(), [](const Sorted& a, const Sorted& b) {
    return a.number != b.number ? a.number < b.number : less_by_natural_order(a.name, b.name);
  });
  for (std::size_t i = 0; i < files.size(); ++i) files[i] = std::move(all[i].file);
}

Result<ScanStamps> stamps_from_names(const std::vector<fs::path>& files, double rate_hz) {
  const auto names = names_of(files);
  if (!names || names->empty() || !may_be_stamps(*names)) {
    return stamps_by_position(files.size(), rate_hz);
  }
  const Form form = names->front().form();
  const bool nanoseconds = fractions_are_nanoseconds(*names);
  ScanStamps stamps;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const Name& name = (*names)[i];
    const auto error = [&](std::string message) {
      return fail(ErrorCode::corrupt_data, std::move(message),
                  SourceLocation{files[i].string(), 0, 0});
    };
    if (name.form() != form) {
      return error(fmt::format(
          "its name is {} and that of {} is {}; expected one of these for all scans, or a "
          "times.txt",
          described(name.form()), files.front().filename().string(), described(form)));
    }
    if (!parse_number<std::uint64_t>(name.whole)) {
      return error("the number in the name does not fit 64 bits");
    }
    const double stamp = stamp_of(name, nanoseconds, rate_hz);
    if (!stamps.values.empty() && stamp <= stamps.values.back()) {
      return error(
          fmt::format("its stamp {} s does not follow the {} s of the scan before, "
                      "expected strictly increasing stamps",
                      stamp, stamps.values.back()));
    }
    stamps.values.push_back(stamp);
  }
  stamps.rule = rule_of(form, nanoseconds, rate_hz);
  return stamps;
}

}  // namespace vantage::io
