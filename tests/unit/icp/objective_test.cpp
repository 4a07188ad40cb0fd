#include <doctest/doctest.h>
#include <cmath>
#include <vector>

#include "common/ndt_coefficients.hpp"
#include "matchers.hpp"

namespace vantage {

TEST_CASE("scores and Hessian of icp equal the formulas written out") {
  const Pose truth = pose_from_xyz_rpy({0.43, -0.31, 1.02}, {0.02, -0.03, 0.65});
  const PointCloud map = test::sparse_yard();
  PointCloud scan = test::seen_from(test::yard(22), truth, 12.0, 600, 2);
  for (int i = 0; i < 50; ++i) scan.emplace_back(0.1 * i, 0.2 * i, 30.0);  // nothing is near
  const auto target = test::prepared_by(
      "icp", map, "map_voxel = 0.0\nneighbours = 8\nsigma = 0.07\nmax_distance = 0.8");
  const Alignment alignment = test::aligned(*target, scan, truth);

  const auto surfels = test::surfels_of(map, 8);
  const Pose pose = alignment.T_map_scan;
  const auto d = matching::NdtCoefficients::derive(0.55, 1.0).value();
  double fitness = 0.0, nvtl = 0.0, matched = 0.0;
  Eigen::Matrix<double, 6, 6> hessian = Eigen::Matrix<double, 6, 6>::Zero();
  for (const Point& p : scan) {
    const Eigen::Vector3d y = pose.rotation.toRotationMatrix() * p;
    const Point x = y + pose.translation;
    const test::Surfel& q = surfels[test::nearest(surfels, x)];
    if ((x - q.point).norm() > 0.8) continue;
    const double r = q.normal.dot(x - q.point) / 0.07;
    const double likelihood = -d.d1 * std::exp(-0.5 * d.d2 * r * r);
    matched += 1.0;
    nvtl += likelihood;
    fitness += likelihood - d.d3;
    const double weight = std::pow(1.0 + r * r / 9.0, -2.0);
    Eigen::Matrix<double, 6, 1> jacobian;
    jacobian << q.normal, y.cross(q.normal);
    hessian += weight / (0.07 * 0.07) * jacobian * jacobian.transpose();
  }
  const auto n = static_cast<double>(scan.size());
  REQUIRE(matched > 0.7 * n);
  REQUIRE(matched <= 600.0);
  CHECK(alignment.score.fitness == doctest::Approx(fitness / n).epsilon(1e-9));
  CHECK(alignment.score.nvtl == doctest::Approx(nvtl / matched).epsilon(1e-9));
  CHECK(alignment.score.coverage == doctest::Approx(matched / n).epsilon(1e-12));
  constexpr double kInformation = 0.55;
  hessian *= kInformation;
  CHECK((alignment.hessian - hessian).norm() < 1e-9 * hessian.norm());
}

}  // namespace vantage
