#include "checks/map_facts.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

namespace vantage::checks {
namespace {

/// Ground of 60 x 60 m with 25 boxes of 3 x 3 x 6 m on it, a point every 0.25 m.
PointCloud town() {
  constexpr double kStep = 0.25;
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, 0.01);
  PointCloud map;
  const auto add = [&](double x, double y, double z) {
    map.emplace_back(x + noise(random), y + noise(random), z + noise(random));
  };
  const auto in_box = [](double x, double y) {
    return std::fmod(x, 12.0) > 4.5 && std::fmod(x, 12.0) < 7.5 && std::fmod(y, 12.0) > 4.5 &&
           std::fmod(y, 12.0) < 7.5;
  };
  for (double x = 0.0; x < 60.0; x += kStep) {
    for (double y = 0.0; y < 60.0; y += kStep) add(x, y, in_box(x, y) ? 6.0 : 0.0);
  }
  for (double x = 4.5; x < 60.0; x += 12.0) {
    for (double y = 4.5; y < 60.0; y += 12.0) {
      for (double along = 0.0; along < 3.0; along += kStep) {
        for (double z = 0.0; z < 6.0; z += kStep) {
          add(x + along, y, z);
          add(x + along, y + 3.0, z);
          add(x, y + along, z);
          add(x + 3.0, y + along, z);
        }
      }
    }
  }
  return map;
}

PointCloud moved(PointCloud map, const Eigen::Matrix3d& matrix, const Point& by = Point::Zero()) {
  for (Point& p : map) p = matrix * p + by;
  return map;
}

Eigen::Matrix3d scaled(double s) { return s * Eigen::Matrix3d::Identity(); }

TEST_CASE("spacing and extent, in any unit") {
  for (const double unit : {1.0, 100.0, 0.001}) {
    const MapFacts facts = measure_map(moved(town(), scaled(unit)));
    CHECK(facts.spacing == doctest::Approx(0.25 * unit).epsilon(0.15));
    CHECK((facts.bulk.max - facts.bulk.min).x() == doctest::Approx(60.0 * unit).epsilon(0.02));
  }
}

TEST_CASE("where up is, in any unit and place") {
  Eigen::Matrix3d turned, y_up, mirrored;
  turned << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  y_up << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  mirrored << 1, 0, 0, 0, 1, 0, 0, 0, -1;
  const auto up = [](const PointCloud& map) { return measure_map(map).up.value(); };
  CHECK(up(town()) == Direction{2, false});
  CHECK(up(moved(town(), scaled(100.0), {5e5, 5e6, 300.0})) == Direction{2, false});
  CHECK(up(moved(town(), turned)) == Direction{2, true});
  CHECK(up(moved(town(), mirrored)) == Direction{2, true});
  CHECK(up(moved(town(), y_up)) == Direction{1, false});
  CHECK(to_string(Direction{1, true}) == "-y");
}

TEST_CASE("a floor with a ceiling does not tell where up is") {
  PointCloud hall;
  for (double x = 0.0; x < 60.0; x += 0.25) {
    for (double y = 0.0; y < 60.0; y += 0.25) {
      hall.emplace_back(x, y, 0.0);
      hall.emplace_back(x, y, 6.0);
    }
  }
  CHECK_FALSE(measure_map(hall).up);
}

TEST_CASE("the rounding of 32-bit floats") {
  const Point origin(458'000.0, 5'428'000.0, 115.0);
  PointCloud far = moved(town(), scaled(1.0), origin);
  CHECK(measure_map(far).rounding == 0.0);
  for (Point& p : far) p = p.cast<float>().cast<double>();
  CHECK(measure_map(far).rounding == 0.5);
}

TEST_CASE("maps with few points, or with all of them in one place") {
  CHECK(measure_map({}).points == 0);
  const PointCloud one{Point(1.0, 2.0, 3.0)};
  CHECK(measure_map(one).spacing == 0.0);
  const PointCloud same(1000, Point(1.0, 2.0, 3.0));
  CHECK_FALSE(measure_map(same).up);
  CHECK(measure_map(same).spacing == 0.0);
}

}  // namespace
}  // namespace vantage::checks
