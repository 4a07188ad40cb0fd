#include "report/plan.hpp"

#include <doctest/doctest.h>

#include <algorithm>

namespace vantage::report {
namespace {

TEST_CASE("a window has its border and its least width, and fits the picture") {
  const PlanWindow window = window_around({0, 0}, {100, 20}, 10.0, 40.0, 600.0, 500.0);
  CHECK(window.min.x() == doctest::Approx(-10.0));
  CHECK(window.max.x() == doctest::Approx(110.0));
  CHECK(window.width == 600.0);
  CHECK(window.x(50.0) == doctest::Approx(300.0));
  CHECK(window.y(window.max.y()) == doctest::Approx(0.0));
  const PlanWindow tall = window_around({0, 0}, {10, 100}, 0.0, 10.0, 600.0, 500.0);
  CHECK(tall.height() <= 501.0);
  const PlanWindow point = window_around({5, 5}, {5, 5}, 0.0, 40.0, 600.0, 500.0);
  CHECK((point.max - point.min).x() == doctest::Approx(40.0));
}

double length(const std::vector<Eigen::Vector2d>& ends) {
  double sum = 0.0;
  for (std::size_t i = 0; i + 1 < ends.size(); i += 2) sum += (ends[i + 1] - ends[i]).norm();
  return sum;
}

TEST_CASE("an outline goes around a union of boxes, not between them") {
  const HalfOpenBox a{{0, 0}, {1, 1}}, b{{1, 0}, {2, 1}}, c{{0, 1}, {1, 2}};
  CHECK(length(outline_lines(a)) == doctest::Approx(4.0));
  CHECK(length(outline_lines(BoxUnion{{a, b}})) == doctest::Approx(6.0));
  CHECK(length(outline_lines(BoxUnion{{a, b, c}})) == doctest::Approx(8.0));
  const BoxUnion apart{{a, HalfOpenBox{{5, 5}, {6, 6}}}};
  CHECK(length(outline_lines(apart)) == doctest::Approx(8.0));
  const BoxUnion uneven{{HalfOpenBox{{0, 0}, {1, 3}}, HalfOpenBox{{1, 1}, {2, 2}}}};
  CHECK(length(outline_lines(uneven)) == doctest::Approx(10.0));
}

TEST_CASE("what lies outside the window is not drawn") {
  const PlanWindow window{{0, 0}, {10, 10}, 100.0};
  CHECK(outline(HalfOpenBox{{20, 20}, {30, 30}}, window).empty());
  CHECK(outline(HalfOpenBox{{1, 1}, {2, 2}}, window) ==
        "M10.0 90.0L20.0 90.0L20.0 80.0L10.0 80.0L10.0 90.0");
  CHECK(outline(HalfOpenBox{{-1e9, -1e9}, {5, 5}}, window).find("e+") == std::string::npos);
}

TEST_CASE("a picture depends on the points, not on their order") {
  const PlanWindow window{{0, 0}, {10, 10}, 50.0};
  PointCloud points;
  for (int i = 0; i < 200; ++i) points.emplace_back(0.05 * i, 5.0, i % 7);
  const auto density = density_picture(points, window);
  const auto height = height_picture(points, window, 0.0, 6.0);
  REQUIRE(density);
  REQUIRE(height);
  CHECK(density->starts_with("data:image/png;base64,iVBORw0KGgo"));
  std::reverse(points.begin(), points.end());
  CHECK(*density_picture(points, window) == *density);
  CHECK(*height_picture(points, window, 0.0, 6.0) == *height);
  points.emplace_back(2.0, 2.0, 0.0);
  CHECK(*density_picture(points, window) != *density);
  CHECK(density_picture({}, window));
}

TEST_CASE("colours of heights leave out what stands out") {
  PointCloud points;
  for (int i = 0; i <= 1000; ++i) points.emplace_back(0, 0, 0.01 * i);
  points.emplace_back(0, 0, 900.0);
  const Heights heights = heights_of(points);
  CHECK(heights.low == doctest::Approx(0.05));
  CHECK(heights.high < 10.0);
  CHECK(heights_of({}).high > heights_of({}).low);
  CHECK(heights_of(PointCloud(5, Point::Zero())).high > 0.0);
}

}  // namespace
}  // namespace vantage::report
