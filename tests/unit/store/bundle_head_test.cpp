#include "common/bundle_head.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>

#include "format.hpp"
#include "store_samples.hpp"

namespace vantage::bundle_folder {
namespace {

using pcd_tiles::kFormat;
using store_samples::check_fails, store_samples::kInfinity, store_samples::replaced;

constexpr auto kLargest = std::numeric_limits<std::uint64_t>::max();

/// Numbers that no short decimal hits, and a text with everything that JSON escapes.
BundleHead sample() {
  return {.map_points = kLargest,
          .map_bounds = {Point(-1.0 / 3.0, 0.1, -0.0), Point(1e6, 5e6 + 0.1, kInfinity)},
          .config = "schema = 1\n# \"quoted\" \\ text, {[ä]}, \t tab, \x01\n",
          .regions = {.count = 25, .bytes = 16384, .checksum = 0x0123'4567'89ab'cdefU}};
}

void check_equal(const BundleHead& a, const BundleHead& b) {
  CHECK(a.map_points == b.map_points);
  CHECK(a.map_bounds.min == b.map_bounds.min);
  CHECK(std::signbit(a.map_bounds.min.z()) == std::signbit(b.map_bounds.min.z()));
  CHECK(a.map_bounds.max == b.map_bounds.max);
  CHECK(a.config == b.config);
  CHECK(a.regions == b.regions);
}

TEST_CASE("index.json comes back bit for bit, in any layout and spelling") {
  const BundleHead head = sample();
  const std::string text = to_json(kFormat, head).value();
  CHECK(text == to_json(kFormat, head).value());
  std::string one_line;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"' && text[i - 1] != '\\') in_string = !in_string;
    if (in_string || (text[i] != '\n' && text[i] != ' ')) one_line += text[i];
  }
  REQUIRE(one_line.size() < text.size());
  for (const std::string& other :
       {text, one_line, replaced(text, "1000000.0", "1e6"), replaced(text, "\\t", "\\u0009")}) {
    const auto read = from_json(kFormat, other, "index.json");
    REQUIRE_MESSAGE(read, to_string(read.error()));
    check_equal(*read, head);
    CHECK(read->generation == from_json(kFormat, text, "index.json")->generation);
  }
  BundleHead rebuilt = head;
  rebuilt.regions.checksum ^= 1U;
  CHECK(from_json(kFormat, to_json(kFormat, rebuilt).value(), "index.json")->generation !=
        from_json(kFormat, text, "index.json")->generation);
}

TEST_CASE("index.json: no damage is read, every byte but white space counts") {
  const BundleHead head = sample();
  const std::string text = to_json(kFormat, head).value();
  std::mt19937 random(4);
  int refused = 0;
  for (std::size_t at = 0; at < text.size(); ++at) {
    std::string bad = text;
    bad[at] = "\"{}[]:,09a-. \n\\\xff"[random() % 16];
    const auto read = from_json(kFormat, bad, "index.json");
    if (read) check_equal(*read, head);  // white space for white space
    refused += read ? 0 : 1;
    if (at + 1 < text.size()) {  // without its last line feed it is whole
      CHECK_FALSE(from_json(kFormat, std::string_view(text).substr(0, at), "index.json"));
    }
  }
  CHECK(refused > 100);
}

TEST_CASE("index.json: what cannot be read again is not written") {
  BundleHead head = sample();
  head.map_bounds.max.y() = std::nan("");
  check_fails(to_json(kFormat, head), ErrorCode::invalid_input, "NaN");
  head = sample();
  head.config = "name = '\xff\xfe'";
  check_fails(to_json(kFormat, head), ErrorCode::invalid_input, "UTF-8");
  head.config = std::string(kMostHeadBytes, '#');
  check_fails(to_json(kFormat, head), ErrorCode::invalid_input,
              "the configuration text has 4194304 bytes");
  head.config.resize(kMostHeadBytes - 2000);
  REQUIRE(to_json(kFormat, head));
  head.config.assign(kMostHeadBytes / 2 + 1, '"');  // two bytes each
  check_fails(to_json(kFormat, head), ErrorCode::invalid_input, "that are read");
}

}  // namespace
}  // namespace vantage::bundle_folder
