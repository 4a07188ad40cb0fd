#include "evaluate/page/samples.hpp"

#include <limits>
#include <map>

namespace vantage::page {

Number shown_value(std::string_view metric, const RunScan& scan) {
  const Metric* found = find_metric(metric);
  if (found == nullptr) return {};
  const Number x = counted_value(*found, scan);
  return x ? Number(found->unit->scale * *x) : Number();
}

std::vector<double> sample_of(const Run& run, std::string_view metric) {
  std::vector<double> sample;
  for (const RunScan& scan : run.scans) {
    if (const Number x = shown_value(metric, scan)) sample.push_back(*x);
  }
  return sample;
}

std::vector<Eigen::Vector2d> over_distance(const Run& run, std::string_view metric) {
  const std::vector<double> way = distances(run);
  std::vector<Eigen::Vector2d> curve;
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    curve.emplace_back(
        way[i],
        shown_value(metric, run.scans[i]).value_or(std::numeric_limits<double>::quiet_NaN()));
  }
  return curve;
}

std::vector<RegionMean> by_region(const Run& run, std::string_view metric) {
  std::map<RegionId, RegionMean> sums;
  for (const RunScan& scan : run.scans) {
    const Number x = shown_value(metric, scan);
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
