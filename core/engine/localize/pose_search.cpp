#include "localize/pose_search.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <numbers>
#include <utility>

#include "localize/hypothesis.hpp"
#include "localize/matched.hpp"
#include "localize/weighing.hpp"
#include "vantage/kit/evenly_picked.hpp"

namespace vantage {
namespace {

// A candidate with less than this share of the best one's score is not tried.
constexpr double kWorthTrying = 0.4;
constexpr std::size_t kFirstPoints = 1000;  // that are aligned first
constexpr std::size_t kWhole = 5;           // poses from which the whole scan is aligned

/// Nothing if nothing matches there.
Result<std::optional<Find>> align_at(const Find& start, PointsView scan, PointsView some,
                                     const Fit& to_itself) {
  const MatchTarget& target = *start.map->target;
  VANTAGE_TRY(auto alignment, aligned_at(target, scan, start.alignment.T_map_scan));
  if (!alignment) return std::optional<Find>();
  VANTAGE_TRY(const Fit fit, fit_at(target, some, alignment->T_map_scan));
  return Find{start.region, start.map, *std::move(alignment), evidence_of(fit, to_itself).share};
}

/// Aligns from the poses of every start; starts from which nothing matches are left out.
Result<std::vector<Find>> align_from(const std::vector<Find>& starts, PointsView scan,
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

// On a map that has changed, alignments end some decimetres off [m].
constexpr double kMoved = 0.8;

/// A start beside a find. @param by  map frame [m]
Find beside(Find find, const Point& by) {
  find.alignment.T_map_scan.translation += by;
  return find;
}

/// Starts above and below a pose: ground is thin, so an alignment does not find it from afar.
std::vector<Find> starts_at_other_heights(const Find& find) {
  constexpr int kHeights = 6;  // to each side
  std::vector<Find> starts;
  for (int k = 1; k <= kHeights; ++k) {
    for (const double step : {-kMoved, kMoved}) {
      starts.push_back(beside(find, {0.0, 0.0, k * step}));
    }
  }
  return starts;
}

/// Starts beside a pose, and turned.
std::vector<Find> starts_around(const Find& find) {
  constexpr double kTurned = 3.0 * std::numbers::pi / 180.0;  // [rad]
  const Eigen::Matrix3d R = find.alignment.T_map_scan.rotation.toRotationMatrix();
  std::vector<Find> starts;
  for (const double side : {-1.0, 1.0}) {
    for (const Eigen::Index axis : {0, 1}) {
      starts.push_back(beside(find, side * kMoved * R.col(axis)));
    }
    auto& turned = starts.emplace_back(find).alignment.T_map_scan.rotation;
    turned = rotation_from_vector({0.0, 0.0, side * kTurned}) * turned;
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

/// The candidates worth trying, region by region, with their maps. Those in a region whose map
/// cannot be used are left out.
Result<std::vector<Find>> starts_at(const std::vector<PoseCandidate>& candidates,
                                    const Searcher& in, const std::stop_token& stop,
                                    SearchAnswer& answer) {
  std::map<RegionId, std::vector<Pose>> by_region;
  for (const auto& [T_map_scan, score] : candidates) {
    if (score < kWorthTrying * candidates.front().score) break;
    VANTAGE_TRY(const auto choice, in.regions.choose(std::nullopt, T_map_scan.translation, 0.0));
    by_region[choice.region].push_back(T_map_scan);
  }
  std::vector<Find> starts;
  for (const auto& [region, poses] : by_region) {
    if (stop.stop_requested()) break;
    const auto map = in.maps.borrow(region);
    if (!map) {  // the sensor is in another region, maybe
      if (answer.failure.empty()) {
        answer.failure = "the map of region " + in.regions.name_of(region) +
                         " cannot be used: " + to_string(map.error());
      }
      continue;
    }
    if (in.regions.size() > 1) answer.work.loaded += (*map)->map_points;
    for (const Pose& pose : poses) {
      starts.push_back({region, *map, {}});
      starts.back().alignment.T_map_scan = pose;
    }
  }
  return starts;
}

/// The finds that differ from better ones.
std::vector<Find> different(const std::vector<Find>& finds, std::size_t most) {
  std::vector<Find> kept;
  for (const Find& find : finds) {
    if (kept.size() == most) break;
    const Pose& pose = find.alignment.T_map_scan;
    const bool is_new = std::ranges::none_of(
        kept, [&](const Find& other) { return is_same_pose(other.alignment.T_map_scan, pose); });
    if (is_new) kept.push_back(find);
  }
  return kept;
}

/// Moves the best find to where the scan fits better above, below or beside it, and adds what fits
/// nearly as well beside it.
/// @param align  aligns the whole scan from some starts
template <class Align>
Result<std::vector<Find>> improved(std::vector<Find> finds, const Align& align) {
  Find& best = finds.front();
  VANTAGE_TRY(const auto heights, align(starts_at_other_heights(best)));
  // Where a map has no ground, heights differ little: only a clearly better one counts.
  for (const Find& find : heights) {
    const double level = (1.0 - kChange) * level_of(find.alignment);
    if (level > level_of(best.alignment)) best = find;
  }
  VANTAGE_TRY(const auto near, align(starts_around(best)));
  for (const Find& find : near) {
    if (level_of(find.alignment) > level_of(best.alignment)) best = find;
  }
  const double least = (1.0 - kChange) * level_of(best.alignment);
  std::ranges::copy_if(near, std::back_inserter(finds),
                       [&](const Find& find) { return level_of(find.alignment) >= least; });
  return finds;
}

}  // namespace

Lookalikes SearchAnswer::around(const Pose& T_map_scan) const {
  // What is expected of wrong poses counts like a mean of them.
  double sum = kMeanOf * std::lerp(kFarScale.value, kSimilarScale.value, kSimilar.value);
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

Result<SearchAnswer> Searcher::operator()(const SearchTask& task, const std::stop_token& stop) {
  const PointCloud& scan = task.scan.points;
  const PointCloud some = Weighing::scored(task.scan);
  std::optional<Fit> to_itself = task.to_itself;
  const auto fit_scan = [&](const Eigen::Vector3d& up) -> Result<void> {
    VANTAGE_TRY(to_itself, fit_to_itself(*matcher, task.scan.finite, some, up));
    return {};
  };
  if (!to_itself && (task.up || params.gravity == Gravity::sensor_z)) {
    VANTAGE_CHECK(fit_scan(task.up.value_or(Eigen::Vector3d::UnitZ())));
    if (!to_itself) return SearchAnswer{};  // too sparse for anything
  }
  if (!places) {
    VANTAGE_TRY(places, open_index(bundle, relocalizer));
    if (places) maps.set_aside(places->bytes());
  }
  if (!places) return SearchAnswer{.searchable = false};
  PlaceQuery query{.area = task.area, .stop = stop};
  if (task.up || params.gravity == Gravity::unknown) query.up = task.up;
  VANTAGE_TRY(const PoseCandidates candidates, places->find(scan, query));
  VANTAGE_CHECK(check_candidates(candidates, query));
  if (!to_itself && !candidates.poses.empty() && !stop.stop_requested()) {
    VANTAGE_CHECK(fit_scan(up_of(candidates.poses.front().T_map_scan)));
  }
  if (!to_itself) return SearchAnswer{.work = {.search_ms = candidates.nominal_ms}};

  SearchAnswer answer{.compared = task.area.complete,
                      .work = {.search_ms = candidates.nominal_ms},
                      .to_itself = *to_itself};
  VANTAGE_TRY(std::vector<Find> starts, starts_at(candidates.poses, *this, stop, answer));
  if (stop.stop_requested()) return answer;
  const auto align = [&](PointsView points, const std::vector<Find>& from) {
    answer.work.aligned += from.size() * points.size();
    return align_from(from, points, some, *to_itself);
  };
  VANTAGE_TRY(const auto first, align(evenly_picked(scan, kFirstPoints), starts));
  starts = different(first, first.size());
  for (const Find& find : starts) answer.tried.push_back({find.alignment.T_map_scan, find.share});
  starts.resize(std::min(starts.size(), kWhole));
  VANTAGE_TRY(answer.finds, align(scan, starts));
  answer.finds = different(answer.finds, kWhole);
  if (answer.finds.empty()) return answer;
  const auto align_whole = [&](const std::vector<Find>& from) { return align(scan, from); };
  VANTAGE_TRY(answer.finds, improved(std::move(answer.finds), align_whole));
  answer.finds = different(answer.finds, kWhole);
  return answer;
}

Result<SearchAnswer> align_again(SearchAnswer answer, const Pose& T_then_now,
                                 const PreparedScan& scan) {
  const auto move = [&](Pose& T_map_scan) { T_map_scan = T_map_scan * T_then_now; };
  for (Tried& one : answer.tried) move(one.T_map_scan);
  for (Find& find : answer.finds) move(find.alignment.T_map_scan);
  VANTAGE_TRY(answer.finds,
              align_from(answer.finds, scan.points, Weighing::scored(scan), answer.to_itself));
  answer.finds = different(answer.finds, answer.finds.size());
  return answer;
}

}  // namespace vantage
