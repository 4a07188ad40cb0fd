#include "vantage/kit/regions.hpp"

#include <cmath>
#include <limits>

namespace vantage {

std::optional<RegionId> nearest_region(const Partition& partition, const Eigen::Vector2d& xy) {
  if (partition.size() == 0 || !xy.allFinite()) return std::nullopt;
  if (const auto owner = partition.locate(xy)) return owner;
  RegionId best;
  double least = std::numeric_limits<double>::infinity();
  for (std::uint32_t id = 0; id < partition.size(); ++id) {
    const double d = distance(partition.regions()[id].footprint, xy);
    if (d < least) {
      least = d;
      best = RegionId{id};
    }
  }
  return best;
}

tl::unexpected<Error> too_many_regions(const std::string& cause) {
  return fail(ErrorCode::invalid_input,
              cause + " cuts the map into more than " + std::to_string(kMaxRegions) + " regions");
}

HalfOpenBox box_owning(const Eigen::Vector2d& min, const Eigen::Vector2d& max) {
  return {min, max.unaryExpr([](double x) {
            return std::nextafter(x, std::numeric_limits<double>::infinity());
          })};
}

}  // namespace vantage
