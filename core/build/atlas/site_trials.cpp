#include "build/atlas/site_trials.hpp"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "localize/evidence.hpp"
#include "localize/hypothesis.hpp"
#include "localize/matched.hpp"
#include "vantage/engine/confidence.hpp"
#include "vantage/engine/prepared_scan.hpp"
#include "vantage/engine/region_maps.hpp"
#include "vantage/kit/evenly_picked.hpp"
#include "vantage/kit/hash.hpp"

namespace vantage {
namespace {

constexpr std::size_t kScoredPoints = 512, kFewestHits = 50;
// Whether an alignment comes back, and where a wrong one ends, fewer points tell as well.
constexpr std::size_t kManyPoints = 1500, kFewPoints = 500;
// Starts around the truth [m]. Each of the first has a scan of its own.
constexpr std::size_t kDirections = 8;
constexpr std::array kOffsets{0.5, 1.0, 2.0, 3.0};
constexpr double kTurn = 3.0 * std::numbers::pi / 180.0;
// Of the places that a search finds: the best, and some of the others.
constexpr std::size_t kFound = 12;
constexpr std::array<std::size_t, 5> kTried{0, 1, 2, 4, 7};
// An alignment is right, or wrong; between them it is neither.
constexpr double kRightMetres = 0.5, kRightRadians = std::numbers::pi / 60.0;
constexpr double kWrongMetres = 2.0, kWrongRadians = std::numbers::pi / 9.0;
// A search finds the truth itself to this.
constexpr double kTruthMetres = 5.0, kTruthRadians = std::numbers::pi / 9.0;
constexpr double kAlikeFrom = 0.5;  // of the share at the right pose

Pose start_at(Pose pose, double distance, double direction, double turn) {
  pose.translation += distance * Point(std::cos(direction), std::sin(direction), 0.0);
  pose.rotation = rotation_from_vector({0.0, 0.0, turn}) * pose.rotation;
  return pose;
}

/// Runs tasks in parallel. @return  the error of the first of them that failed
Result<void> run_all(std::size_t tasks, const std::function<Result<void>(std::size_t)>& run) {
  std::vector<Result<void>> outcomes(tasks);
  tbb::parallel_for(std::size_t{0}, tasks, [&](std::size_t k) { outcomes[k] = run(k); });
  for (const auto& outcome : outcomes) VANTAGE_CHECK(outcome);
  return {};
}

/// Where an alignment ended.
struct Trial {
  Alignment alignment;
  std::size_t points;  // that were aligned
  std::optional<Evidence> evidence;
};
using Trials = std::vector<std::optional<Trial>>;  // nothing: nothing matched

struct SiteTrials {
  SitePlace place;
  Pose truth;  // upright, with some heading
  PointCloud hits = {};
  std::optional<Fit> to_itself = {};  // of the first of its scans
  std::vector<Pose> rivals = {};
  Trials right = {};  // from around the truth
  double basin = 0.0;
  Trials wrong = {};  // one for each rival
};

/// A scan as the localizer prepares it.
struct SiteScan {
  PointCloud finite;  // before it was thinned
  PointCloud many, few, scored;
};

Result<SiteScan> scan_of(const SiteTrials& site, std::size_t variant) {
  // The seed depends on the place alone.
  const auto micrometres = [](double x) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::llround(x * 1e6)));
  };
  const Point& at = site.place.position;
  const std::uint64_t seed =
      hash(variant, micrometres(at.x()), micrometres(at.y()), micrometres(at.z()));
  VANTAGE_TRY(PreparedScan prepared,
              prepare_scan({.points = virtual_scan(site.hits, site.truth, seed)}, nullptr,
                           LocalizerParams{}));
  return SiteScan{.finite = std::move(prepared.finite),
                  .many = evenly_picked(prepared.points, kManyPoints),
                  .few = evenly_picked(prepared.points, kFewPoints),
                  .scored = evenly_picked(prepared.points, kScoredPoints)};
}

/// Sees what is around a site, and looks for places from which its scan may seem to come.
Result<void> look_around(SiteTrials& site, const HitsAt& hits_at, const ScanMatcher& matcher,
                         const RelocalizerIndex* places) {
  VANTAGE_TRY(site.hits, hits_at(site.place.position));
  if (site.hits.size() < kFewestHits) return {};
  VANTAGE_TRY(const SiteScan scan, scan_of(site, 0));
  VANTAGE_TRY(site.to_itself, fit_to_itself(matcher, scan.finite, scan.scored, up_of(site.truth)));
  if (!site.to_itself || places == nullptr) return {};
  VANTAGE_TRY(PoseCandidates found, places->find(scan.many, {.most = kFound}));
  std::erase_if(found.poses, [&](const PoseCandidate& place) {
    return is_near(place.T_map_scan, site.truth, kTruthMetres, kTruthRadians);
  });
  for (const std::size_t k : kTried) {
    if (k < found.poses.size()) site.rivals.push_back(found.poses[k].T_map_scan);
  }
  site.wrong.resize(site.rivals.size());
  return {};
}

