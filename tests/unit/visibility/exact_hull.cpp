#include "exact_hull.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>
#include <random>
#include <tuple>

#include "qhull.hpp"

namespace vantage::test {
namespace {

using Integer = boost::multiprecision::cpp_int;

constexpr std::size_t kHints = 32;

// Every double below is the result of at most 8 roundings of 2^-53 each, relative to the sum of
// its terms' magnitudes; kTiny is for what underflows.
constexpr double kRounding = 0x1p-49, kTiny = 1e-290;

// v / 2^power, a whole number.
Integer integer_of(double v, int power) {
  if (v == 0.0) return 0;
  int exponent = 0;
  const double fraction = std::frexp(v, &exponent);  // v = fraction 2^exponent
  int shift = exponent - 53 - power;
  auto mantissa = static_cast<std::int64_t>(std::ldexp(fraction, 53));
  for (; shift < 0; ++shift) mantissa /= 2;  // trailing zeros of a subnormal number
  Integer whole = mantissa;
  whole <<= shift;
  return whole;
}

// The largest power that makes all coordinates whole, or a smaller one.
int common_power(std::span<const Point> points) {
  int power = std::numeric_limits<double>::max_exponent;
  for (const Point& p : points) {
    for (const double v : p) {
      if (v != 0.0) power = std::min(power, std::max(std::ilogb(v) - 52, -1074));
    }
  }
  return power;
}

// A number that is near for directions that are near: their coordinates, bit by bit (Morton).
std::uint64_t direction_code(const Point& p) {
  const Eigen::Array3d cell = (p.normalized().array() + 1.0) * 1023.0;
  std::uint64_t code = 0;
  for (int bit = 10; bit >= 0; --bit) {
    for (const double v : cell) code = 2 * code + ((static_cast<std::uint64_t>(v) >> bit) & 1U);
  }
  return code;
}

// Coordinates in units of 2^power.
struct Whole {
  Integer x, y, z;

  [[nodiscard]] bool is_zero() const { return x == 0 && y == 0 && z == 0; }
  [[nodiscard]] Whole minus(const Whole& b) const { return {x - b.x, y - b.y, z - b.z}; }
  [[nodiscard]] Integer dot(const Whole& b) const { return x * b.x + y * b.y + z * b.z; }
  [[nodiscard]] Whole cross(const Whole& b) const {
    return {y * b.z - z * b.y, z * b.x - x * b.z, x * b.y - y * b.x};
  }
};

// A vector in doubles with a bound for the error of each coordinate, and exactly if need be.
class Vector {
 public:
  Vector(const Point& rounded, const Point& error, std::function<Whole()> make)
      : rounded_(rounded), error_(error.array() + kTiny), make_(std::move(make)) {}

  [[nodiscard]] const Point& rounded() const { return rounded_; }
  [[nodiscard]] const Point& error() const { return error_; }
  [[nodiscard]] const Whole& exact() const {
    if (!exact_) exact_ = make_();
    return *exact_;
  }
  [[nodiscard]] bool is_zero() const {
    return !(rounded_.array().abs() > error_.array()).any() && exact().is_zero();
  }

 private:
  Point rounded_, error_;
  std::function<Whole()> make_;
  mutable std::optional<Whole> exact_;
};

}  // namespace

// p, differences to it and the signs that are asked of it.
class ExactHull::Apex {
 public:
  Apex(const Point& p, int power) : p_(p), power_(power) {}

  // The sign of n . (p - x).
  [[nodiscard]] int sign(const Vector& n, const Point& x) const {
    const Point d = p_ - x;
    const Point terms = n.rounded().cwiseProduct(d);
    const double sum = terms.sum();
    const double error = kRounding * terms.cwiseAbs().sum() +
                         n.error().dot(d.cwiseAbs()) * (1.0 + kRounding) + kTiny;
    if (sum > error) return 1;
    if (sum < -error) return -1;
    return n.exact().dot(exactly_from(x)).sign();
  }

  // p - x
  [[nodiscard]] Vector from(const Point& x) const {
    const Point d = p_ - x;
    return {d, kRounding * d.cwiseAbs(), [this, x] { return exactly_from(x); }};
  }

