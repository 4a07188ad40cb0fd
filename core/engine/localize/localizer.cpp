#include "vantage/engine/localizer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "localize/belief.hpp"
#include "localize/evidence.hpp"
#include "localize/motion.hpp"
#include "localize/pose_search.hpp"
#include "localize/regions_ahead.hpp"
#include "places/place_index.hpp"
#include "stopwatch.hpp"
#include "vantage/engine/deskew.hpp"
#include "vantage/engine/region_maps.hpp"

namespace vantage {

const char* to_string(Tracking tracking) noexcept {
  switch (tracking) {
    case Tracking::tracked: return "tracked";
    case Tracking::uncertain: return "uncertain";
    case Tracking::lost: return "lost";
  }
  return "unknown";
}

namespace {

constexpr std::string_view kJob = "localization";  // what a missing table would be for

// What is believed of a pose that a user gives, before any scan.
constexpr double kTrustInStart = 0.9;
// The sensor may be carried away between two scans, unnoticed.
constexpr double kCarriedAway = 2e-5;
// A search finds the place, if it is in the area.
constexpr double kRecall = 0.9, kInArea = 0.5;
// With less belief than this in the best hypothesis, others are looked for.
constexpr double kSure = 0.8;
// Hypotheses with less belief are dropped.
constexpr double kLeastBelief = 1e-4;
// Scans taken this near to each other say the same [m].
constexpr double kIndependent = 1.0;
// A hypothesis beyond doubt is weighed only after this way, or if its level fell by this share.
constexpr double kSettledWay = 2.5, kFall = 0.2, kSettledRisk = 1e-4;
// The fit of scans to themselves changes with the surroundings [m].
constexpr double kSurroundings = 25.0;
constexpr std::size_t kScored = 512;  // points of a scan from which its evidence is taken

/// How far a sensor is looked for that could not be found in so many scans: twice as far each time.
/// Once that is everywhere, only now and then, because it takes long.
std::optional<double> search_radius(std::uint32_t scans, double everywhere,
                                    const LocalizerParams& params) {
  const double radius =
      std::ldexp(params.search_first_radius, static_cast<int>(std::min(scans, 60U)) - 1);
  if (scans <= 1 || radius < 2.0 * everywhere) return std::min(radius, everywhere);
  if (scans % params.search_pause == 0) return everywhere;
  return {};
}

/// Two-sided tail of the normal distribution beyond `limit` for a standard deviation `sigma`.
double beyond(double limit, double sigma) {
  return sigma > 0.0 ? std::erfc(limit / (sigma * std::numbers::sqrt2)) : 0.0;
}

}  // namespace

struct Localizer::State {
  State(Bundle the_bundle, PluginPtr<ScanMatcher> the_matcher, const LocalizerParams& the_params)
      : bundle(std::move(the_bundle)),
        matcher(std::move(the_matcher)),
        params(the_params),
        ahead(index),
        maps(bundle.store(), matcher,
             {.memory = static_cast<std::size_t>(params.map_memory * 1024.0 * 1024.0),
              .background = params.prefetch}) {}

  Bundle bundle;
  PluginPtr<ScanMatcher> matcher;
  const MapIndex& index = bundle.index();
  LocalizerParams params;
  RegionsAhead ahead;
  RegionMaps maps;  // uses bundle and matcher

  /// A pose that the sensor may have, and where it came from.
  struct Hypothesis {
    Motion motion;
    std::optional<Pose> initial = {};  // given, not yet used
    Pose predicted = {};               // at this scan
    RegionId region = {};
    std::optional<Alignment> alignment = {};
    std::string failure = {};  // why there is no alignment
    std::optional<Evidence> evidence = {};

    [[nodiscard]] const Pose& pose() const { return alignment ? alignment->T_map_scan : predicted; }
    [[nodiscard]] Pose last() const { return initial ? *initial : motion.pose(); }
  };

  bool started = false;
  std::optional<double> stamp;         // of the last scan
  std::vector<Hypothesis> hypotheses;  // the first is the one that is reported
  Belief belief;                       // in them

