#pragma once

#include <cstddef>
#include <vector>

#include "vantage/engine/atlas.hpp"
#include "vantage/evaluation/statistics.hpp"

namespace vantage {

/// Completes "the bundle has no atlas: ".
inline constexpr const char* kHowToGetAnAtlas = "`vantage assess` makes it";

/// A site is weak in a direction if its largest standard deviation is more than this many times
/// its smallest.
inline constexpr double kWeakRatio = 2.0;
[[nodiscard]] bool is_weak(const SitePrecision& precision) noexcept;

/// The expected error of a site [m]; infinite if a scan from there matches nothing.
[[nodiscard]] double expected_error(const Site& site) noexcept;

/// The axis of which least is known as a bearing, clockwise from the map's y axis [deg], in
/// [0, 180). In a map with y to the north, 0 is north and south, 90 east and west.
[[nodiscard]] double weak_bearing(const SitePrecision& precision) noexcept;

/// A site's alike place that lies nearest to it in plan view; none without alike places.
[[nodiscard]] const AlikePlace* nearest_alike(const Site& site) noexcept;

/// How far from a site an alike place lies in plan view [m].
[[nodiscard]] double distance(const Site& site, const AlikePlace& place) noexcept;

/// An atlas in a few numbers.
struct Localizability {
  std::size_t sites = 0;         ///< all of them
  std::size_t unmatched = 0;     ///< a scan from there matches nothing
  std::size_t beyond_limit = 0;  ///< unmatched, or an expected error above the alert limit
  std::size_t weak = 0;          ///< in a direction
  std::size_t alike = 0;         ///< with alike places
  Statistics expected_error;     ///< [m], over the sites whose scans match
  Statistics basin;              ///< [m], over the same

  /// What of all sites a number of sites is, 0 to 1.
  [[nodiscard]] double share(std::size_t of_sites) const noexcept;
};
/// @param alert_limit  [m]
[[nodiscard]] Localizability localizability_of(const Atlas& atlas, double alert_limit);

/// The sites with the largest expected errors, the worst first; at most `most`.
[[nodiscard]] std::vector<const Site*> worst_sites(const Atlas& atlas, std::size_t most);

}  // namespace vantage
