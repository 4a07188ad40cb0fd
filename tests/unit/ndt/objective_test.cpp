#include <doctest/doctest.h>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
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

Objective objective_of(PointsView map, Neighbours mode,
                       kernel::Evaluate evaluate = kernel::fastest()) {
  return {VoxelMap::build(map, {}).value(), mode, NdtCoefficients::derive(0.55, 1.0).value(),
          evaluate};
}

Pose moved(const Pose& pose, const Vector6& by) {
  Pose result;
  result.rotation = (rotation_from_vector(by.tail<3>()) * pose.rotation).normalized();
  result.translation = pose.translation + by.head<3>();
  return result;
}

Derivatives derivatives(const Objective& objective, PointsView scan, const Pose& pose,
                        const Extent& extent = {}) {
  Workspace workspace;
  objective.begin(scan, workspace);
  return objective.derivatives(pose, workspace, extent);
}

/// The Gaussians that a place is compared with, in double precision and without any cleverness.
struct Neighbour {
  Eigen::Vector3d q;
  double squared;  // Mahalanobis distance
};
std::vector<Neighbour> neighbours(const VoxelMap& map, Neighbours mode, const Point& local) {
  const auto inside = [&](int x, int y, int z) {
    const int steps = std::abs(x) + std::abs(y) + std::abs(z);
    if (mode == Neighbours::direct1) return steps == 0;
    return mode != Neighbours::direct7 || steps <= 1;
  };
  const double edge = map.options().resolution;
  std::vector<Neighbour> found;
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        if (!inside(x, y, z)) continue;
        const VoxelKey key = map.key_of(map.origin() + local + edge * Eigen::Vector3d(x, y, z));
        const std::uint32_t j = key == kNoVoxel ? kNoGaussian : map.find(key);
        if (j == kNoGaussian) continue;
        const Gaussian g = gaussian_of(map.cells()[j]);
        const Eigen::Vector3d q = local - edge * (VoxelMap::corner_of(key) + g.mean);
        Eigen::Matrix3d C;
        C << g.xx, g.xy, g.xz, g.xy, g.yy, g.yz, g.xz, g.yz, g.zz;
        if (mode == Neighbours::kdtree && !(q.norm() < edge)) continue;
        found.push_back({q, q.dot(C * q) / (edge * edge)});
      }
    }
  }
  return found;
}

double value(const VoxelMap& map, Neighbours mode, PointsView scan, const Pose& pose) {
  const NdtCoefficients d = NdtCoefficients::derive(0.55, 1.0).value();
  double sum = 0.0;
  for (const Point& p : scan) {
    for (const Neighbour& n : neighbours(map, mode, pose * p)) {
      sum += d.d1 * std::exp(-0.5 * d.d2 * n.squared);
    }
  }
  return sum;
}

/// The objective jumps where a point changes its Gaussians. These are the points that do not while
/// they move less than `reach` [m].
PointCloud away_from_borders(const VoxelMap& map, Neighbours mode, PointsView scan,
                             const Pose& pose, double reach) {
  const double edge = map.options().resolution;
  PointCloud kept;
  for (const Point& p : scan) {
    const Eigen::Vector3d x = pose * p;
    const Eigen::Vector3d in_voxel = x / edge - (x / edge).array().floor().matrix();
    bool stays = in_voxel.minCoeff() * edge > reach && (1.0 - in_voxel.maxCoeff()) * edge > reach;
    if (mode == Neighbours::kdtree) {
      for (const Neighbour& n : neighbours(map, Neighbours::direct26, x)) {
        stays = stays && std::abs(n.q.norm() - edge) > reach;
      }
    }
    if (stays) kept.push_back(p);
  }
  return kept;
}

/// In units in which rotations weigh as much as translations.
Vector6 scale() {
  constexpr double kRange = 20.0;
  Vector6 s;
  s << 1.0, 1.0, 1.0, 1.0 / kRange, 1.0 / kRange, 1.0 / kRange;
  return s;
}

