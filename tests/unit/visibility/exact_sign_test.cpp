// Signs of determinants against fractions: they are right to the last bit.
#include <doctest/doctest.h>

#include <Eigen/LU>
#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <limits>
#include <random>

#include "exact_sign.hpp"

namespace vantage::test {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;
using hpr::Sign;
using Rational = boost::multiprecision::cpp_rational;
using Exact = std::array<Rational, 3>;

Exact exact(const Vector3d& p) { return {Rational(p.x()), Rational(p.y()), Rational(p.z())}; }
Exact difference(const Exact& a, const Exact& b) {
  return {Rational(a[0] - b[0]), Rational(a[1] - b[1]), Rational(a[2] - b[2])};
}
Rational determinant(const Exact& a, const Exact& b, const Exact& c) {
  return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
         a[2] * (b[0] * c[1] - b[1] * c[0]);
}
Sign sign_of(const Rational& value) { return static_cast<Sign>(value.sign()); }

// How many of the signs were zero, and in how many a determinant in double would be wrong.
struct Tally {
  int signs = 0, zeros = 0, wrong_in_double = 0;

  void count(Sign exact, double rounded) {
    ++signs;
    if (exact == Sign::zero) ++zeros;
    const int in_double = (rounded > 0.0 ? 1 : 0) - (rounded < 0.0 ? 1 : 0);
    if (in_double != static_cast<int>(exact)) ++wrong_in_double;
  }
};

void check_triple(const Vector3d& a, const Vector3d& b, const Vector3d& c, Tally& tally) {
  const Sign expected = sign_of(determinant(exact(a), exact(b), exact(c)));
  const auto opposite = static_cast<Sign>(-static_cast<int>(expected));
  CHECK(hpr::sign_of_triple(a, b, c) == expected);
  CHECK(hpr::sign_of_triple(c, a, b) == expected);
  CHECK(hpr::sign_of_triple(b, a, c) == opposite);
  Eigen::Matrix3d matrix;
  matrix << a, b, c;
  tally.count(expected, matrix.determinant());
}

void check_volume(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d,
                  Tally& tally) {
  const Exact from = exact(a);
  const Sign expected = sign_of(determinant(difference(exact(b), from), difference(exact(c), from),
                                            difference(exact(d), from)));
  const auto opposite = static_cast<Sign>(-static_cast<int>(expected));
  CHECK(hpr::sign_of_volume(a, b, c, d) == expected);
  CHECK(hpr::sign_of_volume(a, c, b, d) == opposite);
  CHECK(hpr::sign_of_volume(d, b, c, a) == opposite);
  Eigen::Matrix3d matrix;
  matrix << b - a, c - a, d - a;
  tally.count(expected, matrix.determinant());
}

void check_turn(const Vector2d& a, const Vector2d& b, const Vector2d& c, Tally& tally) {
  const Rational ax(a.x()), ay(a.y());
  const Rational twice_area = (Rational(b.x()) - ax) * (Rational(c.y()) - ay) -
                              (Rational(b.y()) - ay) * (Rational(c.x()) - ax);
  const Sign expected = sign_of(twice_area);
  CHECK(hpr::sign_of_turn(a, b, c) == expected);
  CHECK(hpr::sign_of_turn(b, c, a) == expected);
  CHECK(hpr::sign_of_turn(b, a, c) == static_cast<Sign>(-static_cast<int>(expected)));
  const Vector2d u = b - a, v = c - a;
  tally.count(expected, u.x() * v.y() - u.y() * v.x());
}

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}

  double uniform(double limit) {
    return std::uniform_real_distribution<double>(-limit, limit)(engine_);
  }
  Vector3d vector(double limit) { return {uniform(limit), uniform(limit), uniform(limit)}; }
  Vector3d whole(int limit) {
    std::uniform_int_distribution<int> coordinate(-limit, limit);
    return Vector3d(coordinate(engine_), coordinate(engine_), coordinate(engine_));
  }
  /// Each coordinate of any magnitude from 1e-12 to 1e12, now and then zero.
  Vector3d of_any_size() {
    Vector3d p;
    for (double& x : p) {
      x = engine_() % 8 == 0 ? 0.0 : std::copysign(std::pow(10.0, uniform(12.0)), uniform(1.0));
    }
    return p;
  }
  /// One coordinate a last digit up or down, or none; a zero stays.
  Vector3d nudged(Vector3d p) {
    const auto axis = static_cast<Eigen::Index>(engine_() % 3);
    const auto way = engine_() % 3;
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    if (way != 0 && p[axis] != 0.0)
      p[axis] = std::nextafter(p[axis], way == 1 ? kInfinity : -kInfinity);
    return p;
  }

 private:
  std::mt19937 engine_;
};

