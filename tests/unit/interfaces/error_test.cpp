#include <doctest/doctest.h>

#include "vantage/result.hpp"

using namespace vantage;

namespace {

Result<int> half(int x) {
  if (x % 2 != 0) return fail(ErrorCode::invalid_input, "odd", SourceLocation{"numbers.txt", 3, 7});
  return x / 2;
}

Result<int> quarter(int x) {
  VANTAGE_TRY(const int once, half(x));
  VANTAGE_TRY(const int twice, half(once));
  return twice;
}

Result<void> check_even(int x) {
  VANTAGE_CHECK(half(x));
  return {};
}

}  // namespace

TEST_CASE("VANTAGE_TRY hands values on and errors up") {
  CHECK(quarter(12).value() == 3);
  CHECK(quarter(6).error().message == "odd");
  CHECK(check_even(2).has_value());
  CHECK_FALSE(check_even(3).has_value());
}

TEST_CASE("an error prints as one line: place, message, innermost context first") {
  Error error = half(1).error();
  CHECK(to_string(error) == "numbers.txt:3:7: error: odd");
  error = std::move(error).during("reading numbers").during("counting");
  CHECK(to_string(error) == "numbers.txt:3:7: error: odd (while reading numbers; while counting)");
  error.where = SourceLocation{"map.pcd", 0, 0};
  error.context.clear();
  CHECK(to_string(error) == "map.pcd: error: odd");
  error.where.reset();
  CHECK(to_string(error) == "error: odd");
}
