#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <tuple>

#include "vantage/params.hpp"

namespace vantage {

/// [localizer]: how scans are prepared, when regions are switched, and how a lost scan is
/// recognized and the sensor found again.
struct LocalizerParams {
  double scan_voxel_size = 0.5;
  double scan_min_range = 0.0;
  std::optional<double> scan_max_range;
  double switch_margin = 0.0;
  double min_coverage = 0.42;
  double min_nvtl = 0.75;
  double max_correction = 2.0;
  std::uint32_t confirming_scans = 2;
  std::optional<double> recovery_radius;
  double search_first_radius = 4.0;
  std::uint32_t search_pause = 4;
  double search_spacing = 2.0;
  std::uint32_t search_headings = 36;
  std::uint32_t search_scored_points = 120;
  std::uint32_t search_starts = 150;
  std::uint32_t search_aligned_points = 500;
  double search_nvtl_share = 0.8;
  bool prefetch = true;
  double prefetch_time = 3.0;
  double prefetch_distance = 5.0;
  double map_memory = 40.0;
  double covariance_scale = 30.0;
  bool deskew = false;

  static constexpr auto schema() {
    return std::tuple{
        optional("scan_voxel_size", &LocalizerParams::scan_voxel_size, "m",
                 "scans are thinned to one centroid per voxel of this size; 0 keeps every point",
                 non_negative),
        optional("scan_min_range", &LocalizerParams::scan_min_range, "m",
                 "scan points nearer to the sensor than this are dropped", non_negative),
        optional("scan_max_range", &LocalizerParams::scan_max_range, "m",
                 "scan points farther from the sensor than this are dropped; unlimited if left out",
                 positive),
        optional("switch_margin", &LocalizerParams::switch_margin, "m",
                 "the localizer switches regions only this far beyond the border; 0 switches at "
                 "the border",
                 non_negative, Source{"Eq. 11", "Yagi et al. 2026, Sec. 2.4"}),
        optional("min_coverage", &LocalizerParams::min_coverage, "",
                 "a scan is lost if the share of its points that have a map voxel is below this",
                 between(0, 1)),
        optional("min_nvtl", &LocalizerParams::min_nvtl, "",
                 "a scan is lost if its nearest-voxel likelihood is below this", non_negative),
        optional("max_correction", &LocalizerParams::max_correction, "m",
                 "a scan is lost if matching moves it farther than this from its predicted pose",
                 positive),
        optional("confirming_scans", &LocalizerParams::confirming_scans, "",
                 "a lost sensor counts as found when this many consecutive scans fit the place",
                 at_least(1)),
        optional("recovery_radius", &LocalizerParams::recovery_radius, "m",
                 "radius of the search for a lost sensor around its last pose; 0: no search; "
                 "unlimited if left out",
                 non_negative),
        optional("search_first_radius", &LocalizerParams::search_first_radius, "m",
                 "radius of the search at the first lost scan; it doubles at each further lost "
                 "scan, up to recovery_radius",
                 positive),
        optional(
            "search_pause", &LocalizerParams::search_pause, "",
            "once the radius has reached its maximum, the search runs only at every n-th lost scan",
            at_least(1)),
        optional("search_spacing", &LocalizerParams::search_spacing, "m",
                 "the search tries places this far apart, and half as far apart if its radius is "
                 "below 10 m",
                 positive),
        optional("search_headings", &LocalizerParams::search_headings, "",
                 "the search tries this many headings at each place", at_least(1)),
        optional("search_scored_points", &LocalizerParams::search_scored_points, "",
                 "the search scores this many points of the scan at each place and heading",
                 at_least(1)),
        optional("search_starts", &LocalizerParams::search_starts, "",
                 "the search aligns the scan from this many of the places with the best score",
                 at_least(1)),
        optional("search_aligned_points", &LocalizerParams::search_aligned_points, "",
                 "the search aligns this many points of the scan from each of these places, then "
                 "the whole scan from the best five resulting poses",
                 at_least(1)),
        optional("search_nvtl_share", &LocalizerParams::search_nvtl_share, "",
                 "a place counts as found if the nearest-voxel likelihood there is at least this "
                 "share of its usual value",
                 non_negative),
        optional("prefetch", &LocalizerParams::prefetch, "",
                 "region maps are loaded in the background before they are needed"),
        optional("prefetch_time", &LocalizerParams::prefetch_time, "s",
                 "regions that the sensor will reach within this time are loaded", non_negative),
        optional("prefetch_distance", &LocalizerParams::prefetch_distance, "m",
                 "regions this near to the sensor's predicted path are loaded", non_negative),
        optional("map_memory", &LocalizerParams::map_memory, "MiB",
                 "limit on the memory of loaded region maps; the map in use is always kept",
                 positive),
        optional("covariance_scale", &LocalizerParams::covariance_scale, "",
                 "the pose's covariance is this factor times the inverse Hessian, which treats the "
                 "errors of points as independent",
                 positive),
        optional("deskew", &LocalizerParams::deskew, "",
                 "points that have times are moved to their position at the scan's stamp, by the "
                 "known motion"),
    };
  }
};

}  // namespace vantage
