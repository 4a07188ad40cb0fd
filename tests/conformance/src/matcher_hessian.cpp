// M19, M20: the Hessian of an alignment.
#include <doctest/doctest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <string>

#include "clauses.hpp"
#include "matcher_scene.hpp"

namespace vantage::conformance {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

// The shipped matchers are off by 4e-5 at most.
constexpr double kSameFit = 1e-3;
// A matcher may weigh points by their distance from the sensor. The shipped ones are off by 2e-5 at
// most; with the rotation about another point, an entry would be off by 0.14.
constexpr double kOtherSensor = 0.05;

/// Aligns once more from the answer, so that the last step is as small as it gets.
Alignment settled(const MatchTarget& target, PointsView scan, const Pose& guess) {
  return align(target, scan, align(target, scan, guess).T_map_scan);
}

/// Metres and radians have no common scale: each entry is compared with those of the diagonal in
/// its row and its column.
void check_alike(const Matrix6& got, const Matrix6& expected, double most, const std::string& how) {
  const Eigen::VectorXd scale = expected.diagonal().cwiseAbs().cwiseSqrt();
  const Matrix6 relative =
      (got - expected).cwiseAbs().cwiseQuotient(Matrix6(scale * scale.transpose()));
  const double by = relative.maxCoeff();
  CHECK_MESSAGE(by <= most, how << ": an entry of the Hessian is off by " << by
                                << " of the diagonal, and at most " << most << " is expected");
}

/// By quarters of a circle, which keep cells along the axes.
struct QuarterTurn {
  Eigen::Matrix3d R = Eigen::Matrix3d::Zero();
  explicit QuarterTurn(int quarters) {
    const int c = quarters == 2 ? -1 : 0, s = quarters == 1 ? 1 : 0;
    R << c, -s, 0, s, c, 0, 0, 0, 1;
  }
  [[nodiscard]] PointCloud of(PointsView points) const {
    PointCloud turned;
    for (const Point& p : points) turned.emplace_back(R * p);
    return turned;
  }
  [[nodiscard]] Pose of(const Pose& pose) const {
    Pose turned;
    turned.rotation = Eigen::Quaterniond(R) * Eigen::Quaterniond(pose.rotation);
    turned.translation = R * pose.translation;
    return turned;
  }
  [[nodiscard]] Matrix6 of(const Matrix6& hessian) const {
    Matrix6 both = Matrix6::Zero();
    both.topLeftCorner<3, 3>() = R;
    both.bottomRightCorner<3, 3>() = R;
    return both * hessian * both.transpose();
  }
};

/// The Hessian of a sensor at `lever` from another, axes of the map frame [m]: the other one moves
/// by t + w x lever if this one moves by t and turns by w.
Matrix6 seen_from_lever(const Matrix6& hessian, const Eigen::Vector3d& lever) {
  Matrix6 step = Matrix6::Identity();
  for (Eigen::Index k = 0; k < 3; ++k) {
    step.block<3, 1>(0, 3 + k) = Eigen::Vector3d(Eigen::Vector3d::Unit(k).cross(lever));
  }
  return step.transpose() * hessian * step;
}

}  // namespace

void hessian_is_positive(const Subject& subject) {
  const Scene scene = some_scene(subject);
  const auto target = prepare(subject, scene.map);
  Random random(subject.seed() + 1);
  bool any = false;
  for (int i = 0; i < 5; ++i) {
    const Pose guess = off(random, kTruth, subject.claims<MatcherClaims>(), 0.5);
    const Alignment got = align(*target, scene.scan, guess);
    if (got.termination == Termination::max_iterations) continue;
    any = true;
    const Eigen::SelfAdjointEigenSolver<Matrix6> solver(Matrix6(got.hessian));
    const double least = solver.eigenvalues()[0];
    CHECK_MESSAGE(least > 0.0, "the least eigenvalue of the Hessian is " << least);
  }
  if (!any) does_not_apply("no alignment converged");
}

void hessian_moves_along(const Subject& subject) {
  const Scene scene = some_scene(subject);
  const auto target = prepare(subject, scene.map);
  Random random(subject.seed() + 1);
  const Pose guess = off(random, kTruth, subject.claims<MatcherClaims>(), 0.25);
  const Alignment expected = settled(*target, scene.scan, guess);
  const Matrix6 hessian = expected.hessian;

  for (const Point& by : kFarByCells) {
    const PointCloud map = moved(scene.map, by);
    const auto far = prepare(subject, map);
    check_alike(settled(*far, scene.scan, moved(guess, by)).hessian, hessian, kSameFit,
                "map and guess moved");
  }
  for (const int quarters : {1, 2}) {
    const QuarterTurn turn(quarters);
    const PointCloud map = turn.of(scene.map);
    const auto turned = prepare(subject, map);
    check_alike(settled(*turned, scene.scan, turn.of(guess)).hessian, turn.of(hessian), kSameFit,
                "map and guess turned about z");
  }
  const Pose turn{rotation_from_vector({0.3, -0.2, 1.0}), Eigen::Vector3d::Zero()};
  PointCloud scan;
  for (const Point& p : scene.scan) scan.push_back(turn * p);
  check_alike(settled(*target, scan, guess * turn.inverse()).hessian, hessian, kSameFit,
              "the scan turned in its frame");

  const Eigen::Vector3d by(1.0, -0.6, 0.4);
  Pose there = guess;
  there.translation -= guess.rotation * by;
  const Eigen::Vector3d lever = expected.T_map_scan.rotation * by;
  check_alike(settled(*target, moved(scene.scan, by), there).hessian,
              seen_from_lever(hessian, lever), kOtherSensor, "the scan moved in its frame");
}

}  // namespace vantage::conformance
