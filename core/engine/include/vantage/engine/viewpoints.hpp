#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/params.hpp"
#include "vantage/point_cloud.hpp"
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

/// One point per voxel: the centroid of the voxel's points (Eq. 4).
/// The grid is anchored at the origin of the frame, so that neighbouring regions and shifted
/// subsets share voxels. The centroids are ordered by voxel (z, then y, then x). Each is
/// summed in the order of `points`.
/// @param points      N points [m]
/// @param voxel_size  edge length [m], > 0
/// Errors: `invalid_input` for a non-finite point or a point beyond 2^50 voxels from the origin.
[[nodiscard]] VANTAGE_API Result<PointCloud> voxel_centroids(PointsView points, double voxel_size);

struct TimedPoints {
  PointCloud points;
  std::vector<double> times;  ///< of each point [s]; empty if unknown
};
/// The same of points that have times: a centroid has the mean of its points' times.
/// @param times  N times [s], or none
[[nodiscard]] VANTAGE_API Result<TimedPoints> voxel_centroids(PointsView points,
                                                              std::span<const double> times,
                                                              double voxel_size);

/// Places along a trajectory: its positions, moved sideways by each lateral offset. All positions
/// for the first offset come before those for the second. The direction of travel is measured in
/// plan view between positions at least half a voxel apart, so that the noise of a standing sensor
/// gives no direction.
/// @param trajectory  N positions of the sensor in driving order, map frame [m]
/// Errors: `invalid_input` for an empty trajectory or a position that is not finite, or for offsets
/// from a trajectory that stays within half a voxel.
[[nodiscard]] VANTAGE_API Result<PointCloud> places_along(PointsView trajectory,
                                                          const ViewpointParams& params);

/// The ground that a robot can reach. The ground of each square metre in plan view is divided into
/// levels, separated by gaps in height of more than `max_step`. Two levels are connected if their
/// mean heights differ by at most `max_step` and their square metres are neighbours (of eight), or
/// two apart with no ground between them. The result is all ground connected to ground below the
/// trajectory. In a square metre, the level below the trajectory is the highest one whose mean
/// height is at most `max_step` above it. Without a trajectory, the result is the connected set
/// with the most levels.
/// @param map         N points, z up [m]
/// @param ground      indices into `map`, strictly ascending
/// @param trajectory  positions of the sensor [m]; may be empty
/// @param max_step    [m], > 0
/// @return            the reachable part of `ground`, for any order of the points
/// Errors: `invalid_input` for a point that is not finite or lies beyond 2^50 m from the origin, or
/// for a trajectory with no ground below it.
[[nodiscard]] VANTAGE_API Result<IndexList> reachable_ground(PointsView map,
                                                             std::span<const std::uint32_t> ground,
                                                             PointsView trajectory,
                                                             double max_step);

/// Virtual viewpoints q at each height offset. All viewpoints at the first height come before those
/// at the second.
/// ViewpointSource::ground: voxel centroids of the ground points g_ij, raised by h_s (Eqs. 4-5).
/// ViewpointSource::trajectory: in each voxel, the place of `places_along` nearest to the centre
/// (the first of equally near places), in the order of `points`. Each is one of the places, not a
/// mean of several.
/// @param points  ground points, or the result of `places_along`; map frame [m]
/// Errors: as `voxel_centroids`.
[[nodiscard]] VANTAGE_API Result<PointCloud> viewpoints_over(PointsView points,
                                                             const ViewpointParams& params);

/// The same for the points that `which` names. Precondition: every index < points.size().
[[nodiscard]] VANTAGE_API Result<PointCloud> viewpoints_over(PointsView points,
                                                             std::span<const std::uint32_t> which,
                                                             const ViewpointParams& params);

}  // namespace vantage
