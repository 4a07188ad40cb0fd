// What `./dev fuzz` does for hours, in small and always the same: every parser is fed with its
// seeds, cut and damaged. It must come back, and say what is wrong in one line.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <random>

#include "targets.hpp"

namespace vantage::test {
namespace {

constexpr std::size_t kCut = 4096;  // [bytes]

struct Outcomes {
  std::size_t read = 0, refused = 0;
};

void feed(const FuzzTarget& target, std::string_view input, Outcomes& outcomes) {
  const auto error = target.run(input);
  ++(error ? outcomes.refused : outcomes.read);
  if (!error) return;
  const std::string line = to_string(*error);
  CAPTURE(line);
  const bool clear = line.find(kFuzzedFile) != std::string::npos &&
                     line.find('\n') == std::string::npos && line.size() < 600;
  CHECK(clear);
}

/// At every 4 KiB, at 64 places between, and at each of the first 64 bytes.
std::vector<std::size_t> cuts(std::size_t size) {
  std::vector<std::size_t> places;
  for (std::size_t at = 0; at < size; at += kCut) places.push_back(at);
  for (std::size_t i = 1; i < 64; ++i) places.push_back(size * i / 64);
  for (std::size_t at = 1; at < std::min<std::size_t>(size, 64); ++at) places.push_back(at);
  return places;
}

/// Flips a bit, or writes a number that is too large for a count, too small or negative.
std::string damaged(std::string_view seed, std::mt19937& random) {
  std::string input(seed);
  const std::size_t hits = 1 + random() % 3;
  for (std::size_t hit = 0; hit < hits; ++hit) {
    // Half of them in the first 512 bytes, where headers are.
    const std::size_t range =
        random() % 2 == 0 ? std::min<std::size_t>(512, input.size()) : input.size();
    const std::size_t at = random() % range;
    if (random() % 2 == 0) {
      input[at] = static_cast<char>(input[at] ^ (1 << random() % 8));
      continue;
    }
    constexpr char kFill[] = {'\0', '\x7f', '\x80', '\xff'};
    const std::size_t length =
        std::min<std::size_t>(std::size_t{1} << random() % 4, input.size() - at);
    std::fill_n(input.begin() + static_cast<std::ptrdiff_t>(at), length, kFill[random() % 4]);
  }
  return input;
}

TEST_CASE("robustness: seeds are read to their end") {
  for (const FuzzTarget& target : fuzz_targets()) {
    CAPTURE(target.name);
    const auto seeds = target.seeds();
    REQUIRE_FALSE(seeds.empty());
    for (const std::string& seed : seeds) {
      const auto error = target.run(seed);
      CHECK_MESSAGE(!error, to_string(error.value_or(Error{})));
    }
  }
}

TEST_CASE("robustness: inputs that are cut off") {
  for (const FuzzTarget& target : fuzz_targets()) {
    CAPTURE(target.name);
    Outcomes outcomes;
    for (const std::string& seed : target.seeds()) {
      for (const std::size_t at : cuts(seed.size())) {
        CAPTURE(at);
        feed(target, std::string_view(seed).substr(0, at), outcomes);
      }
    }
    CHECK(outcomes.refused > 0);
  }
}

TEST_CASE("robustness: inputs with damaged bytes") {
  for (const FuzzTarget& target : fuzz_targets()) {
    CAPTURE(target.name);
    std::mt19937 random(1);
    Outcomes outcomes;
    for (const std::string& seed : target.seeds()) {
      for (int i = 0; i < 400; ++i) {
        CAPTURE(i);
        feed(target, damaged(seed, random), outcomes);
      }
    }
    CHECK(outcomes.refused > 0);
  }
}

}  // namespace
}  // namespace vantage::test
