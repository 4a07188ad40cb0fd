#pragma once

#include <limits>
#include <optional>
#include <tuple>

#include "vantage/params.hpp"

namespace vantage {

/// [localizer]: how scans are prepared, regions switched and lost scans told.
struct LocalizerParams {
  double scan_voxel_size = 0.5;
  double scan_min_range = 0.0;
  std::optional<double> scan_max_range;
  double switch_margin = 0.0;
  double min_coverage = 0.3;
  double min_nvtl = 0.5;

  static constexpr auto schema() {
    return std::tuple{
        optional("scan_voxel_size", &LocalizerParams::scan_voxel_size, "m",
                 "scans are thinned to one centroid a voxel of this size; 0 keeps every point",
                 non_negative),
        optional("scan_min_range", &LocalizerParams::scan_min_range, "m",
                 "scan points nearer to the sensor are dropped", non_negative),
        optional("scan_max_range", &LocalizerParams::scan_max_range, "m",
                 "scan points farther from the sensor are dropped; unlimited if left out",
                 positive),
        optional("switch_margin", &LocalizerParams::switch_margin, "m",
                 "the region changes only this far behind its border; 0 switches at the border",
                 non_negative, Source{"Eq. 11", "Yagi et al. 2026, Sec. 2.4"}),
        optional("min_coverage", &LocalizerParams::min_coverage, "",
                 "a scan is lost if a smaller share of its points has a map voxel", between(0, 1)),
        optional("min_nvtl", &LocalizerParams::min_nvtl, "",
                 "a scan is lost if its nearest-voxel likelihood is lower", non_negative),
    };
  }
};

}  // namespace vantage
