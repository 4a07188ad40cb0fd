#include <doctest/doctest.h>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "objective.hpp"
#include "scenes.hpp"

namespace vantage::ndt {
namespace {

constexpr std::array kModes{Neighbours::direct7, Neighbours::direct1, Neighbours::direct26,
                            Neighbours::kdtree};

std::string name_of(Neighbours mode) {
  for (const auto& [name, value] : enum_names(mode)) {
    if (value == mode) return std::string(name);
  }
  return {};
}

Objective objective_of(PointsView map, Neighbours mode) {
  return {VoxelMap::build(map, {}).value(), mode, NdtCoefficients::derive(0.55, 1.0).value()};
}

Pose moved(const Pose& pose, const Vector6& by) {
  Pose result;
  result.rotation = (rotation_from_vector(by.tail<3>()) * pose.rotation).normalized();
  result.translation = pose.translation + by.head<3>();
  return result;
}

Derivatives derivatives(const Objective& objective, PointsView scan, const Pose& pose) {
  Workspace workspace;
  objective.begin(scan, workspace);
  return objective.derivatives(scan, pose, workspace);
}

/// The objective jumps where a point changes its voxels. These are the points that do not while
/// they move less than `reach` [m].
PointCloud away_from_borders(const Objective& objective, PointsView scan, const Pose& pose,
                             double reach) {
  const VoxelMap& map = objective.map();
  const VoxelTree smaller(map.gaussians(), map.resolution() - reach);
  const VoxelTree larger(map.gaussians(), map.resolution() + reach);
  PointCloud kept;
  for (const Point& p : scan) {
    const Eigen::Vector3d x = pose * p;
    bool stays = smaller.near(x).size == larger.near(x).size;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step = reach * Eigen::Vector3d::Unit(axis);
      stays = stays && map.key_of(x - step) == map.key_of(x + step);
    }
    if (stays) kept.push_back(p);
  }
  return kept;
}

void check_against_differences(const Objective& objective, PointsView scan, const Pose& pose) {
  constexpr double kStep = 1e-6;  // [m], [rad]
  const PointCloud points = away_from_borders(objective, scan, pose, 100.0 * kStep);
  REQUIRE(points.size() > scan.size() / 2);
  const Derivatives at = derivatives(objective, points, pose);
  REQUIRE(at.matched > points.size() / 4);

  Vector6 gradient;
  Matrix6 hessian;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const Derivatives above = derivatives(objective, points, moved(pose, kStep * Vector6::Unit(i)));
    const Derivatives below =
        derivatives(objective, points, moved(pose, -kStep * Vector6::Unit(i)));
    REQUIRE(above.matched == at.matched);
    gradient[i] = (above.value - below.value) / (2.0 * kStep);
    // Seen from the moved pose the rotation vector counts anew: its chart is off by half the
    // commutator, which leaves the symmetric part of the differences untouched.
    hessian.col(i) = (above.gradient - below.gradient) / (2.0 * kStep);
  }
  hessian = (0.5 * (hessian + hessian.transpose())).eval();

  // In units in which rotations weigh as much as translations.
  const double range = 10.0;
  Vector6 scale;
  scale << 1.0, 1.0, 1.0, 1.0 / range, 1.0 / range, 1.0 / range;
  const Matrix6 scaled = scale.asDiagonal() * at.hessian * scale.asDiagonal();
  const Matrix6 difference = scale.asDiagonal() * (at.hessian - hessian) * scale.asDiagonal();
  CHECK((scale.asDiagonal() * (at.gradient - gradient)).norm() <
        1e-7 * (scale.asDiagonal() * at.gradient).norm() + 1e-8 * scaled.norm());
  CHECK(difference.cwiseAbs().maxCoeff() < 1e-6 * scaled.cwiseAbs().maxCoeff());
  CHECK(at.hessian == at.hessian.transpose());
}

}  // namespace

TEST_CASE("gradient and Hessian agree with finite differences in a made-up yard") {
  const PointCloud map = test::yard(11);
  const Pose truth = pose_from_xyz_rpy({0.4, -0.3, 1.0}, {0.02, -0.01, 0.7});
  const PointCloud scan = test::seen_from(test::yard(12), truth, 15.0, 3000, 1);
  std::mt19937 random(3);
  for (const Neighbours mode : kModes) {
    CAPTURE(name_of(mode));
    const Objective objective = objective_of(map, mode);
    check_against_differences(objective, scan, objective.to_local(truth));
    for (int i = 0; i < 4; ++i) {
      check_against_differences(objective, scan,
                                objective.to_local(test::disturbed(truth, 0.6, 4.0, random)));
    }
  }
}

TEST_CASE("gradient and Hessian agree with finite differences on recorded scans") {
  const auto pair = test::recorded_pair();
  if (!pair) return;
  std::mt19937 random(4);
  for (const Neighbours mode : kModes) {
    CAPTURE(name_of(mode));
    const Objective objective = objective_of(pair->map, mode);
    for (const double metres : {0.0, 0.1, 0.5}) {
      check_against_differences(
          objective, pair->scan,
          objective.to_local(test::disturbed(pair->T_map_scan, metres, 6.0 * metres, random)));
    }
  }
}

