#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "vantage/engine/config.hpp"
#include "vantage/result.hpp"

namespace vantage::cli {

/// The files of a run in its folder.
inline constexpr std::array<std::string_view, 3> kFilesOfARun{"scans.csv", "trajectory.tum",
                                                              "summary.json"};

/// Checks what was given to the options and the positional arguments of a program, after parsing:
/// - No value is empty: that is what an unset variable of a shell gives.
/// - No number is NaN.
/// - A file that is written is no file that is given to another option.
/// Errors: a usage error.
[[nodiscard]] Result<void> check_values(const CLI::App& app);

/// The files and folders that [map] and [selector] name.
[[nodiscard]] std::vector<std::filesystem::path> files_named_in(const Config& config);

/// Checks that no output is one of the files that the configuration names.
/// Errors: a usage error.
[[nodiscard]] Result<void> check_outputs(const CLI::App& app, const Config& config);

/// The same for files that a program finds out itself.
/// @param option   that says where to write
/// @param written  what is written there
/// @param read     files, or the folders of runs
[[nodiscard]] Result<void> check_outputs(std::string_view option,
                                         std::span<const std::filesystem::path> written,
                                         std::span<const std::filesystem::path> read);

/// Checks of an option: a number above 0, at least 0, or whole and in [least, most].
[[nodiscard]] CLI::Validator positive_number();
[[nodiscard]] CLI::Validator non_negative_number();
[[nodiscard]] CLI::Validator whole_number(std::uint64_t least, std::uint64_t most);

/// Replaces the name of a value by its number.
/// @param choices  names and numbers
[[nodiscard]] CLI::Validator number_of_name(std::vector<std::pair<std::string, int>> choices);

/// The transformation of an option that takes one of these names, in any case.
template <class Enum>
[[nodiscard]] CLI::Validator one_of(const std::vector<std::pair<std::string, Enum>>& choices) {
  std::vector<std::pair<std::string, int>> numbers;
  for (const auto& [name, value] : choices) numbers.emplace_back(name, static_cast<int>(value));
  return number_of_name(std::move(numbers));
}

}  // namespace vantage::cli
