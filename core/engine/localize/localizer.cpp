#include "vantage/engine/localizer.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

#include "localize/motion.hpp"
#include "localize/pose_search.hpp"
#include "localize/regions_ahead.hpp"
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

/// How far a sensor that has been lost for so many scans is looked for: twice as far each time.
/// Once that is everywhere, only now and then, because it takes long.
std::optional<double> search_radius(std::uint32_t lost_scans, double everywhere,
                                    const LocalizerParams& params) {
  const double radius =
      std::ldexp(params.search_first_radius, static_cast<int>(std::min(lost_scans, 60U)) - 1);
  if (lost_scans <= 1 || radius < 2.0 * everywhere) return std::min(radius, everywhere);
  if (lost_scans % params.search_pause == 0) return everywhere;
  return {};
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

  std::optional<Pose> initial;  // given, not yet used
  bool anywhere = false;        // start_anywhere, not found yet
  Motion motion;

  std::shared_ptr<const ReadyRegion> map;  // of `region`
  RegionId region;

  bool lost = false;
  std::uint32_t lost_scans = 0;     // without a place that could be confirmed
  std::uint32_t fitting_scans = 0;  // in a row, while lost
  double usual_nvtl = 0.0;          // of recent tracked scans; 0 before the first

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
    const auto step = motion.step_to(scan);
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
    maps.expect(ahead(motion.pose().translation.head<2>(), motion.velocity().head<2>(),
                      params.prefetch_time, params.prefetch_distance));
  }

  /// Why an alignment cannot be trusted; empty if it can.
  [[nodiscard]] std::string doubt(const Alignment& alignment) const {
    if (!is_valid(alignment.T_map_scan)) return "the matcher returned no valid pose";
    if (alignment.score.coverage < params.min_coverage) {
      return "coverage " + std::to_string(alignment.score.coverage) + " below min_coverage";
    }
    if (alignment.score.nvtl < params.min_nvtl) {
      return "NVTL " + std::to_string(alignment.score.nvtl) + " below min_nvtl";
    }
    return {};
  }

  [[nodiscard]] std::string doubt(const Alignment& alignment, const Pose& predicted) const {
    const double correction = (alignment.T_map_scan.translation - predicted.translation).norm();
    if (motion.step() && !(correction <= params.max_correction)) {
      return "matching moved the scan by " + std::to_string(correction) +
             " m, more than max_correction";
    }
    return doubt(alignment);
  }

  /// A search tries so many places that some fit passably by chance. What it finds must fit nearly
  /// as well as earlier scans did.
  [[nodiscard]] bool is_find(const Alignment& alignment) const {
    return doubt(alignment).empty() &&
           alignment.score.nvtl >= params.search_nvtl_share * usual_nvtl;
  }

  /// Matches at the prediction and judges the result.
  Result<void> match(PointsView scan, ScanReport& report) const {
    const Stopwatch stopwatch;
    Result<Alignment> alignment = map->target->align(scan, report.T_map_scan_predicted);
    report.seconds_align = stopwatch.seconds();
    if (!alignment) {
      if (alignment.error().code != ErrorCode::too_few_matches) {
        return fail(std::move(alignment).error());
      }
      report.reason = alignment.error().message;
      return {};
    }
    report.reason = doubt(*alignment, report.T_map_scan_predicted);
    set_alignment(*std::move(alignment), report);
    return {};
  }

  void set_alignment(Alignment alignment, ScanReport& report) const {
    report.lcp = localization_contribution_per_point(alignment.score.fitness, report.map_points);
    report.confidence = confidence_of(alignment, params.covariance_scale);
    if (report.reason.empty()) report.T_map_scan = alignment.T_map_scan;
    report.alignment = std::move(alignment);
  }

  /// Where to search for a lost sensor; some scans do not search at all.
  [[nodiscard]] std::optional<SearchArea> search_area(const Pose& predicted) const {
    // Nearer than this the sensor is around its prediction: that is tried too, on a finer grid.
    constexpr double kNear = 10.0;
    SearchArea area;
    area.spacing = params.search_spacing;
    area.headings = params.search_headings;
    area.scored_points = params.search_scored_points;
    area.aligned_points = params.search_aligned_points;
    area.starts = params.search_starts;
    if (anywhere) return area;
    area.centre = predicted.translation;
    // The distance to the farthest place of the map.
    const Bounds3& bounds = index.map_bounds;
    const double everywhere = (area.centre - bounds.min)
                                  .cwiseAbs()
                                  .cwiseMax((area.centre - bounds.max).cwiseAbs())
                                  .head<2>()
                                  .norm();
    const auto radius = search_radius(
        lost_scans, std::min(everywhere, params.recovery_radius.value_or(everywhere)), params);
    if (!radius || *radius <= 0.0) return {};
    area.radius = *radius;
    if (area.radius < kNear) {
      area.spacing = 0.5 * params.search_spacing;
      area.guess = predicted;
    }
    return area;
  }

  /// Searches for a lost sensor and says whether it was found. Later scans must confirm the place.
  Result<bool> search(PointsView scan, ScanReport& report) {
    const auto area = search_area(report.T_map_scan_predicted);
    if (!area) return false;
    const Stopwatch stopwatch;
    VANTAGE_TRY(const auto found, search_pose(index, maps, scan, *area));
    report.seconds_search = stopwatch.seconds();
    if (found.empty() || !is_find(found.front().alignment)) return false;
    // Waiting for a map that could not be expected is not a stall of tracking.
    const bool blocked = report.blocked;
    const double seconds_stall = report.seconds_stall;
    VANTAGE_CHECK(use(found.front().region, report));
    report.blocked = blocked;
    report.seconds_stall = seconds_stall;
    report.reason.clear();
    set_alignment(found.front().alignment, report);
    return true;
  }

  /// Updates what is tracked and what is lost with the scan's outcome.
  void judge(ScanReport& report) {
    const bool fits = report.reason.empty();
    if (!lost && fits) {
      constexpr double kNew = 0.1;  // the usual value is that of about the last ten scans
      const double nvtl = report.alignment->score.nvtl;
      usual_nvtl = usual_nvtl == 0.0 ? nvtl : std::lerp(usual_nvtl, nvtl, kNew);
      report.tracking = Tracking::tracked;
      return;
    }
    lost = true;
    fitting_scans = fits ? fitting_scans + 1 : 0;
    if (fitting_scans >= params.confirming_scans) {
      lost = false;
      lost_scans = fitting_scans = 0;
      report.tracking = Tracking::tracked;
      report.recovered = true;
    } else if (fits) {
      report.reason = "found, to be confirmed by the next scans";
    }
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
  s.initial = T_map_scan;
  s.anywhere = s.lost = false;
  s.lost_scans = s.fitting_scans = 0;
  s.usual_nvtl = 0.0;
  s.motion.forget();
  return {};
}

