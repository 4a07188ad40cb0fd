#include "plot.hpp"

#include <doctest/doctest.h>

#include <string>

namespace vantage::benchmarks {
namespace {

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t found = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++found;
  return found;
}

/// The picture's coordinates of the first curve's points.
std::string polyline(const std::string& svg) {
  const std::string before = "points=\"";
  const auto start = svg.find(before) + before.size();
  return svg.substr(start, svg.find('"', start) - start);
}

Panel panel(std::vector<Mark> marks) {
  return {"shares", {"x [m]", ticks({0, 10})}, {"y [%]", ticks({0, 100})}, {{"a < b", marks}}};
}

TEST_CASE("a plot has its axes with units, a curve for each and one legend") {
  const std::string svg = to_svg({panel({{0, 0}, {10, 100}}), panel({{5, 50}})});
  CHECK(svg.starts_with("<svg xmlns="));
  CHECK(svg.ends_with("</svg>\n"));
  CHECK(count(svg, "<polyline") == 2);
  CHECK(count(svg, ">x [m]<") == 2);
  CHECK(count(svg, ">y [%]<") == 2);
  CHECK(count(svg, ">a &lt; b<") == 1);
  CHECK(count(svg, "a < b") == 0);
}

TEST_CASE("ends of the axes are corners of the panel; a value outside is drawn on the border") {
  const std::string corners = polyline(to_svg({panel({{0, 0}, {10, 100}})}, 500, 400));
  CHECK(polyline(to_svg({panel({{-3, -1}, {99, 1e9}})}, 500, 400)) == corners);
  CHECK(polyline(to_svg({panel({{0, 0}, {9, 90}})}, 500, 400)) != corners);
}

TEST_CASE("on a logarithmic axis equal ratios are equal distances") {
  Panel logarithmic = panel({{10, 0}});
  logarithmic.x = {"size [kB]", ticks({1, 100}), true};
  CHECK(polyline(to_svg({logarithmic})) == polyline(to_svg({panel({{5, 0}})})));
}

TEST_CASE("ticks are written short") {
  const auto all = ticks({0.25, 10});
  CHECK(all[0].text == "0.25");
  CHECK(all[1].text == "10");
}

}  // namespace
}  // namespace vantage::benchmarks