/// @param points, scored  of a scan of the site; no evidence without scored ones
/// @return                nothing if nothing matches
Result<std::optional<Trial>> tried(const MatchTarget& target, const SiteTrials& site,
                                   PointsView points, PointsView scored, const Pose& start) {
  VANTAGE_TRY(auto alignment, aligned_at(target, points, start));
  if (!alignment) return std::optional<Trial>();
  Trial trial{.alignment = *std::move(alignment), .points = points.size(), .evidence = {}};
  if (!scored.empty()) {
    VANTAGE_TRY(const Fit fit, fit_at(target, scored, trial.alignment.T_map_scan));
    const Evidence evidence = evidence_of(fit, *site.to_itself);
    if (std::isfinite(evidence.share)) trial.evidence = evidence;
  }
  return std::optional(std::move(trial));
}

/// Aligns scans of the site from around the truth.
Result<void> try_right(const MatchTarget& target, SiteTrials& site) {
  if (!site.to_itself) return {};
  site.right.resize(kDirections);
  std::vector<SiteScan> scans(kDirections);
  /// Whether all alignments from so far come back.
  const auto come_back = [&](double offset) -> Result<bool> {
    const bool first = offset == kOffsets.front();
    std::array<bool, kDirections> back{};
    VANTAGE_CHECK(run_all(kDirections, [&](std::size_t k) -> Result<void> {
      if (first) {
        VANTAGE_TRY(scans[k], scan_of(site, k));
      }
      const SiteScan& scan = scans[k];
      const double direction = 2.0 * std::numbers::pi * static_cast<double>(k) / kDirections;
      const Pose start = start_at(site.truth, offset, direction, k % 2 == 0 ? kTurn : -kTurn);
      const PointsView scored = first && k % 2 == 0 ? PointsView(scan.scored) : PointsView();
      VANTAGE_TRY(auto trial, tried(target, site, first ? scan.many : scan.few, scored, start));
      back[k] =
          trial && is_near(trial->alignment.T_map_scan, site.truth, kRightMetres, kRightRadians);
      if (first) site.right[k] = std::move(trial);
      return {};
    }));
    return std::ranges::all_of(back, std::identity{});
  };
  const auto& [small, medium, large, largest] = kOffsets;
  VANTAGE_TRY(const bool from_small, come_back(small));
  if (!from_small) return {};
  // Mostly they come back from `large`, and nothing nearer needs to be tried.
  VANTAGE_TRY(const bool from_large, come_back(large));
  VANTAGE_TRY(const bool from_other, come_back(from_large ? largest : medium));
  site.basin = from_large ? (from_other ? largest : large) : (from_other ? medium : small);
  return {};
}

/// Aligns a scan of the site at some of its rivals.
Result<void> try_rivals(const MatchTarget& target, SiteTrials& site,
                        const std::vector<std::size_t>& which) {
  VANTAGE_TRY(const SiteScan scan, scan_of(site, 0));
  for (const std::size_t k : which) {
    VANTAGE_TRY(site.wrong[k], tried(target, site, scan.few, scan.scored, site.rivals[k]));
  }
  return {};
}

/// What is tried with a site in the map of a region.
struct SiteTask {
  std::size_t site;
  std::vector<std::size_t> rivals;  // none: starts around the truth
};

/// The tasks, by the region whose map they need.
std::map<RegionId, std::vector<SiteTask>> tasks_of(const std::vector<SiteTrials>& all,
                                                   const Partition& partition) {
  std::map<RegionId, std::vector<SiteTask>> tasks;
  for (std::size_t s = 0; s < all.size(); ++s) {
    tasks[all[s].place.region].push_back({s, {}});
    std::map<RegionId, std::vector<std::size_t>> rivals;
    for (std::size_t k = 0; k < all[s].rivals.size(); ++k) {
      // Eq. 11: the localizer would use the map of that region.
      const auto region = partition.locate(all[s].rivals[k].translation);
      if (region) rivals[*region].push_back(k);
    }
    for (auto& [region, which] : rivals) tasks[region].push_back({s, std::move(which)});
  }
  return tasks;
}

