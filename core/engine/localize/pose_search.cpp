#include "localize/pose_search.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

namespace vantage {
namespace {

constexpr std::size_t kPlaces = 16;
// A place with less contrast than this share of the best one's is not tried.
constexpr double kWorthTrying = 0.4;
constexpr std::size_t kFirstPoints = 1000;  // that are aligned first
constexpr std::size_t kWhole = 5;           // poses from which the whole scan is aligned
// Poses nearer to each other than this are one find.
constexpr double kSameMetres = 1.0, kSameRadians = std::numbers::pi / 36.0;

using Cell = std::pair<std::int64_t, std::int64_t>;

Cell cell_of(const Point& p, double width) {
  return {static_cast<std::int64_t>(std::floor(p.x() / width)),
          static_cast<std::int64_t>(std::floor(p.y() / width))};
}

/// The region that owns a place, otherwise the nearest one with a map.
RegionId region_at(const MapIndex& index, const Point& place) {
  const auto owner = index.partition.locate(place);
  if (owner && !index.regions[owner->value].empty()) return *owner;
  RegionId nearest;
  double least = std::numeric_limits<double>::infinity();
  for (std::uint32_t r = 0; r < index.regions.size(); ++r) {
    if (index.regions[r].empty()) continue;
    const double away = distance(index.partition[RegionId{r}].footprint, place.head<2>());
    if (away < least) {
      least = away;
      nearest = RegionId{r};
    }
  }
  return nearest;
}

struct Start {
  RegionId region;
  Pose T_map_scan;
};

/// Aligns from every start; starts from which nothing matches are left out.
Result<std::vector<Find>> align_from(const RegionMaps& maps, PointsView scan, PointsView some,
                                     const Fit& to_itself, const std::vector<Start>& starts) {
  std::map<RegionId, std::vector<Pose>> by_region;
  for (const Start& start : starts) by_region[start.region].push_back(start.T_map_scan);
  std::vector<Find> finds;
  for (const auto& [region, poses] : by_region) {
    VANTAGE_TRY(const auto ready, maps.borrow(region));
    std::vector<Result<std::optional<Find>>> found(poses.size());
    tbb::parallel_for(
        std::size_t{0}, poses.size(), [&, &from = poses, &in = region](std::size_t k) {
          found[k] = [&]() -> Result<std::optional<Find>> {
            auto alignment = ready->target->align(scan, from[k]);
            if (!alignment) {
              if (alignment.error().code == ErrorCode::too_few_matches)
                return std::optional<Find>();
              return fail(std::move(alignment).error());
            }
            if (!is_valid(alignment->T_map_scan)) return std::optional<Find>();
            VANTAGE_TRY(const Fit fit, fit_at(*ready->target, some, alignment->T_map_scan));
            return std::optional<Find>(
                Find{in, *std::move(alignment), evidence_of(fit, to_itself)});
          }();
        });
    for (auto& find : found) {
      VANTAGE_TRY(auto one, std::move(find));
      if (one) finds.push_back(*std::move(one));
    }
  }
  // A stable order: regions and starts have one.
  std::stable_sort(finds.begin(), finds.end(), [](const Find& a, const Find& b) {
    return a.evidence.share > b.evidence.share;
  });
  return finds;
}

/// Starts around a pose. On a map that has changed, one alignment often ends some decimetres off.
std::vector<Start> starts_around(const Find& find) {
  constexpr double kMoved = 0.8, kTurned = 3.0 * std::numbers::pi / 180.0;  // [m], [rad]
  const Eigen::Matrix3d R = find.alignment.T_map_scan.rotation.toRotationMatrix();
  std::vector<Start> starts;
  for (const double side : {-1.0, 1.0}) {
    for (const Eigen::Index axis : {0, 1}) {
      Pose moved = find.alignment.T_map_scan;
      moved.translation += side * kMoved * R.col(axis);
      starts.push_back({find.region, moved});
    }
    Pose turned = find.alignment.T_map_scan;
    turned.rotation = rotation_from_vector({0.0, 0.0, side * kTurned}) * turned.rotation;
    starts.push_back({find.region, turned});
  }
  return starts;
}

double level_of(const Find& find) {
  return find.alignment.score.nvtl * find.alignment.score.coverage;
}

/// The finds that differ from better ones.
std::vector<Find> different(const std::vector<Find>& finds, std::size_t most) {
  std::vector<Find> kept;
  for (const Find& find : finds) {
    if (kept.size() == most) break;
    const Pose& pose = find.alignment.T_map_scan;
    if (std::none_of(kept.begin(), kept.end(), [&](const Find& other) {
          return (other.alignment.T_map_scan.translation - pose.translation).norm() < kSameMetres &&
                 rotation_between(other.alignment.T_map_scan, pose) < kSameRadians;
        })) {
      kept.push_back(find);
    }
  }
  return kept;
}

}  // namespace

PointCloud upright_part(PointsView scan) {
  // A cell's ground is the lowest point in it and its neighbours: a wall has ground in front of it
  // within 8 m. What lies half a metre above is no curb.
  constexpr double kCell = 4.0, kAbove = 0.5;
  std::map<Cell, double> lowest;
  for (const Point& p : scan) {
    const Cell cell = cell_of(p, kCell);
    for (std::int64_t dx = -1; dx <= 1; ++dx) {
      for (std::int64_t dy = -1; dy <= 1; ++dy) {
        const auto [at, first] = lowest.try_emplace({cell.first + dx, cell.second + dy}, p.z());
        if (!first) at->second = std::min(at->second, p.z());
      }
    }
  }
  PointCloud upright;
  for (const Point& p : scan) {
    if (p.z() > lowest.at(cell_of(p, kCell)) + kAbove) upright.push_back(p);
  }
  constexpr std::size_t kFewest = 60;  // fewer points do not tell one place from another
  if (upright.size() < kFewest) upright.assign(scan.begin(), scan.end());
  return upright;
}

Result<Finds> search_pose(const MapIndex& index, const RegionMaps& maps, const PlaceIndex& places,
                          PointsView scan, PointsView some, const Fit& to_itself,
                          const PlaceArea& area) {
  const PointCloud upright = upright_part(scan);
  std::vector<Start> starts;
  double best = 0.0;
  for (const Place& place : find_places(places, upright, area, kPlaces)) {
    best = std::max(best, place.contrast);
    if (place.contrast < kWorthTrying * best) break;
    starts.push_back({region_at(index, place.T_map_scan.translation), place.T_map_scan});
  }
  Finds result{.finds = {}, .aligned = starts.size()};
  VANTAGE_TRY(const auto first,
              align_from(maps, evenly_picked(scan, kFirstPoints), some, to_itself, starts));
  starts.clear();
  for (const Find& find : different(first, kWhole)) {
    starts.push_back({find.region, find.alignment.T_map_scan});
  }
  VANTAGE_TRY(auto found, align_from(maps, scan, some, to_itself, starts));
  found = different(found, kWhole);
  if (!found.empty()) {
    VANTAGE_TRY(const auto near, align_from(maps, scan, some, to_itself, starts_around(found[0])));
    for (const Find& find : near) {
      if (level_of(find) > level_of(found[0])) found[0] = find;
    }
  }
  result.finds = different(found, kWhole);
  return result;
}

}  // namespace vantage
