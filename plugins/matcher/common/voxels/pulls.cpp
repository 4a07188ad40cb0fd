#include "pulls.hpp"

#include <cmath>

namespace vantage::ndt {
namespace {

/// E's term of one point and one Gaussian, differentiated: J = [I, -[y]x].
/// @param q  from the mean to the point, in voxels
/// @param y  the point seen from the sensor, axes of the map [m]
struct Term {
  Vector6 gradient;
  Matrix6 hessian;
};
Term term_of(const Gaussian& gaussian, const Eigen::Vector3d& q, const Eigen::Vector3d& y,
             const NdtCoefficients& d, double per_edge) {
  Eigen::Matrix3d C;
  C << gaussian.xx, gaussian.xy, gaussian.xz, gaussian.xy, gaussian.yy, gaussian.yz, gaussian.xz,
      gaussian.yz, gaussian.zz;
  const Eigen::Vector3d u = C * q;
  const double scale = std::abs(d.d1) * d.d2 * std::exp(-0.5 * d.d2 * q.dot(u));
  const Eigen::Vector3d g = scale * per_edge * u;
  const Eigen::Matrix3d A = scale * per_edge * per_edge * (C - d.d2 * (u * u.transpose()));
  Eigen::Matrix<double, 3, 6> J;
  J.leftCols<3>().setIdentity();
  J.rightCols<3>() << 0.0, y.z(), -y.y(), -y.z(), 0.0, y.x(), y.y(), -y.x(), 0.0;
  Term term{.gradient = J.transpose() * g, .hessian = J.transpose() * A * J};
  // What the second derivatives of the rotation add.
  const Eigen::Matrix3d torque = g * y.transpose();
  term.hessian.bottomRightCorner<3, 3>() +=
      0.5 * (torque + torque.transpose()) - torque.trace() * Eigen::Matrix3d::Identity();
  return term;
}

/// A Gaussian that points meet.
struct Met {
  Gaussian gaussian;
  Point mean;  // map frame [m]
  Term sum{.gradient = Vector6::Zero(), .hessian = Matrix6::Zero()};
  bool pulls = false;  // at least one of them is near enough
};

}  // namespace

std::vector<Pull> pulls_on(const Objective& objective, PointsView scan, const Pose& T_map_scan) {
  const VoxelMap& map = objective.map();
  const kernel::Search& search = objective.search();
  const double edge = map.options().resolution, per_edge = 1.0 / edge;
  const Eigen::Matrix3d R = T_map_scan.rotation.normalized().toRotationMatrix();
  std::vector<Met> met;
  std::vector<std::uint32_t> place(map.cells().size(), kNoGaussian);  // in `met`
  for (const Point& p : scan) {
    const Eigen::Vector3d y = R * p;
    const Point at = y + T_map_scan.translation;
    for (std::uint32_t s = 0; s < search.size; ++s) {
      const auto& step = search.steps[s];
      const Eigen::Vector3d offset = edge * Eigen::Vector3d(step[0], step[1], step[2]);
      const VoxelKey key = map.key_of(at + offset);
      const std::uint32_t i = key == kNoVoxel ? kNoGaussian : map.find(key);
      if (i == kNoGaussian) continue;
      if (place[i] == kNoGaussian) {
        place[i] = static_cast<std::uint32_t>(met.size());
        met.push_back({.gaussian = gaussian_of(map.cells()[i]), .mean = map.mean_of(i)});
      }
      Met& here = met[place[i]];
      const Eigen::Vector3d q = (at - here.mean) * per_edge;
      if (search.within_edge && !(q.squaredNorm() < 1.0)) continue;
      const Term term = term_of(here.gaussian, q, y, objective.coefficients(), per_edge);
      here.sum.gradient += term.gradient;
      here.sum.hessian += term.hessian;
      here.pulls = true;
    }
  }
  std::vector<Pull> result;
  result.reserve(met.size());
  for (std::uint32_t i = 0; i < place.size(); ++i) {
    if (place[i] == kNoGaussian || !met[place[i]].pulls) continue;
    const Term& sum = met[place[i]].sum;
    Pull pull{.element = i};
    std::size_t k = 0;
    for (Eigen::Index row = 0; row < 6; ++row) {
      pull.gradient[static_cast<std::size_t>(row)] = static_cast<float>(sum.gradient[row]);
      for (Eigen::Index column = row; column < 6; ++column) {
        pull.hessian[k++] = static_cast<float>(sum.hessian(row, column));
      }
    }
    result.push_back(pull);
  }
  return result;
}

}  // namespace vantage::ndt
