#include "view/sites.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "support/made_atlas.hpp"
#include "view/scene.hpp"

using namespace vantage;
using namespace vantage::view;

TEST_CASE("an expected error is coloured by its logarithm, from blue to red") {
  CHECK(share_of_error(0.0) == 0.0);
  CHECK(share_of_error(0.01) == doctest::Approx(0.0));
  CHECK(share_of_error(0.1) == doctest::Approx(0.5));
  CHECK(share_of_error(1.0) == doctest::Approx(1.0));
  CHECK(share_of_error(30.0) == 1.0);
  CHECK(share_of_error(std::numeric_limits<double>::infinity()) == 1.0);
  CHECK(badness(0.0).z() > badness(0.0).x());
  CHECK(badness(1.0).x() > badness(1.0).z());
}

TEST_CASE("sites are drawn around the origin, with weak directions and alike places") {
  const Point first(500'005, 4'100'005, 31), origin(500'000, 4'100'000, 30);
  const Atlas atlas = test::made_atlas(first);
  const auto marks = site_marks(atlas, origin, {}, 0.5);
  REQUIRE(marks.size() == 4);
  CHECK(marks[0].at == Point(5, 5, 1));
  CHECK(marks[0].color.isApprox(badness(0.0)));
  CHECK(marks[3].color.isApprox(badness(1.0)));  // matches nothing
  CHECK(marks[3].weak.empty());

  // Far weaker than strong: the longest line, along 30 degrees from the x axis.
  REQUIRE(marks[1].weak.size() == 2);
  const Point along = marks[1].weak[1] - marks[1].weak[0];
  CHECK(along.norm() == doctest::Approx(2 * 0.5 * 11.0));
  CHECK(std::atan2(along.y(), along.x()) == doctest::Approx(std::acos(-1.0) / 6.0));
  CHECK(marks[1].at.isApprox(0.5 * (marks[1].weak[0] + marks[1].weak[1])));
  const Point short_one = marks[0].weak[1] - marks[0].weak[0];
  CHECK(short_one.norm() == doctest::Approx(2 * 0.5 * (2.0 * 8.0 / 6.0 - 1.0)));

  REQUIRE(marks[2].alike.size() == 2);
  CHECK(marks[2].alike[0].isApprox(Point(5, 5, 1)));
  CHECK(site_marks(atlas, origin, RegionId{1}, 0.5).empty());
  CHECK(site_marks(atlas, origin, RegionId{0}, 0.5).size() == 4);
}

TEST_CASE("a site without any spread has the longest line") {
  Atlas atlas = test::made_atlas({0, 0, 0});
  atlas.sites.resize(1);
  atlas.sites[0].precision->sigma_strong = 0.0;
  const auto marks = site_marks(atlas, Point::Zero(), {}, 1.0);
  CHECK((marks[0].weak[1] - marks[0].weak[0]).norm() == doctest::Approx(22.0));
}
