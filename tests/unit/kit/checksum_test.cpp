#include "vantage/kit/checksum.hpp"

#include <doctest/doctest.h>

#include <string>
#include <string_view>
#include <utility>

namespace vantage {
namespace {

TEST_CASE("a checksum is XXH64: the values that `xxhsum -H1` prints") {
  CHECK(checksum_of(std::string_view()) == 0xef46db3751d8e999U);
  CHECK(checksum_of(std::string_view("a")) == 0xd24ec4f1a98c6e5bU);
  CHECK(checksum_of(std::string_view("abc")) == 0x44bc2cf5ad770999U);
  CHECK(Checksum().value() == 0xef46db3751d8e999U);
}

TEST_CASE("a checksum of pieces is that of the whole, wherever it is cut") {
  std::string text;
  for (int k = 0; k < 100; ++k) text.push_back(static_cast<char>(7 * k));
  const std::string_view whole = text;
  for (std::size_t cut = 0; cut <= whole.size(); ++cut) {
    Checksum pieces;
    pieces.add(whole.substr(0, cut));
    const Checksum copied = pieces;
    pieces.add(whole.substr(cut));
    CHECK(pieces.value() == checksum_of(whole));
    CHECK(copied.value() == checksum_of(whole.substr(0, cut)));
  }
}

TEST_CASE("a number is added as its eight bytes, the lowest first") {
  Checksum number;
  number.add(std::uint64_t{0x8070605040302010});
  CHECK(number.value() == checksum_of(std::string_view("\x10\x20\x30\x40\x50\x60\x70\x80")));
}

TEST_CASE("every changed byte of a text changes its checksum, and so does a change of two") {
  std::string text = "regions of a city, one after another, in pages with checksums";
  const std::uint64_t good = checksum_of(std::string_view(text));
  for (char& byte : text) {
    for (int bit = 0; bit < 8; ++bit) {
      byte = static_cast<char>(byte ^ (1 << bit));
      CHECK(checksum_of(std::string_view(text)) != good);
      byte = static_cast<char>(byte ^ (1 << bit));
    }
  }
  std::swap(text[3], text[11]);
  CHECK(checksum_of(std::string_view(text)) != good);
}

}  // namespace
}  // namespace vantage
