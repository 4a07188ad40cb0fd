#include "io/autoware_tiles.hpp"

#include <fmt/format.h>
#include <yaml.h>

#include <cmath>
#include <new>
#include <optional>
#include <set>
#include <utility>

#include "io/text.hpp"

namespace vantage::io {
namespace {

/// One event that libyaml reports, with a copy of its text.
struct Event {
  yaml_event_type_t type = YAML_NO_EVENT;
  std::string text;  // of a scalar
  std::uint32_t line = 0;
};

class EventReader {
 public:
  EventReader(std::string_view yaml, const std::string& file) : file_(file) {
    if (yaml_parser_initialize(&parser_) == 0) throw std::bad_alloc();
    yaml_parser_set_input_string(&parser_, reinterpret_cast<const unsigned char*>(yaml.data()),
                                 yaml.size());
  }
  ~EventReader() { yaml_parser_delete(&parser_); }
  EventReader(const EventReader&) = delete;
  EventReader& operator=(const EventReader&) = delete;

  [[nodiscard]] Result<Event> next() {
    yaml_event_t event;
    if (yaml_parser_parse(&parser_, &event) == 0) {
      const auto& mark = parser_.problem_mark;
      return error(static_cast<std::uint32_t>(mark.line + 1),
                   fmt::format("is no YAML: {}",
                               parser_.problem == nullptr ? "out of memory" : parser_.problem));
    }
    Event read{event.type, {}, static_cast<std::uint32_t>(event.start_mark.line + 1)};
    if (event.type == YAML_SCALAR_EVENT) {
      const auto& scalar = event.data.scalar;
      read.text.assign(reinterpret_cast<const char*>(scalar.value), scalar.length);
    }
    yaml_event_delete(&event);
    return read;
  }

  /// Returns the next event, which must be of that type.
  [[nodiscard]] Result<Event> next(yaml_event_type_t type, std::string_view expected) {
    VANTAGE_TRY(Event event, next());
    if (event.type == type) return event;
    return error(event.line, fmt::format("expected {}, found {}", expected, described(event)));
  }

  [[nodiscard]] tl::unexpected<Error> error(std::uint32_t line, std::string message) const {
    return fail(ErrorCode::corrupt_data, std::move(message), SourceLocation{file_, line, 0});
  }

  [[nodiscard]] static std::string described(const Event& event) {
    switch (event.type) {
      case YAML_SCALAR_EVENT: return quoted(event.text);
      case YAML_ALIAS_EVENT: return "an alias";
      case YAML_SEQUENCE_START_EVENT: return "a list";
      case YAML_MAPPING_START_EVENT: return "a mapping";
      case YAML_SEQUENCE_END_EVENT: return "the end of the list";
      case YAML_MAPPING_END_EVENT: return "the end of the mapping";
      default: return "the end of the document";
    }
  }

 private:
  const std::string& file_;
  yaml_parser_t parser_;
};

class MetadataReader {
 public:
  MetadataReader(std::string_view yaml, const std::string& file) : events_(yaml, file) {}

  [[nodiscard]] Result<AutowareTiles> read() {
    constexpr std::string_view kDocument = "a mapping of file names to corners";
    VANTAGE_CHECK(events_.next(YAML_STREAM_START_EVENT, kDocument));
    VANTAGE_CHECK(events_.next(YAML_DOCUMENT_START_EVENT, kDocument));
    VANTAGE_TRY(const Event start, events_.next(YAML_MAPPING_START_EVENT, kDocument));
    while (true) {
      VANTAGE_TRY(const Event key, events_.next());
      if (key.type == YAML_MAPPING_END_EVENT) break;
      if (key.type != YAML_SCALAR_EVENT) {
        return events_.error(key.line, fmt::format("expected the name of a file, found {}",
                                                   EventReader::described(key)));
      }
      VANTAGE_CHECK(read_entry(key));
    }
    for (const auto& [name, resolution] :
         {std::pair{"x_resolution", x_resolution_}, std::pair{"y_resolution", y_resolution_}}) {
      if (!resolution) return events_.error(start.line, fmt::format("there is no {}", name));
    }
    tiles_.x_resolution = *x_resolution_;
    tiles_.y_resolution = *y_resolution_;
    VANTAGE_CHECK(events_.next(YAML_DOCUMENT_END_EVENT, "the end of the document"));
    VANTAGE_CHECK(events_.next(YAML_STREAM_END_EVENT, "the end of the only document"));
    return std::move(tiles_);
  }

 private:
  [[nodiscard]] Result<void> read_entry(const Event& key) {
    if (!names_.insert(key.text).second) {
      return events_.error(key.line, fmt::format("{} occurs twice", quoted(key.text)));
    }
    if (key.text == "x_resolution") return read_resolution(key, x_resolution_);
    if (key.text == "y_resolution") return read_resolution(key, y_resolution_);
    if (key.text.empty() || key.text == "." || key.text == ".." ||
        key.text.find_first_of(std::string_view("/\0", 2)) != std::string::npos) {
      return events_.error(key.line, fmt::format("expected the name of a file in the folder of "
                                                 "tiles, found {}",
                                                 quoted(key.text)));
    }
    return read_tile(key);
  }

  [[nodiscard]] Result<void> read_resolution(const Event& key, std::optional<double>& resolution) {
    VANTAGE_TRY(const Event value, events_.next(YAML_SCALAR_EVENT, "a length in metres"));
    const auto number = parse_number<double>(value.text);
    if (!number || !std::isfinite(*number) || *number <= 0.0) {
      return events_.error(value.line, fmt::format("{} must be a positive length in metres, found "
                                                   "{}",
                                                   key.text, quoted(value.text)));
    }
    resolution = *number;
    return {};
  }

  [[nodiscard]] Result<void> read_tile(const Event& key) {
    const std::string expected =
        fmt::format("the corner of {}, two whole numbers [x, y]", quoted(key.text));
    VANTAGE_CHECK(events_.next(YAML_SEQUENCE_START_EVENT, expected));
    AutowareTile tile{.file = key.text};
    for (std::int64_t* coordinate : {&tile.x, &tile.y}) {
      VANTAGE_TRY(const Event value, events_.next(YAML_SCALAR_EVENT, expected));
      const auto number = parse_number<std::int64_t>(value.text);
      if (!number) {
        return events_.error(value.line,
                             fmt::format("expected {}, found {}", expected, quoted(value.text)));
      }
      *coordinate = *number;
    }
    VANTAGE_CHECK(events_.next(YAML_SEQUENCE_END_EVENT, expected));
    tiles_.tiles.push_back(std::move(tile));
    return {};
  }

  EventReader events_;
  AutowareTiles tiles_;
  std::optional<double> x_resolution_, y_resolution_;
  std::set<std::string> names_;
};

/// "20.0": a number that no YAML reader takes for an integer.
std::string resolution_text(double resolution) {
  std::string text = fmt::format("{}", resolution);
  return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
}

}  // namespace

Result<AutowareTiles> parse_autoware_tiles(std::string_view yaml, const std::string& file) {
  return MetadataReader(yaml, file).read();
}

std::string to_yaml(const AutowareTiles& tiles) {
  std::string text =
      fmt::format("x_resolution: {}\ny_resolution: {}\n", resolution_text(tiles.x_resolution),
                  resolution_text(tiles.y_resolution));
  for (const AutowareTile& tile : tiles.tiles) {
    text += fmt::format("{}: [{}, {}]\n", tile.file, tile.x, tile.y);
  }
  return text;
}

}  // namespace vantage::io