  // An n in the plane n . w = 0, w = p - v, with n . (p - x) > 0 for the origin, the hints and the
  // set. What counts of each p - x is its part across w; these directions must fit into less than
  // half a turn about w, between a rightmost and a leftmost one.
  [[nodiscard]] std::optional<Vector> in_plane(const Point& v, std::span<const Point> hints,
                                               std::span<const Point> set) const {
    Point rightmost = Point::Zero(), leftmost = rightmost;  // the x
    Vector right = quarter_turn(v, rightmost);              // points left of the rightmost
    Vector left = right;                                    // points left of the leftmost
    if (right.is_zero()) return std::nullopt;
    const Vector along = across(v, rightmost);  // the only direction until two differ
    bool differ = false;
    for (const auto& points : {hints, set}) {
      for (const Point& x : points) {
        if (x == p_ || x == rightmost || x == leftmost) continue;
        const int of_right = sign(right, x);
        const int of_left = differ ? sign(left, x) : of_right;
        if (!differ && of_right == 0) {
          if (sign(along, x) <= 0) return std::nullopt;
        } else if (of_right > 0 && of_left > 0) {
          left = quarter_turn(v, leftmost = x);
          differ = true;
        } else if (of_right < 0 && of_left < 0) {
          right = quarter_turn(v, rightmost = x);
          differ = true;
        } else if (!(of_right >= 0 && of_left <= 0 && of_right != of_left)) {
          return std::nullopt;
        }
      }
    }
    return differ ? amid(v, rightmost, leftmost) : along;
  }

 private:
  [[nodiscard]] Whole exactly(const Point& x) const {
    return {integer_of(x.x(), power_), integer_of(x.y(), power_), integer_of(x.z(), power_)};
  }
  [[nodiscard]] Whole exactly_from(const Point& x) const { return exactly(p_).minus(exactly(x)); }

  // w x (p - x): the part of p - x across w, a quarter turn to the left about w = p - v.
  [[nodiscard]] Vector quarter_turn(const Point& v, const Point& x) const {
    const Point w = p_ - v, d = p_ - x;
    return {w.cross(d), kRounding * sum_of_products(w, d),
            [this, v, x] { return exactly_from(v).cross(exactly_from(x)); }};
  }
  // (w x (p - x)) x w: the part of p - x across w.
  [[nodiscard]] Vector across(const Point& v, const Point& x) const {
    const Point w = p_ - v, d = p_ - x;
    return {w.cross(d).cross(w),
            kRounding * sum_of_products(sum_of_products(w, d).array() + kTiny, w), [this, v, x] {
              const Whole exact_w = exactly_from(v);
              return exact_w.cross(exactly_from(x)).cross(exact_w);
            }};
  }
  // w x (p - r) - w x (p - l) = w x (l - r): left of r and right of l.
  [[nodiscard]] Vector amid(const Point& v, const Point& r, const Point& l) const {
    const Point w = p_ - v, d = l - r;
    return {w.cross(d), kRounding * sum_of_products(w, d),
            [this, v, r, l] { return exactly_from(v).cross(exactly(l).minus(exactly(r))); }};
  }
  // a x b with every term made positive.
  [[nodiscard]] static Point sum_of_products(const Point& a, const Point& b) {
    const Point s = a.cwiseAbs(), t = b.cwiseAbs();
    return {s.y() * t.z() + s.z() * t.y(), s.z() * t.x() + s.x() * t.z(),
            s.x() * t.y() + s.y() * t.x()};
  }

