#include "localize/pose_search.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <set>
#include <tuple>
#include <utility>

namespace vantage {
namespace {

// The whole scan is aligned from few poses, because each takes as long as a tracked scan.
constexpr std::size_t kAlignedWhole = 5;
// Starts nearer to each other than this count as one: a matcher leads from both to the same pose.
constexpr double kSameMetres = 2.0, kSameRadians = std::numbers::pi / 9.0;

/// A pose to try, and the evidence for it.
struct Start {
  RegionId region;
  Pose T_map_scan;
  double evidence = 0.0;
};

/// Compares by evidence; ties are never broken by chance.
bool better(const Start& a, const Start& b) {
  const auto order = [](const Start& s) {
    return std::tuple(-s.evidence, s.region, s.T_map_scan.translation.x(),
                      s.T_map_scan.translation.y(), s.T_map_scan.rotation.z());
  };
  return order(a) < order(b);
}

bool same(const Pose& a, const Pose& b) {
  return (a.translation - b.translation).norm() < kSameMetres &&
         rotation_between(a, b) < kSameRadians;
}

/// The best starts that differ from each other.
std::vector<Start> best_of(std::vector<Start> starts, std::size_t most) {
  std::sort(starts.begin(), starts.end(), better);
  std::vector<Start> best;
  for (const Start& start : starts) {
    if (best.size() == most) break;
    if (std::none_of(best.begin(), best.end(), [&](const Start& other) {
          return same(start.T_map_scan, other.T_map_scan);
        })) {
      best.push_back(start);
    }
  }
  return best;
}

using Cell = std::pair<std::int64_t, std::int64_t>;

Cell cell_of(const Point& p, double width) {
  return {static_cast<std::int64_t>(std::floor(p.x() / width)),
          static_cast<std::int64_t>(std::floor(p.y() / width))};
}

PointCloud every_nth(PointsView points, std::size_t most) {
  PointCloud some;
  const std::size_t n = std::min(most, points.size());
  for (std::size_t k = 0; k < n; ++k) some.push_back(points[k * points.size() / n]);
  return some;
}

/// The part of a scan that stands up. The ground matches at any heading and says nothing.
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
  return upright;
}

/// One viewpoint per cell, the first.
PointCloud places_in(const ReadyRegion& region, const SearchArea& area) {
  PointCloud places;
  std::set<Cell> taken;
  for (const Point& viewpoint : region.viewpoints) {
    if ((viewpoint - area.centre).head<2>().norm() > area.radius) continue;
    if (!taken.insert(cell_of(viewpoint, area.spacing)).second) continue;
    places.push_back(viewpoint + Point(0, 0, area.height));
  }
  return places;
}

/// The best headings at each place.
Result<std::vector<Start>> score_places(RegionId region, const MatchTarget& target, PointsView scan,
                                        const PointCloud& places, std::uint32_t headings) {
  std::vector<Start> starts(places.size());
  std::vector<Result<void>> outcomes(places.size());
  tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t k) {
    starts[k].region = region;
    for (std::uint32_t heading = 0; heading < headings; ++heading) {
      const double yaw = 2.0 * std::numbers::pi * heading / headings;
      const Pose pose = pose_from_xyz_rpy(places[k], {0.0, 0.0, yaw});
      const auto score = target.score(scan, pose);
      if (!score) {
        outcomes[k] = fail(score.error());
        return;
      }
      if (heading == 0 || evidence(*score) > starts[k].evidence) {
        starts[k].T_map_scan = pose;
        starts[k].evidence = evidence(*score);
      }
    }
  });
  for (const Result<void>& outcome : outcomes) VANTAGE_CHECK(outcome);
  return starts;
}

/// Aligns from every start; starts from which nothing matches are left out.
Result<std::vector<Hypothesis>> align_from(const RegionMaps& maps, PointsView scan,
                                           const std::vector<Start>& starts) {
  std::map<RegionId, std::vector<Pose>> by_region;
  for (const Start& start : starts) by_region[start.region].push_back(start.T_map_scan);
  std::vector<Hypothesis> found;
  for (const auto& [region, poses] : by_region) {
    VANTAGE_TRY(const auto ready, maps.borrow(region));
    std::vector<std::optional<Result<Alignment>>> alignments(poses.size());
    tbb::parallel_for(std::size_t{0}, poses.size(), [&, &from = poses](std::size_t k) {
      alignments[k] = ready->target->align(scan, from[k]);
    });
    for (auto& alignment : alignments) {
      if (*alignment) {
        found.push_back({region, **std::move(alignment)});
      } else if (alignment->error().code != ErrorCode::too_few_matches) {
        return fail(std::move(*alignment).error());
      }
    }
  }
  return found;
}

std::vector<Start> starts_at(const std::vector<Hypothesis>& hypotheses) {
  std::vector<Start> starts;
  for (const Hypothesis& h : hypotheses) {
    if (!is_valid(h.alignment.T_map_scan)) continue;
    starts.push_back({h.region, h.alignment.T_map_scan, evidence(h.alignment.score)});
  }
  return starts;
}

}  // namespace

Result<std::vector<Hypothesis>> search_pose(const MapIndex& index, const RegionMaps& maps,
                                            PointsView scan, const SearchArea& area) {
  PointCloud upright = upright_part(scan);
  constexpr std::size_t kFewest = 60;  // fewer points do not tell one place from another
  if (upright.size() < kFewest) upright.assign(scan.begin(), scan.end());
  if (upright.empty()) return std::vector<Hypothesis>{};
  const PointCloud scored = every_nth(upright, area.scored_points);

  std::vector<Start> starts;
  for (std::uint32_t r = 0; r < index.regions.size(); ++r) {
    const RegionId region{r};
    if (index.regions[r].empty() ||
        distance(index.partition[region].footprint, area.centre.head<2>()) > area.radius) {
      continue;
    }
    VANTAGE_TRY(const auto ready, maps.borrow(region));
    PointCloud places = places_in(*ready, area);
    if (area.guess) places.push_back(area.guess->translation);
    VANTAGE_TRY(std::vector<Start> here,
                score_places(region, *ready->target, scored, places, area.headings));
    starts.insert(starts.end(), here.begin(), here.end());
    starts = best_of(std::move(starts), area.starts);
  }

  VANTAGE_TRY(const auto coarse, align_from(maps, every_nth(scan, area.aligned_points), starts));
  starts = best_of(starts_at(coarse), kAlignedWhole);
  VANTAGE_TRY(std::vector<Hypothesis> found, align_from(maps, scan, starts));
  const std::vector<Start> best = best_of(starts_at(found), kAlignedWhole);
  std::vector<Hypothesis> different;
  for (const Start& start : best) {
    const auto at = std::find_if(found.begin(), found.end(), [&](const Hypothesis& h) {
      return h.region == start.region &&
             h.alignment.T_map_scan.translation == start.T_map_scan.translation;
    });
    different.push_back(*at);
  }
  return different;
}

}  // namespace vantage
