#include "build/atlas/site_trials.hpp"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "build/atlas/virtual_lidar.hpp"
#include "localize/hypothesis.hpp"
#include "localize/pose_search.hpp"
#include "vantage/engine/confidence.hpp"
#include "vantage/engine/prepared_scan.hpp"
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

double plan_distance(const Pose& a, const Pose& b) {
  return (a.translation - b.translation).head<2>().norm();
}

std::vector<double> quantiles_of(std::vector<double> samples) {
  if (samples.empty()) return {};
  std::sort(samples.begin(), samples.end());
  std::vector<double> result;
  for (std::size_t k = 0; k < Calibration::kQuantiles; ++k) {
    result.push_back(samples[k * (samples.size() - 1) / (Calibration::kQuantiles - 1)]);
  }
  return result;
}

/// The first of the errors of parallel tasks.
Result<void> all_of(const std::vector<Result<void>>& outcomes) {
  for (const auto& outcome : outcomes) VANTAGE_CHECK(outcome);
  return {};
}

}  // namespace

/// A scan as the localizer prepares it.
struct SiteTrials::Scan {
  PointCloud finite;  // before it was thinned
  PointCloud many, few, scored;
};

Result<SiteTrials> SiteTrials::prepare(const Partition& partition,
                                       const std::vector<SitePlace>& sites, const HitsAt& hits_at,
                                       const RelocalizerIndex* places,
                                       const PluginPtr<ScanMatcher>& matcher,
                                       std::function<void()> step) {
  SiteTrials trials(matcher, std::move(step));
  trials.by_region_.resize(partition.size());
  if (sites.empty()) return trials;
  for (const SitePlace& place : sites) {
    const auto bits = std::uint64_t(trials.sites_.size());
    // No heading is that of the map's walls.
    const double heading = 0.3 + 2.4 * static_cast<double>(bits % 97);
    trials.sites_.push_back(
        {.place = place, .truth = pose_from_xyz_rpy(place.position, {0.0, 0.0, heading})});
  }
  std::vector<Result<void>> outcomes(trials.sites_.size());
  tbb::parallel_for(std::size_t{0}, trials.sites_.size(), [&](std::size_t s) {
    SiteState& site = trials.sites_[s];
    outcomes[s] = hits_at(site.place.position).and_then([&](PointCloud&& hits) {
      site.hits = std::move(hits);
      return trials.look_around(site, places);
    });
    trials.step_();
  });
  VANTAGE_CHECK(all_of(outcomes));
  for (std::size_t s = 0; s < trials.sites_.size(); ++s) {
    SiteState& site = trials.sites_[s];
    trials.by_region_[site.place.region.value].own.push_back(s);
    site.wrong.resize(site.rivals.size());
    for (std::size_t k = 0; k < site.rivals.size(); ++k) {
      // Eq. 11: the localizer would use the map of that region.
      const auto region = partition.locate(site.rivals[k].translation);
      if (region) trials.by_region_[region->value].rivals.emplace_back(s, k);
    }
  }
  return trials;
}

std::vector<RegionId> SiteTrials::regions() const {
  std::vector<RegionId> regions;
  for (std::uint32_t r = 0; r < by_region_.size(); ++r) {
    if (!by_region_[r].own.empty() || !by_region_[r].rivals.empty()) regions.push_back(RegionId{r});
  }
  return regions;
}

Result<void> SiteTrials::look_around(SiteState& site, const RelocalizerIndex* places) const {
  if (site.hits.size() < kFewestHits) return {};
  VANTAGE_TRY(const Scan scan, scan_of(site, 0));
  VANTAGE_TRY(site.to_itself, fit_to_itself(*matcher_, scan.finite, scan.scored));
  if (!site.to_itself || places == nullptr) return {};
  std::vector<Pose> others;
  VANTAGE_TRY(const PoseCandidates found, places->find(scan.many, {.most = kFound}));
  for (const PoseCandidate& place : found.poses) {
    if (!is_near(place.T_map_scan, site.truth, kTruthMetres, kTruthRadians)) {
      others.push_back(place.T_map_scan);
    }
  }
  for (const std::size_t k : kTried) {
    if (k < others.size()) site.rivals.push_back(others[k]);
  }
  return {};
}

