#include "vantage/evaluation/summary.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "evaluation/degrees.hpp"
#include "vantage/evaluation/metrics.hpp"

namespace vantage {
namespace {

/// The values of a metric that count for a run.
std::vector<double> sample_of(const Run& run, const Metric& metric) {
  std::vector<double> sample;
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    if (i == 0 && metric.is(kAfterFirst)) continue;
    if (const auto x = counted_value(metric, run.scans[i])) sample.push_back(*x);
  }
  return sample;
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
  RunSummary s;
  s.scans = run.scans.size();
  s.tracked =
      static_cast<std::size_t>(std::count_if(run.scans.begin(), run.scans.end(), is_tracked));
  for (const Metric& metric : metrics()) {
    s.of_metrics.push_back(statistics_of(sample_of(run, metric)));
  }
  s.relative_frame = relative_errors(run, 0.0);
  s.relative_10m = relative_errors(run, 10.0);
  s.within_sigmas_translation = within_sigmas(run, &PoseError::translation, 0);
  s.within_sigmas_rotation = within_sigmas(run, &PoseError::rotation, 3);
  return s;
}

Statistics RunSummary::operator[](std::string_view key) const {
  const Metric* metric = find_metric(key);
  const auto at = static_cast<std::size_t>(metric - metrics().data());
  return metric != nullptr && at < of_metrics.size() ? of_metrics[at] : Statistics{};
}

std::size_t RunSummary::count(std::string_view key) const {
  return static_cast<std::size_t>((*this)[key].sum);
}

}  // namespace vantage
