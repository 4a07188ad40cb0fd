#include "vantage/engine/regions_ahead.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace vantage {
namespace {

// The way is looked at in steps of a twelfth: of prefetch_time 3 s, a step is 0.25 s, which is 4 m
// at 60 km/h and less than prefetch_distance.
constexpr int kMoments = 12;
// m to the side for each metre of the way: a turn by 17 degrees. prefetch_distance allows for more.
constexpr double kSwerve = 0.3;
// What is read around the area that is asked about, so that the next question needs nothing [m].
constexpr double kMore = 50.0;

double distance_to_box(const Bounds2& box, const Eigen::Vector2d& xy) {
  return (box.min - xy).cwiseMax(xy - box.max).cwiseMax(0.0).norm();
}

Bounds2 square(const Eigen::Vector2d& xy, double half) {
  const Eigen::Vector2d off = Eigen::Vector2d::Constant(half);
  return {xy - off, xy + off};
}

}  // namespace

RegionsAhead::RegionsAhead(std::shared_ptr<const RegionDirectory> directory)
    : directory_(std::move(directory)) {}

Result<std::shared_ptr<const RegionsAhead::Around>> RegionsAhead::around(
    const Bounds2& area) const {
  {
    const std::scoped_lock lock(mutex_);
    if (around_ && around_->area.contains(area.min) && around_->area.contains(area.max)) {
      return around_;
    }
  }
  const Eigen::Vector2d more = Eigen::Vector2d::Constant(kMore);
  VANTAGE_TRY(Around more_than_area, read({area.min - more, area.max + more}));
  auto now = std::make_shared<const Around>(std::move(more_than_area));
  const std::scoped_lock lock(mutex_);
  around_ = now;
  return now;
}

Result<RegionsAhead::Around> RegionsAhead::read(const Bounds2& area) const {
  Around around{.area = area, .regions = {}, .places = {}};
  std::vector<Region> regions;
  VANTAGE_TRY(const std::vector<RegionId> meeting, directory_->meeting(area));
  for (const RegionId id : meeting) {
    VANTAGE_TRY(DirectoryEntry entry, directory_->entry(id));
    around.places.push_back({.region = id,
                             .box = bounds_of(entry.region.footprint),
                             .has_map = !entry.summary.empty()});
    regions.push_back(std::move(entry.region));
  }
  if (regions.empty()) return around;
  VANTAGE_TRY(around.regions, Partition::from(std::move(regions)));
  return around;
}

RegionsAhead::Nearest RegionsAhead::nearest_of(const Around& around, const Eigen::Vector2d& xy) {
  Nearest nearest;
  for (std::size_t k = 0; k < around.places.size(); ++k) {
    const Place& place = around.places[k];
    if (!place.has_map || distance_to_box(place.box, xy) >= nearest.distance) continue;
    const double d = around.distance_to(k, xy);
    if (d < nearest.distance) nearest = {place.region, d};
  }
  return nearest;
}

Result<RegionId> RegionsAhead::nearest(const Eigen::Vector2d& xy) const {
  VANTAGE_TRY(const auto here, around(square(xy, 0.0)));
  const Nearest nearby = nearest_of(*here, xy);
  const double known =  // every region nearer than this is here
      std::min((xy - here->area.min).minCoeff(), (here->area.max - xy).minCoeff());
  if (nearby.distance <= known) return nearby.region;
  // Squares around the place, until one is sure to hold the nearest region, or all of them.
  const Bounds2& extent = directory_->summary().extent;
  for (double half = std::max(kMore, 2.0 * distance_to_box(extent, xy));; half *= 2.0) {
    VANTAGE_TRY(const Around there, read(square(xy, half)));
    const Nearest nearest = nearest_of(there, xy);
    const bool has_all = there.area.contains(extent.min) && there.area.contains(extent.max);
    if (nearest.distance <= half || has_all || !std::isfinite(half)) return nearest.region;
  }
}

Result<std::optional<RegionId>> RegionsAhead::owner_of(const Point& place) const {
  if (!place.allFinite()) return std::nullopt;
  VANTAGE_TRY(const auto here, around(square(place.head<2>(), 0.0)));
  const auto owner = here->regions.locate(place);  // Eq. 11 is Eq. 2
  if (!owner || !here->places[owner->value].has_map) return std::nullopt;
  return here->places[owner->value].region;
}

Result<RegionsAhead::Choice> RegionsAhead::choose(const std::optional<RegionId>& in_use,
                                                  const Point& place, double margin) const {
  const Eigen::Vector2d xy = place.head<2>();
  VANTAGE_TRY(const auto owner, owner_of(place));
  if (!owner) {
    if (in_use) return Choice{*in_use, true};
    VANTAGE_TRY(const RegionId closest, nearest(xy));
    return Choice{closest, true};
  }
  if (in_use && *owner != *in_use && margin > 0.0) {
    VANTAGE_TRY(const DirectoryEntry entry, directory_->entry(*in_use));
    const HeightInterval& height = entry.region.height;
    const double above = std::max({0.0, height.min - place.z(), place.z() - height.max});
    if (std::hypot(distance(entry.region.footprint, xy), above) <= margin) {
      return Choice{*in_use, false};
    }
  }
  return Choice{*owner, false};
}

Result<std::vector<RegionId>> RegionsAhead::operator()(const Eigen::Vector2d& xy,
                                                       const Eigen::Vector2d& velocity,
                                                       double seconds, double margin) const {
  const double way = velocity.norm() * seconds;
  const double reach = margin + (1.0 + kSwerve) * way;
  VANTAGE_TRY(const auto here, around(square(xy, reach)));
  std::vector<std::tuple<int, double, RegionId>> ahead;  // when, how far from here, which region
  for (std::size_t k = 0; k < here->places.size(); ++k) {
    const Place& place = here->places[k];
    const double from_here = distance_to_box(place.box, xy);
    if (!place.has_map || from_here > reach) continue;
    for (int moment = 0; moment <= kMoments; ++moment) {
      const double share = static_cast<double>(moment) / kMoments;
      const Eigen::Vector2d there = xy + share * seconds * velocity;
      if (here->distance_to(k, there) > margin + kSwerve * share * way) continue;
      ahead.emplace_back(moment, from_here, place.region);
      break;
    }
  }
  std::sort(ahead.begin(), ahead.end());
  std::vector<RegionId> regions;
  for (const auto& [moment, from_here, region] : ahead) regions.push_back(region);
  return regions;
}

std::string RegionsAhead::name_of(RegionId region) const {
  const auto entry = directory_->entry(region);
  return entry ? "'" + entry->region.label + "'" : std::to_string(region.value);
}

}  // namespace vantage
