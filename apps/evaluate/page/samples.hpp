#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "vantage/evaluation/metrics.hpp"
#include "vantage/evaluation/run.hpp"

namespace vantage::page {

using Number = std::optional<double>;
/// The metric with this key of a scan, in the unit shown, as summarize() counts it; none if there
/// is no such metric.
[[nodiscard]] Number shown_value(std::string_view metric, const RunScan& scan);

[[nodiscard]] std::vector<double> sample_of(const Run& run, std::string_view metric);

/// The value of each scan over the distance travelled [m]; NaN if the scan has none.
[[nodiscard]] std::vector<Eigen::Vector2d> over_distance(const Run& run, std::string_view metric);

/// The mean of a value over each region's scans that have one, by region.
struct RegionMean {
  RegionId region;
  double mean = 0.0;
  std::size_t scans = 0;
};
[[nodiscard]] std::vector<RegionMean> by_region(const Run& run, std::string_view metric);

}  // namespace vantage::page
