// Closed forms: which gap behind a sampled surface hides a point. delta is half the angle between
// neighbouring samples, d the distance of the surface, g the gap of a point amid two samples.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "scenes.hpp"
#include "support/plugins.hpp"

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

// Where the x axis meets the surface.
enum class Amid : bool { two, four };

PointCloud plane(double d, double delta, Amid samples = Amid::two) {
  const double half_spacing = d * std::tan(delta);
  PointCloud cloud = wall(d, 6, 2.0 * half_spacing);
  return samples == Amid::two ? cloud : translated(std::move(cloud), {0, 0, half_spacing});
}

// Samples at one distance, 2 delta apart along the equator.
PointCloud shell(double d, double delta, Amid samples = Amid::two) {
  PointCloud cloud;
  for (int azimuth = -6; azimuth < 6; ++azimuth) {
    for (int elevation = -6; elevation <= 6; ++elevation) {
      const double up = samples == Amid::two ? 0.0 : 1.0;
      const double a = (2.0 * azimuth + 1.0) * delta, e = (2.0 * elevation + up) * delta;
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

TEST_CASE("amid four samples of a square pattern the gap is twice that amid two") {
  const auto check = [](PointCloud (*surface)(double, double, Amid), double d, double delta,
                        double gap, const hpr::Settings& settings) {
    CAPTURE(d);
    CAPTURE(delta);
    CAPTURE(settings.radius);
    CHECK(sees_behind(surface(d, delta, Amid::two), d, 0.99 * gap, settings));
    CHECK(!sees_behind(surface(d, delta, Amid::two), d, 1.01 * gap, settings));
    CHECK(sees_behind(surface(d, delta, Amid::four), d, 0.99 * 2.0 * gap, settings));
    CHECK(!sees_behind(surface(d, delta, Amid::four), d, 1.01 * 2.0 * gap, settings));
  };
  for (const double d : {2.0, 10.0, 50.0}) {
    for (const double delta : {0.002, 0.005}) {
      const double squared = delta * delta;
      for (const double radius : {200.0, 2000.0, 20000.0}) {
        const hpr::Settings settings{.kernel = hpr::Kernel::spherical_flip, .radius = radius};
        check(plane, d, delta, radius * squared, settings);
        check(shell, d, delta, (radius - 0.5 * d) * squared, settings);
      }
      check(plane, d, delta, d * squared, inversion());
      check(shell, d, delta, 0.5 * d * squared, inversion());
    }
  }
}

// Whether the plugin sees the point at (d + g, 0, 0) in a map whose box is a cube of that diagonal.
bool plugin_sees_behind(PointCloud surface, double d, double g, double diagonal,
                        const std::string& params) {
  surface.emplace_back(d + g, 0.0, 0.0);
  const double half = 0.5 * diagonal / std::sqrt(3.0);
  const auto hpr = plugin<VisibilityOperator>("hpr", params);
  const auto scene =
      hpr->prepare(surface, {.map_bounds = {Point::Constant(-half), Point::Constant(half)}});
  REQUIRE(scene);
  const auto indices = (*scene)->visible(Point::Zero());
  REQUIRE(indices);
  return indices->back() == surface.size() - 1;
}

TEST_CASE(
    "alpha makes R of the diagonal of the map's box: the gap behind a plane is alpha D delta^2") {
  const double d = 5.0, delta = 0.004;
  for (const double diagonal : {40.0, 200.0}) {
    for (const double alpha : {10.0, 100.0, 1000.0, 10000.0}) {
      CAPTURE(diagonal);
      CAPTURE(alpha);
      const double gap = alpha * diagonal * delta * delta;
      if (d + 2.02 * gap > 0.5 * diagonal / std::sqrt(3.0)) continue;
      const std::string params = "alpha = " + std::to_string(alpha);
      CHECK(plugin_sees_behind(plane(d, delta), d, 0.99 * gap, diagonal, params));
      CHECK(!plugin_sees_behind(plane(d, delta), d, 1.01 * gap, diagonal, params));
      CHECK(plugin_sees_behind(plane(d, delta, Amid::four), d, 1.98 * gap, diagonal, params));
      CHECK(!plugin_sees_behind(plane(d, delta, Amid::four), d, 2.02 * gap, diagonal, params));
      const std::string inverted = "kernel = \"inversion\"\n" + params;
      const double small_gap = d * delta * delta;  // whatever alpha is
      CHECK(plugin_sees_behind(plane(d, delta), d, 0.99 * small_gap, diagonal, inverted));
      CHECK(!plugin_sees_behind(plane(d, delta), d, 1.01 * small_gap, diagonal, inverted));
    }
  }
}

TEST_CASE("the parameters gap and angular_spacing hide what is farther behind than the gap") {
  for (const double spacing : {0.2, 0.4, 1.0}) {  // degrees
    const double delta = 0.5 * spacing * std::numbers::pi / 180.0;
    for (const double gap : {0.05, 0.3, 1.0}) {
      const double radius = gap / (delta * delta);
      const std::string params =
          "gap = " + std::to_string(gap) + "\nangular_spacing = " + std::to_string(spacing);
      for (const double d : {5.0, 20.0}) {
        CAPTURE(spacing);
        CAPTURE(gap);
        CAPTURE(d);
        const double diagonal = 100.0;  // no part in it
        if (diagonal > radius) continue;
        CHECK(plugin_sees_behind(plane(d, delta), d, 0.98 * gap, diagonal, params));
        CHECK(!plugin_sees_behind(plane(d, delta), d, 1.02 * gap, diagonal, params));
        const double behind_shell = gap * (1.0 - 0.5 * d / radius);
        CHECK(plugin_sees_behind(shell(d, delta), d, 0.98 * behind_shell, diagonal, params));
        CHECK(!plugin_sees_behind(shell(d, delta), d, 1.02 * behind_shell, diagonal, params));
      }
    }
  }
}

}  // namespace
}  // namespace vantage::test
