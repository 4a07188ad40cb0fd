#include "building/input.hpp"

#include <doctest/doctest.h>

namespace vantage::building {
namespace {

TEST_CASE("a tiled map is read at once if there is room, and if an index can count its points") {
  constexpr std::uint64_t kGiB = std::uint64_t{1} << 30U, kMost = 0xffff'fffe;
  CHECK(fits_at_once(1'000'000, kGiB));
  CHECK_FALSE(fits_at_once(kMost, kGiB));
  CHECK(fits_at_once(kMost, 1000 * kGiB));
  CHECK_FALSE(fits_at_once(kMost + 1, 1000 * kGiB));  // check_points refuses so many
}

}  // namespace
}  // namespace vantage::building
