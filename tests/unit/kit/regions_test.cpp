#include "vantage/kit/regions.hpp"

#include <doctest/doctest.h>

#include <cmath>

namespace vantage {
namespace {

using Eigen::Vector2d;

TEST_CASE("a box that owns two corners ends one step beyond the greater") {
  const HalfOpenBox box = box_owning({-1.0, 0.0}, {2.0, 0.0});
  CHECK(contains(Footprint(box), Vector2d(-1.0, 0.0)));
  CHECK(contains(Footprint(box), Vector2d(2.0, 0.0)));
  CHECK_FALSE(contains(Footprint(box), box.max));
  CHECK(std::nextafter(box.max.x(), 0.0) == 2.0);
}

}  // namespace
}  // namespace vantage