Result<SiteTrials::Scan> SiteTrials::scan_of(const SiteState& site, std::size_t variant) const {
  // The seed depends on the place alone.
  const auto micrometres = [](double x) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::llround(x * 1e6)));
  };
  const Point& at = site.place.position;
  const std::uint64_t seed =
      hash(variant, micrometres(at.x()), micrometres(at.y()), micrometres(at.z()));
  Scan scan;
  VANTAGE_TRY(PreparedScan prepared,
              prepare_scan({.points = virtual_scan(site.hits, site.truth, seed)}, nullptr,
                           LocalizerParams{}));
  scan.many = evenly_picked(prepared.points, kManyPoints);
  scan.few = evenly_picked(prepared.points, kFewPoints);
  scan.scored = evenly_picked(prepared.points, kScoredPoints);
  scan.finite = std::move(prepared.finite);
  return scan;
}

Result<PluginPtr<MatchTarget>> SiteTrials::target_of(const RegionMap& map) const {
  const bool is_prepared = !map.prepared.bytes.empty();
  if (!is_prepared && map.points.empty()) return PluginPtr<MatchTarget>();
  auto made = is_prepared ? matcher_->restore(map.prepared.bytes) : matcher_->prepare(map.points);
  if (made) return in_library_of(matcher_, *std::move(made));
  if (made.error().code == ErrorCode::too_few_matches) return PluginPtr<MatchTarget>();
  return fail(std::move(made).error());
}

Result<void> SiteTrials::run_in(RegionId region, const RegionMap& map) {
  const InRegion& here = by_region_[region.value];
  // Isolated: a thread that waits here must not take up another region, whose map it would hold
  // beside this one.
  return tbb::this_task_arena::isolate([&]() -> Result<void> {
    VANTAGE_TRY(const auto target, target_of(map));
    if (!target) {
      for (std::size_t k = 0; k < here.own.size(); ++k) step_();
      return {};
    }
    std::vector<std::pair<std::size_t, std::vector<std::size_t>>> rivals;  // by site
    for (const auto& [site, rival] : here.rivals) {
      if (rivals.empty() || rivals.back().first != site) rivals.push_back({site, {}});
      rivals.back().second.push_back(rival);
    }
    std::vector<Result<void>> outcomes(here.own.size() + rivals.size());
    tbb::parallel_for(std::size_t{0}, outcomes.size(), [&](std::size_t k) {
      if (k < here.own.size()) {
        outcomes[k] = try_right(*target, sites_[here.own[k]]);
        step_();
      } else {
        const auto& [site, which] = rivals[k - here.own.size()];
        outcomes[k] = try_rivals(*target, sites_[site], which);
      }
    });
    return all_of(outcomes);
  });
}

Result<std::optional<SiteTrials::Trial>> SiteTrials::tried(const MatchTarget& target,
                                                           const Fit& to_itself, PointsView points,
                                                           PointsView scored,
                                                           const Pose& start) const {
  using Outcome = Result<std::optional<Trial>>;
  auto alignment = target.align(points, start);
  if (!alignment) {
    if (alignment.error().code == ErrorCode::too_few_matches) return std::optional<Trial>();
    return fail(std::move(alignment).error());
  }
  if (!is_valid(alignment->T_map_scan) || !alignment->hessian.allFinite()) {
    return std::optional<Trial>();
  }
  Trial trial{.alignment = *std::move(alignment), .evidence = {}};
  if (!scored.empty()) {
    VANTAGE_TRY(const Fit fit, fit_at(target, scored, trial.alignment.T_map_scan));
    const Evidence evidence = evidence_of(fit, to_itself);
    if (std::isfinite(evidence.share)) trial.evidence = evidence;
  }
  return Outcome(std::move(trial));
}

