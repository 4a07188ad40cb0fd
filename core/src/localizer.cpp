#include "vantage/localizer.hpp"

#include <cmath>
#include <limits>
#include <utility>

#include "stopwatch.hpp"

namespace vantage {
namespace {

struct Moment {
  double stamp;
  Pose T_map_scan;
  std::optional<Pose> odometry;
};

/// Where the sensor is at `scan`, from the last one or two moments.
Pose predict(const std::optional<Moment>& before_last, const Moment& last, const Scan& scan) {
  if (scan.odometry && last.odometry) {
    return last.T_map_scan * (last.odometry->inverse() * *scan.odometry);
  }
  if (!before_last) return last.T_map_scan;
  // Constant velocity in the sensor's own frame, so that a turn goes on as a turn.
  const Pose step = before_last->T_map_scan.inverse() * last.T_map_scan;
  const double fraction = (scan.stamp - last.stamp) / (last.stamp - before_last->stamp);
  return last.T_map_scan * interpolate(Pose{}, step, fraction);
}

}  // namespace

const char* to_string(Tracking tracking) noexcept {
  switch (tracking) {
    case Tracking::tracked: return "tracked";
    case Tracking::lost: return "lost";
  }
  return "unknown";
}

struct Localizer::State {
  PluginPtr<MapStore> store;
  PluginPtr<ScanMatcher> matcher;
  LocalizerParams params;
  MapIndex index;

  std::optional<Pose> initial;  // given, not yet used
  std::optional<Moment> before_last, last;

  PluginPtr<MatchTarget> target;  // of `region`
  RegionId region;

  [[nodiscard]] bool has_map(RegionId id) const { return !index.regions[id.value].empty(); }

  /// The nearest region that has a map; the index has at least one.
  [[nodiscard]] RegionId nearest_with_map(const Eigen::Vector2d& xy) const {
    RegionId best;
    double best_distance = std::numeric_limits<double>::infinity();
    for (std::uint32_t r = 0; r < index.partition.size(); ++r) {
      const double d = distance(index.partition[RegionId{r}].footprint, xy);
      if (has_map(RegionId{r}) && d < best_distance) {
        best = RegionId{r};
        best_distance = d;
      }
    }
    return best;
  }

  struct Choice {
    RegionId region;
    bool outside;
  };
  /// Eq. 11 with hysteresis.
  [[nodiscard]] Choice choose_region(const Point& position) const {
    const Eigen::Vector2d xy = position.head<2>();
    const auto located = index.partition.locate(position);
    if (!located || !has_map(*located)) {
      return {target ? region : nearest_with_map(xy), true};
    }
    if (target && *located != region && params.switch_margin > 0.0 &&
        distance(index.partition[region].footprint, xy) <= params.switch_margin) {
      return {region, false};
    }
    return {*located, false};
  }

  Result<void> switch_to(RegionId next, ScanReport& report) {
    const std::string activity = "switching to region '" + index.partition[next].label + "'";
    Stopwatch stopwatch;
    auto map = store->get(next);
    if (!map) return fail(std::move(map).error().during(activity));
    report.seconds_load = stopwatch.seconds();

    stopwatch = {};
    auto prepared = matcher->prepare(map->points);
    if (!prepared) return fail(std::move(prepared).error().during(activity));
    target = in_library_of(matcher, *std::move(prepared));
    report.seconds_prepare = stopwatch.seconds();
    region = next;
    report.switched = true;
    return {};
  }

  /// Why an alignment is not to be believed; empty if it is.
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
};

Localizer::Localizer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Localizer::Localizer(Localizer&&) noexcept = default;
Localizer& Localizer::operator=(Localizer&&) noexcept = default;
Localizer::~Localizer() = default;

Result<Localizer> Localizer::open(PluginPtr<MapStore> store, PluginPtr<ScanMatcher> matcher,
                                  const LocalizerParams& params) {
  auto state = std::make_unique<State>();
  VANTAGE_TRY(state->index, store->index());
  if (state->index.regions.size() != state->index.partition.size()) {
    return fail(ErrorCode::corrupt_data,
                "the bundle's index has " + std::to_string(state->index.regions.size()) +
                    " summaries for " + std::to_string(state->index.partition.size()) + " regions");
  }
  bool any = false;
  for (const RegionSummary& summary : state->index.regions) any = any || summary.points > 0;
  if (!any) return fail(ErrorCode::invalid_input, "no region of the bundle holds any point");
  state->store = std::move(store);
  state->matcher = std::move(matcher);
  state->params = params;
  return Localizer(std::move(state));
}

const MapIndex& Localizer::index() const noexcept { return state_->index; }

Result<void> Localizer::start(const Pose& T_map_scan) {
  if (!is_valid(T_map_scan)) {
    return fail(ErrorCode::invalid_input, "the initial pose is no rigid transform");
  }
  state_->initial = T_map_scan;
  state_->before_last.reset();
  state_->last.reset();
  return {};
}

Result<ScanReport> Localizer::localize(const Scan& scan) {
  State& s = *state_;
  if (!s.initial && !s.last) {
    return fail(ErrorCode::invalid_input, "localization has no first pose: call start");
  }
  if (!std::isfinite(scan.stamp) || (s.last && scan.stamp <= s.last->stamp)) {
    return fail(ErrorCode::invalid_input,
                "scan stamps must increase: " + std::to_string(scan.stamp) + " s" +
                    (s.last ? " follows " + std::to_string(s.last->stamp) + " s" : ""));
  }
  ScanReport report;
  report.stamp = scan.stamp;
  report.T_map_scan_predicted = s.initial ? *s.initial : predict(s.before_last, *s.last, scan);
  report.T_map_scan = report.T_map_scan_predicted;

  // Eq. 11 asks the last estimate; before the first scan that is the initial pose.
  const Point& position = s.initial ? s.initial->translation : s.last->T_map_scan.translation;
  const State::Choice choice = s.choose_region(position);
  report.outside = choice.outside;
  if (!s.target || choice.region != s.region) VANTAGE_CHECK(s.switch_to(choice.region, report));
  report.region = s.region;
  report.map_points = s.index.regions[s.region.value].points;

  VANTAGE_TRY(const PreparedScan prepared, prepare_scan(scan.points, s.params));
  report.scan_points = prepared.points.size();
  report.dropped_points = prepared.dropped;

  const Stopwatch stopwatch;
  Result<Alignment> alignment = s.target->align(prepared.points, report.T_map_scan_predicted);
  report.seconds_align = stopwatch.seconds();
  if (alignment) {
    report.reason = s.doubt(*alignment);
    if (report.reason.empty()) {
      report.tracking = Tracking::tracked;
      report.T_map_scan = alignment->T_map_scan;
    }
    report.lcp = localization_contribution_per_point(alignment->score.fitness, report.map_points);
    report.alignment = *std::move(alignment);
  } else if (alignment.error().code == ErrorCode::too_few_matches) {
    report.reason = alignment.error().message;
  } else {
    return fail(std::move(alignment).error().during("matching the scan at " +
                                                    std::to_string(scan.stamp) + " s"));
  }

  s.initial.reset();
  s.before_last = std::exchange(s.last, Moment{scan.stamp, report.T_map_scan, scan.odometry});
  return report;
}

}  // namespace vantage
