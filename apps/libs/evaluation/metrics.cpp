#include "vantage/evaluation/metrics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "evaluation/degrees.hpp"
#include "terminal/counts.hpp"

namespace vantage {
namespace {

using Value = std::optional<double>;
using Size = MetricUnit::Size;

constexpr double kFarMetres = 2.0, kFarDegrees = 5.0;

constexpr std::array kLengths{Size{"m", 1.0}, Size{"cm", 1e-2}, Size{"mm", 1e-3}};
constexpr std::array kAngles{Size{"deg", 1.0}, Size{"rad", kDegrees}};
constexpr std::array kTimes{Size{"ms", 1.0}, Size{"s", 1e3}, Size{"us", 1e-3}};
constexpr std::array kSizes{Size{"MB", 1e6}, Size{"kB", 1e3}, Size{"GB", 1e9}, Size{"B", 1.0}};
constexpr std::array kShares{Size{"%", 1e-2}, Size{"", 1.0}};
constexpr std::array kNumbers{Size{"", 1.0}};

constexpr MetricUnit kLength{"cm", 100.0, kLengths, -1};
constexpr MetricUnit kAngle{"deg", 1.0, kAngles, -1};
constexpr MetricUnit kTime{"ms", 1.0, kTimes, 4};
constexpr MetricUnit kBytes{"MB", 1e-6, kSizes, -1};
constexpr MetricUnit kShare{"%", 100.0, kShares, -1};
constexpr MetricUnit kNumber{"", 1.0, kNumbers, -1};
constexpr MetricUnit kMillionth{"1e-6", 1e6, kNumbers, -1};

constexpr auto kLess = Better::less, kMore = Better::more, kNeither = Better::neither;
using G = MetricGroup;

Value flag(bool on) { return on ? 1.0 : 0.0; }
Value count(std::uint64_t n) { return static_cast<double>(n); }
Value milliseconds(double seconds) { return 1e3 * seconds; }
Value if_positive(const Value& x) { return x && *x > 0.0 ? x : Value(); }

// What gates in percent divide by: the scans for which a metric has a value.
constexpr std::string_view kAllScans = "scans";
constexpr std::string_view kKnownScans = "scans with a pose and a reference";
constexpr std::string_view kKnownTracked = "tracked scans with a reference";

/// Whether a matcher compared the scan with a map.
bool was_aligned(const RunScan& s) {
  return s.report.alignment.has_value() || s.report.seconds_align > 0.0;
}
Value score(const RunScan& s, double ScanScore::*member) {
  return s.report.alignment ? Value((s.report.alignment->score).*member) : Value();
}
Value error(const RunScan& s, double PoseError::*member) {
  return s.error ? Value((*s.error).*member) : Value();
}
Value predicted(const RunScan& s, float PredictedError::*member) {
  const Value x = s.predicted ? Value((*s.predicted).*member) : Value();
  return x && std::isfinite(*x) ? x : Value();  // without a limit, nothing is said
}
/// Whether the pose is farther than this from the reference.
Value beyond(const RunScan& s, double metres, double degrees) {
  if (!s.error) return {};
  return flag(s.error->metres > metres || s.error->degrees > degrees);
}
Value tracked_beyond(const RunScan& s, double metres, double degrees) {
  return is_tracked(s) ? beyond(s, metres, degrees) : Value();
}
Value map_points(const RunScan& s) {
  return was_aligned(s) && s.map.points > 0 ? count(s.report.map_points) : Value();
}

constexpr std::array kMetrics{
    Metric{"lost", "lost", &kNumber, 0, kLess, G::scans, "sum", "sum", "1 if the scan is lost",
           [](const RunScan& s) { return flag(s.report.tracking == Tracking::lost); }, kNotInFiles,
           kAllScans},
    Metric{"uncertain", "uncertain", &kNumber, 0, kLess, G::scans, "sum", "sum",
           "1 if the scan is uncertain: neither tracked nor lost",
           [](const RunScan& s) { return flag(s.report.tracking == Tracking::uncertain); },
           kNotInFiles, kAllScans},
    Metric{"far_off", "beyond 2 m or 5 deg", &kNumber, 0, kLess, G::scans, "sum", "",
           "1 if the pose, tracked or not, is more than 2 m or 5 degrees from the reference",
           [](const RunScan& s) { return beyond(s, kFarMetres, kFarDegrees); }, kNotInFiles,
           kKnownScans},
    Metric{"wrong", "tracked beyond 2 m or 5 deg", &kNumber, 0, kLess, G::scans, "sum", "",
           "1 if a tracked scan is more than 2 m or 5 degrees from the reference",
           [](const RunScan& s) { return tracked_beyond(s, kFarMetres, kFarDegrees); }, kNotInFiles,
           kKnownTracked},
    Metric{"misleading", "misleading information", &kNumber, 0, kLess, G::scans, "sum", "",
           "1 if a tracked scan is farther from the reference than `alert_limit` or "
           "`alert_limit_deg` of the run",
           [](const RunScan& s) {
             return tracked_beyond(s, s.alert_limit.metres, s.alert_limit.degrees);
           },
           kNotInFiles, kKnownTracked},
    Metric{"recovered", "relocalized", &kNumber, 0, kNeither, G::scans, "sum", "",
           "1 for the first tracked scan after lost ones",
           [](const RunScan& s) { return flag(s.report.recovered); }},
    Metric{"switched", "switches", &kNumber, 0, kNeither, G::scans, "sum", "",
           "1 if the region is not that of the scan before; sums leave out the first scan",
           [](const RunScan& s) { return flag(s.report.switched); }, kAfterFirst},
    Metric{"outside", "outside", &kNumber, 0, kLess, G::scans, "sum", "",
           "1 if the last pose was in no region with a map: the old map was kept",
           [](const RunScan& s) { return flag(s.report.outside); }},
    Metric{"blocked", "blocked", &kNumber, 0, kLess, G::scans, "sum", "",
           "1 if the map to switch to was not ready",
           [](const RunScan& s) { return flag(s.report.blocked); }, kOwnMaps},
    Metric{"map_points", "map points", &kNumber, 0, kLess, G::map, "mean", "mean",
           "points of the map that the scan was matched against (N_point of Eq. 13)", map_points,
           kNeedsPoints},
    Metric{"scan_points", "scan points", &kNumber, 0, kNeither, G::match, "mean", "",
           "points of the scan after thinning (N of Eq. 12)",
           [](const RunScan& s) { return count(s.report.scan_points); }},
    Metric{"dropped_points", "dropped points", &kNumber, 0, kLess, G::scans, "sum", "",
           "points of the scan that were not finite, or farther than 10 km",
           [](const RunScan& s) { return count(s.report.dropped_points + s.dropped_by_reader); }},
    Metric{"doubted", "odometry doubted", &kNumber, 0, kLess, G::scans, "sum", "",
           "1 if odometry has contradicted the motion that is known since the scan before, and did "
           "not always count",
           [](const RunScan& s) { return flag(s.report.seconds_doubted > 0.0); }, kNotInOldFiles},
    Metric{"align_ms", "align", &kTime, 2, kLess, G::time, "mean p95", "mean",
           "time of scan matching alone (T_align, Sec. 3.3)",
           [](const RunScan& s) { return if_positive(milliseconds(s.report.seconds_align)); }},
    Metric{"stall_ms", "stall", &kTime, 2, kLess, G::time, "max p99", "",
           "time that the scan waited for its map",
           [](const RunScan& s) { return milliseconds(s.report.seconds_stall); }, kOwnMaps},
    Metric{"search_ms", "search", &kTime, 2, kLess, G::time, "mean max", "",
           "time of the search for a lost sensor",
           [](const RunScan& s) { return if_positive(milliseconds(s.report.seconds_search)); }},
    Metric{"verdict_ms", "verdict", &kTime, 2, kLess, G::time, "mean max", "",
           "time of weighing the poses that are followed, and of comparing them",
           [](const RunScan& s) { return if_positive(milliseconds(s.report.seconds_verdict)); },
           kNotInOldFiles},
    Metric{"scan_ms", "whole scan", &kTime, 2, kLess, G::time, "mean p95 max", "",
           "time of the whole scan, from its points to its pose",
           [](const RunScan& s) { return if_positive(milliseconds(s.seconds)); },
           kOwnMaps | kNotInOldFiles},
    Metric{"load_ms", "load", &kTime, 2, kLess, G::time, "mean max", "",
           "time to load the map of the new region, in any thread",
           [](const RunScan& s) {
             return s.report.switched ? milliseconds(s.report.seconds_load) : Value();
           },
           kOwnMaps},
    Metric{"prepare_ms", "prepare", &kTime, 2, kLess, G::time, "mean max", "",
           "time of preparing that map for matching",
           [](const RunScan& s) {
             return s.report.switched ? milliseconds(s.report.seconds_prepare) : Value();
           },
           kOwnMaps},
    Metric{"iterations", "iterations", &kNumber, 1, kLess, G::match, "mean", "",
           "steps of the matcher",
           [](const RunScan& s) {
             return s.report.alignment ? count(s.report.alignment->iterations) : Value();
           },
           kTrackedOnly},
    Metric{"fitness", "fitness", &kNumber, 4, kMore, G::match, "mean", "",
           "S_fitness (Eq. 12); a scan point without a voxel counts 0",
           [](const RunScan& s) { return score(s, &ScanScore::fitness); }, kTrackedOnly},
    Metric{"nvtl", "NVTL", &kNumber, 3, kMore, G::match, "mean", "",
           "nearest voxel transformation likelihood: mean over the matched points of the "
           "likelihood of the best voxel",
           [](const RunScan& s) { return score(s, &ScanScore::nvtl); }, kTrackedOnly},
    Metric{"coverage", "coverage", &kShare, 2, kMore, G::match, "mean", "",
           "share of the scan's points that have a voxel in the map",
           [](const RunScan& s) { return score(s, &ScanScore::coverage); }, kTrackedOnly},
    Metric{"lcp", "LCP", &kMillionth, 3, kMore, G::match, "mean", "",
           "`fitness` divided by `map_points` (Eq. 13)",
           [](const RunScan& s) {
             return s.report.alignment && map_points(s) ? Value(s.report.lcp) : Value();
           },
           kTrackedOnly | kNeedsPoints},
    Metric{"sigma_m", "sigma", &kLength, 2, kLess, G::match, "mean", "",
           "largest standard deviation of the estimated position",
           [](const RunScan& s) {
             const auto& c = s.report.confidence;
             return c ? Value(c->sigma_translation[0]) : Value();
           },
           kTrackedOnly},
    Metric{"sigma_deg", "sigma", &kAngle, 3, kLess, G::match, "mean", "",
           "largest standard deviation of the estimated rotation",
           [](const RunScan& s) {
             const auto& c = s.report.confidence;
             return c ? Value(c->sigma_rotation[0] * kDegrees) : Value();
           },
           kTrackedOnly},
    Metric{"degenerate", "degenerate", &kNumber, 1, kLess, G::match, "mean max", "",
           "number of directions that the match barely constrains",
           [](const RunScan& s) {
             const auto& c = s.report.confidence;
             return c ? count(c->degenerate) : Value();
           },
           kTrackedOnly},
    Metric{"prediction_m", "error of the prediction", &kLength, 2, kLess, G::match, "mean p95", "",
           "distance of the predicted position from the reference, before matching",
           [](const RunScan& s) {
             return s.prediction_error ? Value(s.prediction_error->metres) : Value();
           }},
    Metric{"prediction_deg", "error of the prediction", &kAngle, 3, kLess, G::match, "mean", "",
           "angle between the predicted rotation and that of the reference, before matching",
           [](const RunScan& s) {
             return s.prediction_error ? Value(s.prediction_error->degrees) : Value();
           }},
    Metric{"passes", "passes", &kNumber, 2, kLess, G::match, "mean max", "",
           "how often the sweep was undistorted and matched; its halves do not count",
           [](const RunScan& s) { return if_positive(count(s.report.passes)); }},
    Metric{"correction_m", "correction", &kLength, 2, kNeither, G::match, "mean p95", "",
           "how far matching moved the predicted position",
           [](const RunScan& s) {
             const ScanReport& r = s.report;
             if (!r.alignment || !r.has_pose) return Value();
             return Value((r.T_map_scan.translation - r.T_map_scan_predicted.translation).norm());
           },
           kTrackedOnly},
    Metric{"risk", "integrity risk", &kNumber, 2, kLess, G::match, "mean median max", "",
           "probability, in the localizer's own estimate, that the pose is beyond the alert limit",
           [](const RunScan& s) { return s.report.has_pose ? Value(s.report.risk) : Value(); },
           kNotInOldFiles | kSignificant},
    Metric{"error_m", "error", &kLength, 2, kLess, G::error, "mean rmse median p95 max", "mean p95",
           "distance from the reference; trajectories are not aligned",
           [](const RunScan& s) { return error(s, &PoseError::metres); }, kTrackedOnly},
    Metric{"error_deg", "error", &kAngle, 3, kLess, G::error, "mean rmse median p95 max", "",
           "angle from the reference",
           [](const RunScan& s) { return error(s, &PoseError::degrees); }, kTrackedOnly},
    Metric{"expected_m", "error expected", &kLength, 2, kLess, G::error, "mean", "",
           "root mean square of the errors that the bundle expects where the sensor is; only of "
           "maps whose elements a selector chose",
           [](const RunScan& s) { return predicted(s, &PredictedError::expected); },
           kOwnMaps | kTrackedOnly | kNotInOldFiles},
    Metric{"promised_m", "error promised", &kLength, 2, kLess, G::error, "mean", "",
           "the error that the bundle promises for 95 % of scans where the sensor is, even with a "
           "third of their view covered",
           [](const RunScan& s) { return predicted(s, &PredictedError::error); },
           kOwnMaps | kTrackedOnly | kNotInOldFiles},
    Metric{"held_bytes", "maps in memory", &kBytes, 2, kLess, G::map, "max", "",
           "memory of all maps that are ready to match against",
           [](const RunScan& s) { return count(s.report.held_bytes); }},
    Metric{
        "map_bytes", "map size", &kBytes, 2, kLess, G::map, "mean max", "",
        "size of the map in use in the bundle",
        [](const RunScan& s) { return was_aligned(s) ? if_positive(count(s.map.bytes)) : Value(); },
        kOwnMaps},
    Metric{"reduction_used", "reduction used", &kShare, 1, kMore, G::map, "mean", "",
           "share of the wide-area map's points that the map in use leaves out",
           [](const RunScan& s) {
             const Value points = map_points(s);
             if (!points || s.wide_area_points == 0) return Value();
             return Value(1.0 - *points / static_cast<double>(s.wide_area_points));
           },
           kNeedsPoints},
};

constexpr std::array kStatistics{
    NamedStatistic{"mean", &Statistics::mean},     NamedStatistic{"rmse", &Statistics::rmse},
    NamedStatistic{"std", &Statistics::std},       NamedStatistic{"min", &Statistics::min},
    NamedStatistic{"median", &Statistics::median}, NamedStatistic{"p95", &Statistics::p95},
    NamedStatistic{"p99", &Statistics::p99},       NamedStatistic{"max", &Statistics::max},
    NamedStatistic{"sum", &Statistics::sum}};

}  // namespace

std::span<const Metric> metrics() { return kMetrics; }

std::vector<const Metric*> metrics_by_group() {
  std::vector<const Metric*> sorted;
  for (const Metric& metric : kMetrics) sorted.push_back(&metric);
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Metric* a, const Metric* b) { return a->group < b->group; });
  return sorted;
}