  std::shared_ptr<const ReadyRegion> map;  // of `region`
  RegionId region;

  std::optional<PlaceIndex> places;   // from the first search on
  std::uint32_t searched_scans = 0;   // in a row, without certainty
  bool was_lost = false;              // since the last tracked scan
  std::optional<double> usual_share;  // evidence of recent tracked scans
  double usual_level = 0.0;
  std::optional<Fit> to_itself;  // of the scan at `reference_at`
  Point reference_at = Point::Zero();
  std::optional<Point> weighed_at;        // where the best hypothesis was weighed last
  double sigma_m = 0.0, sigma_rad = 0.0;  // of the reported pose; 0 before the first

  [[nodiscard]] bool has_map(RegionId id) const { return !index.regions[id.value].empty(); }

  struct Choice {
    RegionId region;
    bool outside;
  };
  /// Eq. 11 with hysteresis.
  [[nodiscard]] Choice choose_region(const Point& position) const {
    const Eigen::Vector2d xy = position.head<2>();
    const auto located = index.partition.locate(position);
    if (!located || !has_map(*located)) {
      return {map ? region : ahead.nearest(xy), true};
    }
    if (map && *located != region && params.switch_margin > 0.0 &&
        distance(index.partition[region].footprint, xy) <= params.switch_margin) {
      return {region, false};
    }
    return {*located, false};
  }

  [[nodiscard]] Result<PreparedScan> prepare(const Scan& scan) const {
    const auto step = hypotheses.empty() ? std::nullopt : hypotheses[0].motion.step_to(scan);
    if (!params.deskew || scan.seconds.empty() || !step) return prepare_scan(scan.points, params);
    VANTAGE_TRY(const PointCloud points,
                deskew(scan.points, scan.seconds, step->T_now_later, step->seconds));
    return prepare_scan(points, params);
  }

  /// Makes a region's map the one that scans are matched against.
  Result<void> use(RegionId next, ScanReport& report) {
    if (!map || next != region) {
      const Stopwatch stopwatch;
      auto taken = maps.take(next);
      if (!taken) {
        return fail(std::move(taken).error().during("switching to region '" +
                                                    index.partition[next].label + "'"));
      }
      map = std::move(taken->region);
      region = next;
      report.blocked = taken->blocked;
      report.seconds_stall = stopwatch.seconds();
      report.seconds_load = map->seconds_load;
      report.seconds_prepare = map->seconds_prepare;
    }
    report.region = region;
    report.map_points = map->map_points;
    return {};
  }

  void expect_what_is_ahead() {
    if (!params.prefetch) return;
    const Motion& motion = hypotheses.front().motion;
    maps.expect(ahead(motion.pose().translation.head<2>(), motion.velocity().head<2>(),
                      params.prefetch_time, params.prefetch_distance));
  }

  /// Predicts where each hypothesis is now, and matches the scan there.
  Result<void> match(const Scan& scan, PointsView points, ScanReport& report) {
    for (std::size_t h = 0; h < hypotheses.size(); ++h) {
      Hypothesis& one = hypotheses[h];
      one.predicted = one.initial ? *one.initial : one.motion.predict(scan);
      one.alignment.reset();
      one.evidence.reset();
      // Eq. 11 uses the last estimate; before the first scan, that is the initial pose.
      const Choice choice = choose_region(one.last().translation);
      std::shared_ptr<const ReadyRegion> ready;
      if (h == 0) {
        report.outside = choice.outside;
        VANTAGE_CHECK(use(choice.region, report));
        ready = map;
      } else {
        VANTAGE_TRY(ready, maps.borrow(choice.region));
      }
      one.region = choice.region;
      const Stopwatch stopwatch;
      auto alignment = ready->target->align(points, one.predicted);
      if (h == 0) report.seconds_align = stopwatch.seconds();
      one.failure.clear();
      if (!alignment && alignment.error().code != ErrorCode::too_few_matches) {
        return fail(std::move(alignment).error());
      }
      if (!alignment) {
        one.failure = alignment.error().message;
      } else if (!is_valid(alignment->T_map_scan)) {
        one.failure = "the matcher returned no valid pose";
      } else {
        one.alignment = *std::move(alignment);
      }
    }
    return {};
  }

