#include "vantage/kit/bit_coder.hpp"

#include <doctest/doctest.h>

#include <array>
#include <random>
#include <span>
#include <utility>
#include <vector>

using namespace vantage;

namespace {

/// One of `one_in` is set.
std::vector<bool> bits(std::size_t count, std::uint32_t one_in) {
  std::mt19937 random(5);
  std::vector<bool> bits(count);
  for (std::size_t i = 0; i < count; ++i) bits[i] = random() % one_in == 0;
  return bits;
}

std::vector<std::byte> coded(const std::vector<bool>& bits) {
  BitEncoder encoder;
  Chance chance;
  for (const bool bit : bits) encoder.code(chance, bit);
  return std::move(encoder).finish();
}

}  // namespace

TEST_CASE("bits come back as they were coded, and the bytes end with the last") {
  for (const std::uint32_t one_in : {1U, 2U, 3U, 50U, 100'000U}) {
    for (const std::size_t count : {0UL, 1UL, 7UL, 20'000UL}) {
      CAPTURE(one_in);
      CAPTURE(count);
      const std::vector<bool> all = bits(count, one_in);
      const auto bytes = coded(all);
      BitDecoder decoder(bytes);
      Chance chance;
      std::size_t wrong = 0;
      for (const bool bit : all) wrong += decoder.code(chance, false) != bit ? 1 : 0;
      CHECK(wrong == 0);
      CHECK(decoder.is_at_end());
    }
  }
}

TEST_CASE("likely bits take little room") {
  CHECK(coded(bits(80'000, 2)).size() < 10'400);  // 10,000 by Shannon
  CHECK(coded(bits(80'000, 50)).size() < 1'700);  // 1,414 by Shannon
  CHECK(coded(bits(80'000, 1)).size() < 20);
}

TEST_CASE("bits beyond the end of the bytes are cut off") {
  const auto bytes = coded(bits(1000, 2));
  for (const std::size_t size : {std::size_t{0}, std::size_t{3}, bytes.size() - 1}) {
    CAPTURE(size);
    BitDecoder decoder(std::span<const std::byte>(bytes).first(size));
    Chance chance;
    for (int i = 0; i < 1000; ++i) decoder.code(chance, false);
    CHECK(decoder.is_cut_off());
    CHECK_FALSE(decoder.is_at_end());
  }
  auto longer = bytes;
  longer.push_back(std::byte{0});
  BitDecoder decoder(longer);
  Chance chance;
  for (int i = 0; i < 1000; ++i) decoder.code(chance, false);
  CHECK_FALSE(decoder.is_at_end());
  CHECK_FALSE(decoder.is_cut_off());
}

TEST_CASE("a chance is never certain") {
  for (const bool bit : {false, true}) {
    Chance chance;
    for (int i = 0; i < 10'000; ++i) chance.learn(bit);
    CHECK(chance.set() >= 1);
    CHECK(chance.set() <= 65535);
    CHECK((chance.set() > 65000) == bit);
  }
}
