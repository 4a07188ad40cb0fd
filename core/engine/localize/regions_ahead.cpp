#include "localize/regions_ahead.hpp"

#include <algorithm>
#include <limits>
#include <tuple>

namespace vantage {
namespace {

// The way is looked at in steps of a twelfth: of prefetch_time 3 s, a step is 0.25 s, which is 4 m
// at 60 km/h and less than prefetch_distance.
constexpr int kMoments = 12;
// m to the side for each metre of the way: a turn by 17 degrees. prefetch_distance allows for more.
constexpr double kSwerve = 0.3;

double distance_to_box(const Eigen::Vector2d& min, const Eigen::Vector2d& max,
                       const Eigen::Vector2d& xy) {
  return (min - xy).cwiseMax(xy - max).cwiseMax(0.0).norm();
}

}  // namespace

RegionsAhead::RegionsAhead(const MapIndex& index) : index_(index) {
  for (std::uint32_t r = 0; r < index.partition.size(); ++r) {
    if (index.regions[r].empty()) continue;
    const Bounds2 bounds = bounds_of(index.partition[RegionId{r}].footprint);
    places_.push_back({bounds.min, bounds.max, RegionId{r}});
  }
}

RegionId RegionsAhead::nearest(const Eigen::Vector2d& xy) const {
  RegionId nearest;
  double nearest_distance = std::numeric_limits<double>::infinity();
  for (const Place& place : places_) {
    if (distance_to_box(place.min, place.max, xy) >= nearest_distance) continue;
    const double d = distance(footprint_of(place), xy);
    if (d >= nearest_distance) continue;
    nearest = place.region;
    nearest_distance = d;
  }
  return nearest;
}

RegionId RegionsAhead::at(const Point& place) const {
  const auto owner = index_.partition.locate(place);
  return owner && !index_.regions[owner->value].empty() ? *owner : nearest(place.head<2>());
}

std::vector<RegionId> RegionsAhead::operator()(const Eigen::Vector2d& xy,
                                               const Eigen::Vector2d& velocity, double seconds,
                                               double margin) const {
  const double way = velocity.norm() * seconds;
  const double reach = margin + (1.0 + kSwerve) * way;
  std::vector<std::tuple<int, double, RegionId>> ahead;  // when, how far from here, which region
  for (const Place& place : places_) {
    const double from_here = distance_to_box(place.min, place.max, xy);
    if (from_here > reach) continue;
    const Footprint& footprint = footprint_of(place);
    for (int moment = 0; moment <= kMoments; ++moment) {
      const double share = static_cast<double>(moment) / kMoments;
      const Eigen::Vector2d there = xy + share * seconds * velocity;
      if (distance(footprint, there) > margin + kSwerve * share * way) continue;
      ahead.emplace_back(moment, from_here, place.region);
      break;
    }
  }
  std::sort(ahead.begin(), ahead.end());
  std::vector<RegionId> regions;
  for (const auto& [moment, from_here, region] : ahead) regions.push_back(region);
  return regions;
}

}  // namespace vantage