Vector2d level(const Vector3d& p) { return p.head<2>(); }

void check_all(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d,
               Tally& tally) {
  check_triple(a, b, c, tally);
  check_volume(a, b, c, d, tally);
  check_turn(level(a), level(b), level(c), tally);
}

TEST_CASE("exact signs of random determinants") {
  Random random(1);
  Tally tally;
  for (int run = 0; run < 300; ++run) {
    check_all(random.vector(1.0), random.vector(1.0), random.vector(1e3), random.vector(1e-3),
              tally);
  }
  CHECK(tally.zeros == 0);
}

TEST_CASE("exact signs on whole coordinates, where many determinants are zero") {
  Random random(2);
  Tally tally;
  for (const int limit : {1, 2, 5}) {
    for (int run = 0; run < 300; ++run) {
      const Vector3d by = 1e6 * random.whole(2);
      check_all(random.whole(limit), random.whole(limit), random.whole(limit), random.whole(limit),
                tally);
      check_volume(random.whole(limit) + by, random.whole(limit) + by, random.whole(limit) + by,
                   random.whole(limit) + by, tally);
    }
  }
  CHECK(tally.zeros > tally.signs / 8);
  CHECK(tally.zeros < tally.signs / 2);
}

TEST_CASE("exact signs a last digit off a plane or a line, where doubles fail") {
  Random random(3);
  Tally tally;
  for (int run = 0; run < 600; ++run) {
    const Vector3d a = random.vector(10.0), b = random.vector(10.0), c = random.vector(10.0);
    const double s = random.uniform(1.0), t = random.uniform(1.0);
    check_triple(a, b, random.nudged(s * a + t * b), tally);
    check_volume(a, b, c, random.nudged(a + s * (b - a) + t * (c - a)), tally);
    check_turn(level(a), level(b), level(random.nudged(a + s * (b - a))), tally);
  }
  CHECK(tally.wrong_in_double > tally.signs / 10);
}

TEST_CASE("exact signs far from the origin, where differences round") {
  Random random(4);
  Tally tally;
  for (int run = 0; run < 300; ++run) {
    const Vector3d far(5e6 + 1.0 / 3.0, -4.9e6, 100.1);
    const Vector3d a = far + random.vector(1e-8), b = far + random.vector(1e-8);
    const Vector3d c = far + random.vector(1e-8), d = far + random.vector(1e-8);
    check_all(a, b, c, d, tally);
    check_all(a, 2.0 * a, random.nudged(3.0 * a), random.nudged(0.5 * a), tally);
  }
  CHECK(tally.wrong_in_double > 0);
}

TEST_CASE("exact signs with magnitudes from 1e-12 to 1e12") {
  Random random(5);
  Tally tally;
  for (int run = 0; run < 600; ++run) {
    const Vector3d a = random.of_any_size(), b = random.of_any_size();
    const Vector3d c = random.of_any_size(), d = random.of_any_size();
    check_all(a, b, c, d, tally);
    check_volume(a, b, c, random.nudged(b), tally);
    check_triple(a, b, random.nudged(1e-12 * a + 1e12 * b), tally);
  }
  CHECK(tally.wrong_in_double > 0);
}

TEST_CASE("exact signs: which way round is positive") {
  const Vector3d x = Vector3d::UnitX(), y = Vector3d::UnitY(), z = Vector3d::UnitZ();
  CHECK(hpr::sign_of_triple(x, y, z) == Sign::positive);
  CHECK(hpr::sign_of_volume(Vector3d::Zero(), x, y, z) == Sign::positive);
  CHECK(hpr::sign_of_volume(x, y, z, Vector3d::Zero()) == Sign::negative);
  CHECK(hpr::sign_of_turn({0, 0}, {1, 0}, {0, 1}) == Sign::positive);
}

}  // namespace
}  // namespace vantage::test
