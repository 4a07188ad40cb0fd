#include "localize/search_area.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vantage {
namespace {

// A search this far [m] takes a fraction of a second.
constexpr double kQuick = 400.0;

/// Twice as far at each scan. Once that is everywhere, only now and then, because it takes long.
std::optional<double> search_radius(std::uint32_t scans, double everywhere,
                                    const LocalizerParams& params) {
  const double first = everywhere <= kQuick ? everywhere : params.search_first_radius;
  const double radius = std::ldexp(first, static_cast<int>(std::min(scans, 60U)) - 1);
  if (scans <= 2 || radius < 2.0 * everywhere) return std::min(radius, everywhere);
  if (scans % params.search_pause == 0) return everywhere;
  return {};
}

/// Twice as far after so many scans in a row that did not find the sensor: the prior may be wrong.
std::optional<PlaceArea> around(const PosePrior& prior, std::uint32_t scans) {
  constexpr double kSigmas = 3.0, kSlack = 2.0;  // [m]
  constexpr std::uint32_t kPatience = 16;
  const double sigma = prior.sigma_translation.head<2>().maxCoeff();
  if (!std::isfinite(sigma)) return {};
  PlaceArea area;
  area.centre = prior.T_map_sensor.translation.head<2>();
  area.radius = std::ldexp(kSlack + kSigmas * sigma, static_cast<int>(scans / kPatience));
  area.heading = heading_of(prior.T_map_sensor);
  area.heading_within = scans < kPatience
                            ? std::min(std::numbers::pi, kSigmas * prior.sigma_heading)
                            : std::numbers::pi;
  return area;
}

}  // namespace

std::optional<PlaceArea> search_area(const std::optional<PosePrior>& prior,
                                     const std::optional<Pose>& predicted, const Bounds3& map,
                                     std::uint32_t scans, bool everywhere,
                                     const LocalizerParams& params) {
  if (prior) {
    if (auto area = around(*prior, scans)) {
      const bool is_quick = area->radius <= kQuick;
      return is_quick || scans % params.search_pause == 0 ? area : std::nullopt;
    }
  }
  if (!predicted) {
    if (scans > 2 && scans % params.search_pause != 0) return {};
    return PlaceArea();
  }
  PlaceArea area;
  area.centre = predicted->translation.head<2>();
  const Eigen::Vector2d least = map.min.head<2>(), most = map.max.head<2>();
  // The distance to the farthest place of the map, and to the nearest one.
  const double farthest =
      (area.centre - least).cwiseAbs().cwiseMax((area.centre - most).cwiseAbs()).norm();
  const double nearest = distance(HalfOpenBox{least, most}, area.centre);
  const double widest = std::min(farthest, params.recovery_radius.value_or(farthest));
  std::optional<double> radius = everywhere ? widest : search_radius(scans, widest, params);
  // A circle off the map holds no place.
  if (radius && *radius < nearest) radius = widest;
  if (!radius || *radius <= 0.0) return {};
  area.radius = *radius;
  area.complete = *radius >= widest;
  return area;
}

}  // namespace vantage