  /// Whether a scan has to be weighed: a hypothesis beyond doubt needs it only now and then.
  [[nodiscard]] bool to_be_weighed() const {
    const Hypothesis& first = hypotheses.front();
    if (hypotheses.size() > 1 || !weighed_at || !first.alignment) return true;
    if (1.0 - belief.of(0) > kSettledRisk) return true;
    const ScanScore& score = first.alignment->score;
    if (score.nvtl * score.coverage < (1.0 - kFall) * usual_level) return true;
    return (first.pose().translation - *weighed_at).norm() >= kSettledWay;
  }

  /// The fit of the scan to itself, or of one that was taken near.
  Result<void> renew_reference(PointsView raw, PointsView some, const Point& at) {
    if (to_itself && (at - reference_at).norm() < kSurroundings) return {};
    VANTAGE_TRY(to_itself, fit_to_itself(*matcher, raw, some));
    reference_at = at;
    return {};
  }

  /// Takes in what the scan says about each hypothesis.
  Result<void> weigh(const Scan& scan, PointsView raw, PointsView points) {
    if (!to_be_weighed()) return {};
    const PointCloud some = evenly_picked(points, kScored);
    const Point at = hypotheses.front().pose().translation;
    VANTAGE_CHECK(renew_reference(raw, some, at));
    std::vector<double> ratios(hypotheses.size(), 0.0);
    // Scans taken side by side share their errors.
    const double news =
        weighed_at ? std::clamp((at - *weighed_at).norm() / kIndependent, 0.1, 1.0) : 1.0;
    for (int attempt = 0; attempt < 2; ++attempt) {
      for (std::size_t h = 0; h < hypotheses.size(); ++h) {
        VANTAGE_TRY(ratios[h], ratio(hypotheses[h], some, scan));
      }
      // A poor fit may come from an old reference.
      const double best = *std::max_element(ratios.begin(), ratios.end());
      if (best >= 0.0 || reference_at == at) break;
      to_itself.reset();
      VANTAGE_CHECK(renew_reference(raw, some, at));
    }
    prefer_sharper(ratios);
    for (double& ratio : ratios) ratio *= news;
    belief.weigh(ratios);
    weighed_at = at;
    return {};
  }

  /// log(p(scan | hypothesis right) / p(scan | wrong)).
  Result<double> ratio(Hypothesis& one, PointsView some, const Scan& scan) {
    constexpr double kNothingFits = -6.0;
    if (!to_itself) return 0.0;
    if (!one.alignment) return kNothingFits;
    VANTAGE_TRY(const auto ready, maps.borrow(one.region));
    VANTAGE_TRY(const Fit fit, fit_at(*ready->target, some, one.alignment->T_map_scan));
    one.evidence = evidence_of(fit, *to_itself);
    return log_likelihood_ratio(*one.evidence, usual_share) + surprise(one) +
           agreement(one.pose(), scan.prior);
  }

  /// A wrong pose does not move as the sensor does: matching pulls it about.
  [[nodiscard]] double surprise(const Hypothesis& one) const {
    constexpr double kExpected = 1.0, kMost = 6.0;  // [m]
    if (!one.motion.step()) return 0.0;
    const double pulled =
        (one.alignment->T_map_scan.translation - one.predicted.translation).norm();
    return -std::min(kMost, (pulled / kExpected) * (pulled / kExpected));
  }

  /// log(p(prior | pose) / p(prior | somewhere else within three sigma)).
  [[nodiscard]] static double agreement(const Pose& pose, const std::optional<PosePrior>& prior) {
    constexpr double kMost = 8.0, kElsewhere = 3.0;
    if (!prior) return 0.0;
    double squared = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      const double z = (pose.translation[axis] - prior->T_map_sensor.translation[axis]) /
                       prior->sigma_translation[axis];
      squared += z * z;
    }
    const double turned =
        std::remainder(heading_of(pose) - heading_of(prior->T_map_sensor), 2.0 * std::numbers::pi);
    squared += (turned / prior->sigma_heading) * (turned / prior->sigma_heading);
    return std::max(-kMost, std::min(0.0, kElsewhere - 0.5 * squared));
  }

