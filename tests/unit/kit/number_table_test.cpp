#include "vantage/kit/number_table.hpp"

#include <doctest/doctest.h>

#include <map>
#include <random>

#include "vantage/kit/hash.hpp"

namespace vantage {
namespace {

TEST_CASE("a number table numbers keys as a map does") {
  std::vector<std::uint64_t> keys;
  NumberTable table;
  std::map<std::uint64_t, std::uint32_t> expected;
  std::mt19937 random(3);
  for (const auto& [name, hash] :
       {std::pair<const char*, std::uint64_t (*)(std::uint64_t)>{"scattered", scatter},
        {"all in one slot", [](std::uint64_t) -> std::uint64_t { return 7; }}}) {
    CAPTURE(name);
    keys.clear();
    expected.clear();
    table = {};
    const auto is = [&](std::uint64_t key) {
      return [&keys, key](std::uint32_t number) { return keys[number] == key; };
    };
    const auto hash_of = [&, hash = hash](std::uint32_t number) { return hash(keys[number]); };
    CHECK(table.find(hash(1), is(1)) == NumberTable::kNone);
    for (int i = 0; i < 5000; ++i) {
      const std::uint64_t key = random() % 1500;
      const std::uint32_t number = table.insert(hash(key), is(key), hash_of);
      if (number == keys.size()) keys.push_back(key);
      REQUIRE(number == expected.try_emplace(key, expected.size()).first->second);
      REQUIRE(table.size() == keys.size());
    }
    for (std::uint64_t key = 0; key < 1600; ++key) {
      const auto found = expected.find(key);
      CHECK(table.find(hash(key), is(key)) ==
            (found == expected.end() ? NumberTable::kNone : found->second));
    }
    keys.resize(10);
    table.renumber(10, hash_of);
    CHECK(table.size() == 10);
    for (std::uint32_t number = 0; number < 10; ++number) {
      CHECK(table.find(hash(keys[number]), is(keys[number])) == number);
    }
  }
}

}  // namespace
}  // namespace vantage