void check_against_differences(const Objective& objective, Neighbours mode, PointsView scan,
                               const Pose& pose) {
  constexpr double kStep = 2e-4;
  const PointCloud points = away_from_borders(objective.map(), mode, scan, pose, 4.0 * kStep);
  REQUIRE(points.size() > scan.size() / 2);
  const Derivatives at = derivatives(objective, points, pose);
  REQUIRE(at.matched > points.size() / 4);

  const auto shifted = [&](Eigen::Index i, double by_i, Eigen::Index j, double by_j) {
    Vector6 step = Vector6::Zero();
    step[i] += by_i * kStep * scale()[i];
    step[j] += by_j * kStep * scale()[j];
    return value(objective.map(), mode, points, moved(pose, step));
  };
  const double here = value(objective.map(), mode, points, pose);
  CHECK(at.value == doctest::Approx(here).epsilon(1e-5));
  const Vector6 gradient = scale().asDiagonal() * at.gradient;
  const Matrix6 hessian = scale().asDiagonal() * at.hessian * scale().asDiagonal();
  CHECK(at.hessian == at.hessian.transpose());
  Vector6 gradient_error;
  double worst = 0.0;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const double above = shifted(i, 1, i, 0), below = shifted(i, -1, i, 0);
    gradient_error[i] = gradient[i] - (above - below) / (2.0 * kStep);
    worst =
        std::max(worst, std::abs(hessian(i, i) - (above - 2.0 * here + below) / (kStep * kStep)));
    for (Eigen::Index j = i + 1; j < 6; ++j) {
      const double mixed = (shifted(i, 1, j, 1) - shifted(i, 1, j, -1) - shifted(i, -1, j, 1) +
                            shifted(i, -1, j, -1)) /
                           (4.0 * kStep * kStep);
      worst = std::max(worst, std::abs(hessian(i, j) - mixed));
    }
  }
  CHECK(gradient_error.norm() < 1e-4 * gradient.norm() + 1e-6 * hessian.norm());
  CHECK(worst < 1e-4 * hessian.cwiseAbs().maxCoeff());
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
    check_against_differences(objective, mode, scan, objective.to_local(truth));
    for (int i = 0; i < 2; ++i) {
      check_against_differences(objective, mode, scan,
                                objective.to_local(test::disturbed(truth, 0.6, 4.0, random)));
    }
  }
}

