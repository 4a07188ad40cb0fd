#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "vantage/api.hpp"

namespace vantage {

/// What kind of thing went wrong. Callers branch on the code; people read the message.
enum class ErrorCode : std::uint8_t {
  invalid_input,        ///< data given to a function breaks its contract
  invalid_config,       ///< a configuration file or command-line override is wrong
  not_found,            ///< a file, plugin, region or key does not exist
  already_exists,       ///< something exists where the write would go, and must not be overwritten
  io_failure,           ///< the operating system refused a read or a write
  corrupt_data,         ///< a file's content contradicts its format
  incompatible_plugin,  ///< a shared library is not a plugin of this build
  too_few_matches,      ///< a scan does not overlap the map enough to be matched
  unsupported,          ///< a plugin does not offer what the caller asked for
  internal,             ///< a defect: an exception or a broken invariant
};

/// A place in a text file. Line and column count from 1; 0 means unknown.
struct SourceLocation {
  std::string file;
  std::uint32_t line = 0;
  std::uint32_t column = 0;

  friend bool operator==(const SourceLocation&, const SourceLocation&) = default;
};

/// An error is a value: what happened, where in which file, and what was being done.
struct Error {
  ErrorCode code = ErrorCode::internal;
  std::string message;
  std::optional<SourceLocation> where;
  std::vector<std::string> context;    ///< innermost first: "reading map.pcd", "building ..."
  std::vector<std::string> keys = {};  ///< the parameters at fault; `parse` turns them into `where`

  /// Adds one more layer of "while ..." to the error.
  [[nodiscard]] VANTAGE_API Error during(std::string activity) &&;
};

/// One line: `file:line:column: error: message (while reading ...; while building ...)`.
VANTAGE_API std::ostream& operator<<(std::ostream&, const SourceLocation&);
VANTAGE_API std::ostream& operator<<(std::ostream&, const Error&);
[[nodiscard]] VANTAGE_API std::string to_string(const Error&);
[[nodiscard]] VANTAGE_API const char* to_string(ErrorCode) noexcept;

}  // namespace vantage
