#include "evaluate/page/samples.hpp"

#include <limits>
#include <map>

namespace vantage::page {
namespace {

template <class F>
Number scored(const RunScan& scan, const F& value) {
  if (!is_tracked(scan) || !scan.report.alignment) return {};
  return value(scan.report);
}

}  // namespace

Number align_ms(const RunScan& scan) { return 1e3 * scan.report.seconds_align; }
Number fitness(const RunScan& scan) {
  return scored(scan, [](const ScanReport& r) { return r.alignment->score.fitness; });
}
Number coverage_percent(const RunScan& scan) {
  return scored(scan, [](const ScanReport& r) { return 100.0 * r.alignment->score.coverage; });
}
Number nvtl(const RunScan& scan) {
  return scored(scan, [](const ScanReport& r) { return r.alignment->score.nvtl; });
}
Number lcp_millionths(const RunScan& scan) {
  return scored(scan, [](const ScanReport& r) { return 1e6 * r.lcp; });
}
Number error_cm(const RunScan& scan) {
  return scan.error && is_tracked(scan) ? Number{100.0 * scan.error->metres} : Number{};
}
Number error_deg(const RunScan& scan) {
  return scan.error && is_tracked(scan) ? Number{scan.error->degrees} : Number{};
}

std::vector<double> sample_of(const Run& run, ScanValue value) {
  std::vector<double> sample;
  for (const RunScan& scan : run.scans) {
    if (const Number x = value(scan)) sample.push_back(*x);
  }
  return sample;
}

std::vector<Eigen::Vector2d> over_distance(const Run& run, ScanValue value) {
  const std::vector<double> way = distances(run);
  std::vector<Eigen::Vector2d> curve;
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    curve.emplace_back(way[i],
                       value(run.scans[i]).value_or(std::numeric_limits<double>::quiet_NaN()));
  }
  return curve;
}

std::vector<RegionMean> by_region(const Run& run, ScanValue value) {
  std::map<RegionId, RegionMean> sums;
  for (const RunScan& scan : run.scans) {
    const Number x = value(scan);
    if (!x) continue;
    RegionMean& sum = sums[scan.report.region];
    sum.region = scan.report.region;
    sum.mean += *x;
    ++sum.scans;
  }
  std::vector<RegionMean> means;
  for (auto& [region, sum] : sums) {
    sum.mean /= static_cast<double>(sum.scans);
    means.push_back(sum);
  }
  return means;
}

}  // namespace vantage::page