std::optional<double> counted_value(const Metric& metric, const RunScan& scan) {
  if (metric.is(kTrackedOnly) && !is_tracked(scan)) return {};
  return metric.value(scan);
}

const Metric* find_metric(std::string_view key) {
  const auto* found = std::find_if(kMetrics.begin(), kMetrics.end(),
                                   [&](const Metric& metric) { return metric.key == key; });
  return found == kMetrics.end() ? nullptr : found;
}

std::string heading(const Metric& metric) {
  return metric.unit->shown.empty() ? std::string(metric.name)
                                    : fmt::format("{} [{}]", metric.name, metric.unit->shown);
}

std::string shown(const Metric& metric, double value) {
  return rounded(metric, metric.unit->scale * value);
}

std::string rounded(const Metric& metric, double value) {
  if (metric.is(kSignificant)) return fmt::format("{:.{}g}", value, metric.digits);
  if (metric.digits > 0) return fmt::format("{:.{}f}", value, metric.digits);
  return cli::grouped_whole(value);
}

std::string_view name_in_gates(const Metric& metric) {
  for (const std::string_view unit : {"_ms", "_m", "_deg", "_bytes"}) {
    if (metric.key.ends_with(unit)) return metric.key.substr(0, metric.key.size() - unit.size());
  }
  return metric.key;
}

std::span<const NamedStatistic> named_statistics() { return kStatistics; }

std::vector<NamedStatistic> statistics_in(std::string_view names) {
  std::vector<NamedStatistic> listed;
  while (!names.empty()) {
    const std::string_view name = names.substr(0, names.find(' '));
    for (const NamedStatistic& statistic : kStatistics) {
      if (statistic.name == name) listed.push_back(statistic);
    }
    names.remove_prefix(std::min(names.size(), name.size() + 1));
  }
  return listed;
}

NamedStatistic headline(const Metric& metric) { return statistics_in(metric.statistics).front(); }

}  // namespace vantage
