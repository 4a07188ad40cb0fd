#include "vantage/evaluation/summary.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace vantage {
namespace {

constexpr double kDegrees = 180.0 / M_PI;
constexpr double kLostMetres = 2.0, kLostDegrees = 5.0;

/// A column of a statistic over the scans for which `value` gives a number.
template <class F>
Statistics over(const Run& run, const F& value) {
  std::vector<double> sample;
  for (const RunScan& scan : run.scans) {
    if (const std::optional<double> x = value(scan)) sample.push_back(*x);
  }
  return statistics_of(sample);
}

/// Share of the errors along the axes within 1, 2 and 3 standard deviations; a normal distribution
/// would have 68, 95 and 99.7 %.
std::array<double, 3> within_sigmas(const Run& run, Eigen::Vector3d PoseError::*error,
                                    Eigen::Index first) {
  std::array<double, 3> within{};
  std::size_t errors = 0;
  for (const RunScan& scan : run.scans) {
    if (!is_tracked(scan) || !scan.error || !scan.report.confidence) continue;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const double sigma =
          std::sqrt(scan.report.confidence->covariance(first + axis, first + axis));
      const double size = std::abs(((*scan.error).*error)[axis]);
      ++errors;
      for (std::size_t k = 0; k < 3; ++k) {
        if (size <= static_cast<double>(k + 1) * sigma) within[k] += 1.0;
      }
    }
  }
  for (double& share : within) share /= static_cast<double>(std::max<std::size_t>(errors, 1));
  return within;
}

/// @param step  distance along the reference's path between the scans that are compared [m]; 0: the
///              next scan
RelativeErrors relative_errors(const Run& run, double step) {
  const std::vector<double> way = distances(run);
  const auto compared = [&](std::size_t i) {
    return is_tracked(run.scans[i]) && run.scans[i].reference.has_value();
  };
  std::vector<double> m, deg;
  for (std::size_t i = 0, j = 1; i + 1 < run.scans.size(); ++i) {
    j = std::max(j, i + 1);
    while (j < run.scans.size() && way[j] - way[i] < step) ++j;
    if (j == run.scans.size()) break;
    if (!compared(i) || !compared(j)) continue;
    const auto motion = [](const Pose& from, const Pose& to) { return from.inverse() * to; };
    const Pose truth = motion(*run.scans[i].reference, *run.scans[j].reference);
    const Pose estimate = motion(run.scans[i].report.T_map_scan, run.scans[j].report.T_map_scan);
    m.push_back((truth.inverse() * estimate).translation.norm());
    deg.push_back(rotation_between(truth, estimate) * kDegrees);
  }
  return {.m = statistics_of(m), .deg = statistics_of(deg)};
}
}  // namespace

RunSummary summarize(const Run& run) {
  using Number = std::optional<double>;
  RunSummary s;
  s.scans = run.scans.size();
  for (const RunScan& scan : run.scans) {
    s.tracked += is_tracked(scan) ? 1 : 0;
    s.recovered += scan.report.recovered ? 1 : 0;
    s.switches += scan.report.switched ? 1 : 0;
    s.blocking_loads += scan.report.blocked ? 1 : 0;
    s.outside += scan.report.outside ? 1 : 0;
    s.dropped_points += scan.report.dropped_points + scan.dropped_by_reader;
    s.held_bytes = std::max(s.held_bytes, scan.report.held_bytes);
    if (scan.error && (scan.error->metres > kLostMetres || scan.error->degrees > kLostDegrees)) {
      ++s.far_off;
      s.tracked_far_off += is_tracked(scan) ? 1 : 0;
    }
  }
  s.lost = s.scans - s.tracked;
  // The first map is made ready at the start; that is not a switch.
  if (!run.scans.empty() && run.scans.front().report.switched) --s.switches;

  const auto error = [&](double PoseError::*member) {
    return over(run, [=](const RunScan& scan) -> Number {
      if (!scan.error || !is_tracked(scan)) return {};
      return (*scan.error).*member;
    });
  };
  s.error_m = error(&PoseError::metres);
  s.error_deg = error(&PoseError::degrees);
  s.relative_frame = relative_errors(run, 0.0);
  s.relative_10m = relative_errors(run, 10.0);

  s.align_ms = over(run, [](const RunScan& x) -> Number { return 1e3 * x.report.seconds_align; });
  s.stall_ms = over(run, [](const RunScan& x) -> Number { return 1e3 * x.report.seconds_stall; });
  s.search_ms = over(run, [](const RunScan& x) -> Number {
    if (x.report.seconds_search <= 0.0) return {};
    return 1e3 * x.report.seconds_search;
  });
  const auto at_switches = [&](double ScanReport::*member) {
    return over(run, [=](const RunScan& x) -> Number {
      if (!x.report.switched) return {};
      return 1e3 * x.report.*member;
    });
  };
  s.load_ms = at_switches(&ScanReport::seconds_load);
  s.prepare_ms = at_switches(&ScanReport::seconds_prepare);
  s.map_points = over(
      run, [](const RunScan& x) -> Number { return static_cast<double>(x.report.map_points); });

  const auto tracked = [&](const auto& value) {
    return over(run, [&](const RunScan& x) -> Number {
      if (!is_tracked(x) || !x.report.alignment) return {};
      return value(x.report);
    });
  };
  s.iterations =
      tracked([](const ScanReport& r) { return static_cast<double>(r.alignment->iterations); });
  s.fitness = tracked([](const ScanReport& r) { return r.alignment->score.fitness; });
  s.nvtl = tracked([](const ScanReport& r) { return r.alignment->score.nvtl; });
  s.coverage = tracked([](const ScanReport& r) { return r.alignment->score.coverage; });
  s.lcp = tracked([](const ScanReport& r) { return r.lcp; });
  s.sigma_m = tracked([](const ScanReport& r) { return r.confidence->sigma_translation[0]; });
  s.within_sigmas_translation = within_sigmas(run, &PoseError::translation, 0);
  s.within_sigmas_rotation = within_sigmas(run, &PoseError::rotation, 3);
  return s;
}
}  // namespace vantage
