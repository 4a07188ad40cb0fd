#include <open3d/geometry/KDTreeSearchParam.h>
#include <open3d/geometry/PointCloud.h>
#include <open3d/pipelines/registration/Registration.h>
#include <open3d/pipelines/registration/TransformationEstimation.h>

#include "matching_peers.hpp"
#include "vantage/kit/voxel_points.hpp"

namespace vantage::benchmarks {
namespace {

namespace registration = open3d::pipelines::registration;

class Icp final : public Competitor {
 public:
  explicit Icp(double map_voxel) : map_voxel_(map_voxel) {}

  Result<void> prepare(PointsView map) override {
    map_.points_.assign(map.begin(), map.end());
    if (map_voxel_ > 0.0) {
      VANTAGE_TRY(map_.points_, voxel_centroids(map, map_voxel_));
    }
    map_.EstimateNormals(open3d::geometry::KDTreeSearchParamKNN(kNeighbours));
    return {};
  }
  void take(PointsView scan) override { scan_.points_.assign(scan.begin(), scan.end()); }
  Result<Answer> align(const Pose& T_map_scan_guess) override {
    Eigen::Matrix4d guess = Eigen::Matrix4d::Identity();
    guess.topLeftCorner<3, 3>() = T_map_scan_guess.rotation.toRotationMatrix();
    guess.topRightCorner<3, 1>() = T_map_scan_guess.translation;
    const auto found = registration::RegistrationICP(
        scan_, map_, kMaxDistance, guess, registration::TransformationEstimationPointToPlane());
    Answer answer;
    const Eigen::Matrix3d rotation = found.transformation_.topLeftCorner<3, 3>();
    answer.T_map_scan.rotation = Eigen::Quaterniond(rotation).normalized();
    answer.T_map_scan.translation = found.transformation_.topRightCorner<3, 1>();
    return answer;
  }

 private:
  static constexpr int kNeighbours = 10;
  static constexpr double kMaxDistance = 1.0;  // [m]
  double map_voxel_;
  open3d::geometry::PointCloud map_, scan_;
};

}  // namespace

std::unique_ptr<Competitor> open3d_icp(double map_voxel) {
  return std::make_unique<Icp>(map_voxel);
}

}  // namespace vantage::benchmarks
