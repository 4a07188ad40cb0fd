#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace vantage::cli {

/// The first argument by which a shell asks a program what can follow it.
inline constexpr const char* kCompletionQuery = "__complete";

/// What can follow a program on the command line, for the scripts of `vantage completion`. One line
/// each, six fields with tabs between them, none of them empty:
/// - the subcommand it belongs to, or "." for the program itself
/// - "command", "option" (takes a value), "flag" or "argument"
/// - its names, with commas between them
/// - its value: "none"; "file", "dir", "plugin" (a name); "word" for what cannot be guessed; or
///   "{a,b}", the choices. It follows from the type name of the option: DIR, PLUGIN, {a,b} (also of
///   CLI::IsMember), FILE, TEXT and PATH for files, all others for words.
/// - "many" if it takes several, else "one"
/// - its help
[[nodiscard]] std::string completion_table(const CLI::App& app);

}  // namespace vantage::cli
