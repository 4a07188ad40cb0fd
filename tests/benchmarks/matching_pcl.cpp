#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/gicp.h>
#include <pcl/registration/ndt.h>

#include "matching_peers.hpp"
#include "vantage/kit/voxel_points.hpp"

namespace vantage::benchmarks {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

Cloud::Ptr cloud_of(PointsView points) {
  auto cloud = std::make_shared<Cloud>();
  cloud->reserve(points.size());
  for (const Point& p : points) {
    const Eigen::Vector3f f = p.cast<float>();
    cloud->emplace_back(f.x(), f.y(), f.z());
  }
  return cloud;
}

Eigen::Matrix4f matrix_of(const Pose& pose) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = pose.rotation.toRotationMatrix();
  matrix.topRightCorner<3, 1>() = pose.translation;
  return matrix.cast<float>();
}

Pose pose_of(const Eigen::Matrix4f& matrix) {
  Pose pose;
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>().cast<double>();
  pose.rotation = Eigen::Quaterniond(rotation).normalized();
  pose.translation = matrix.topRightCorner<3, 1>().cast<double>();
  return pose;
}

template <class Registration>
class Pcl : public Competitor {
 public:
  void take(PointsView scan) override { scan_ = cloud_of(scan); }
  Result<Answer> align(const Pose& T_map_scan_guess) override {
    registration_.setInputSource(scan_);
    Cloud aligned;
    registration_.align(aligned, matrix_of(T_map_scan_guess));
    return Answer{.T_map_scan = pose_of(registration_.getFinalTransformation())};
  }

 protected:
  Registration registration_;
  Cloud::ConstPtr scan_;
};

class Ndt final : public Pcl<pcl::NormalDistributionsTransform<pcl::PointXYZ, pcl::PointXYZ>> {
 public:
  Result<void> prepare(PointsView map) override {
    registration_.setResolution(1.0F);
    registration_.setTransformationEpsilon(1e-6);
    registration_.setStepSize(0.1);
    registration_.setMaximumIterations(35);
    registration_.setInputTarget(cloud_of(map));
    return {};
  }
  Result<Answer> align(const Pose& T_map_scan_guess) override {
    VANTAGE_TRY(Answer answer, Pcl::align(T_map_scan_guess));
    answer.iterations = static_cast<std::uint32_t>(registration_.getFinalNumIteration());
    return answer;
  }
};

class Gicp final : public Pcl<pcl::GeneralizedIterativeClosestPoint<pcl::PointXYZ, pcl::PointXYZ>> {
 public:
  explicit Gicp(double map_voxel) : map_voxel_(map_voxel) {}
  Result<void> prepare(PointsView map) override {
    PointCloud thinned(map.begin(), map.end());
    if (map_voxel_ > 0.0) {
      VANTAGE_TRY(thinned, voxel_centroids(map, map_voxel_));
    }
    registration_.setMaxCorrespondenceDistance(1.0);
    const Cloud::Ptr target = cloud_of(thinned);
    registration_.setInputTarget(target);
    // The covariances of the map are computed at the first alignment and kept.
    scan_ = cloud_of(PointsView(thinned).first(100));
    (void)Pcl::align(Pose{});
    return {};
  }

 private:
  double map_voxel_;
};

}  // namespace

std::unique_ptr<Competitor> pcl_ndt() { return std::make_unique<Ndt>(); }
std::unique_ptr<Competitor> pcl_gicp(double map_voxel) { return std::make_unique<Gicp>(map_voxel); }

}  // namespace vantage::benchmarks
