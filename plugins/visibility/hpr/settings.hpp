#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string_view>
#include <utility>

namespace vantage::hpr {

/// How a point p, relative to the viewpoint, is turned inside out.
enum class Kernel : std::uint8_t {
  spherical_flip,  ///< p + 2 (R - |p|) p / |p| (Katz, Tal, Basri 2007)
  inversion,       ///< R^2 / |p|^2 p (Eq. 8 as printed)
};

constexpr auto enum_names(Kernel) {
  using namespace std::string_view_literals;
  return std::array{std::pair{"spherical_flip"sv, Kernel::spherical_flip},
                    std::pair{"inversion"sv, Kernel::inversion}};
}

struct Settings {
  Kernel kernel = Kernel::spherical_flip;
  double radius = 0.0;  ///< R [m]; only the flip depends on it, since R only scales the hull of the
                        ///< inversion
  double max_range = std::numeric_limits<double>::infinity();  ///< [m]
};

}  // namespace vantage::hpr
