#include "plot.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

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

TEST_CASE("names at the curves replace the legend, and do not cover each other") {
  Panel named = panel({{0, 50}, {10, 40}});
  named.curves.push_back({"other", {{0, 50}, {10, 90}}});
  const auto heights = [](const std::string& svg) {
    std::vector<double> all;
    for (const char* name : {">a &lt; b<", ">other<"}) {
      REQUIRE(count(svg, name) == 1);
      const auto at = svg.rfind("y=\"", svg.find(name));
      all.push_back(std::stod(svg.substr(at + 3)));
    }
    return all;
  };
  const auto legend = heights(to_svg({named}));
  CHECK(legend[0] == legend[1]);
  named.names = true;
  const auto beside = heights(to_svg({named}));
  CHECK(beside[0] - beside[1] >= 12.0);
}

TEST_CASE("a band spans the marks' ranges, and a hollow mark is not filled") {
  const std::string plain = to_svg({panel({{0, 50}, {10, 40}})});
  CHECK(count(plain, "<polygon") == 0);
  const std::string svg = to_svg({panel({{0, 50, "", 40, 60, true}, {10, 40}})});
  CHECK(count(svg, "<polygon") == 1);
  CHECK(count(svg, "fill=\"#fff\" stroke=\"#1f5fa8\"") == 1);
  CHECK(count(plain, "fill=\"#fff\" stroke=\"#1f5fa8\"") == 0);
}

TEST_CASE("a level is a line over the panel with its text; a note is below") {
  Panel with = panel({{0, 0}});
  with.levels = {{50, "half"}};
  const std::string svg = to_svg({with}, 900, 420, "a note");
  CHECK(count(svg, ">half<") == 1);
  CHECK(count(svg, ">a note<") == 1);
  CHECK(count(svg, "<line") == count(to_svg({panel({{0, 0}})}), "<line") + 1);
}

TEST_CASE("ticks are written short") {
  const auto all = ticks({0.25, 10});
  CHECK(all[0].text == "0.25");
  CHECK(all[1].text == "10");
}

}  // namespace
}  // namespace vantage::benchmarks