  static double heading_of(const Pose& pose) {
    const Eigen::Matrix3d R = pose.rotation.toRotationMatrix();
    return std::atan2(R(1, 0), R(0, 0));
  }

  /// Of several poses for one scan, the wrong ones fit worse than the right one.
  void prefer_sharper(std::vector<double>& ratios) const {
    constexpr double kPreference = 15.0;
    double best = 0.0;
    for (const Hypothesis& one : hypotheses) {
      if (one.evidence) best = std::max(best, one.evidence->share);
    }
    if (best <= 0.0) return;
    for (std::size_t h = 0; h < hypotheses.size(); ++h) {
      const double share = hypotheses[h].evidence ? hypotheses[h].evidence->share : 0.0;
      ratios[h] += kPreference * (std::max(0.0, share) - best) / best;
    }
  }

  /// Where to search; some scans do not search at all.
  [[nodiscard]] std::optional<PlaceArea> search_area(const Scan& scan) const {
    PlaceArea area;
    if (scan.prior && scan.prior->sigma_translation.head<2>().allFinite()) {
      constexpr double kSigmas = 3.0, kSlack = 2.0;
      area.centre = scan.prior->T_map_sensor.translation.head<2>();
      area.radius = kSlack + kSigmas * scan.prior->sigma_translation.head<2>().maxCoeff();
      if (std::isfinite(scan.prior->sigma_heading)) {
        area.heading = heading_of(scan.prior->T_map_sensor);
        area.heading_within = std::min(std::numbers::pi, kSigmas * scan.prior->sigma_heading);
      }
      return area;
    }
    if (hypotheses.empty()) {
      if (searched_scans > 1 && searched_scans % params.search_pause != 0) return {};
      return area;
    }
    area.centre = hypotheses.front().predicted.translation.head<2>();
    // The distance to the farthest place of the map.
    const Bounds3& bounds = index.map_bounds;
    const double everywhere = (area.centre - bounds.min.head<2>())
                                  .cwiseAbs()
                                  .cwiseMax((area.centre - bounds.max.head<2>()).cwiseAbs())
                                  .norm();
    const auto radius = search_radius(
        searched_scans, std::min(everywhere, params.recovery_radius.value_or(everywhere)), params);
    if (!radius || *radius <= 0.0) return {};
    area.radius = *radius;
    return area;
  }

  /// Makes the map of the best hypothesis the current one.
  Result<void> use_best(ScanReport& report) {
    if (map && hypotheses.front().region == region) return {};
    // Waiting for a map that could not be expected is not a stall of tracking.
    const bool blocked = report.blocked;
    const double seconds_stall = report.seconds_stall;
    VANTAGE_CHECK(use(hypotheses.front().region, report));
    report.blocked = blocked;
    report.seconds_stall = seconds_stall;
    return {};
  }

  /// Looks for other poses that the sensor may have, and adds them to the hypotheses.
  Result<void> search(const Scan& scan, PointsView raw, PointsView points, ScanReport& report) {
    const auto area = search_area(scan);
    if (!area) return {};
    const Stopwatch stopwatch;
    if (!places) {
      auto made = PlaceIndex::of_bundle(index, *bundle.store());
      if (!made && made.error().code == ErrorCode::unsupported) {
        report.reason = made.error().message;
        return {};
      }
      if (!made) return fail(std::move(made).error());
      places = *std::move(made);
    }
    const PointCloud some = evenly_picked(points, kScored);
    VANTAGE_TRY(const auto reference, fit_to_itself(*matcher, raw, some));
    if (!reference) return {};
    VANTAGE_TRY(const Finds found,
                search_pose(index, maps, *places, points, some, *reference, *area));
    report.seconds_search = stopwatch.seconds();
    const bool bounded = std::isfinite(area->radius) && !scan.prior;
    const double recall = kRecall * (bounded ? kInArea : 1.0);
    for (const Find& find : found.finds) add(find, recall, found.aligned, scan);
    return {};
  }

