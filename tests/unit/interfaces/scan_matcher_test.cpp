#include "vantage/scan_matcher.hpp"

#include <doctest/doctest.h>

#include "support/fakes.hpp"

using namespace vantage;

TEST_CASE("a matcher that does not store prepared maps says so") {
  const test::TruthMatcher matcher(std::make_shared<test::Truth>());
  const auto target = matcher.prepare({});
  REQUIRE(target);
  const auto excerpt = (*target)->excerpt({});
  REQUIRE_FALSE(excerpt);
  CHECK(excerpt.error().code == ErrorCode::unsupported);
  CHECK(std::string(to_string(excerpt.error().code)) == "unsupported");
  const auto restored = matcher.restore({});
  REQUIRE_FALSE(restored);
  CHECK(restored.error().code == ErrorCode::unsupported);
}

TEST_CASE("a region is empty without points and without elements to match against") {
  CHECK(RegionSummary{}.empty());
  CHECK(RegionSummary{.points = 0, .viewpoints = 5, .elements = 0, .bytes = 500}.empty());
  CHECK_FALSE(RegionSummary{.points = 1, .viewpoints = 0, .elements = 0, .bytes = 0}.empty());
  CHECK_FALSE(RegionSummary{.points = 0, .viewpoints = 0, .elements = 1, .bytes = 0}.empty());
}