void Localizer::start_anywhere() {
  State& s = *state_;
  s.initial.reset();
  s.anywhere = s.lost = true;
  s.lost_scans = s.fitting_scans = 0;
  s.usual_nvtl = 0.0;
  s.motion.forget();
}

Result<ScanReport> Localizer::localize(const Scan& scan) {
  State& s = *state_;
  if (!s.initial && !s.anywhere && !s.motion.started()) {
    return fail(ErrorCode::invalid_input, "localization has no first pose: call start");
  }
  if (!std::isfinite(scan.stamp) || (s.motion.started() && scan.stamp <= s.motion.stamp())) {
    return fail(
        ErrorCode::invalid_input,
        "scan stamps must increase: " + std::to_string(scan.stamp) + " s" +
            (s.motion.started() ? " follows " + std::to_string(s.motion.stamp()) + " s" : ""));
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
  if (s.anywhere) {
    report.reason = "the sensor has not been found yet";
    report.has_pose = false;
  } else {
    report.T_map_scan_predicted = s.initial ? *s.initial : s.motion.predict(scan);
    report.T_map_scan = report.T_map_scan_predicted;
    // Eq. 11 uses the last estimate; before the first scan, that is the initial pose.
    const State::Choice choice =
        s.choose_region(s.initial ? s.initial->translation : s.motion.pose().translation);
    report.outside = choice.outside;
    VANTAGE_CHECK(s.use(choice.region, report));
    auto matched = s.match(prepared.points, report);
    if (!matched) return during(std::move(matched).error());
  }
  bool found = false;
  if (!report.reason.empty() && !prepared.points.empty()) {
    ++s.lost_scans;
    auto searched = s.search(prepared.points, report);
    if (!searched) return during(std::move(searched).error());
    found = *searched;
  }
  report.switched = s.map && (!had_map || s.region != region_before);
  report.held_bytes = s.maps.statistics().bytes;
  s.judge(report);

  if (s.anywhere && !found) return report;
  report.has_pose = true;
  s.initial.reset();
  s.anywhere = false;
  if (found && s.motion.started()) {
    // The sensor was elsewhere all the time: its motion continues from there.
    s.motion.add(scan, report.T_map_scan_predicted);
    s.motion.correct(report.T_map_scan);
  } else {
    s.motion.add(scan, report.T_map_scan);
  }
  s.expect_what_is_ahead();
  return report;
}

}  // namespace vantage
