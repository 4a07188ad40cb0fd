#include "common/opening.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>
#include <random>

namespace vantage::terrain {
namespace {

constexpr double kNothing = std::numeric_limits<double>::infinity();

Heights random_heights(std::size_t width, std::size_t height, double share_empty, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> z(-5.0, 5.0), share(0.0, 1.0);
  Heights heights{width, height, std::vector<double>(width * height)};
  for (double& value : heights.z) value = share(random) < share_empty ? kNothing : z(random);
  return heights;
}

/// The definition: the highest of the minima over all squares that hold the cell.
double opened_at(const Heights& in, int x, int y, int radius) {
  double highest = -kNothing;
  for (int cy = y - radius; cy <= y + radius; ++cy) {
    for (int cx = x - radius; cx <= x + radius; ++cx) {
      double lowest = kNothing;
      for (int j = std::max(cy - radius, 0);
           j <= std::min<int>(cy + radius, static_cast<int>(in.height) - 1); ++j) {
        for (int i = std::max(cx - radius, 0);
             i <= std::min<int>(cx + radius, static_cast<int>(in.width) - 1); ++i) {
          lowest = std::min(
              lowest, in.z[static_cast<std::size_t>(j) * in.width + static_cast<std::size_t>(i)]);
        }
      }
      highest = std::max(highest, lowest);
    }
  }
  return highest;
}

TEST_CASE("the opening equals its definition" * doctest::test_suite("slow")) {
  for (const auto& [width, height] :
       {std::pair<std::size_t, std::size_t>{1, 1}, {1, 9}, {13, 1}, {12, 7}, {40, 33}}) {
    for (const double share_empty : {0.0, 0.4, 0.95}) {
      for (const std::size_t radius : {1U, 2U, 5U, 14U}) {
        CAPTURE(width);
        CAPTURE(height);
        CAPTURE(share_empty);
        CAPTURE(radius);
        const Heights in = random_heights(width, height, share_empty, 3);
        const Heights out = opening(in, radius);
        REQUIRE(out.width == width);
        REQUIRE(out.height == height);
        bool equal = true;
        for (std::size_t y = 0; y < height; ++y) {
          for (std::size_t x = 0; x < width; ++x) {
            equal = equal &&
                    out.z[y * width + x] == opened_at(in, static_cast<int>(x), static_cast<int>(y),
                                                      static_cast<int>(radius));
          }
        }
        CHECK(equal);
      }
    }
  }
}

TEST_CASE("an opening is not above its input, and opening again changes nothing") {
  const Heights in = random_heights(60, 50, 0.2, 8);
  const Heights once = opening(in, 3), twice = opening(once, 3), wider = opening(once, 7);
  for (std::size_t k = 0; k < in.z.size(); ++k) CHECK(once.z[k] <= in.z[k]);
  CHECK(twice.z == once.z);
  CHECK(wider.z == opening(in, 7).z);
}

TEST_CASE("a tilted plane is its own opening, up to its border") {
  Heights plane{50, 40, std::vector<double>(2000)};
  for (std::size_t k = 0; k < 2000; ++k) {
    plane.z[k] = 0.25 * static_cast<double>(k % 50) - 0.5 * static_cast<double>(k / 50);
  }
  CHECK(opening(plane, 16).z == plane.z);
}

}  // namespace
}  // namespace vantage::terrain
