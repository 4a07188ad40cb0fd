#include "vantage/kit/index_set.hpp"

#include <doctest/doctest.h>
#include <tbb/parallel_for.h>

#include <numeric>
#include <random>
#include <set>

using namespace vantage;

TEST_CASE("a set of indices is the ascending union of what was added, in any order") {
  std::mt19937 random(5);
  for (const std::uint32_t limit : {1U, 63U, 64U, 65U, 1000U}) {
    IndexSet set(limit);
    std::set<std::uint32_t> expected;
    CHECK(set.ascending().empty());
    for (int n = 0; n < 20; ++n) {
      IndexList some(random() % 50);
      for (std::uint32_t& k : some) k = static_cast<std::uint32_t>(random() % limit);
      set.add(some);
      expected.insert(some.begin(), some.end());
      CHECK(set.size() == expected.size());
      CHECK(set.ascending() == IndexList(expected.begin(), expected.end()));
    }
  }
}

TEST_CASE("threads that add to the same words lose nothing") {
  IndexSet set(6400);
  tbb::parallel_for(std::uint32_t{0}, std::uint32_t{64}, [&](std::uint32_t first) {
    IndexList some;
    for (std::uint32_t k = first; k < 6400; k += 64) some.push_back(k);
    set.add(some);
  });
  IndexList all(6400);
  std::iota(all.begin(), all.end(), 0U);
  CHECK(set.ascending() == all);
}
