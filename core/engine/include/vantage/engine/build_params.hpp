#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/params.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Where viewpoints come from.
enum class ViewpointSource : std::uint8_t {
  ground,      ///< wherever a robot could stand, as in the paper
  trajectory,  ///< where the sensor was while mapping
};
constexpr auto enum_names(ViewpointSource) {
  return std::array{std::pair{std::string_view("ground"), ViewpointSource::ground},
                    std::pair{std::string_view("trajectory"), ViewpointSource::trajectory}};
}

/// [viewpoints]: Sec. 2.2.
struct ViewpointParams {
  ViewpointSource source = ViewpointSource::ground;
  double voxel_size = 1.0;     // s_voxel
  double sensor_height = 1.0;  // h_s
  std::vector<double> height_offsets{0.0};
  std::vector<double> lateral_offsets{0.0};
  bool reachable = false;
  double max_step = 0.3;
  double min_gain = 0.0;

  static constexpr auto schema() {
    return std::tuple{
        optional(
            "source", &ViewpointParams::source, "",
            "over the ground, or along the trajectory of [map], which is the sensor's own path "
            "and needs no [ground]",
            Source{{}, "Yagi et al. 2026, Sec. 2.2"}),
        optional("voxel_size", &ViewpointParams::voxel_size, "m",
                 "s_voxel: one viewpoint for each voxel of this size that holds ground, or "
                 "trajectory",
                 positive, Source{"Eq. 4", "Yagi et al. 2026, Sec. 2.2"}),
        optional("sensor_height", &ViewpointParams::sensor_height, "m",
                 "h_s: height of the sensor above the ground; has no meaning for a trajectory",
                 non_negative, Source{"Eq. 5", "Yagi et al. 2026, Sec. 2.2"}),
        optional("height_offsets", &ViewpointParams::height_offsets, "m",
                 "for sensors at several heights: one viewpoint at each of these heights above "
                 "h_s, or above the trajectory; the search for a lost sensor begins at the first"),
        optional("lateral_offsets", &ViewpointParams::lateral_offsets, "m",
                 "only for a trajectory: a viewpoint at each of these to the left of the direction "
                 "of travel"),
        optional("reachable", &ViewpointParams::reachable, "",
                 "only for ground: leave out roofs and islands, that is, ground not connected to "
                 "the ground below the trajectory of [map], or without a trajectory to the largest "
                 "connected ground"),
        optional("max_step", &ViewpointParams::max_step, "m",
                 "with reachable: neighbouring square metres are connected if their heights differ "
                 "by at most this",
                 positive),
        optional(
            "min_gain", &ViewpointParams::min_gain, "",
            "adaptive spacing: viewpoints are evaluated at 8, 4, 2 and 1 times voxel_size, as long "
            "as more than this share of the points they see is new; 0 evaluates all viewpoints",
            Range{.min = 0.0, .max = 1.0, .max_open = true}),
    };
  }
  [[nodiscard]] VANTAGE_API Result<void> validate() const;
};

/// [thinning]: how region maps are made smaller after visibility has chosen their points.
struct ThinningParams {
  std::optional<double> voxel_size;     // [m]
  std::optional<std::uint32_t> budget;  // points per region

  static constexpr auto schema() {
    return std::tuple{
        optional("voxel_size", &ThinningParams::voxel_size, "m",
                 "instead of budget: a region map keeps one of its points in each voxel of this "
                 "size",
                 positive),
        // 8 voxels meet at the origin: if they are large, they hold all points, and no larger size
        // gives fewer voxels.
        optional("budget", &ThinningParams::budget, "",
                 "instead of voxel_size: a region map keeps at most this many points, one per "
                 "voxel of the smallest sufficient size",
                 at_least(8)),
    };
  }
  [[nodiscard]] VANTAGE_API Result<void> validate() const;
};

/// [ground.outliers]: which points the ground filter does not get.
struct OutlierParams {
  std::uint32_t neighbours = 50;
  double ratio = 1.0;

  static constexpr auto schema() {
    constexpr Source kSource{{}, "Rusu et al. 2008"};
    return std::tuple{
        optional("neighbours", &OutlierParams::neighbours, "",
                 "k: each point's mean distance to its k nearest others is compared",
                 between(1, 10'000), kSource),
        optional("ratio", &OutlierParams::ratio, "",
                 "a point is an outlier if its mean distance is more than this many standard "
                 "deviations above the mean of all points",
                 any_number, kSource),
    };
  }
};

/// [atlas]: where `vantage assess` measures how well a sensor can be localized.
struct AtlasParams {
  std::uint32_t max_sites = 400;
  double site_spacing = 20.0;

  static constexpr auto schema() {
    return std::tuple{
        optional("max_sites", &AtlasParams::max_sites, "",
                 "the assessment measures at this many viewpoints at most; in a larger map, they "
                 "stand farther apart",
                 at_least(1)),
        optional("site_spacing", &AtlasParams::site_spacing, "m",
                 "one viewpoint is measured at in each square of this size", positive),
    };
  }
};

}  // namespace vantage
