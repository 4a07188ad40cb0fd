#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <utility>

namespace vantage::matching {

/// The robust loss: how much a match with a large residual counts.
enum class Kernel : std::uint8_t { geman_mcclure, huber, none };
constexpr auto enum_names(Kernel /*unused*/) {
  using namespace std::string_view_literals;
  return std::array{std::pair{"geman_mcclure"sv, Kernel::geman_mcclure},
                    std::pair{"huber"sv, Kernel::huber}, std::pair{"none"sv, Kernel::none}};
}

/// The loss rho(s) of a squared normalized residual s, with scale c, and its derivative.
struct RobustLoss {
  Kernel kernel = Kernel::geman_mcclure;
  double scale = 1.0;  ///< c, in standard deviations

  /// geman_mcclure: s / (1 + s/c^2); huber: s up to c^2, beyond it 2 c sqrt(s) - c^2; none: s.
  [[nodiscard]] double value(double s) const noexcept {
    const double c2 = scale * scale;
    switch (kernel) {
      case Kernel::geman_mcclure: return s / (1.0 + s / c2);
      case Kernel::huber: return s <= c2 ? s : 2.0 * scale * std::sqrt(s) - c2;
      case Kernel::none: break;
    }
    return s;
  }

  /// d rho / d s, in (0, 1]: the weight of the match in iteratively reweighted least squares.
  [[nodiscard]] double weight(double s) const noexcept {
    const double c2 = scale * scale;
    switch (kernel) {
      case Kernel::geman_mcclure: return c2 * c2 / ((c2 + s) * (c2 + s));
      case Kernel::huber: return s <= c2 ? 1.0 : scale / std::sqrt(s);
      case Kernel::none: break;
    }
    return 1.0;
  }
};

}  // namespace vantage::matching