TEST_CASE("gradient and Hessian agree with finite differences on recorded scans") {
  const auto pair = test::recorded_pair();
  if (!pair) return;
  // Near ones, which a step of the rotation moves about as far as one of the translation.
  PointCloud scan;
  std::ranges::copy_if(pair->scan, std::back_inserter(scan),
                       [](const Point& p) { return p.norm() < 20.0; });
  std::mt19937 random(4);
  for (const Neighbours mode : kModes) {
    CAPTURE(name_of(mode));
    const Objective objective = objective_of(pair->map, mode);
    for (const double metres : {0.0, 0.5}) {
      check_against_differences(
          objective, mode, scan,
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
    const PointCloud points =
        away_from_borders(objective.map(), Neighbours::direct7, scan, pose, 0.1);
    REQUIRE(points.size() > 50);
    const Derivatives at = derivatives(objective, points, pose);
    const Eigen::SelfAdjointEigenSolver<Matrix6> solver(at.majorizer);
    CHECK(solver.eigenvalues()[0] >= -1e-6 * solver.eigenvalues()[5]);
    Vector6 step = Vector6::Zero();
    step.head<3>() = 0.05 * Eigen::Vector3d(unit(random), unit(random), unit(random));
    const double bound = at.value + at.gradient.dot(step) + 0.5 * step.dot(at.majorizer * step);
    CHECK(derivatives(objective, points, moved(pose, step)).value <=
          bound + 1e-5 * std::abs(bound));
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
  struct ByTheBook {
    Eigen::Vector3d mean;
    Eigen::Matrix3d inverse;
  };
  std::map<std::array<double, 3>, ByTheBook> cells;
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
    CHECK(score->fitness == doctest::Approx(fitness / n).epsilon(1e-4));
    CHECK(score->nvtl == doctest::Approx(nvtl / matched).epsilon(1e-4));
    CHECK(score->coverage == doctest::Approx(matched / n).epsilon(1e-12));

    const Objective ours = objective_of(map, mode);
    const Derivatives at = derivatives(ours, scan, ours.to_local(pose));
    CHECK(at.value == doctest::Approx(objective).epsilon(1e-4));
    CHECK(static_cast<double>(at.matched) == matched);
  }
}

TEST_CASE("every kernel gives the same, to a relative 1e-5") {
  const PointCloud map = test::yard(11);
  const Pose truth = pose_from_xyz_rpy({0.4, -0.3, 1.0}, {0.02, -0.01, 0.7});
  const PointCloud scan = test::seen_from(test::yard(12), truth, 25.0, 20001, 1);
  if (!kernel::has_avx2()) MESSAGE("only one kernel runs here");
  std::mt19937 random(6);
  for (const Neighbours mode : kModes) {
    CAPTURE(name_of(mode));
    const Objective plain = objective_of(map, mode, &kernel::evaluate_baseline);
    const Objective fast = objective_of(map, mode, kernel::fastest());
    for (const double metres : {0.0, 0.3}) {
      const Pose pose = plain.to_local(test::disturbed(truth, metres, 5.0 * metres, random));
      for (const std::size_t stride : {1, 3}) {
        const Derivatives a = derivatives(plain, scan, pose, {.stride = stride});
        const Derivatives b = derivatives(fast, scan, pose, {.stride = stride});
        CHECK(a.value == doctest::Approx(b.value).epsilon(1e-5));
        CHECK((scale().asDiagonal() * (a.gradient - b.gradient)).norm() <
              1e-5 * (scale().asDiagonal() * (a.majorizer * scale())).norm());
        CHECK((a.hessian - b.hessian).norm() < 1e-5 * a.majorizer.norm());
        CHECK((a.majorizer - b.majorizer).norm() < 1e-5 * a.majorizer.norm());
        // A point on a border may fall to either side.
        CHECK(std::max(a.matched, b.matched) - std::min(a.matched, b.matched) <= 1);
        CHECK(a.score.fitness == doctest::Approx(b.score.fitness).epsilon(1e-4));
        CHECK(a.score.nvtl == doctest::Approx(b.score.nvtl).epsilon(1e-4));
      }
    }
  }
}

TEST_CASE("terms that are left out are zero, and the others do not change") {
  const Pose truth = pose_from_xyz_rpy({0.4, -0.3, 1.0}, {0.02, -0.01, 0.7});
  const PointCloud scan = test::seen_from(test::yard(12), truth, 15.0, 3000, 1);
  for (const kernel::Evaluate evaluate : {&kernel::evaluate_baseline, kernel::fastest()}) {
    const Objective objective = objective_of(test::yard(11), Neighbours::direct7, evaluate);
    const Pose pose = objective.to_local(truth);
    const Derivatives all = derivatives(objective, scan, pose);
    const Derivatives part = derivatives(objective, scan, pose, {kernel::Terms::majorizer});
    CHECK(part.value == doctest::Approx(all.value).epsilon(1e-6));
    CHECK((part.majorizer - all.majorizer).norm() < 1e-6 * all.majorizer.norm());
    CHECK((part.gradient - all.gradient).norm() < 1e-6 * all.majorizer.norm());
    CHECK(part.hessian.isZero(0.0));
    const Derivatives score = derivatives(objective, scan, pose, {kernel::Terms::score});
    CHECK(score.majorizer.isZero(0.0));
    CHECK(score.gradient.isZero(0.0));
    CHECK(score.score.fitness == doctest::Approx(all.score.fitness).epsilon(1e-6));
    CHECK(score.score.coverage == all.score.coverage);
  }
}

TEST_CASE("what a pose gives does not depend on the poses, scans and maps asked for before") {
  const Pose truth = pose_from_xyz_rpy({0.4, -0.3, 1.0}, {0.02, -0.01, 0.7});
  const PointCloud scan = test::seen_from(test::yard(12), truth, 15.0, 3001, 1);
  std::mt19937 random(7);
  for (const Neighbours mode : kModes) {
    CAPTURE(name_of(mode));
    const std::array maps{objective_of(test::yard(11), mode), objective_of(test::yard(13), mode)};
    Workspace used;
    for (int i = 0; i < 20; ++i) {
      const Objective& objective = maps[i % 3 == 2 ? 1 : 0];
      const PointsView part = PointsView(scan).first(i % 4 < 2 ? 3001 : 1001);
      objective.begin(part, used);
      const Pose pose = objective.to_local(test::disturbed(truth, 0.05 * i, 0.3 * i, random));
      const Derivatives fresh = derivatives(objective, part, pose);
      const Derivatives again = objective.derivatives(pose, used);
      CHECK(again.value == fresh.value);
      CHECK(again.gradient == fresh.gradient);
      CHECK(again.hessian == fresh.hessian);
      CHECK(again.score.fitness == fresh.score.fitness);
    }
  }
}

}  // namespace vantage::ndt
