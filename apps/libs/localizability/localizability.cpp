#include "localizability/localizability.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace vantage {

bool is_weak(const SitePrecision& precision) noexcept {
  return precision.sigma_weak > kWeakRatio * precision.sigma_strong;
}

double expected_error(const Site& site) noexcept {
  return site.precision ? site.precision->expected_error : std::numeric_limits<double>::infinity();
}

double weak_bearing(const SitePrecision& precision) noexcept {
  const double bearing = 90.0 - precision.weak_direction * 180.0 / std::numbers::pi;
  return bearing < 0.0 ? bearing + 180.0 : bearing;
}

double distance(const Site& site, const AlikePlace& place) noexcept {
  return (place.T_map_scan.translation - site.position).head<2>().norm();
}

const AlikePlace* nearest_alike(const Site& site) noexcept {
  const auto nearest = std::min_element(site.alike.begin(), site.alike.end(),
                                        [&](const AlikePlace& a, const AlikePlace& b) {
                                          return distance(site, a) < distance(site, b);
                                        });
  return nearest == site.alike.end() ? nullptr : &*nearest;
}

double Localizability::share(std::size_t of_sites) const noexcept {
  return sites == 0 ? 0.0 : static_cast<double>(of_sites) / static_cast<double>(sites);
}

Localizability localizability_of(const Atlas& atlas, double alert_limit) {
  Localizability all;
  std::vector<double> errors, basins;
  for (const Site& site : atlas.sites) {
    ++all.sites;
    if (!site.alike.empty()) ++all.alike;
    if (expected_error(site) > alert_limit) ++all.beyond_limit;
    if (!site.precision) {
      ++all.unmatched;
      continue;
    }
    if (is_weak(*site.precision)) ++all.weak;
    errors.push_back(site.precision->expected_error);
    basins.push_back(site.precision->basin);
  }
  all.expected_error = statistics_of(errors);
  all.basin = statistics_of(basins);
  return all;
}

std::vector<const Site*> worst_sites(const Atlas& atlas, std::size_t most) {
  std::vector<const Site*> sites;
  for (const Site& site : atlas.sites) sites.push_back(&site);
  std::stable_sort(sites.begin(), sites.end(), [](const Site* a, const Site* b) {
    return expected_error(*a) > expected_error(*b);
  });
  sites.resize(std::min(most, sites.size()));
  return sites;
}

}  // namespace vantage
