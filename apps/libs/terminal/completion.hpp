#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace vantage::cli {

/// The first argument with which a shell asks a program what can follow on its command line.
inline constexpr const char* kCompletionQuery = "__complete";

/// What can follow a program on the command line, for the scripts of `vantage completion`. There is
/// one line for each, with six fields separated by tabs, none of them empty:
/// - the subcommand it belongs to, or "." for the program itself
/// - "command", "option" (takes a value), "flag" or "argument"
/// - its names, separated by commas
/// - its value: "none"; "file", "dir", "plugin" (a name); "word" for a value that cannot be
///   guessed; or "{a,b}", the choices. It follows from the type name of the option: DIR, PLUGIN,
///   {a,b} (also of CLI::IsMember), FILE, TEXT and PATH for files; all others are words.
/// - "many" if it takes several values, otherwise "one"
/// - its help
[[nodiscard]] std::string completion_table(const CLI::App& app);

}  // namespace vantage::cli
