#include "scenes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "support/required.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/trajectory_io.hpp"

namespace vantage::test {
PointCloud yard(std::uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, 0.02);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  PointCloud cloud;
  const auto add = [&](double x, double y, double z) {
    cloud.emplace_back(x + noise(random), y + noise(random), z + noise(random));
  };
  for (int i = 0; i < 50000; ++i) {
    const double x = between(-20.0, 20.0), y = between(-15.0, 15.0);
    add(x, y, 0.2 * std::sin(0.3 * x) * std::cos(0.4 * y));
  }
  for (int i = 0; i < 15000; ++i) add(between(-20.0, 20.0), 12.0, between(0.0, 5.0));
  for (int i = 0; i < 15000; ++i) add(-17.0, between(-15.0, 15.0), between(0.0, 5.0));
  for (int i = 0; i < 5000; ++i) add(between(6.0, 10.0), -7.0, between(0.0, 3.0));
  for (int i = 0; i < 5000; ++i) add(6.0, between(-11.0, -7.0), between(0.0, 3.0));
  for (int pole = 0; pole < 10; ++pole) {
    const double x = between(-15.0, 15.0), y = between(-12.0, 10.0);
    for (int i = 0; i < 1000; ++i) {
      const double angle = between(0.0, 2.0 * std::numbers::pi);
      add(x + 0.2 * std::cos(angle), y + 0.2 * std::sin(angle), between(0.0, 4.0));
    }
  }
  return cloud;
}

PointCloud seen_from(PointsView cloud, const Pose& T_map_scan, double range, std::size_t points,
                     std::uint32_t seed) {
  PointCloud scan;
  const Pose T_scan_map = T_map_scan.inverse();
  for (const Point& p : cloud) {
    const Point q = T_scan_map * p;
    if (q.norm() <= range) scan.push_back(q);
  }
  std::shuffle(scan.begin(), scan.end(), std::mt19937(seed));
  scan.resize(std::min(points, scan.size()));
  return scan;
}

const YardScene& yard_scene() {
  static const YardScene made{yard(41), seen_from(yard(42), kYardPose, 18.0, 4000, 1)};
  return made;
}

PluginPtr<MatchTarget> prepared(PointsView map, const std::string& toml) {
  const auto matcher = plugin<ScanMatcher>("ndt", toml);
  return in_library_of(matcher, required(matcher->prepare(map)));
}

PointCloud thinned(PointsView cloud, double edge) {
  std::map<std::array<double, 3>, std::pair<Point, double>> voxels;
  for (const Point& p : cloud) {
    const Eigen::Vector3d index = (p / edge).array().floor();
    const auto [at, fresh] = voxels.try_emplace({index.x(), index.y(), index.z()}, p, 1.0);
    if (!fresh) at->second = {at->second.first + p, at->second.second + 1.0};
  }
  PointCloud centroids;
  for (const auto& [index, sum] : voxels) centroids.push_back(sum.first / sum.second);
  return centroids;
}

PointCloud sparse_yard() {
  PointCloud sparse = thinned(yard(21), 0.6);
  std::erase_if(sparse, [](const Point& p) { return p.norm() > 14.0; });
  return sparse;
}

PointCloud shifted(PointsView cloud, const Eigen::Vector3d& by) {
  PointCloud result(cloud.begin(), cloud.end());
  for (Point& p : result) p += by;
  return result;
}

Pose disturbed(const Pose& pose, double metres, double degrees, std::mt19937& random) {
  const auto vector = [&](double longest) {
    std::normal_distribution<double> normal;
    const Eigen::Vector3d direction =
        Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    return Eigen::Vector3d(direction *
                           std::uniform_real_distribution<double>(0.0, longest)(random));
  };
  Pose result;
  result.translation = pose.translation + vector(metres);
  result.rotation =
      rotation_from_vector(vector(degrees * std::numbers::pi / 180.0)) * pose.rotation;
  result.rotation.normalize();
  return result;
}

std::optional<Pair> recorded_pair() {
  const auto folder = real_data("kitti_street");
  if (!folder) return std::nullopt;
  Pair pair;
  pair.map = required(io::read_point_cloud(*folder / "scans/000001.pcd")).points;
  pair.scan = thinned(required(io::read_point_cloud(*folder / "scans/000003.pcd")).points, 0.5);
  const io::Trajectory reference = required(io::read_trajectory(*folder / "ref_poses_tum.txt"));
  pair.T_map_scan =
      io::pose_at(reference, 0.1).value().inverse() * io::pose_at(reference, 0.3).value();
  return pair;
}

double degrees(double radians) { return radians * 180.0 / std::numbers::pi; }

}  // namespace vantage::test
