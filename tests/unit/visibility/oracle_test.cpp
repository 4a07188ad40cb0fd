// Closed forms: which gap behind a sampled surface hides a point. delta is half the angle between
// neighbouring samples, d the distance of the surface, g the gap of a point amid two samples.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "scenes.hpp"

namespace vantage::test {
namespace {

// Whether the point at (d + g, 0, 0) is seen, past samples of a surface about the x axis.
bool sees_behind(PointCloud surface, double d, double g, const hpr::Settings& settings) {
  surface.emplace_back(d + g, 0.0, 0.0);
  const auto indices = hpr::hidden_point_removal(surface, Point::Zero(), settings);
  REQUIRE(indices);
  for (std::uint32_t i = 0; i + 1 < surface.size(); ++i) {
    CHECK(std::binary_search(indices->begin(), indices->end(), i));
  }
  return indices->back() == surface.size() - 1;
}

PointCloud plane(double d, double delta) { return wall(d, 6, 2.0 * d * std::tan(delta)); }

// Samples at one distance, 2 delta apart along the equator.
PointCloud shell(double d, double delta) {
  PointCloud cloud;
  for (int azimuth = -6; azimuth < 6; ++azimuth) {
    for (int elevation = -6; elevation <= 6; ++elevation) {
      const double a = (2.0 * azimuth + 1.0) * delta, e = 2.0 * elevation * delta;
      cloud.emplace_back(d * std::cos(e) * std::cos(a), d * std::cos(e) * std::sin(a),
                         d * std::sin(e));
    }
  }
  return cloud;
}

TEST_CASE("the spherical flip hides a point behind a shell iff g > (R - d/2) delta^2") {
  for (const double d : {2.0, 10.0, 50.0}) {
    for (const double delta : {0.002, 0.005, 0.01}) {
      for (const double radius : {200.0, 2000.0, 20000.0}) {
        CAPTURE(d);
        CAPTURE(delta);
        CAPTURE(radius);
        const double threshold = (radius - 0.5 * d) * delta * delta;
        if (d + 1.05 * threshold > radius) continue;
        const hpr::Settings settings{.kernel = hpr::Kernel::spherical_flip, .radius = radius};
        CHECK(sees_behind(shell(d, delta), d, 0.99 * threshold, settings));
        CHECK(!sees_behind(shell(d, delta), d, 1.01 * threshold, settings));
      }
    }
  }
}

TEST_CASE("the spherical flip hides a point behind a plane iff g > R delta^2") {
  for (const double d : {2.0, 10.0, 50.0}) {
    for (const double delta : {0.002, 0.005}) {
      for (const double radius : {200.0, 2000.0, 20000.0}) {
        CAPTURE(d);
        CAPTURE(delta);
        CAPTURE(radius);
        const double threshold = radius * delta * delta;
        const hpr::Settings settings{.kernel = hpr::Kernel::spherical_flip, .radius = radius};
        CHECK(sees_behind(plane(d, delta), d, 0.99 * threshold, settings));
        CHECK(!sees_behind(plane(d, delta), d, 1.01 * threshold, settings));
      }
    }
  }
}

TEST_CASE("the inversion hides a point behind a plane iff g > d delta^2, for any R") {
  for (const double d : {2.0, 10.0, 50.0}) {
    for (const double delta : {0.002, 0.005, 0.01}) {
      CAPTURE(d);
      CAPTURE(delta);
      const double threshold = d * delta * delta;
      CHECK(sees_behind(plane(d, delta), d, 0.99 * threshold, inversion()));
      CHECK(!sees_behind(plane(d, delta), d, 1.01 * threshold, inversion()));
    }
  }
}

TEST_CASE("the inversion hides a point behind a shell iff g > d delta^2 / 2, for any R") {
  for (const double d : {2.0, 10.0, 50.0}) {
    for (const double delta : {0.002, 0.005, 0.01}) {
      CAPTURE(d);
      CAPTURE(delta);
      const double threshold = 0.5 * d * delta * delta;
      CHECK(sees_behind(shell(d, delta), d, 0.99 * threshold, inversion()));
      CHECK(!sees_behind(shell(d, delta), d, 1.01 * threshold, inversion()));
    }
  }
}

TEST_CASE("the parameters gap and angular_spacing hide what is farther behind than the gap") {
  const double spacing_degrees = 0.4, delta = 0.5 * spacing_degrees * std::numbers::pi / 180.0;
  const std::string params = "gap = 0.3\nangular_spacing = 0.4";
  for (const double d : {5.0, 20.0}) {
    PointCloud map = plane(d, delta);
    map.emplace_back(d + 0.29, 0.0, 0.0);
    CHECK(seen(map, Point::Zero(), params).size() == map.size());
    map.back().x() = d + 0.31;
    CHECK(seen(map, Point::Zero(), params).size() == map.size() - 1);
  }
}

}  // namespace
}  // namespace vantage::test
