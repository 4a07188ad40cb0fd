#include "vantage/engine/localizer.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "localize/alignment.hpp"
#include "localize/belief.hpp"
#include "localize/hypothesis.hpp"
#include "localize/regions_ahead.hpp"
#include "localize/search_area.hpp"
#include "localize/search_job.hpp"
#include "localize/searcher.hpp"
#include "localize/verdict.hpp"
#include "localize/weighing.hpp"
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

// What is believed of a pose that a user gives, before any scan.
constexpr double kTrustInStart = 0.97;
// The probability that the sensor was carried away, after a surprise.
constexpr double kCarriedAway = 0.05;
// With less belief than this in the best hypothesis, others are looked for.
constexpr double kSure = 0.8;
// Hypotheses with less belief are dropped.
constexpr double kLeastBelief = 1e-4;
}  // namespace

struct Localizer::State {
  State(Bundle the_bundle, PluginPtr<ScanMatcher> the_matcher, const LocalizerParams& the_params,
        const ShareModel& model)
      : bundle(std::move(the_bundle)),
        matcher(std::move(the_matcher)),
        params(the_params),
        ahead(directory),
        maps(bundle.store(), matcher,
             {.memory = static_cast<std::size_t>(params.map_memory * 1024.0 * 1024.0),
              .background = params.prefetch}),
        weighing(*matcher, maps, model) {}

  Bundle bundle;
  PluginPtr<ScanMatcher> matcher;
  std::shared_ptr<const RegionDirectory> directory = bundle.directory();
  LocalizerParams params;
  RegionsAhead ahead;
  RegionMaps maps;  // uses bundle and matcher

  bool started = false;
  std::optional<double> stamp;         // of the last scan
  std::optional<Pose> odometry;        // of the last scan
  std::vector<Hypothesis> hypotheses;  // the first is the one that is reported
  Belief belief;                       // in them

  std::shared_ptr<const ReadyRegion> map;  // of `region`
  RegionId region;

  Weighing weighing;
  Verdict verdict{params};
  bool compared = false;             // the hypotheses with all other places
  std::uint32_t doubtful_scans = 0;  // in a row

  Searcher searcher{*directory, bundle.store(), matcher, ahead, maps, params};
  bool startled = false;   // the sensor was carried away, maybe, since the search began
  bool surprised = false;  // by a scan, since a search began last
  SearchJob job{std::ref(searcher), {params.live, params.search_budget}};  // last: may be running

