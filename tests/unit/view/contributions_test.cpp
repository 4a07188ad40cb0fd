#include "view/contributions.hpp"

#include <doctest/doctest.h>

#include "view/scene.hpp"

using namespace vantage;
using namespace vantage::view;

namespace {

Contributions two_regions() {
  Contributions found;
  found.parts.push_back({.region = RegionId{1},
                         .scans = 2,
                         .elements = {{{5, 0, 0}, 1.0}, {{-5, 0, 0}, 3.0}},
                         .elsewhere = 8.0});
  found.parts.push_back({.region = RegionId{4},
                         .scans = 1,
                         .elements = {{{5.0001, 0, 0}, 2.0}, {{0, 0, 9}, 4.0}},
                         .elsewhere = 0.0});
  return found;
}

}  // namespace

TEST_CASE("an element that several maps have counts as one; each region has its own") {
  const Contributions found = two_regions();
  CHECK(found.scans({}) == 3);
  CHECK(found.scans(RegionId{4}) == 1);
  CHECK(found.scans(RegionId{0}) == 0);
  CHECK(found.elsewhere({}) == 8.0);
  const auto all = found.elements({});
  REQUIRE(all.size() == 3);
  CHECK(all[0].middle == Point(-5, 0, 0));
  CHECK(all[1].middle == Point(0, 0, 9));
  CHECK(all[2].middle == Point(5, 0, 0));
  CHECK(all[2].leverage == 3.0);
  CHECK(found.elements(RegionId{1}).size() == 2);
  CHECK(found.elements(RegionId{0}).empty());
}

TEST_CASE("the strongest elements come first, whatever their order") {
  const auto all = two_regions().elements({});
  CHECK(strongest(all, 0.0) == 0.0);
  CHECK(strongest(all, 0.1) == 4.0);  // at least one
  CHECK(strongest(all, 0.5) == 7.0);
  CHECK(strongest(all, 1.0) == 10.0);
  CHECK(strongest({}, 0.5) == 0.0);
}

TEST_CASE("contributions are coloured by their logarithm, over two decades") {
  Drawing drawing;
  for (const double leverage : {1.0, 0.1, 0.01, 1e-5, 0.0, -0.3}) {
    drawing.points.emplace_back(0, 0, 0);
    drawing.leverages.push_back(leverage);
  }
  // All but the largest few: the range leaves out strays.
  for (int i = 0; i < 1000; ++i) {
    drawing.points.emplace_back(0, 0, 0);
    drawing.leverages.push_back(1.0);
  }
  const Scales scales = scales_of(drawing);
  CHECK(scales.contribution.high == doctest::Approx(0.0));
  CHECK(scales.contribution.low == doctest::Approx(-2.0));
  const auto colors = colors_of(drawing, Coloring::contribution, scales, {});
  CHECK(colors[0].isApprox(magma(1.0)));
  CHECK(colors[1].isApprox(magma(0.14 + 0.86 * 0.5)));
  for (const std::size_t weak : {2, 3, 4, 5}) CHECK(colors[weak].isApprox(magma(0.14)));
}
