#include "exact_sign.hpp"

#include <array>
#include <cmath>
#include <cstddef>

namespace vantage::hpr {
namespace {

/// A number as the exact sum of doubles that do not overlap, in ascending magnitude (Shewchuk
/// 1997).
template <std::size_t Capacity>
class Expansion {
 public:
  void add(double x) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < size_; ++i) {
      const double sum = x + terms_[i];
      const double shadow = sum - x;
      const double rest = (x - (sum - shadow)) + (terms_[i] - shadow);
      if (rest != 0.0) terms_[kept++] = rest;
      x = sum;
    }
    if (x != 0.0) terms_[kept++] = x;
    size_ = kept;
  }
  void add_product(double x, double y) {
    const double product = x * y;
    add(std::fma(x, y, -product));
    add(product);
  }
  template <std::size_t N>
  void add_scaled(const Expansion<N>& other, double factor) {
    for (std::size_t i = 0; i < other.size(); ++i) add_product(other[i], factor);
  }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] double operator[](std::size_t i) const { return terms_[i]; }
  [[nodiscard]] Sign sign() const {
    if (size_ == 0) return Sign::zero;
    return terms_[size_ - 1] > 0.0 ? Sign::positive : Sign::negative;
  }

 private:
  std::array<double, Capacity> terms_{};
  std::size_t size_ = 0;
};

/// Adds factor * det(a, b, c); factor is 1 or -1.
template <std::size_t N>
void add_triple(Expansion<N>& sum, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                const Eigen::Vector3d& c, double factor) {
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Eigen::Index j = (i + 1) % 3, k = (i + 2) % 3;
    Expansion<4> cofactor;
    cofactor.add_product(b[j], c[k]);
    cofactor.add_product(-b[k], c[j]);
    sum.add_scaled(cofactor, factor * a[i]);
  }
}

}  // namespace

Sign sign_of_triple(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  Expansion<24> sum;
  add_triple(sum, a, b, c, 1.0);
  return sum.sign();
}

Sign sign_of_volume(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                    const Eigen::Vector3d& d) {
  Expansion<96> sum;
  add_triple(sum, b, c, d, 1.0);
  add_triple(sum, a, c, d, -1.0);
  add_triple(sum, a, b, d, 1.0);
  add_triple(sum, a, b, c, -1.0);
  return sum.sign();
}

Sign sign_of_turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  Expansion<12> sum;
  const auto add_minor = [&](const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
    sum.add_product(p.x(), q.y());
    sum.add_product(-p.y(), q.x());
  };
  add_minor(a, b);
  add_minor(b, c);
  add_minor(c, a);
  return sum.sign();
}

}  // namespace vantage::hpr