  void add(const Find& find, double recall, std::size_t aligned, const Scan& scan) {
    constexpr double kSameMetres = 1.0, kSameRadians = 5.0 * std::numbers::pi / 180.0;
    const Pose& pose = find.alignment.T_map_scan;
    for (const Hypothesis& known : hypotheses) {
      if ((known.pose().translation - pose.translation).norm() < kSameMetres &&
          rotation_between(known.pose(), pose) < kSameRadians) {
        return;
      }
    }
    // The best of many wrong poses fits better than one of them.
    const double log_odds = std::log(recall / (1.0 - recall) / static_cast<double>(aligned)) +
                            log_likelihood_ratio(find.evidence, usual_share) +
                            agreement(pose, scan.prior);
    Hypothesis one{.motion = {},
                   .initial = pose,
                   .predicted = pose,
                   .region = find.region,
                   .alignment = find.alignment,
                   .failure = {},
                   .evidence = find.evidence};
    if (!hypotheses.empty() && hypotheses.front().motion.started()) {
      // The sensor was elsewhere all the time: its motion continues from there.
      one.motion = hypotheses.front().motion;
    }
    hypotheses.push_back(std::move(one));
    belief.add(log_odds);
  }

  /// Orders the hypotheses by belief, and drops those that are refuted. Those that became the same
  /// pose become one.
  void sort_out() {
    constexpr double kSameMetres = 0.3, kSameRadians = 3.0 * std::numbers::pi / 180.0;
    std::vector<std::size_t> order(hypotheses.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return belief.of(a) > belief.of(b); });
    std::vector<std::vector<std::size_t>> groups;
    for (const std::size_t h : order) {
      const auto same = std::find_if(groups.begin(), groups.end(), [&](const auto& group) {
        const Pose& other = hypotheses[group.front()].pose();
        return (hypotheses[h].pose().translation - other.translation).norm() < kSameMetres &&
               rotation_between(hypotheses[h].pose(), other) < kSameRadians;
      });
      if (same != groups.end()) {
        same->push_back(h);
      } else if (groups.empty() ||
                 (groups.size() < params.max_hypotheses && belief.of(h) >= kLeastBelief)) {
        groups.push_back({h});
      }
    }
    belief.keep(groups);
    std::vector<Hypothesis> sorted;
    for (const auto& group : groups) sorted.push_back(std::move(hypotheses[group.front()]));
    hypotheses = std::move(sorted);
  }

  /// Fills in what is reported of the best hypothesis, and the verdict.
  void conclude(ScanReport& report) {
    const Hypothesis& best = hypotheses.front();
    report.T_map_scan_predicted = best.predicted;
    report.T_map_scan = best.pose();
    report.reason = best.failure;
    report.alignment = best.alignment;
    if (best.alignment) {
      report.lcp =
          localization_contribution_per_point(best.alignment->score.fitness, report.map_points);
      report.confidence = confidence_of(*best.alignment, params.covariance_scale);
    }
    const double wrong = 1.0 - belief.of(0);
    report.risk = std::min(1.0, wrong + imprecise(best, report));
    if (belief.elsewhere() > 0.5 || !best.alignment) {
      report.tracking = Tracking::lost;
      report.T_map_scan = best.evidence || !best.alignment ? best.predicted : best.pose();
      if (report.reason.empty()) report.reason = "the scan does not fit the map here";
    } else if (report.risk > params.max_risk) {
      report.tracking = Tracking::uncertain;
      report.reason = wrong > params.max_risk
                          ? "other poses are not excluded yet"
                          : "the map does not say along one direction where the sensor is";
    } else {
      report.tracking = Tracking::tracked;
    }
    limit(best, report);
    if (report.tracking != Tracking::tracked) {
      was_lost = was_lost || report.tracking == Tracking::lost;
      return;
    }
    report.recovered = std::exchange(was_lost, false);
    constexpr double kNew = 0.1;  // the usual value is that of about the last ten scans
    const ScanScore& score = best.alignment->score;
    const double level = score.nvtl * score.coverage;
    usual_level = usual_level == 0.0 ? level : std::lerp(usual_level, level, kNew);
    if (best.evidence && best.evidence->share > 0.0) {
      usual_share =
          usual_share ? std::lerp(*usual_share, best.evidence->share, kNew) : best.evidence->share;
    }
  }

  /// The probability that the pose is off by more than the alert limit although it is the right one
  /// of the hypotheses.
  double imprecise(const Hypothesis& best, const ScanReport& report) {
    // Motion adds to the error of the last pose; where the scan says more, its own error counts.
    constexpr double kDriftMetres = 0.02, kDriftRadians = 0.002;  // per metre, with odometry
    constexpr double kGuessed = 5.0;                              // times as much without odometry
    double way = 0.0;
    if (const auto step = best.motion.step()) way = step->T_now_later.translation.norm();
    const double factor = (best.motion.has_odometry() ? 1.0 : kGuessed) * way;
    const bool known = sigma_m > 0.0;
    const double carried_m = std::hypot(sigma_m, kDriftMetres * factor);
    const double carried_rad = std::hypot(sigma_rad, kDriftRadians * factor);
    if (!report.confidence) {
      sigma_m = carried_m;
      sigma_rad = carried_rad;
    } else {
      sigma_m = report.confidence->sigma_translation[0];
      sigma_rad = report.confidence->sigma_rotation[0];
      if (known) {
        sigma_m = std::min(sigma_m, carried_m);
        sigma_rad = std::min(sigma_rad, carried_rad);
      }
    }
    const double limit_rad = params.alert_limit_deg * std::numbers::pi / 180.0;
    return beyond(params.alert_limit, sigma_m) + beyond(limit_rad, sigma_rad);
  }

  /// The limits that a user may set.
  void limit(const Hypothesis& best, ScanReport& report) const {
    if (report.tracking == Tracking::lost) return;
    const ScanScore& score = best.alignment->score;
    const double pulled =
        (best.alignment->T_map_scan.translation - best.predicted.translation).norm();
    if (params.min_coverage && score.coverage < *params.min_coverage) {
      report.reason = "coverage " + std::to_string(score.coverage) + " below min_coverage";
    } else if (params.min_nvtl && score.nvtl < *params.min_nvtl) {
      report.reason = "NVTL " + std::to_string(score.nvtl) + " below min_nvtl";
    } else if (params.max_correction && best.motion.step() && !(pulled <= *params.max_correction)) {
      report.reason =
          "matching moved the scan by " + std::to_string(pulled) + " m, more than max_correction";
      report.T_map_scan = best.predicted;
    } else {
      return;
    }
    report.tracking = Tracking::lost;
  }

  /// Every hypothesis moves on.
  void move_on(const Scan& scan, const ScanReport& report) {
    for (std::size_t h = 0; h < hypotheses.size(); ++h) {
      Hypothesis& one = hypotheses[h];
      const Pose& pose = h == 0 ? report.T_map_scan : one.pose();
      if (one.initial && one.motion.started()) {
        // The sensor was elsewhere all the time: its motion continues from there.
        one.motion.add(scan, one.motion.predict(scan));
        one.motion.correct(pose);
      } else {
        one.motion.add(scan, pose);
      }
      one.initial.reset();
    }
  }

  void forget_everything() {
    hypotheses.clear();
    belief = Belief();
    stamp.reset();
    searched_scans = 0;
    was_lost = false;
    usual_share.reset();
    to_itself.reset();
    weighed_at.reset();
    usual_level = sigma_m = sigma_rad = 0.0;
  }
};

