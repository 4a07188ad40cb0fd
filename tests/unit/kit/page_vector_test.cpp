#include "vantage/kit/page_vector.hpp"

#include <doctest/doctest.h>

#include <cstdint>
#include <numeric>
#include <random>
#include <thread>
#include <vector>

namespace vantage {
namespace {

using Numbers = PageVector<std::uint32_t>;

TEST_CASE("A vector in pages counts whole pages, and a short one its elements") {
  Numbers few;
  few.reserve(10);
  CHECK(bytes_of(few) == 40);
  Numbers many;
  many.reserve(1025);
  CHECK(bytes_of(many) == 8192);
}

TEST_CASE("Vectors in pages that come and go on several threads keep their own values") {
  const auto work = [](unsigned seed) {
    std::mt19937 random(seed);
    // From less than a page to more than what is kept of freed blocks.
    std::uniform_int_distribution<std::size_t> size(500, 700'000);
    std::vector<std::pair<std::uint32_t, Numbers>> held(8);
    std::size_t wrong = 0;
    for (std::uint32_t step = 0; step < 400; ++step) {
      auto& [first, numbers] = held[random() % held.size()];
      for (std::size_t i = 0; i < numbers.size(); ++i) wrong += numbers[i] != first + i;
      first = seed * 1'000'000 + step;
      numbers = Numbers(size(random) >> (step % 8));
      std::iota(numbers.begin(), numbers.end(), first);
    }
    return wrong;
  };
  std::size_t wrong = 0;
  {
    const std::jthread other([&] { wrong = work(1); });
    CHECK(work(2) == 0);
  }
  CHECK(wrong == 0);
}

}  // namespace
}  // namespace vantage
