#include "localize/pose_search.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "evenly_picked.hpp"

namespace vantage {
namespace {

constexpr std::size_t kPlaces = 16;
// A place with less contrast than this share of the best one's is not tried.
constexpr double kWorthTrying = 0.4;
constexpr std::size_t kFirstPoints = 1000;  // that are aligned first
constexpr std::size_t kWhole = 5;           // poses from which the whole scan is aligned
// A find beside the best one is a rival if its level is this part of the best one's.
constexpr double kAsHigh = 0.5;

using Cell = std::pair<std::int64_t, std::int64_t>;

Cell cell_of(const Point& p, double width) {
  return {static_cast<std::int64_t>(std::floor(p.x() / width)),
          static_cast<std::int64_t>(std::floor(p.y() / width))};
}

struct Start {
  RegionId region;
  std::shared_ptr<const ReadyRegion> map;
  Pose T_map_scan;
};

/// Nothing if nothing matches there.
Result<std::optional<Find>> align_at(const Start& start, PointsView scan, PointsView some,
                                     const Fit& to_itself, const AlertLimit& limit) {
  const MatchTarget& target = *start.map->target;
  auto alignment = target.align(scan, start.T_map_scan);
  if (!alignment) {
    if (alignment.error().code == ErrorCode::too_few_matches) return std::optional<Find>();
    return fail(std::move(alignment).error());
  }
  if (!is_valid(alignment->T_map_scan)) return std::optional<Find>();
  VANTAGE_TRY(const Fit fit, fit_at(target, some, alignment->T_map_scan, limit));
  return Find{start.region, start.map, *std::move(alignment), evidence_of(fit, to_itself)};
}

/// Aligns from every start; starts from which nothing matches are left out.
Result<std::vector<Find>> align_from(const std::vector<Start>& starts, PointsView scan,
                                     PointsView some, const Fit& to_itself,
                                     const AlertLimit& limit) {
  std::vector<Result<std::optional<Find>>> found(starts.size());
  tbb::parallel_for(std::size_t{0}, starts.size(), [&](std::size_t k) {
    found[k] = align_at(starts[k], scan, some, to_itself, limit);
  });
  std::vector<Find> finds;
  for (auto& find : found) {
    VANTAGE_TRY(auto one, std::move(find));
    if (one) finds.push_back(*std::move(one));
  }
  // A stable order: starts have one.
  std::stable_sort(finds.begin(), finds.end(), [](const Find& a, const Find& b) {
    return a.evidence.share > b.evidence.share;
  });
  return finds;
}

Start start_at(const Find& find) { return {find.region, find.map, find.alignment.T_map_scan}; }

/// Starts around a pose. On a map that has changed, one alignment often ends some decimetres off.
std::vector<Start> starts_around(const Find& find) {
  constexpr double kMoved = 0.8, kTurned = 3.0 * std::numbers::pi / 180.0;  // [m], [rad]
  const Eigen::Matrix3d R = find.alignment.T_map_scan.rotation.toRotationMatrix();
  std::vector<Start> starts;
  for (const double side : {-1.0, 1.0}) {
    for (const Eigen::Index axis : {0, 1}) {
      Start moved = start_at(find);
      moved.T_map_scan.translation += side * kMoved * R.col(axis);
      starts.push_back(std::move(moved));
    }
    Start turned = start_at(find);
    turned.T_map_scan.rotation =
        rotation_from_vector({0.0, 0.0, side * kTurned}) * turned.T_map_scan.rotation;
    starts.push_back(std::move(turned));
  }
  return starts;
}

/// The places worth trying, region by region, with their maps.
Result<std::vector<Start>> starts_at(const SearchedBundle& bundle, const std::vector<Place>& places,
                                     const Pose& T_level_sensor, SearchWork& work,
                                     const std::stop_token& stop) {
  std::map<RegionId, std::vector<Pose>> by_region;
  for (const Place& place : places) {
    if (place.contrast < kWorthTrying * places.front().contrast) break;
    const Pose T_map_scan = place.T_map_scan * T_level_sensor;
    VANTAGE_TRY(const RegionId region, bundle.regions.at(T_map_scan.translation));
    by_region[region].push_back(T_map_scan);
  }
  std::vector<Start> starts;
  for (const auto& [region, poses] : by_region) {
    if (stop.stop_requested()) break;
    VANTAGE_TRY(const auto map, bundle.maps.borrow(region));
    if (bundle.regions.size() > 1) work.loaded += map->map_points;
    for (const Pose& pose : poses) starts.push_back({region, map, pose});
  }
  return starts;
}

/// The finds that differ from better ones.
std::vector<Find> different(const std::vector<Find>& finds, std::size_t most) {
  std::vector<Find> kept;
  for (const Find& find : finds) {
    if (kept.size() == most) break;
    const Pose& pose = find.alignment.T_map_scan;
    if (std::none_of(kept.begin(), kept.end(), [&](const Find& other) {
          return is_same_pose(other.alignment.T_map_scan, pose);
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

Result<Finds> search_pose(const SearchedBundle& bundle, PointsView scan, PointsView some,
                          const Fit& to_itself, const AlertLimit& limit, const PlaceArea& area,
                          const Pose& T_level_sensor, const std::stop_token& stop) {
  PointCloud level;
  level.reserve(scan.size());
  for (const Point& p : scan) level.push_back(T_level_sensor * p);
  const PointCloud upright = upright_part(level);
  const PlacesFound places = find_places(bundle.places, upright, area, kPlaces, stop);
  Finds result;
  result.work.words = places.words;
  VANTAGE_TRY(std::vector<Start> starts,
              starts_at(bundle, places.places, T_level_sensor, result.work, stop));
  result.aligned = starts.size();
  if (stop.stop_requested()) return result;

  const auto align = [&](PointsView points, const std::vector<Start>& from) {
    result.work.aligned += from.size() * points.size();
    return align_from(from, points, some, to_itself, limit);
  };
  VANTAGE_TRY(const auto first, align(evenly_picked(scan, kFirstPoints), starts));
  starts.clear();
  for (const Find& find : different(first, kWhole)) starts.push_back(start_at(find));
  VANTAGE_TRY(auto found, align(scan, starts));
  found = different(found, kWhole);
  if (!found.empty()) {
    VANTAGE_TRY(const auto near, align(scan, starts_around(found[0])));
    for (const Find& find : near) {
      if (level_of(find.alignment) > level_of(found[0].alignment)) found[0] = find;
    }
    for (const Find& find : near) {
      if (level_of(find.alignment) >= kAsHigh * level_of(found[0].alignment)) found.push_back(find);
    }
  }
  result.finds = different(found, kWhole);
  return result;
}

Result<std::vector<Find>> align_again(const std::vector<Find>& finds, const Pose& T_then_now,
                                      PointsView scan, PointsView some, const Fit& to_itself,
                                      const AlertLimit& limit) {
  std::vector<Start> starts;
  for (const Find& find : finds) {
    starts.push_back(start_at(find));
    starts.back().T_map_scan = starts.back().T_map_scan * T_then_now;
  }
  VANTAGE_TRY(const auto again, align_from(starts, scan, some, to_itself, limit));
  return different(again, finds.size());
}

}  // namespace vantage