  Point p_;
  int power_;
};

ExactHull::ExactHull(std::span<const Point> points) : power_(common_power(points)) {}

void ExactHull::add(const Point& p) { set_.push_back(p); }

bool ExactHull::is_vertex(const Point& p) {
  if (p == Point::Zero()) return false;
  const Apex apex(p, power_);
  // n = main + e * aside with e > 0 as small as need be; aside = p - solved, main . aside = 0.
  Point solved = Point::Zero();
  Vector aside = apex.from(solved);
  std::optional<Vector> main;  // 0 at first
  const auto meets = [&](const Point& x) {
    if (x == solved) return true;
    const int sign = main ? apex.sign(*main, x) : 0;
    return sign > 0 || (sign == 0 && apex.sign(aside, x) > 0);
  };
  const std::vector<Point> hints = hints_;
  const auto solve = [&](const Point& x, std::size_t hints_before, std::size_t set_before) {
    solved = x;
    aside = apex.from(x);
    main = apex.in_plane(x, std::span(hints).first(hints_before),
                         std::span(std::as_const(set_)).first(set_before));
    return main.has_value();
  };
  for (std::size_t i = 0; i < hints.size(); ++i) {
    if (hints[i] != p && !meets(hints[i]) && !solve(hints[i], i, 0)) return false;
  }
  for (std::size_t i = 0; i < set_.size(); ++i) {
    if (set_[i] == p || meets(set_[i])) continue;
    if (hints_.size() < kHints) {
      hints_.push_back(set_[i]);
    } else {
      hints_[next_hint_++ % kHints] = set_[i];
    }
    if (!solve(set_[i], hints.size(), i)) return false;
  }
  return true;
}

bool ExactHull::is_vertex_by(const Point& n, const Point& p) const {
  const auto is_below = [&](const Point& x) {
    const Point terms = n.cwiseProduct(p - x);
    return terms.sum() > kRounding * terms.cwiseAbs().sum() + kTiny;
  };
  return is_below(Point::Zero()) && std::all_of(set_.begin(), set_.end(), [&](const Point& x) {
           return x == p || is_below(x);
         });
}

namespace {

// hull_vertices of points of which no two are at one place.
std::vector<std::uint32_t> vertices_of_distinct(std::span<const Point> points) {
  std::vector<Point> outward(points.size(), Point::Zero());
  std::vector<std::uint32_t> candidates, others;
  if (const auto rough = qhull_vertices(points)) {
    for (const RoughVertex& v : *rough) {
      candidates.push_back(v.index);
      outward[v.index] = v.outward;
    }
  }
  std::vector<bool> is_candidate(points.size());
  for (const std::uint32_t k : candidates) is_candidate[k] = true;
  for (std::uint32_t k = 0; k < points.size(); ++k) {
    if (!is_candidate[k]) others.push_back(k);
  }
  std::shuffle(candidates.begin(), candidates.end(), std::mt19937(1));
  // Neighbours one after the other, so that what decided one decides the next.
  std::vector<std::uint64_t> key(points.size());
  for (const std::uint32_t k : others) key[k] = direction_code(points[k]);
  std::sort(others.begin(), others.end(), [&](auto a, auto b) { return key[a] < key[b]; });

  // Whatever the candidates are at first: at the end no other point is outside their hull, so that
  // their hull is the hull of all.
  ExactHull hull(points);
  for (const std::uint32_t k : candidates) hull.add(points[k]);
  for (const std::uint32_t k : others) {
    if (!hull.is_vertex(points[k])) continue;
    candidates.push_back(k);
    hull.add(points[k]);
  }
  std::erase_if(candidates, [&](std::uint32_t k) {
    return !hull.is_vertex_by(outward[k], points[k]) && !hull.is_vertex(points[k]);
  });
  std::sort(candidates.begin(), candidates.end());
  return candidates;
}

}  // namespace

std::vector<std::uint32_t> hull_vertices(std::span<const Point> points) {
  std::vector<std::uint32_t> order(points.size()), place_of(points.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto key = [&](std::uint32_t k) {
    return std::tie(points[k].x(), points[k].y(), points[k].z());
  };
  std::sort(order.begin(), order.end(), [&](auto a, auto b) { return key(a) < key(b); });
  std::vector<Point> places;
  for (const std::uint32_t k : order) {
    if (places.empty() || places.back() != points[k]) places.push_back(points[k]);
    place_of[k] = static_cast<std::uint32_t>(places.size() - 1);
  }
  std::vector<bool> is_vertex(places.size());
  for (const std::uint32_t place : vertices_of_distinct(places)) is_vertex[place] = true;
  std::vector<std::uint32_t> vertices;
  for (std::uint32_t k = 0; k < points.size(); ++k) {
    if (is_vertex[place_of[k]]) vertices.push_back(k);
  }
  return vertices;
}

bool is_vertex(std::span<const Point> points, std::size_t k) {
  std::vector<Point> shuffled(points.begin(), points.end());
  std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(3));
  ExactHull hull(points);
  for (const Point& p : shuffled) hull.add(p);
  return hull.is_vertex(points[k]);
}

}  // namespace vantage::test
