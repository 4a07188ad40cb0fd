#include "view/sites.hpp"

#include <cmath>

#include "localizability/localizability.hpp"
#include "view/scene.hpp"

namespace vantage::view {

std::vector<SiteMark> site_marks(const Atlas& atlas, const Point& origin,
                                 const std::optional<RegionId>& region, double unit) {
  constexpr double kMostRatio = 6.0;
  std::vector<SiteMark> marks;
  for (const Site& site : atlas.sites) {
    if (region && site.region != *region) continue;
    SiteMark mark{.at = site.position - origin,
                  .color = badness(share_of_error(expected_error(site))),
                  .weak = {},
                  .alike = {}};
    if (const auto& p = site.precision) {
      const double ratio = p->sigma_weak < kMostRatio * p->sigma_strong
                               ? p->sigma_weak / p->sigma_strong
                               : kMostRatio;
      const double half = unit * (2.0 * ratio - 1.0);
      const Point along(half * std::cos(p->weak_direction), half * std::sin(p->weak_direction), 0);
      mark.weak = {mark.at - along, mark.at + along};
    }
    for (const AlikePlace& place : site.alike) {
      mark.alike.push_back(place.T_map_scan.translation - origin);
    }
    marks.push_back(std::move(mark));
  }
  return marks;
}

}  // namespace vantage::view
