#include "report/chart.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

namespace vantage::report {
namespace {

std::string texts(const Axis& axis) {
  std::string all;
  for (const Tick& tick : axis.ticks) all += tick.text + " ";
  return all;
}

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t found = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++found;
  return found;
}

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();

TEST_CASE("ticks are round numbers that enclose both ends") {
  CHECK(texts(linear_axis("", 0.0, 9.3)) == "0 2 4 6 8 10 ");
  CHECK(texts(linear_axis("", 0.0, 0.13)) == "0 0.05 0.10 0.15 ");
  CHECK(texts(linear_axis("", -0.21, -0.13)) == "-0.22 -0.20 -0.18 -0.16 -0.14 -0.12 ");
  CHECK(texts(linear_axis("", 0.0, 10.0)) == "0 2 4 6 8 10 ");
  CHECK(texts(linear_axis("", 8.0, 5.0)) == texts(linear_axis("", 5.0, 8.0)));
}

TEST_CASE("an axis over one value has room around it") {
  for (const double value : {0.0, 3.0, -3.0, 1e6}) {
    CAPTURE(value);
    const Axis axis = linear_axis("", value, value);
    REQUIRE(axis.ticks.size() >= 2);
    CHECK(axis.ticks.front().value <= value);
    CHECK(axis.ticks.back().value >= value);
    CHECK(axis.ticks.front().value < axis.ticks.back().value);
  }
}

TEST_CASE("on a logarithmic axis equal ratios are equal distances") {
  const Axis axis = logarithmic_axis("", 1.3, 70.0);
  CHECK(texts(axis) == "1 2 5 10 20 50 100 ");
  CHECK(axis.along(10.0) == doctest::Approx(0.5));
  CHECK(axis.along(0.0) == 0.0);
  CHECK(axis.along(1e9) == 1.0);
  CHECK(texts(logarithmic_axis("", 0.02, 300.0)) == "0.01 0.1 1 10 100 1000 ");
  CHECK(texts(logarithmic_axis("", 3.0, 3.0)) == "2 5 ");
}

TEST_CASE("an axis is logarithmic only where a few values would leave the others no room") {
  CHECK_FALSE(axis_over("", std::vector<double>{1, 2, 3, 20}, true).logarithmic);
  CHECK(axis_over("", std::vector<double>{1, 2, 3, 900}, true).logarithmic);
  CHECK_FALSE(axis_over("", std::vector<double>{-1, 2, 3, 900}, true).logarithmic);
  CHECK(axis_over("", std::vector<double>{4, 5}, true).ticks.front().value == 0.0);
  CHECK(axis_over("", std::vector<double>{4, 5}, false).ticks.front().value == 4.0);
  CHECK(axis_over("", {}, true).ticks.size() >= 2);
}

TEST_CASE("a box has the quartiles of its sample, and whiskers within 1.5 boxes") {
  const Box box = box_of(std::vector<double>{5, 1, 2, 3, 4, 100, kGap});
  CHECK(box.count == 6);
  CHECK(box.q1 == doctest::Approx(2.25));
  CHECK(box.median == doctest::Approx(3.5));
  CHECK(box.q3 == doctest::Approx(4.75));
  CHECK(box.low == 1.0);
  CHECK(box.high == 5.0);
  CHECK(box.mean == doctest::Approx(115.0 / 6.0));
  CHECK(box.outliers == std::vector<double>{100.0});
  CHECK(box_of({}).count == 0);
  CHECK(box_of(std::vector<double>{7}).low == 7.0);
}

TEST_CASE("a thinned curve keeps what stands out, gaps too") {
  std::vector<Eigen::Vector2d> curve;
  for (int i = 0; i < 10000; ++i) curve.emplace_back(i, i == 4321 ? 9.0 : i == 77 ? -9.0 : 0.0);
  curve[6000].y() = kGap;
  const auto kept = thinned(curve, 200);
  CHECK(kept.size() <= 301);
  double least = 0.0, greatest = 0.0;
  std::size_t gaps = 0;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (i > 0) CHECK(kept[i].x() > kept[i - 1].x());
    gaps += std::isfinite(kept[i].y()) ? 0 : 1;
    least = std::fmin(least, kept[i].y());
    greatest = std::fmax(greatest, kept[i].y());
  }
  CHECK(least == -9.0);
  CHECK(greatest == 9.0);
  CHECK(gaps == 1);
  CHECK(thinned({{1, 2}, {3, 4}}, 200).size() == 2);
}

TEST_CASE("a cumulative curve tells the share at or below a value") {
  const auto curve = cumulative(std::vector<double>{3, 1, kGap, 2, 4});
  REQUIRE(curve.size() == 4);
  CHECK(curve[1] == Eigen::Vector2d(2.0, 0.5));
  CHECK(curve[3] == Eigen::Vector2d(4.0, 1.0));
}

TEST_CASE("a name is cut in its middle, never within a letter") {
  CHECK(shortened("short", 10) == "short");
  CHECK(shortened("visibility_clusters", 11) == "visib…sters");
  for (std::size_t most = 3; most < 12; ++most) {
    const std::string cut = shortened("ääääääääääää", most);
    CAPTURE(cut);
    CHECK(count(cut, "\xc3") == count(cut, "\xa4"));
  }
}

TEST_CASE("a gap parts a curve; a point between gaps shows") {
  const LinePanel panel{"t",
                        linear_axis("x", 0, 4),
                        linear_axis("y", 0, 4),
                        {{"c", {}, {{0, 1}, {1, 1}, {2, kGap}, {3, 2}, {4, kGap}}}}};
  const std::string svg = to_svg(panel);
  const auto start = svg.rfind("class=\"line\"");
  const std::string d = svg.substr(start, svg.find("/>", start) - start);
  CHECK(count(d, "M") == 2);
  CHECK(count(d, "L") == 1);
  CHECK(count(d, "h0.1") == 1);
  CHECK(d.find("nan") == std::string::npos);
}

TEST_CASE("rows of a panel: a box each, words where there is nothing; names are disarmed") {
  const RowPanel panel{"<t>",
                       linear_axis("x", 0, 4),
                       {{.name = "a<b>", .look = {}, .sample = {1, 2, 3}},
                        {.name = "empty", .look = {}, .beneath = true, .sample = {}}}};
  const std::string svg = to_svg(panel);
  CHECK(count(svg, ">none<") == 1);
  CHECK(count(svg, "a&lt;b&gt;") >= 1);
  CHECK(count(svg, "<b>") == 0);
  CHECK(count(svg, "<t>") == 0);
  CHECK(svg.find("3 values") != std::string::npos);
}

}  // namespace
}  // namespace vantage::report
