#include "localize/pose_search.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "localize/hypothesis.hpp"
#include "vantage/kit/evenly_picked.hpp"

namespace vantage {
namespace {

// A candidate with less than this share of the best one's score is not tried.
constexpr double kWorthTrying = 0.4;
constexpr std::size_t kFirstPoints = 1000;  // that are aligned first
constexpr std::size_t kWhole = 5;           // poses from which the whole scan is aligned

struct Start {
  RegionId region;
  std::shared_ptr<const ReadyRegion> map;
  Pose T_map_scan;
};

/// Nothing if nothing matches there.
Result<std::optional<Find>> align_at(const Start& start, PointsView scan, PointsView some,
                                     const Fit& to_itself) {
  const MatchTarget& target = *start.map->target;
  auto alignment = target.align(scan, start.T_map_scan);
  if (!alignment) {
    if (alignment.error().code == ErrorCode::too_few_matches) return std::optional<Find>();
    return fail(std::move(alignment).error());
  }
  if (!is_valid(alignment->T_map_scan)) return std::optional<Find>();
  VANTAGE_TRY(const Fit fit, fit_at(target, some, alignment->T_map_scan));
  return Find{start.region, start.map, *std::move(alignment), evidence_of(fit, to_itself).share};
}

/// Aligns from every start; starts from which nothing matches are left out.
Result<std::vector<Find>> align_from(const std::vector<Start>& starts, PointsView scan,
                                     PointsView some, const Fit& to_itself) {
  std::vector<Result<std::optional<Find>>> found(starts.size());
  tbb::parallel_for(std::size_t{0}, starts.size(),
                    [&](std::size_t k) { found[k] = align_at(starts[k], scan, some, to_itself); });
  std::vector<Find> finds;
  for (auto& find : found) {
    VANTAGE_TRY(auto one, std::move(find));
    if (one) finds.push_back(*std::move(one));
  }
  // A stable order: starts have one.
  std::ranges::stable_sort(finds, std::greater(), &Find::share);
  return finds;
}

/// At a find, moved in the map frame [m].
Start start_at(const Find& find, const Point& by = Point::Zero()) {
  Start start{find.region, find.map, find.alignment.T_map_scan};
  start.T_map_scan.translation += by;
  return start;
}

// On a map that has changed, alignments end some decimetres off [m].
constexpr double kMoved = 0.8;

/// Starts above and below a pose: ground is thin, so an alignment does not find it from afar.
std::vector<Start> starts_at_other_heights(const Find& find) {
  return {start_at(find, {0.0, 0.0, -kMoved}), start_at(find, {0.0, 0.0, kMoved})};
}

/// Starts beside a pose, and turned.
std::vector<Start> starts_around(const Find& find) {
  constexpr double kTurned = 3.0 * std::numbers::pi / 180.0;  // [rad]
  const Eigen::Matrix3d R = find.alignment.T_map_scan.rotation.toRotationMatrix();
  std::vector<Start> starts;
  for (const double side : {-1.0, 1.0}) {
    for (const Eigen::Index axis : {0, 1}) {
      starts.push_back(start_at(find, side * kMoved * R.col(axis)));
    }
    Start turned = start_at(find);
    turned.T_map_scan.rotation =
        rotation_from_vector({0.0, 0.0, side * kTurned}) * turned.T_map_scan.rotation;
    starts.push_back(std::move(turned));
  }
  return starts;
}

Result<void> check_candidates(const PoseCandidates& found, const PlaceQuery& query) {
  const auto is_sound = [](const PoseCandidate& candidate) {
    return is_valid(candidate.T_map_scan) && std::isfinite(candidate.score);
  };
  if (found.poses.size() <= query.most && std::ranges::all_of(found.poses, is_sound) &&
      found.nominal_ms >= 0.0) {
    return {};
  }
  return fail(ErrorCode::internal,
              "the relocalizer plugin broke its contract: more candidates than were asked for, or "
              "one that is no pose");
}

/// The candidates worth trying, region by region, with their maps.
Result<std::vector<Start>> starts_at(const SearchedBundle& bundle,
                                     const std::vector<PoseCandidate>& candidates, SearchWork& work,
                                     const std::stop_token& stop) {
  std::map<RegionId, std::vector<Pose>> by_region;
  for (const auto& [T_map_scan, score] : candidates) {
    if (score < kWorthTrying * candidates.front().score) break;
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

Lookalikes Finds::around(const Pose& T_map_scan, const ShareModel& model) const {
  // What the model expects of wrong poses counts like a mean of them.
  double sum = kMeanOf * std::lerp(model.wrong_scale, model.similar_scale, model.similar);
  double samples = kMeanOf;
  for (const Tried& one : tried) {
    if ((one.T_map_scan.translation - T_map_scan.translation).norm() < 2.0 * kBasin) continue;
    sum += std::clamp(one.share, 0.0, kMostShare);
    samples += 1.0;
  }
  // In a map of one street, all places fit. Then the comparison of the poses has to tell them
  // apart.
  return {static_cast<double>(tried.size()), std::min(2.0 * kSimilarScale, sum / samples)};
}

Result<Finds> search_pose(const SearchedBundle& bundle, PointsView scan, PointsView some,
                          const Fit& to_itself, const PlaceQuery& query) {
  VANTAGE_TRY(const PoseCandidates candidates, bundle.places.find(scan, query));
  VANTAGE_CHECK(check_candidates(candidates, query));
  Finds result;
  result.work.search_ms = candidates.nominal_ms;
  VANTAGE_TRY(std::vector<Start> starts,
              starts_at(bundle, candidates.poses, result.work, query.stop));
  if (query.stop.stop_requested()) return result;

  const auto align = [&](PointsView points, const std::vector<Start>& from) {
    result.work.aligned += from.size() * points.size();
    return align_from(from, points, some, to_itself);
  };
  VANTAGE_TRY(const auto first, align(evenly_picked(scan, kFirstPoints), starts));
  starts.clear();
  for (const Find& find : different(first, first.size())) {
    result.tried.push_back({find.alignment.T_map_scan, find.share});
    if (starts.size() < kWhole) starts.push_back(start_at(find));
  }
  VANTAGE_TRY(auto found, align(scan, starts));
  found = different(found, kWhole);
  if (!found.empty()) {
    VANTAGE_TRY(const auto heights, align(scan, starts_at_other_heights(found[0])));
    // Where a map has no ground, heights differ little: only a clearly better one counts.
    for (const Find& find : heights) {
      const double level = (1.0 - kChange) * level_of(find.alignment);
      if (level > level_of(found[0].alignment)) found[0] = find;
    }
    VANTAGE_TRY(const auto near, align(scan, starts_around(found[0])));
    for (const Find& find : near) {
      if (level_of(find.alignment) > level_of(found[0].alignment)) found[0] = find;
    }
    for (const Find& find : near) {
      if (level_of(find.alignment) >= (1.0 - kChange) * level_of(found[0].alignment))
        found.push_back(find);
    }
  }
  result.finds = different(found, kWhole);
  return result;
}

Result<std::vector<Find>> align_again(const std::vector<Find>& finds, const Pose& T_then_now,
                                      PointsView scan, PointsView some, const Fit& to_itself) {
  std::vector<Start> starts;
  for (const Find& find : finds) {
    starts.push_back(start_at(find));
    starts.back().T_map_scan = starts.back().T_map_scan * T_then_now;
  }
  VANTAGE_TRY(const auto again, align_from(starts, scan, some, to_itself));
  return different(again, finds.size());
}

}  // namespace vantage
