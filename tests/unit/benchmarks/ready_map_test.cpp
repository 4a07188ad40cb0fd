#include "ready_map.hpp"

#include <doctest/doctest.h>

namespace vantage::benchmarks {
namespace {

TEST_CASE("a matcher's parameters are parted by semicolons") {
  const auto option = MatcherOption::from("ndt: resolution = 2.0; neighbours = \"direct1\"");
  CHECK(option.name == "ndt");
  const auto matcher = option.load();
  REQUIRE_MESSAGE(matcher, to_string(matcher.error()));
  CHECK(MatcherOption::from("ndt").params.empty());
}

TEST_CASE("a mistake in a matcher's parameters is an error") {
  for (const char* text : {"ndt: resolution", "ndt: resolutoin = 1.0", "no_such_matcher"}) {
    CAPTURE(text);
    CHECK_FALSE(MatcherOption::from(text).load());
  }
}

TEST_CASE("a bundle of something else than was asked for is refused") {
  MapIndex points, cells, both, nothing;
  points.regions = {{.points = 7}, {}};
  cells.regions = {{.elements = 3}, {}};
  both.regions = {{.points = 7, .elements = 3}};
  nothing.regions = {{}};
  CHECK(check_content(points, StoredContent::points));
  CHECK(check_content(cells, StoredContent::prepared));
  for (const MapIndex& index : {cells, both, nothing}) {
    CHECK_FALSE(check_content(index, StoredContent::points));
  }
  for (const MapIndex& index : {points, both, nothing}) {
    CHECK_FALSE(check_content(index, StoredContent::prepared));
  }
}

}  // namespace
}  // namespace vantage::benchmarks
