#include "vantage/kit/hash.hpp"

#include <doctest/doctest.h>

#include <set>

namespace vantage {
namespace {

TEST_CASE("scatter is the finalizer of SplitMix64") {
  // The first outputs of the generator with the seed 0, whose state grows by the golden ratio.
  constexpr std::uint64_t kStep = 0x9e3779b97f4a7c15U;
  CHECK(scatter(0) == 0xe220a8397b1dcdafU);
  CHECK(scatter(kStep) == 0x6e789e6aa1b965f4U);
  CHECK(scatter(2 * kStep) == 0x06c45d188009454fU);
}

TEST_CASE("a hash of several numbers depends on their order, and on each") {
  CHECK(hash(7) == 7);
  CHECK(hash(7, 1, 2) != hash(7, 2, 1));
  CHECK(hash(7, 1, 2) != hash(8, 1, 2));
  CHECK(hash(7, 1, -1) == hash(hash(7, 1), ~std::uint64_t{0}));
}

TEST_CASE("cells that are equal have one hash, and neighbours have different ones") {
  const CellHash cell_hash;
  CHECK(cell_hash(std::array{0.0, -0.0, 3.0}) == cell_hash(std::array{-0.0, 0.0, 3.0}));
  std::set<std::size_t> of_integers, of_doubles;
  for (int x = -20; x < 20; ++x) {
    for (int y = -20; y < 20; ++y) {
      of_integers.insert(cell_hash(std::array{x, y}));
      of_doubles.insert(cell_hash(std::array{1.0 * x, 1.0 * y}));
    }
  }
  CHECK(of_integers.size() == 1600);
  CHECK(of_doubles.size() == 1600);
}

}  // namespace
}  // namespace vantage
