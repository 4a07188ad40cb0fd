#include "exact_hull.hpp"

#include <algorithm>
#include <cmath>
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

// v / 2^power, a whole number.
Integer integer_of(double v, int power) {
  if (v == 0.0) return 0;
  int exponent = 0;
  const double fraction = std::frexp(v, &exponent);  // v = fraction 2^exponent
  int shift = exponent - 53 - power;
  auto mantissa = static_cast<std::int64_t>(std::ldexp(fraction, 53));
  for (; shift < 0; ++shift) mantissa /= 2;  // trailing zeros of a subnormal number
  return Integer(mantissa) << shift;
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

// v / 2^scale within one unit of roundoff; scale is at least the number of bits of v.
double scaled(const Integer& v, int scale) {
  if (v == 0) return 0.0;
  const Integer magnitude = abs(v);
  const int extra = std::max(static_cast<int>(msb(magnitude)) - 62, 0);
  const double leading = static_cast<double>(static_cast<std::int64_t>(magnitude >> extra));
  return std::ldexp(v < 0 ? -leading : leading, extra - scale);
}

int bits_of(const Integer& v) { return v == 0 ? 0 : static_cast<int>(msb(abs(v))) + 1; }

}  // namespace

struct ExactHull::Vector {
  Integer x, y, z;
  Point rounded;         // a multiple of it, each coordinate within 2^-52 of itself
  bool is_fine = false;  // false: a coordinate is too small beside the others to be rounded so

  Vector(Integer a, Integer b, Integer c) : x(std::move(a)), y(std::move(b)), z(std::move(c)) {
    constexpr double kSmallest = 1e-200;
    const int scale = std::max({bits_of(x), bits_of(y), bits_of(z)});
    rounded = {scaled(x, scale), scaled(y, scale), scaled(z, scale)};
    const auto fine = [](const Integer& v, double r) { return v == 0 || std::abs(r) > kSmallest; };
    is_fine = fine(x, rounded.x()) && fine(y, rounded.y()) && fine(z, rounded.z());
  }

  [[nodiscard]] bool is_zero() const { return x == 0 && y == 0 && z == 0; }
  [[nodiscard]] Vector cross(const Vector& b) const {
    return {y * b.z - z * b.y, z * b.x - x * b.z, x * b.y - y * b.x};
  }
  [[nodiscard]] Vector minus(const Vector& b) const { return {x - b.x, y - b.y, z - b.z}; }
};

class ExactHull::Apex {
 public:
  Apex(const Point& p, int power)
      : p_(p),
        power_(power),
        x_(integer_of(p.x(), power)),
        y_(integer_of(p.y(), power)),
        z_(integer_of(p.z(), power)) {}

  // p - x
  [[nodiscard]] Vector from(const Point& x) const {
    return {x_ - integer_of(x.x(), power_), y_ - integer_of(x.y(), power_),
            z_ - integer_of(x.z(), power_)};
  }

  // The sign of n . (p - x).
  [[nodiscard]] int sign(const Vector& n, const Point& x) const {
    const Point terms = n.rounded.cwiseProduct(p_ - x);
    const double sum = terms.sum();
    const double error = 0x1p-49 * terms.cwiseAbs().sum() + 1e-300;
    if (n.is_fine && sum > error) return 1;
    if (n.is_fine && sum < -error) return -1;
    const Integer exact = n.x * (x_ - integer_of(x.x(), power_)) +
                          n.y * (y_ - integer_of(x.y(), power_)) +
                          n.z * (z_ - integer_of(x.z(), power_));
    return exact.sign();
  }

  // An n in the plane n . w = 0 with n . (p - x) > 0 for the origin, the hints and the first `size`
  // of the set. What counts of each p - x is its part across w; these directions must fit into less
  // than half a turn about w, between a rightmost and a leftmost one.
  [[nodiscard]] std::optional<Vector> in_plane(const Vector& w, std::span<const Point> hints,
                                               std::span<const Point> set) const {
    Vector right = w.cross(from(Point::Zero()));  // points left of the rightmost direction
    if (right.is_zero()) return std::nullopt;
    Vector left = right;                  // points left of the leftmost
    const Vector along = right.cross(w);  // the only direction there is until two differ
    bool differ = false;
    for (const auto& points : {hints, set}) {
      for (const Point& x : points) {
        if (x == p_) continue;
        const int of_right = sign(right, x);
        if (!differ) {
          if (of_right > 0) left = w.cross(from(x));
          if (of_right < 0) right = w.cross(from(x));
          if (of_right == 0 && sign(along, x) <= 0) return std::nullopt;
          differ = of_right != 0;
          continue;
        }
        const int of_left = sign(left, x);
        const bool between = of_right >= 0 && of_left <= 0 && of_right != of_left;
        if (between) continue;
        if (of_right > 0 && of_left > 0) {
          left = w.cross(from(x));
        } else if (of_right < 0 && of_left < 0) {
          right = w.cross(from(x));
        } else {
          return std::nullopt;
        }
      }
    }
    return differ ? right.minus(left) : along;
  }

 private:
  Point p_;
  int power_;
  Integer x_, y_, z_;
};

ExactHull::ExactHull(std::span<const Point> points) : power_(common_power(points)) {}

void ExactHull::add(const Point& p) { set_.push_back(p); }

bool ExactHull::is_vertex(const Point& p) {
  if (p == Point::Zero()) return false;
  const Apex apex(p, power_);
  // n = main + e * aside with e > 0 as small as need be.
  Vector main(0, 0, 0), aside = apex.from(Point::Zero());
  const auto meets = [&](const Point& x) {
    const int sign = apex.sign(main, x);
    return sign > 0 || (sign == 0 && apex.sign(aside, x) > 0);
  };
  const std::vector<Point> hints = hints_;
  const auto solve = [&](const Point& x, std::size_t hints_before, std::size_t set_before) {
    aside = apex.from(x);
    auto n = apex.in_plane(aside, std::span(hints).first(hints_before),
                           std::span(std::as_const(set_)).first(set_before));
    if (!n) return false;
    main = *std::move(n);
    return true;
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
    return terms.sum() > 0x1p-49 * terms.cwiseAbs().sum() + 1e-300;
  };
  return is_below(Point::Zero()) && std::all_of(set_.begin(), set_.end(), [&](const Point& x) {
           return x == p || is_below(x);
         });
}

std::vector<std::uint32_t> hull_vertices(std::span<const Point> points) {
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
  // Neighbours one after the other, so that what decided one decides the next.
  const auto cell = [&](std::uint32_t k) {
    const Eigen::Array3d direction = (8.0 * points[k].normalized()).array().round();
    return std::tuple(direction.x(), direction.y(), direction.z());
  };
  std::shuffle(candidates.begin(), candidates.end(), std::mt19937(1));
  std::shuffle(others.begin(), others.end(), std::mt19937(2));
  std::stable_sort(others.begin(), others.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return cell(a) < cell(b); });

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

bool is_vertex(std::span<const Point> points, std::size_t k) {
  std::vector<Point> shuffled(points.begin(), points.end());
  std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(3));
  ExactHull hull(points);
  for (const Point& p : shuffled) hull.add(p);
  return hull.is_vertex(points[k]);
}

}  // namespace vantage::test
