#include "vantage/kit/numbers.hpp"

#include <doctest/doctest.h>

#include <cstdlib>
#include <limits>

namespace vantage {
namespace {

TEST_CASE("the shortest text of a number reads back as the same bits") {
  CHECK(shortest(0.1) == "0.1");
  CHECK(shortest(-3.0) == "-3");
  for (const double x : {1.0 / 3.0, 1e300, -5e-324, std::numeric_limits<double>::max()}) {
    CHECK(std::strtod(shortest(x).c_str(), nullptr) == x);
  }
}

TEST_CASE("numbered names have three digits or as many as the last one needs") {
  CHECK(zero_padded(7, 3) == "007");
  CHECK(zero_padded(1234, 3) == "1234");
  CHECK(numbered("group_", 0).empty());
  CHECK(numbered("group_", 2) == std::vector<std::string>{"group_000", "group_001"});
  CHECK(numbered("s", 1000).back() == "s999");
  const std::vector<std::string> many = numbered("s", 1001);
  CHECK(many.front() == "s0000");
  CHECK(many.back() == "s1000");
}

}  // namespace
}  // namespace vantage
