#pragma once

#include <optional>
#include <vector>

#include "vantage/evaluation/run.hpp"

namespace vantage::page {

using Number = std::optional<double>;
/// A quantity of a scan; none if it was not measured.
using ScanValue = Number (*)(const RunScan&);

// The same scans as in summarize(): scores and errors of tracked scans only.
[[nodiscard]] Number align_ms(const RunScan& scan);
[[nodiscard]] Number fitness(const RunScan& scan);
[[nodiscard]] Number coverage_percent(const RunScan& scan);
[[nodiscard]] Number nvtl(const RunScan& scan);
[[nodiscard]] Number lcp_millionths(const RunScan& scan);
[[nodiscard]] Number error_cm(const RunScan& scan);
[[nodiscard]] Number error_deg(const RunScan& scan);

[[nodiscard]] std::vector<double> sample_of(const Run& run, ScanValue value);

/// The value of each scan over the distance travelled [m]; NaN if there is none.
[[nodiscard]] std::vector<Eigen::Vector2d> over_distance(const Run& run, ScanValue value);

/// The mean of a value over each region's scans that have one, by region.
struct RegionMean {
  RegionId region;
  double mean = 0.0;
  std::size_t scans = 0;
};
[[nodiscard]] std::vector<RegionMean> by_region(const Run& run, ScanValue value);

}  // namespace vantage::page
