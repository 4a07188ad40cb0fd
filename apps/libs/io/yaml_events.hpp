#pragma once

#include <yaml.h>

#include <cstdint>
#include <string>
#include <string_view>

#include "vantage/result.hpp"

namespace vantage::io {

/// One event that libyaml reports, with a copy of its text.
struct YamlEvent {
  yaml_event_type_t type = YAML_NO_EVENT;
  std::string text;  ///< of a scalar
  std::uint32_t line = 0;
};

/// For messages: "'text'", "a list".
[[nodiscard]] std::string described(const YamlEvent& event);

/// The events of a YAML text. The text and `file`, its name in errors, must outlive the reader.
class YamlEventReader {
 public:
  YamlEventReader(std::string_view yaml, const std::string& file);
  ~YamlEventReader();
  YamlEventReader(const YamlEventReader&) = delete;
  YamlEventReader& operator=(const YamlEventReader&) = delete;

  /// Errors: `corrupt_data` for text that is no YAML.
  [[nodiscard]] Result<YamlEvent> next();
  /// The next event, which must be of that type. @param expected  for the message
  [[nodiscard]] Result<YamlEvent> next(yaml_event_type_t type, std::string_view expected);
  /// Reads on to the end of the value that this event begins.
  [[nodiscard]] Result<void> skip(const YamlEvent& begin);

  [[nodiscard]] tl::unexpected<Error> error(std::uint32_t line, std::string message) const;

 private:
  const std::string& file_;
  yaml_parser_t parser_;
};

}  // namespace vantage::io
