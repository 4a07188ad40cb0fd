#include "vantage/kit/checksum.hpp"

#include <doctest/doctest.h>

#include <cstring>

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

TEST_CASE("words are added as a loop over them would, and the rest is given back") {
  const std::string_view text = "0123456789abcdefghi";
  for (std::size_t size = 0; size <= text.size(); ++size) {
    const std::string_view bytes = text.substr(0, size);
    Fnv1a words, halves, loop, half_loop;
    CHECK(words.add_words(bytes) == bytes.substr(size / 8 * 8));
    CHECK(halves.add_words<std::uint32_t>(bytes) == bytes.substr(size / 4 * 4));
    for (std::size_t at = 0; at + 4 <= size; at += 4) {
      std::uint64_t word = 0;
      std::memcpy(&word, bytes.data() + at, 4);
      half_loop.add(word);
      if (at % 8 != 0 || at + 8 > size) continue;
      std::memcpy(&word, bytes.data() + at, 8);
      loop.add(word);
    }
    CHECK(words.value() == loop.value());
    CHECK(halves.value() == half_loop.value());
  }
}

}  // namespace
}  // namespace vantage
