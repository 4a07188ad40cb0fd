#include "terminal/option_values.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "terminal/command_line.hpp"

namespace vantage::cli {
namespace {

namespace fs = std::filesystem;

// Options that name a file to write, or the folder of a run.
constexpr std::array<std::string_view, 5> kOutputs{"--out", "--html", "--mcap", "--png",
                                                   "--record"};

struct Given {
  std::string option, value;
  bool is_output, is_number;
};

/// All values that were given, to the program or to its subcommands.
std::vector<Given> given_to(const CLI::App& app) {
  std::vector<Given> all;
  for (const CLI::Option* option : app.get_options()) {
    const std::string name = option->get_name();
    const bool is_output = std::ranges::find(kOutputs, name) != kOutputs.end();
    const bool is_number = option->get_type_name().find("FLOAT") != std::string::npos;
    for (const std::string& value : option->results()) {
      all.push_back({name, value, is_output, is_number});
    }
  }
  for (const CLI::App* job : app.get_subcommands()) {
    const auto more = given_to(*job);
    all.insert(all.end(), more.begin(), more.end());
  }
  return all;
}

/// The same for all paths of one file, whether it exists or not.
fs::path place_of(const fs::path& path) {
  std::error_code ignored;
  const fs::path place = fs::weakly_canonical(path, ignored);
  return ignored ? path.lexically_normal() : place;
}

bool is_folder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

bool is_file(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored) && !is_folder(path);
}

/// A file, or those of a run in a folder.
std::vector<fs::path> files_at(const fs::path& path) {
  if (!is_folder(path)) return {place_of(path)};
  std::vector<fs::path> files;
  for (const std::string_view name : kFilesOfARun) files.push_back(place_of(path / name));
  return files;
}

bool writes(const Given& output, const fs::path& file) {
  // As far as its value says.
  return !is_folder(file) && std::ranges::count(files_at(output.value), place_of(file)) > 0;
}

std::optional<double> number_of(const std::string& text) {
  char* end = nullptr;
  const double x = std::strtod(text.c_str(), &end);
  return text.empty() || *end != '\0' ? std::nullopt : std::optional(x);
}

CLI::Validator number_that(bool (*fits)(double), const char* expected) {
  return {[fits, expected](const std::string& text) {
            const auto x = number_of(text);
            return x && std::isfinite(*x) && fits(*x)
                       ? std::string()
                       : fmt::format("expected {}, not '{}'", expected, text);
          },
          ""};
}

}  // namespace

Result<void> check_values(const CLI::App& app) {
  const auto all = given_to(app);
  for (const Given& one : all) {
    if (one.value.empty()) {
      return usage_error(fmt::format("{} is given an empty value", one.option));
    }
    if (const auto x = number_of(one.value); one.is_number && x && std::isnan(*x)) {
      return usage_error(fmt::format("{} takes a number, not '{}'", one.option, one.value));
    }
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!all[i].is_output) continue;
    for (std::size_t k = 0; k < all.size(); ++k) {
      // A value that is neither may be a name, not a path.
      const bool counts = all[k].is_output || is_file(all[k].value);
      if (k == i || !counts || !writes(all[i], all[k].value)) continue;
      return usage_error(fmt::format("{} would overwrite {}, which is given to {}", all[i].option,
                                     all[k].value, all[k].option));
    }
  }
  return {};
}

std::vector<fs::path> files_named_in(const Config& config) {
  std::vector<fs::path> named;
  if (config.map) {
    named = config.map->files;
    if (config.map->trajectory) named.push_back(*config.map->trajectory);
  }
  if (config.selector) {
    if (config.selector->scans) named.push_back(*config.selector->scans);
    if (config.selector->poses) named.push_back(*config.selector->poses);
  }
  return named;
}

Result<void> check_outputs(const CLI::App& app, const Config& config) {
  const auto named = files_named_in(config);
  for (const Given& one : given_to(app)) {
    for (const fs::path& input : named) {
      if (!one.is_output || !writes(one, input)) continue;
      return usage_error(fmt::format("{} would overwrite {}, which the configuration names",
                                     one.option, input.string()));
    }
  }
  return {};
}

Result<void> check_outputs(std::string_view option, std::span<const fs::path> written,
                           std::span<const fs::path> read) {
  std::set<fs::path> places;
  for (const fs::path& file : written) places.insert(place_of(file));
  for (const fs::path& input : read) {
    for (const fs::path& file : files_at(input)) {
      if (!places.contains(file)) continue;
      return usage_error(
          fmt::format("{} would overwrite {}, which is read", option, file.string()));
    }
  }
  return {};
}

CLI::Validator positive_number() {
  return number_that([](double x) { return x > 0.0; }, "a number above 0");
}

CLI::Validator non_negative_number() {
  return number_that([](double x) { return x >= 0.0; }, "a number that is not negative");
}

CLI::Validator whole_number(std::uint64_t least, std::uint64_t most) {
  return {[least, most](const std::string& text) {
            std::uint64_t x = 0;
            const char* const end = text.data() + text.size();
            const auto [stop, error] = std::from_chars(text.data(), end, x);
            return error == std::errc{} && stop == end && x >= least && x <= most
                       ? std::string()
                       : fmt::format("expected a whole number from {} to {}, not '{}'", least, most,
                                     text);
          },
          ""};
}

CLI::Validator number_of_name(std::vector<std::pair<std::string, int>> choices) {
  return {[choices = std::move(choices)](std::string& text) {
            const std::string name = CLI::detail::to_lower(text);
            std::string names;
            for (const auto& [known, number] : choices) {
              if (known == name) {
                text = std::to_string(number);
                return std::string();
              }
              names += (names.empty() ? "" : ", ") + known;
            }
            return fmt::format("expected one of {}, not '{}'", names, text);
          },
          ""};
}

}  // namespace vantage::cli
