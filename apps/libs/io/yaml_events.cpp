#include "io/yaml_events.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <new>
#include <utility>

#include "io/text.hpp"

namespace vantage::io {

std::string described(const YamlEvent& event) {
  switch (event.type) {
    case YAML_SCALAR_EVENT: return quoted(std::string_view(event.text));
    case YAML_ALIAS_EVENT: return "an alias";
    case YAML_SEQUENCE_START_EVENT: return "a list";
    case YAML_MAPPING_START_EVENT: return "a mapping";
    case YAML_SEQUENCE_END_EVENT: return "the end of the list";
    case YAML_MAPPING_END_EVENT: return "the end of the mapping";
    default: return "the end of the document";
  }
}

YamlEventReader::YamlEventReader(std::string_view yaml, const std::string& file) : file_(file) {
  if (yaml_parser_initialize(&parser_) == 0) throw std::bad_alloc();
  yaml_parser_set_input_string(&parser_, reinterpret_cast<const unsigned char*>(yaml.data()),
                               yaml.size());
}

YamlEventReader::~YamlEventReader() { yaml_parser_delete(&parser_); }

Result<YamlEvent> YamlEventReader::next() {
  yaml_event_t event;
  if (yaml_parser_parse(&parser_, &event) == 0) {
    const auto& mark = parser_.problem_mark;
    return error(static_cast<std::uint32_t>(mark.line + 1),
                 fmt::format("is no YAML: {}",
                             parser_.problem == nullptr ? "out of memory" : parser_.problem));
  }
  YamlEvent read{event.type, {}, static_cast<std::uint32_t>(event.start_mark.line + 1)};
  if (event.type == YAML_SCALAR_EVENT) {
    const auto& scalar = event.data.scalar;
    read.text.assign(reinterpret_cast<const char*>(scalar.value), scalar.length);
  }
  yaml_event_delete(&event);
  return read;
}

Result<YamlEvent> YamlEventReader::next(yaml_event_type_t type, std::string_view expected) {
  VANTAGE_TRY(YamlEvent event, next());
  if (event.type == type) return event;
  return error(event.line, fmt::format("expected {}, found {}", expected, described(event)));
}

Result<void> YamlEventReader::skip(const YamlEvent& begin) {
  std::size_t depth = 0;
  const auto count = [&](yaml_event_type_t type) {
    if (type == YAML_MAPPING_START_EVENT || type == YAML_SEQUENCE_START_EVENT) ++depth;
    if (type == YAML_MAPPING_END_EVENT || type == YAML_SEQUENCE_END_EVENT) --depth;
  };
  count(begin.type);
  while (depth > 0) {
    VANTAGE_TRY(const YamlEvent event, next());
    count(event.type);
  }
  return {};
}

tl::unexpected<Error> YamlEventReader::error(std::uint32_t line, std::string message) const {
  return fail(ErrorCode::corrupt_data, std::move(message), SourceLocation{file_, line, 0});
}

}  // namespace vantage::io