  struct Choice {
    RegionId region;
    bool outside;
  };
  /// Eq. 11 with hysteresis.
  [[nodiscard]] Result<Choice> choose_region(const Point& position) const {
    const Eigen::Vector2d xy = position.head<2>();
    VANTAGE_TRY(const auto located, ahead.owner_of(position));
    if (!located) {
      if (map) return Choice{region, true};
      VANTAGE_TRY(const RegionId nearest, ahead.nearest(xy));
      return Choice{nearest, true};
    }
    if (map && *located != region && params.switch_margin > 0.0) {
      VANTAGE_TRY(const double away, ahead.distance_to(region, xy));
      if (away <= params.switch_margin) return Choice{region, false};
    }
    return Choice{*located, false};
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
        return fail(std::move(taken).error().during("switching to region " + ahead.name_of(next)));
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

  Result<void> expect_what_is_ahead() {
    if (!params.prefetch) return {};
    const Motion& motion = hypotheses.front().motion;
    VANTAGE_TRY(auto regions,
                ahead(motion.pose().translation.head<2>(), motion.velocity().head<2>(),
                      params.prefetch_time, params.prefetch_distance));
    maps.expect(std::move(regions));
    return {};
  }

  /// Predicts where each hypothesis is now, and matches the scan there.
  Result<void> match(const Scan& scan, PointsView points, ScanReport& report) {
    for (std::size_t h = 0; h < hypotheses.size(); ++h) {
      Hypothesis& one = hypotheses[h];
      one.predicted = one.initial ? *one.initial : one.motion.predict(scan);
      one.alignment.reset();
      one.evidence.reset();
      // Eq. 11 uses the last estimate; before the first scan, that is the initial pose.
      VANTAGE_TRY(const Choice choice, choose_region(one.last().translation));
      std::shared_ptr<const ReadyRegion> ready;
      if (h == 0) {
        report.outside = choice.outside;
        VANTAGE_CHECK(use(choice.region, report));
        ready = map;
      } else {
        VANTAGE_TRY(ready, maps.borrow(choice.region));
      }
      one.map = ready;
      one.region = choice.region;
      const Stopwatch stopwatch;
      auto alignment = align_at_prediction(one, scan, points);
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

  /// Whether no other poses need to be looked for.
  [[nodiscard]] bool is_sure(const std::optional<PosePrior>& prior) const {
    constexpr double kDisagreement = -1.0;
    return !hypotheses.empty() && compared && hypotheses.front().fits() && belief.of(0) >= kSure &&
           agreement(hypotheses.front().pose(), prior) > kDisagreement;
  }

  /// How the sensor moved since the scan before: by odometry, otherwise as the best hypothesis did.
  [[nodiscard]] Pose step_to(const Scan& scan) const {
    if (odometry && scan.odometry) return odometry->inverse() * *scan.odometry;
    return hypotheses.empty() ? Pose{} : hypotheses.front().step();
  }

  /// @param weighed  whether the scan was
  void begin_search(const Scan& scan, const PreparedScan& prepared, bool weighed) {
    const auto predicted =
        hypotheses.empty() ? std::nullopt : std::optional(hypotheses.front().predicted);
    const auto area = search_area(scan.prior, predicted, directory->summary().map_bounds,
                                  doubtful_scans, surprised, params);
    if (!area) return;
    startled = surprised = false;
    job.begin(scan.stamp, {prepared, weighed ? weighing.fresh_reference() : std::nullopt, *area});
  }

  /// Adds what the search under way found to the hypotheses, once it is known.
  Result<void> take_finds(const Scan& scan, const PreparedScan& prepared) {
    auto known = job.answer(scan.stamp);
    if (!known) return {};
    VANTAGE_TRY(SearchAnswer answer, std::move(known->answer));
    if (!answer.searchable) params.recovery_radius = 0.0;
    if (known->T_then_now) {
      VANTAGE_TRY(answer.found.finds,
                  align_again(answer.found.finds, *known->T_then_now, prepared.points,
                              Weighing::scored(prepared), answer.to_itself));
    }
    compared = compared || !answer.searchable || (answer.compared && !startled);
    for (const Find& f : answer.found.finds) add(f, answer.recall, answer.found.aligned, scan);
    return {};
  }

  void add(const Find& find, double recall, std::size_t aligned, const Scan& scan) {
    constexpr double kSameMetres = 1.0, kSameRadians = 5.0 * std::numbers::pi / 180.0;
    const Pose& pose = find.alignment.T_map_scan;
    if (std::ranges::any_of(hypotheses, [&](const Hypothesis& known) {
          return is_near(known.pose(), pose, kSameMetres, kSameRadians);
        })) {
      return;
    }
    Hypothesis one{.motion = {},
                   .initial = pose,
                   .predicted = pose,
                   .region = find.region,
                   .map = find.map,
                   .alignment = find.alignment,
                   .failure = {},
                   .evidence = find.evidence};
    if (!hypotheses.empty()) one.motion = hypotheses.front().motion;
    hypotheses.push_back(std::move(one));
    // The best of many wrong poses fits better than one of them.
    belief.add(std::log(recall / (1.0 - recall) / static_cast<double>(aligned)) +
               weighing.of(find.evidence, pose, scan.prior));
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
        return is_near(hypotheses[h].pose(), hypotheses[group.front()].pose(), kSameMetres,
                       kSameRadians);
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

  void forget_everything(bool lost) {
    hypotheses.clear();
    belief = Belief();
    job.drop();
    stamp.reset();
    odometry.reset();
    compared = params.recovery_radius == 0.0;  // nothing to compare with
    startled = surprised = false;
    doubtful_scans = 0;
    weighing.forget();
    verdict.forget(lost);
    started = true;
  }
};

Localizer::Localizer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Localizer::Localizer(Localizer&&) noexcept = default;
Localizer& Localizer::operator=(Localizer&&) noexcept = default;
Localizer::~Localizer() = default;

Result<Localizer> Localizer::open(Bundle bundle, PluginPtr<ScanMatcher> matcher,
                                  const LocalizerParams& params, const ShareModel& model) {
  const BundleSummary& all = bundle.directory()->summary();
  if (all.empty_regions == all.regions) {
    return fail(ErrorCode::invalid_input, "no region of the bundle holds any point");
  }
  // A program may have set what a file could not.
  VANTAGE_TRY(const LocalizerParams checked, parse<LocalizerParams>(to_table(params)));
  return Localizer(std::make_unique<State>(std::move(bundle), std::move(matcher), checked, model));
}

const RegionDirectory& Localizer::regions() const noexcept { return *state_->directory; }
const LocalizerParams& Localizer::params() const noexcept { return state_->params; }

Result<void> Localizer::start(const Pose& T_map_scan) {
  State& s = *state_;
  if (!is_valid(T_map_scan)) {
    return fail(ErrorCode::invalid_input, "the initial pose is no rigid transform");
  }
  VANTAGE_TRY(const auto choice, s.choose_region(T_map_scan.translation));
  auto taken = s.maps.take(choice.region);  // so that the first scan finds the map ready
  if (!taken) {
    return fail(std::move(taken).error().during("making region " + s.ahead.name_of(choice.region) +
                                                " ready"));
  }
  s.forget_everything(false);
  s.hypotheses.push_back({.motion = {}, .initial = T_map_scan});
  s.belief = Belief::in_one(kTrustInStart);
  return {};
}

void Localizer::start_anywhere() {
  State& s = *state_;
  s.forget_everything(true);
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
  std::vector<double> comparison;
  bool surprise = false;
  if (!s.hypotheses.empty()) {
    VANTAGE_CHECK(s.match(scan, prepared.points, report));
    const Hypothesis& first = s.hypotheses.front();
    surprise = s.weighing.is_surprising(first);
    const double doubt = doubt_of_prediction(first, scan, s.stamp);
    if (!s.weighing.is_due(s.hypotheses, s.belief.of(0) - doubt)) {
      s.belief.forget(doubt);
    } else {
      const ScopeTimer timer(report.seconds_verdict);
      auto news = s.weighing(prepared, scan.prior, s.hypotheses);
      if (!news) return during(std::move(news).error());
      // A scan that does not fit speaks for itself. One that still fits may be from a place alike.
      s.belief.forget(surprise && first.fits() ? kCarriedAway : doubt);
      s.belief.weigh(*news);
      comparison = s.weighing.compare(s.hypotheses);
      s.belief.weigh(comparison);
    }
  }
  // Once the sensor is lost or was carried away, what was compared has become worthless.
  if (surprise || (!s.hypotheses.empty() && s.belief.elsewhere() > 0.5)) {
    s.startled = s.startled || s.compared || surprise;
    s.surprised = s.surprised || surprise;
    s.compared = s.params.recovery_radius == 0.0;
  }
  const bool sure = s.is_sure(scan.prior);
  s.doubtful_scans = sure ? 0 : s.doubtful_scans + 1;
  s.job.move(s.step_to(scan));
  const Stopwatch search;
  if (!sure && !prepared.points.empty() && !s.job.under_way()) {
    s.begin_search(scan, prepared, !comparison.empty());
  }
  if (s.job.under_way() && !prepared.points.empty()) {
    if (auto taken = s.take_finds(scan, prepared); !taken) return during(std::move(taken).error());
    report.seconds_search = search.seconds();
    // The finds take part in the comparison.
    const ScopeTimer timer(report.seconds_verdict);
    std::vector<double> anew = s.weighing.compare(s.hypotheses);
    for (std::size_t h = 0; h < comparison.size(); ++h) anew[h] -= comparison[h];
    s.belief.weigh(anew);
  }
  s.stamp = scan.stamp;
  s.odometry = scan.odometry;
  if (s.hypotheses.empty()) {
    report.reason = "the sensor has not been found yet";
    report.has_pose = false;
    return report;
  }
  s.sort_out();
  VANTAGE_CHECK(s.use_best(report));
  report.switched = s.map && (!had_map || s.region != region_before);
  Hypothesis& best = s.hypotheses.front();
  s.verdict.conclude(best,
                     {.belief = s.belief.of(0),
                      .elsewhere = s.belief.elsewhere(),
                      .compared = s.compared,
                      .scores_as_usual = s.weighing.scores_as_usual(best)},
                     report);
  const bool tracked = report.tracking == Tracking::tracked;
  s.weighing.learn(best, tracked);
  best.proven = best.proven || tracked;
  report.held_bytes = s.maps.statistics().bytes;
  s.move_on(scan, report);
  VANTAGE_CHECK(s.expect_what_is_ahead());
  return report;
}

}  // namespace vantage