Localizer::Localizer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Localizer::Localizer(Localizer&&) noexcept = default;
Localizer& Localizer::operator=(Localizer&&) noexcept = default;
Localizer::~Localizer() = default;

Result<Localizer> Localizer::open(Bundle bundle, PluginPtr<ScanMatcher> matcher,
                                  const LocalizerParams& params) {
  const auto& regions = bundle.index().regions;
  if (std::all_of(regions.begin(), regions.end(),
                  [](const RegionSummary& region) { return region.empty(); })) {
    return fail(ErrorCode::invalid_input, "no region of the bundle holds any point");
  }
  // A program may have set what a file could not.
  VANTAGE_TRY(const LocalizerParams checked, parse<LocalizerParams>(to_table(params)));
  return Localizer(std::make_unique<State>(std::move(bundle), std::move(matcher), checked));
}

Result<Localizer> Localizer::open(Bundle bundle, const Config& config,
                                  const PluginLoader& plugins) {
  VANTAGE_TRY(const PluginChoice choice, config.need(config.matcher, "matcher", kJob));
  VANTAGE_TRY(auto matcher, plugins.load<ScanMatcher>(choice));
  return open(std::move(bundle), std::move(matcher), config.localizer.value_or(LocalizerParams{}));
}

Result<Localizer> Localizer::open(const Config& config, const PluginLoader& plugins) {
  VANTAGE_TRY(Bundle bundle, Bundle::open(config, plugins, kJob));
  return open(std::move(bundle), config, plugins);
}

