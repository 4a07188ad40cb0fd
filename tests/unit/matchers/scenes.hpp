#pragma once

#include <cstdint>
#include <optional>
#include <random>
#include <string>

#include "vantage/engine/plugin_loader.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage::test {

/// A yard of 40 x 30 m, about 100,000 points with 2 cm of noise: uneven ground, two walls, a shed,
/// poles. The sensor's place is about (0, 0, 1).
[[nodiscard]] PointCloud yard(std::uint32_t seed);

/// What a sensor at the pose sees of a cloud: `points` of those within `range` [m], drawn at
/// random, in the sensor's frame.
[[nodiscard]] PointCloud seen_from(PointsView cloud, const Pose& T_map_scan, double range,
                                   std::size_t points, std::uint32_t seed);

/// Where the scan of `yard_scene` was taken: T_map_scan.
inline const Pose kYardPose = pose_from_xyz_rpy({0.4, -0.3, 1.0}, {0.02, -0.01, 0.7});

/// A yard and 4000 points of a scan in it, of the same yard but for the noise and the poles.
struct YardScene {
  PointCloud map, scan;
};
[[nodiscard]] const YardScene& yard_scene();

/// A map made ready by the loaded ndt plugin; a mistake in `toml` or an error ends the test with an
/// exception.
[[nodiscard]] PluginPtr<MatchTarget> prepared(PointsView map, const std::string& toml = {});

/// The centroids of the points in each voxel of the given edge [m].
[[nodiscard]] PointCloud thinned(PointsView cloud, double edge);

/// A yard's centroids in voxels of 60 cm, to 14 m.
[[nodiscard]] PointCloud sparse_yard();

[[nodiscard]] PointCloud shifted(PointsView cloud, const Eigen::Vector3d& by);

/// A pose off by a translation of at most `metres` and a rotation of at most `degrees`, in random
/// directions.
[[nodiscard]] Pose disturbed(const Pose& pose, double metres, double degrees, std::mt19937& random);

/// A recorded pair: a map and a scan near it.
struct Pair {
  PointCloud map, scan;
  Pose T_map_scan;  // the reference
};
/// kitti_street's scan 000003 (0.5 m centroids) on 000001's points; nothing where there is no
/// recorded data.
[[nodiscard]] std::optional<Pair> recorded_pair();

[[nodiscard]] double degrees(double radians);

}  // namespace vantage::test