TEST_CASE("the majorizer is positive semidefinite and lies nowhere below the objective") {
  const Pose truth = pose_from_xyz_rpy({0.4, -0.3, 1.0}, {0.02, -0.01, 0.7});
  const PointCloud scan = test::seen_from(test::yard(12), truth, 15.0, 2000, 1);
  const Objective objective = objective_of(test::yard(11), Neighbours::direct7);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < 20; ++i) {
    const Pose pose = objective.to_local(test::disturbed(truth, 0.5, 3.0, random));
    const PointCloud points = away_from_borders(objective, scan, pose, 0.1);
    REQUIRE(points.size() > 50);
    const Derivatives at = derivatives(objective, points, pose);
    const Eigen::SelfAdjointEigenSolver<Matrix6> solver(at.majorizer);
    CHECK(solver.eigenvalues()[0] >= -1e-9 * solver.eigenvalues()[5]);
    Vector6 step = Vector6::Zero();
    step.head<3>() = 0.05 * Eigen::Vector3d(unit(random), unit(random), unit(random));
    const double bound = at.value + at.gradient.dot(step) + 0.5 * step.dot(at.majorizer * step);
    CHECK(derivatives(objective, points, moved(pose, step)).value <= bound + 1e-9);
  }
}

TEST_CASE("scores and objective equal Eq. 12 written out") {
  const PointCloud map = test::yard(21);
  const Pose pose = pose_from_xyz_rpy({0.43, -0.31, 1.02}, {0.02, -0.03, 0.65});
  PointCloud scan = test::seen_from(test::yard(22), pose, 18.0, 800, 2);
  for (int i = 0; i < 50; ++i) scan.emplace_back(0.1 * i, 0.2 * i, 30.0);  // without a voxel

  // Everything by the book: voxels in a tree map, covariances in two passes, constants by hand.
  std::map<std::array<double, 3>, PointCloud> voxels;
  const auto voxel_of = [](const Point& p) {
    return std::array{std::floor(p.x()), std::floor(p.y()), std::floor(p.z())};
  };
  for (const Point& p : map) voxels[voxel_of(p)].push_back(p);
  struct Cell {
    Eigen::Vector3d mean;
    Eigen::Matrix3d inverse;
  };
  std::map<std::array<double, 3>, Cell> cells;
  for (const auto& [voxel, points] : voxels) {
    if (points.size() < 6) continue;
    const double n = static_cast<double>(points.size());
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Point& p : points) mean += p / n;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    for (const Point& p : points) covariance += (p - mean) * (p - mean).transpose() / (n - 1.0);
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
    const Eigen::Vector3d values =
        solver.eigenvalues().cwiseMax(0.01 * solver.eigenvalues().maxCoeff());
    const Eigen::Matrix3d V = solver.eigenvectors();
    cells[voxel] = {mean, (V * values.asDiagonal() * V.transpose()).inverse()};
  }
  const double c1 = 10.0 * 0.45, c2 = 0.55;
  const double d3 = -std::log(c2);
  const double d1 = -std::log(c1 + c2) - d3;
  const double d2 = -2.0 * std::log((-std::log(c1 * std::exp(-0.5) + c2) - d3) / d1);

  for (const Neighbours mode : kModes) {
    CAPTURE(name_of(mode));
    double fitness = 0.0, nvtl = 0.0, objective = 0.0, matched = 0.0;
    for (const Point& p : scan) {
      const Eigen::Vector3d x = pose * p;
      const std::array<double, 3> own = voxel_of(x);
      double sum = 0.0, best = 0.0, neighbours = 0.0;
      for (int dx = -1; dx <= 1; ++dx) {
        for (int dy = -1; dy <= 1; ++dy) {
          for (int dz = -1; dz <= 1; ++dz) {
            const int steps = std::abs(dx) + std::abs(dy) + std::abs(dz);
            if (mode == Neighbours::direct1 && steps > 0) continue;
            if (mode == Neighbours::direct7 && steps > 1) continue;
            const auto cell = cells.find({own[0] + dx, own[1] + dy, own[2] + dz});
            if (cell == cells.end()) continue;
            const Eigen::Vector3d q = x - cell->second.mean;
            if (mode == Neighbours::kdtree && q.norm() >= 1.0) continue;
            const double e = std::exp(-0.5 * d2 * q.dot(cell->second.inverse * q));
            neighbours += 1.0;
            sum += -d1 * e - d3;
            best = std::max(best, -d1 * e);
            objective += d1 * e;
          }
        }
      }
      if (neighbours == 0.0) continue;
      matched += 1.0;
      fitness += sum / neighbours;
      nvtl += best;
    }
    const double n = static_cast<double>(scan.size());
    REQUIRE(matched > 0.6 * n);
    REQUIRE(matched < n);

    const auto target = test::prepared(map, "neighbours = \"" + name_of(mode) + "\"");
    const auto score = target->score(scan, pose);
    REQUIRE(score);
    CHECK(score->fitness == doctest::Approx(fitness / n).epsilon(1e-9));
    CHECK(score->nvtl == doctest::Approx(nvtl / matched).epsilon(1e-9));
    CHECK(score->coverage == doctest::Approx(matched / n).epsilon(1e-12));

    const Objective ours = objective_of(map, mode);
    const Derivatives at = derivatives(ours, scan, ours.to_local(pose));
    CHECK(at.value == doctest::Approx(objective).epsilon(1e-9));
    CHECK(static_cast<double>(at.matched) == matched);
  }
}

}  // namespace vantage::ndt