const MapIndex& Localizer::index() const noexcept { return state_->index; }

Result<void> Localizer::start(const Pose& T_map_scan) {
  State& s = *state_;
  if (!is_valid(T_map_scan)) {
    return fail(ErrorCode::invalid_input, "the initial pose is no rigid transform");
  }
  const RegionId region = s.choose_region(T_map_scan.translation).region;
  auto taken = s.maps.take(region);  // so that the first scan finds the map ready
  if (!taken) {
    return fail(std::move(taken).error().during("making region '" +
                                                s.index.partition[region].label + "' ready"));
  }
  s.forget_everything();
  s.hypotheses.push_back({.motion = {}, .initial = T_map_scan});
  s.belief = Belief::in_one(kTrustInStart);
  s.started = true;
  return {};
}

void Localizer::start_anywhere() {
  State& s = *state_;
  s.forget_everything();
  s.was_lost = s.started = true;
}

Result<ScanReport> Localizer::localize(const Scan& scan) {
  State& s = *state_;
  if (!s.started) {
    return fail(ErrorCode::invalid_input, "localization has no first pose: call start");
  }
  if (!std::isfinite(scan.stamp) || (s.stamp && scan.stamp <= *s.stamp)) {
    return fail(ErrorCode::invalid_input,
                "scan stamps must increase: " + std::to_string(scan.stamp) + " s" +
                    (s.stamp ? " follows " + std::to_string(*s.stamp) + " s" : ""));
  }
  ScanReport report;
  report.stamp = scan.stamp;
  VANTAGE_TRY(const PreparedScan prepared, s.prepare(scan));
  report.scan_points = prepared.points.size();
  report.dropped_points = prepared.dropped;
  const auto during = [&](Error error) {
    return fail(
        std::move(error).during("matching the scan at " + std::to_string(scan.stamp) + " s"));
  };

  const bool had_map = s.map != nullptr;
  const RegionId region_before = s.region;
  if (!s.hypotheses.empty()) {
    VANTAGE_CHECK(s.match(scan, prepared.points, report));
    s.belief.forget(kCarriedAway);
    const auto weighed = s.weigh(scan, prepared.finite, prepared.points);
    if (!weighed) return during(weighed.error());
  }
  const bool sure = !s.hypotheses.empty() && s.belief.of(0) >= kSure;
  s.searched_scans = sure ? 0 : s.searched_scans + 1;
  if (!sure && !prepared.points.empty()) {
    const auto searched = s.search(scan, prepared.finite, prepared.points, report);
    if (!searched) return during(searched.error());
  }
  s.stamp = scan.stamp;
  if (s.hypotheses.empty()) {
    report.reason = report.reason.empty() ? "the sensor has not been found yet" : report.reason;
    report.has_pose = false;
    return report;
  }
  s.sort_out();
  VANTAGE_CHECK(s.use_best(report));
  report.switched = s.map && (!had_map || s.region != region_before);
  s.conclude(report);
  report.held_bytes = s.maps.statistics().bytes;
  s.move_on(scan, report);
  s.expect_what_is_ahead();
  return report;
}

}  // namespace vantage