Result<void> SiteTrials::try_right(const MatchTarget& target, SiteState& site) const {
  if (!site.to_itself) return {};
  site.right.resize(kDirections);
  std::vector<Scan> scans(kDirections);
  /// Whether all alignments from so far come back.
  const auto come_back = [&](double offset) -> Result<bool> {
    const bool first = offset == kOffsets.front();
    std::array<bool, kDirections> back{};
    std::vector<Result<void>> outcomes(kDirections);
    tbb::parallel_for(std::size_t{0}, kDirections, [&](std::size_t k) {
      outcomes[k] = [&]() -> Result<void> {
        if (first) {
          VANTAGE_TRY(scans[k], scan_of(site, k));
        }
        const Scan& scan = scans[k];
        const double direction = 2.0 * std::numbers::pi * static_cast<double>(k) / kDirections;
        const Pose start = start_at(site.truth, offset, direction, k % 2 == 0 ? kTurn : -kTurn);
        VANTAGE_TRY(auto trial, tried(target, *site.to_itself, first ? scan.many : scan.few,
                                      first && k % 2 == 0 ? scan.scored : PointCloud{}, start));
        back[k] =
            trial && is_near(trial->alignment.T_map_scan, site.truth, kRightMetres, kRightRadians);
        if (first) site.right[k] = std::move(trial);
        return {};
      }();
    });
    VANTAGE_CHECK(all_of(outcomes));
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

Result<void> SiteTrials::try_rivals(const MatchTarget& target, SiteState& site,
                                    const std::vector<std::size_t>& which) const {
  VANTAGE_TRY(const Scan scan, scan_of(site, 0));
  for (const std::size_t k : which) {
    VANTAGE_TRY(site.wrong[k],
                tried(target, *site.to_itself, scan.few, scan.scored, site.rivals[k]));
  }
  return {};
}

std::optional<SitePrecision> SiteTrials::precision_of(const SiteState& site) {
  Alignment mean;
  double squares = 0.0, weights = 0.0;
  std::size_t matched = 0;
  for (const auto& trial : site.right) {
    if (!trial) continue;
    const double off = plan_distance(trial->alignment.T_map_scan, site.truth);
    squares += off * off;
    // What is known at the site, and not where an alignment slid to.
    const double known = 1.0 / (1.0 + off * off / (kRightMetres * kRightMetres));
    mean.hessian += known * trial->alignment.hessian;
    weights += known;
    ++matched;
  }
  if (matched == 0) return {};
  mean.hessian /= weights;
  const Eigen::Matrix2d covariance =
      covariance_of(mean, kManyPoints, LocalizerParams{}.covariance_scale).topLeftCorner<2, 2>();
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

std::vector<AlikePlace> SiteTrials::alike_of(const SiteState& site) {
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

void SiteTrials::add_shares(const SiteState& site, std::vector<double>& right,
                            std::vector<double>& wrong) {
  const auto add = [&](const auto& trials, bool near, double metres, double radians,
                       std::vector<double>& shares) {
    for (const auto& trial : trials) {
      if (!trial || !trial->evidence) continue;
      if (is_near(trial->alignment.T_map_scan, site.truth, metres, radians) == near) {
        shares.push_back(trial->evidence->share);
      }
    }
  };
  add(site.right, true, kRightMetres, kRightRadians, right);
  add(site.wrong, false, kWrongMetres, kWrongRadians, wrong);
}

Atlas SiteTrials::atlas(const MatcherChoice& matcher) const {
  Atlas atlas;
  std::vector<double> right, wrong;
  std::size_t telling = 0;
  for (const SiteState& site : sites_) {
    // Virtual scans that do not find their own pose do not tell right from wrong either: a map
    // without its ground has viewpoints where no sensor could be.
    const bool tells = site.basin > 0.0;
    if (tells) {
      ++telling;
      add_shares(site, right, wrong);
    }
    atlas.sites.push_back({.region = site.place.region,
                           .position = site.place.position,
                           .precision = precision_of(site),
                           .alike = alike_of(site)});
  }
  if (2 * telling < sites_.size()) {
    right.clear();
    wrong.clear();
  }
  atlas.calibration = {.matcher = matcher,
                       .right_samples = right.size(),
                       .wrong_samples = wrong.size(),
                       .right = quantiles_of(right),
                       .wrong = quantiles_of(wrong)};
  return atlas;
}

}  // namespace vantage
