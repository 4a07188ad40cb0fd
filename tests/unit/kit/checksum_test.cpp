#include "vantage/kit/checksum.hpp"

#include <doctest/doctest.h>

namespace vantage {
namespace {

std::uint64_t sum_of(std::string_view bytes) {
  Fnv1a sum;
  sum.add(bytes);
  return sum.value();
}

TEST_CASE("FNV-1a has the values that its authors published") {
  CHECK(sum_of("") == 0xcbf29ce484222325U);
  CHECK(sum_of("a") == 0xaf63dc4c8601ec8cU);
  CHECK(sum_of("foobar") == 0x85944171f73967e8U);
}

TEST_CASE("a checksum of parts is that of the whole, and a byte above 127 is not negative") {
  Fnv1a parts;
  parts.add("foo");
  parts.add(std::string_view("bar"));
  CHECK(parts.value() == sum_of("foobar"));
  Fnv1a byte;
  byte.add(std::uint64_t{0xff});
  CHECK(byte.value() == sum_of("\xff"));
}

}  // namespace
}  // namespace vantage
