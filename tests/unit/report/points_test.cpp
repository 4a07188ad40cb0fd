#include "report/points.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <random>

namespace vantage::report {
namespace {

PointCloud cloud(std::size_t n) {
  std::mt19937 random(3);
  const auto next = [&] { return static_cast<double>(random()) / 4294967296.0; };
  PointCloud points;
  for (std::size_t i = 0; i < n; ++i) {
    points.emplace_back(4.5e5 + 300.0 * next(), -200.0 * next(), 20.0 * next());
  }
  return points;
}

TEST_CASE("a quantized point is where it was, to half a step") {
  const PointCloud points = cloud(1000);
  const QuantizedPoints q = quantized(points, bounds_of(points));
  REQUIRE(q.points.size() == points.size());
  CHECK(q.step.x() < 0.005);
  for (std::size_t i = 0; i < points.size(); ++i) {
    CHECK(((q.at(i) - points[i]).cwiseAbs().array() <= 0.5001 * q.step.array() + 1e-9).all());
  }
}

TEST_CASE("a cloud without extent, and none at all") {
  const PointCloud one{{1, 2, 3}, {1, 2, 3}};
  CHECK(quantized(one, bounds_of(one)).at(1) == Point(1, 2, 3));
  CHECK(quantized({}, Bounds3{}).points.empty());
}

TEST_CASE("what lies outside the box comes to its border") {
  const PointCloud points{{-5, 0.5, 99}};
  const auto q = quantized(points, Bounds3{Point::Zero(), Point::Ones()});
  CHECK(q.at(0).x() == 0.0);
  CHECK(q.at(0).z() == doctest::Approx(1.0));
}

TEST_CASE("base64 is that of RFC 4648") {
  const auto of = [](std::string_view text) {
    return base64(std::vector<std::uint8_t>(text.begin(), text.end()));
  };
  CHECK(of("").empty());
  CHECK(of("f") == "Zg==");
  CHECK(of("fo") == "Zm8=");
  CHECK(of("foobar") == "Zm9vYmFy");
  QuantizedPoints q;
  q.points = {{0x0102, 0x0304, 0xfffe}};
  CHECK(base64(q) == "AgEEA/7/");
}

TEST_CASE("thinning keeps points of the cloud, not more than asked for, whatever their order") {
  PointCloud points = cloud(5000);
  const PointCloud kept = thinned(points, 700);
  CHECK(kept.size() <= 700);
  CHECK(kept.size() > 350);
  for (const Point& p : kept) CHECK(std::find(points.begin(), points.end(), p) != points.end());
  std::shuffle(points.begin(), points.end(), std::mt19937(5));
  CHECK(thinned(points, 700) == kept);
  CHECK(thinned(points, 5000).size() == 5000);
  CHECK(thinned(points, 0).empty());
  CHECK(thinned(PointCloud(50, Point(1, 2, 3)), 10).size() == 1);
}

}  // namespace
}  // namespace vantage::report
