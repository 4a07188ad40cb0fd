#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string_view>
#include <utility>

#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::hpr {

/// How a point p, seen from the viewpoint, is turned inside out.
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
  double radius = 0.0;  ///< R [m]; only the flip depends on it: under inversion it scales the hull
  double max_range = std::numeric_limits<double>::infinity();  ///< [m]
};

/// The points seen from a viewpoint: those that become vertices of the convex hull of all turned
/// points and the viewpoint (Eqs. 7-9). Only points at a distance in (0, max_range] take part.
/// Points at one place are all seen or all hidden. The order of the points does not matter.
///
/// Where all turned points and the viewpoint lie in one plane or on one line, the hull is taken in
/// that plane or on that line.
/// @param map        finite points [m]
/// @param viewpoint  finite [m]
/// @return           strictly ascending indices; empty if no point takes part
/// Errors: `invalid_input` where a point that takes part is farther than R (flip, at least two
/// places); `internal` with Qhull's message if it finds no hull.
/// Thread safety: may run in many threads at once.
[[nodiscard]] Result<IndexList> hidden_point_removal(PointsView map, const Point& viewpoint,
                                                     const Settings& settings);

/// The same answer from Qhull on all points that take part; for tests.
[[nodiscard]] Result<IndexList> hidden_point_removal_by_qhull(PointsView map,
                                                              const Point& viewpoint,
                                                              const Settings& settings);

/// The same answer from Qhull on the points that StarHull cannot prove to be hidden by a margin:
/// what `hidden_point_removal` does where a sign is uncertain; apart for tests.
[[nodiscard]] Result<IndexList> hidden_point_removal_by_culled_qhull(PointsView map,
                                                                     const Point& viewpoint,
                                                                     const Settings& settings);

}  // namespace vantage::hpr