std::optional<SitePrecision> precision_of(const SiteTrials& site) {
  Alignment mean;
  double squares = 0.0, weights = 0.0, points = 0.0;
  std::size_t matched = 0;
  for (const auto& trial : site.right) {
    if (!trial) continue;
    const Point away = trial->alignment.T_map_scan.translation - site.truth.translation;
    const double off = away.head<2>().norm();
    squares += off * off;
    // What is known at the site, and not where an alignment slid to.
    const double known = 1.0 / (1.0 + off * off / (kRightMetres * kRightMetres));
    mean.hessian += known * trial->alignment.hessian;
    points += known * static_cast<double>(trial->points);
    weights += known;
    ++matched;
  }
  if (matched == 0) return {};
  mean.hessian /= weights;
  const Eigen::Matrix2d covariance =
      covariance_of(mean, static_cast<std::size_t>(std::round(points / weights)),
                    LocalizerParams{}.covariance_scale)
          .topLeftCorner<2, 2>();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(covariance);
  const Eigen::Vector2d sigma = axes.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  const Eigen::Vector2d weak = axes.eigenvectors().col(1);
  double direction = std::atan2(weak.y(), weak.x());
  if (direction < 0.0) direction += std::numbers::pi;
  if (direction >= std::numbers::pi) direction = 0.0;
  // How far the alignments scatter says most where matching is about to fail; elsewhere there are
  // too few of them, and their covariance says more.
  return SitePrecision{
      .expected_error = std::sqrt(squares / static_cast<double>(matched) + sigma.squaredNorm()),
      .sigma_strong = sigma[0],
      .sigma_weak = sigma[1],
      .weak_direction = direction,
      .basin = site.basin};
}

std::vector<AlikePlace> alike_of(const SiteTrials& site) {
  std::vector<double> right;
  double noise = 0.0;
  for (const auto& trial : site.right) {
    if (!trial || !trial->evidence) continue;
    right.push_back(trial->evidence->share);
    noise = trial->evidence->noise;
  }
  if (right.empty()) return {};
  std::nth_element(right.begin(), right.begin() + static_cast<std::ptrdiff_t>(right.size() / 2),
                   right.end());
  const double usual = right[right.size() / 2];
  if (usual <= noise) return {};
  std::vector<AlikePlace> alike;
  for (const auto& trial : site.wrong) {
    if (!trial || !trial->evidence) continue;
    const Pose& pose = trial->alignment.T_map_scan;
    if (is_near(pose, site.truth, kWrongMetres, kWrongRadians)) continue;
    const double likeness = trial->evidence->share / usual;
    const bool known = std::ranges::any_of(alike, [&](const AlikePlace& other) {
      return is_near(other.T_map_scan, pose, kWrongMetres, kWrongRadians);
    });
    if (likeness >= kAlikeFrom && !known) alike.push_back({pose, likeness});
  }
  std::ranges::stable_sort(alike, std::greater{}, &AlikePlace::likeness);
  return alike;
}

Atlas atlas_of(const std::vector<SiteTrials>& all) {
  Atlas atlas;
  for (const SiteTrials& site : all) {
    atlas.sites.push_back({.region = site.place.region,
                           .position = site.place.position,
                           .precision = precision_of(site),
                           .alike = alike_of(site)});
  }
  return atlas;
}

}  // namespace

Result<Atlas> try_sites(const Bundle& bundle, const std::vector<SitePlace>& sites,
                        const HitsAt& hits_at, const RelocalizerIndex* places,
                        const PluginPtr<ScanMatcher>& matcher, const std::function<void()>& step) {
  VANTAGE_TRY(const auto index, bundle.index());
  std::vector<SiteTrials> all;
  for (const SitePlace& place : sites) {
    // No heading is that of the map's walls.
    const double heading = 0.3 + 2.4 * static_cast<double>(all.size() % 97);
    all.push_back(
        {.place = place, .truth = pose_from_xyz_rpy(place.position, {0.0, 0.0, heading})});
  }
  VANTAGE_CHECK(run_all(all.size(), [&](std::size_t s) {
    Result<void> looked = look_around(all[s], hits_at, *matcher, places);
    step();
    return looked;
  }));
  const auto tasks = tasks_of(all, index->partition);
  const std::vector in_regions(tasks.begin(), tasks.end());
  VANTAGE_CHECK(run_all(in_regions.size(), [&](std::size_t r) -> Result<void> {
    VANTAGE_TRY(const RegionMap map, bundle.get(in_regions[r].first));
    const auto run = [&]() -> Result<void> {
      VANTAGE_TRY(const auto target, if_matched(target_in(map, matcher)));
      const std::vector<SiteTask>& here = in_regions[r].second;
      return run_all(here.size(), [&](std::size_t k) {
        SiteTrials& site = all[here[k].site];
        const bool from_truth = here[k].rivals.empty();
        Result<void> outcome;
        if (target) {
          outcome =
              from_truth ? try_right(**target, site) : try_rivals(**target, site, here[k].rivals);
        }
        if (from_truth) step();
        return outcome;
      });
    };
    // Isolated: a thread that waits here must not take up another region, whose map it would hold
    // beside this one.
    return tbb::this_task_arena::isolate(run);
  }));
  return atlas_of(all);
}

}  // namespace vantage
