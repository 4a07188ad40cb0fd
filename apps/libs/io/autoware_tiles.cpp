#include "io/autoware_tiles.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "io/text.hpp"
#include "io/yaml_events.hpp"

namespace vantage::io {
namespace {

class MetadataReader {
 public:
  MetadataReader(std::string_view yaml, const std::string& file) : events_(yaml, file) {}

  [[nodiscard]] Result<AutowareTiles> read() {
    constexpr std::string_view kDocument = "a mapping of file names to corners";
    VANTAGE_CHECK(events_.next(YAML_STREAM_START_EVENT, kDocument));
    VANTAGE_CHECK(events_.next(YAML_DOCUMENT_START_EVENT, kDocument));
    VANTAGE_TRY(const YamlEvent start, events_.next(YAML_MAPPING_START_EVENT, kDocument));
    while (true) {
      VANTAGE_TRY(const YamlEvent key, events_.next());
      if (key.type == YAML_MAPPING_END_EVENT) break;
      if (key.type != YAML_SCALAR_EVENT) {
        return events_.error(key.line,
                             fmt::format("expected the name of a file, found {}", described(key)));
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
  [[nodiscard]] Result<void> read_entry(const YamlEvent& key) {
    if (!names_.insert(key.text).second) {
      return events_.error(key.line,
                           fmt::format("{} occurs twice", quoted(std::string_view(key.text))));
    }
    if (key.text == "x_resolution") return read_resolution(key, x_resolution_);
    if (key.text == "y_resolution") return read_resolution(key, y_resolution_);
    if (key.text.empty() || key.text == "." || key.text == ".." ||
        key.text.find_first_of(std::string_view("/\0", 2)) != std::string::npos) {
      return events_.error(key.line, fmt::format("expected the name of a file in the folder of "
                                                 "tiles, found {}",
                                                 quoted(std::string_view(key.text))));
    }
    return read_tile(key);
  }

  [[nodiscard]] Result<void> read_resolution(const YamlEvent& key,
                                             std::optional<double>& resolution) {
    VANTAGE_TRY(const YamlEvent value, events_.next(YAML_SCALAR_EVENT, "a length in metres"));
    const auto number = parse_number<double>(value.text);
    if (!number || !std::isfinite(*number) || *number <= 0.0) {
      return events_.error(value.line, fmt::format("{} must be a positive length in metres, found "
                                                   "{}",
                                                   key.text, quoted(std::string_view(value.text))));
    }
    resolution = *number;
    return {};
  }

  [[nodiscard]] Result<void> read_tile(const YamlEvent& key) {
    const std::string expected = fmt::format("the corner of {}, two whole numbers [x, y]",
                                             quoted(std::string_view(key.text)));
    VANTAGE_CHECK(events_.next(YAML_SEQUENCE_START_EVENT, expected));
    AutowareTile tile{.file = key.text};
    for (std::int64_t* coordinate : {&tile.x, &tile.y}) {
      VANTAGE_TRY(const YamlEvent value, events_.next(YAML_SCALAR_EVENT, expected));
      const auto number = parse_number<std::int64_t>(value.text);
      if (!number) {
        return events_.error(value.line, fmt::format("expected {}, found {}", expected,
                                                     quoted(std::string_view(value.text))));
      }
      *coordinate = *number;
    }
    VANTAGE_CHECK(events_.next(YAML_SEQUENCE_END_EVENT, expected));
    tiles_.tiles.push_back(std::move(tile));
    return {};
  }

  YamlEventReader events_;
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
