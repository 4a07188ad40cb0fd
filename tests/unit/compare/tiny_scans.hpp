#pragma once

#include <string>
#include <vector>

#include "vantage/evaluation/metrics.hpp"

namespace vantage::test {

/// A scan of a tiny scans.csv.
struct TinyScan {
  std::string stamp, tracking = "tracked", error_m = "0.01", align_ms = "5";
};

/// The columns that comparing needs, in another order than localize writes them, and one more.
inline std::string tiny_csv(const std::vector<TinyScan>& scans) {
  std::string csv = "reason,stamp,tracking,distance_m";
  for (const Metric& metric : metrics()) {
    if (!metric.is(kNotInFiles)) csv += "," + std::string(metric.key);
  }
  csv += '\n';
  for (const TinyScan& s : scans) {
    csv += "\"a \"\"b\"\", c\"," + s.stamp + "," + s.tracking + "," + s.stamp;
    for (const Metric& metric : metrics()) {
      if (metric.is(kNotInFiles)) continue;
      const bool of_match = metric.group == MetricGroup::match && metric.key != "risk";
      csv += ',';
      if (metric.key == "error_m") {
        csv += s.error_m;
      } else if (metric.key == "align_ms") {
        csv += s.align_ms;
      } else if (!of_match || s.tracking == "tracked") {
        csv += metric.is_count() ? "0" : "0.5";
      }
    }
    csv += '\n';
  }
  return csv;
}

}  // namespace vantage::test
