#include <doctest/doctest.h>
#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "common/ndt_coefficients.hpp"
#include "matchers.hpp"
#include "support/plugins.hpp"

namespace vantage {
namespace {

/// Segal's covariance of a point: 1 along its surface and epsilon across it, times a variance.
Eigen::Matrix3d covariance(const Eigen::Vector3d& normal, double along, double across) {
  if (normal.isZero(0.0)) return along * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
  Eigen::Matrix3d axes;
  axes << u, v, normal;
  return axes * Eigen::Vector3d(along, along, across).asDiagonal() * axes.transpose();
}

}  // namespace

TEST_CASE("scores and Hessian of gicp equal the formulas written out") {
  const Pose truth = pose_from_xyz_rpy({0.43, -0.31, 1.02}, {0.02, -0.03, 0.65});
  const PointCloud map = test::sparse_yard();
  PointCloud scan = test::thinned(test::seen_from(test::yard(22), truth, 12.0, 100000, 2), 0.7);
  for (int i = 0; i < 50; ++i) scan.emplace_back(0.1 * i, 0.0, 30.0);  // a line, nothing is near
  const auto target = test::prepared_by("gicp", map,
                                        "map_voxel = 0.0\nneighbours = 8\nsigma = 0.07\nepsilon = "
                                        "0.01\nmax_distance = 0.8\nkernel = \"huber\"\n"
                                        "kernel_scale = 1.5");
  const Alignment alignment = test::aligned(*target, scan, truth);

  const auto surfels = test::surfels_of(map, 8), scan_surfels = test::surfels_of(scan, 8);
  CHECK(scan_surfels.back().normal.isZero(0.0));
  const Pose pose = alignment.T_map_scan;
  const Eigen::Matrix3d R = pose.rotation.toRotationMatrix();
  const auto c = matching::NdtCoefficients::derive(0.55, 1.0).value();
  double fitness = 0.0, nvtl = 0.0, matched = 0.0;
  Eigen::Matrix<double, 6, 6> hessian = Eigen::Matrix<double, 6, 6>::Zero();
  for (const auto& [p, normal] : scan_surfels) {
    const Eigen::Vector3d y = R * p;
    const Point x = y + pose.translation;
    const test::Surfel& q = surfels[test::nearest(surfels, x)];
    const Eigen::Vector3d d = x - q.point;
    if (d.norm() > 0.8) continue;
    const double across = 0.07 * 0.07, along = across / 0.01;
    const Eigen::Matrix3d C_q = covariance(q.normal, along, across);
    const Eigen::Matrix3d C_p = R * covariance(normal, along, across) * R.transpose();
    const double scored = 0.25 * d.dot((C_q.inverse() + C_p.inverse()) * d);
    const double likelihood = -c.d1 * std::exp(-0.5 * c.d2 * scored);
    const Eigen::Matrix3d A = (C_q + C_p).inverse();
    const double squared = d.dot(A * d);
    matched += 1.0;
    nvtl += likelihood;
    fitness += likelihood - c.d3;
    Eigen::Matrix<double, 3, 6> jacobian;
    jacobian << Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Zero();
    for (const Eigen::Index axis : {0, 1, 2}) {
      jacobian.col(3 + axis) = Eigen::Vector3d::Unit(axis).cross(y);
    }
    hessian += std::min(1.0, 1.5 / std::sqrt(squared)) * jacobian.transpose() * A * jacobian;
  }
  const auto n = static_cast<double>(scan.size());
  REQUIRE(matched > 300.0);
  REQUIRE(matched < n - 49.0);
  CHECK(alignment.score.fitness == doctest::Approx(fitness / n).epsilon(1e-9));
  CHECK(alignment.score.nvtl == doctest::Approx(nvtl / matched).epsilon(1e-9));
  CHECK(alignment.score.coverage == doctest::Approx(matched / n).epsilon(1e-12));
  constexpr double kInformation = 5.0;
  hessian *= kInformation;
  CHECK((alignment.hessian - hessian).norm() < 1e-9 * hessian.norm());
}

TEST_CASE("a scan of which most points coincide is matched by the others, in no more time") {
  const Pose truth = pose_from_xyz_rpy({0.4, -0.3, 1.0}, {0.02, -0.01, 0.7});
  PointCloud scan = test::seen_from(test::yard(42), truth, 18.0, 4000, 1);
  scan.resize(scan.size() + 100'000, Point(0.0, 0.0, 30.0));  // 10^10 pairs
  const auto target = test::prepared_by("gicp", test::yard(41), "min_coverage = 0.01");
  const Alignment alignment = test::aligned(*target, scan, truth);
  CHECK((alignment.T_map_scan.translation - truth.translation).norm() < 0.01);
}

TEST_CASE("epsilon is a share above 0") {
  for (const char* toml : {"epsilon = 0.0", "epsilon = 1.1", "epsilon = -0.1"}) {
    CAPTURE(toml);
    const auto loaded = test::built_plugins().load<ScanMatcher>(
        {.plugin = "gicp", .library = {}, .params = test::table(toml), .where = {}});
    REQUIRE(!loaded);
    CHECK(loaded.error().code == ErrorCode::invalid_config);
  }
}

TEST_CASE("at epsilon 1 points attract points, whatever their surfaces") {
  // Three points in general position determine a pose, which planes of three would not.
  PointCloud map;
  for (int i = 0; i < 40; ++i) {
    map.emplace_back(3.0 * std::cos(2.1 * i), 2.0 * std::sin(1.3 * i), std::cos(0.7 * i));
  }
  const Pose truth = pose_from_xyz_rpy({0.05, -0.03, 0.04}, {0.01, -0.01, 0.02});
  PointCloud scan;
  for (const Point& p : map) scan.push_back(truth.inverse() * p);
  const auto target = test::prepared_by(
      "gicp", map, "map_voxel = 0.0\nepsilon = 1.0\nkernel = \"none\"\nmax_distance = 0.5");
  const Alignment alignment = test::aligned(*target, scan, Pose{});
  CHECK((alignment.T_map_scan.translation - truth.translation).norm() < 1e-9);
  CHECK(rotation_between(alignment.T_map_scan, truth) < 1e-9);
}

}  // namespace vantage
