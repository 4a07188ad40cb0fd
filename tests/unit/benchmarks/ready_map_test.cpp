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

TEST_CASE("a matcher's parameters go into a configuration as they were given") {
  const auto overrides = MatcherOption::from("ndt: resolution = 2.0; min_points = 7").overrides();
  CHECK(overrides ==
        std::vector<std::string>{"matcher.plugin=ndt",
                                 "matcher.params={ resolution = 2.0, min_points = 7}"});
}

}  // namespace
}  // namespace vantage::benchmarks
