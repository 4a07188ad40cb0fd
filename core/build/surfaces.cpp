#include "build/surfaces.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>

#include "vantage/kit/hash.hpp"

namespace vantage {
namespace {

constexpr double kEdge = 0.4;  // of a voxel [m]

/// Distinct for the voxels within 800 km of each other. Neighbours above each other have
/// consecutive keys.
std::uint64_t voxel_of(const Point& p) {
  constexpr std::uint64_t kMask = (1U << 21U) - 1;
  constexpr std::int64_t kMiddle = 1 << 20U;  // keys begin anew far below and above the ground
  const auto part = [](double x) {
    const auto voxel = static_cast<std::int64_t>(std::floor(x / kEdge));
    return static_cast<std::uint64_t>(voxel + kMiddle) & kMask;
  };
  return part(p.x()) << 42U | part(p.y()) << 21U | part(p.z());
}

constexpr std::int64_t kCube = 8;  // voxels along the edge of a cube

/// The key of the cube that a voxel lies in.
std::uint64_t cube_of(std::uint64_t voxel) {
  constexpr std::uint64_t kPart = ((1U << 21U) - 1) & ~std::uint64_t{kCube - 1};
  return voxel & (kPart << 42U | kPart << 21U | kPart);
}

/// The key of a voxel so many columns away, at the same height.
std::uint64_t moved(std::uint64_t key, std::int64_t x, std::int64_t y) {
  constexpr std::uint64_t kMask = (1U << 21U) - 1;
  const auto part = [&](unsigned shift, std::int64_t by) {
    return (((key >> shift) + static_cast<std::uint64_t>(by)) & kMask) << shift;
  };
  return part(42, x) | part(21, y) | (key & kMask);
}

/// Sums of the points in a voxel, in whole micrometres from its corner: they are the same in any
/// order.
struct Sums {
  using Whole = Eigen::Matrix<std::int64_t, 3, 1>;
  std::int64_t count = 0;
  Whole sum = Whole::Zero();
  Eigen::Matrix<std::int64_t, 3, 3> squares = Eigen::Matrix<std::int64_t, 3, 3>::Zero();

  void add(const Whole& p) {
    ++count;
    sum += p;
    squares.noalias() += p * p.transpose();
  }
  /// @param shift  from the corner of these to that of the others
  void add(const Sums& others, const Whole& shift) {
    count += others.count;
    sum += others.sum + others.count * shift;
    squares += others.squares + others.sum * shift.transpose() + shift * others.sum.transpose() +
               others.count * (shift * shift.transpose());
  }
};

constexpr double kUnit = 1e-6;  // [m]

struct Plane {
  Point middle;  // from the voxel's corner [m]
  Point normal;
};
/// None if the points are too few or not flat.
std::optional<Plane> plane_of(const Sums& sums) {
  constexpr std::int64_t kFewest = 6;
  constexpr double kFlat = 0.1;  // of the eigenvalues
  if (sums.count < kFewest) return std::nullopt;
  const auto points = static_cast<double>(sums.count);
  const Point mean = kUnit * sums.sum.cast<double>() / points;
  const Eigen::Matrix3d covariance =
      kUnit * kUnit * sums.squares.cast<double>() / points - mean * mean.transpose();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes;
  axes.computeDirect(covariance);
  if (!(axes.eigenvalues()[0] < kFlat * axes.eigenvalues()[1])) return std::nullopt;
  return Plane{mean, axes.eigenvectors().col(0)};
}

/// The points in a voxel.
struct SurfaceVoxel {
  std::uint64_t key = 0;
  Point corner;             // map frame [m]
  std::uint32_t point = 0;  // one of them, whatever their order is
  Sums sums;
};

using Keyed = std::pair<std::uint64_t, std::uint32_t>;

SurfaceVoxel voxel_with(PointsView map, std::span<const Keyed> points) {
  const Point& some = map[points.front().second];
  SurfaceVoxel voxel{.key = points.front().first,
                     .corner = kEdge * Point((some / kEdge).array().floor()),
                     .point = 0,
                     .sums = {}};
  std::pair<std::uint64_t, std::uint32_t> least{~std::uint64_t{0}, 0};
  for (const auto& [key, k] : points) {
    const Sums::Whole p = ((map[k] - voxel.corner) / kUnit).array().round().cast<std::int64_t>();
    voxel.sums.add(p);
    least = std::min(least, {hash(5, p.x(), p.y(), p.z()), k});
  }
  voxel.point = least.second;
  return voxel;
}

/// All voxels of a map, ascending by key. Takes memory for points and voxels, and none for the
/// space between them: a point may be far from all others.
std::vector<SurfaceVoxel> surface_voxels_of(PointsView map) {
  std::vector<Keyed> keyed(map.size());
  tbb::parallel_for(std::size_t{0}, map.size(), [&](std::size_t k) {
    keyed[k] = {voxel_of(map[k]), static_cast<std::uint32_t>(k)};
  });
  tbb::parallel_sort(keyed.begin(), keyed.end());
  std::vector<std::uint32_t> begins;  // of each voxel in `keyed`, and the end
  for (std::uint32_t k = 0; k < keyed.size(); ++k) {
    if (k == 0 || keyed[k].first != keyed[k - 1].first) begins.push_back(k);
  }
  begins.push_back(static_cast<std::uint32_t>(keyed.size()));
  std::vector<SurfaceVoxel> voxels(begins.size() - 1);
  tbb::parallel_for(std::size_t{0}, voxels.size(), [&](std::size_t v) {
    voxels[v] = voxel_with(map, std::span(keyed).subspan(begins[v], begins[v + 1] - begins[v]));
  });
  return voxels;
}

/// The voxel's points and those of the voxels around it.
Sums around(const std::vector<SurfaceVoxel>& voxels, const SurfaceVoxel& voxel) {
  const auto edge = static_cast<std::int64_t>(std::llround(kEdge / kUnit));
  Sums sums;
  for (std::int64_t x = -1; x <= 1; ++x) {
    for (std::int64_t y = -1; y <= 1; ++y) {
      const std::uint64_t column = moved(voxel.key, x, y);
      auto at =
          std::ranges::lower_bound(voxels, column == 0 ? 0 : column - 1, {}, &SurfaceVoxel::key);
      for (; at != voxels.end() && at->key <= column + 1; ++at) {
        const auto z = static_cast<std::int64_t>(at->key - column);
        sums.add(at->sums, edge * Sums::Whole(x, y, z));
      }
    }
  }
  return sums;
}

struct Disc {
  Point middle;            // map frame [m]
  Eigen::Vector3f normal;  // zero if the points are no surface: then `middle` is one of them
  float radius;            // [m]
};

Disc disc_of(PointsView map, const std::vector<SurfaceVoxel>& voxels, const SurfaceVoxel& voxel) {
  constexpr std::int64_t kEnough = 30;
  constexpr float kDiscRadius = 0.3F, kPointRadius = 0.2F;
  std::optional<Plane> plane;
  if (voxel.sums.count < kEnough) plane = plane_of(around(voxels, voxel));
  if (!plane) plane = plane_of(voxel.sums);
  if (!plane) return {map[voxel.point], Eigen::Vector3f::Zero(), kPointRadius};
  const Point own = kUnit * voxel.sums.sum.cast<double>() / static_cast<double>(voxel.sums.count);
  const double off = plane->normal.dot(own - plane->middle);
  return {voxel.corner + own - off * plane->normal, plane->normal.cast<float>(), kDiscRadius};
}

/// The box around some discs.
Bounds3 box_around(std::span<const Disc> discs) {
  constexpr double kClearance = 0.01;
  Bounds3 box;
  for (const Disc& disc : discs) {
    const Point sines = (1.0 - disc.normal.cast<double>().array().square()).max(0.0).sqrt();
    const Point half = double{disc.radius} * sines.array() + kClearance;
    box.extend(disc.middle - half);
    box.extend(disc.middle + half);
  }
  return box;
}

}  // namespace

Surfaces::Surfaces(PointsView map) {
  const std::vector<SurfaceVoxel> voxels = surface_voxels_of(map);
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order;  // by cube
  for (std::uint32_t k = 0; k < voxels.size(); ++k) order.emplace_back(cube_of(voxels[k].key), k);
  std::ranges::sort(order);
  std::vector<std::size_t> begins;  // of each cube in `order`, and the end
  for (std::size_t k = 0; k < order.size(); ++k) {
    if (k == 0 || order[k].first != order[k - 1].first) begins.push_back(k);
  }
  begins.push_back(order.size());
  std::uint32_t groups = 0;
  for (std::size_t c = 0; c + 1 < begins.size(); ++c) {
    const std::uint32_t begin = groups;
    groups += static_cast<std::uint32_t>((begins[c + 1] - begins[c] + kLanes - 1) / kLanes);
    cubes_.push_back({.begin = begin, .end = groups, .half = Eigen::Vector3f::Zero()});
  }
  constexpr float kNowhere = 1e6F;  // [m]
  Discs nowhere{};
  nowhere.x.fill(kNowhere);
  nowhere.radius.fill(0.0F);
  discs_.resize(groups, nowhere);
  middles_.resize(kLanes * discs_.size(), Point::Constant(kNowhere));
  cube_middles_.resize(cubes_.size());
  tbb::parallel_for(std::size_t{0}, cubes_.size(), [&](std::size_t c) {
    std::vector<Disc> of_cube;
    for (std::size_t k = begins[c]; k < begins[c + 1]; ++k) {
      of_cube.push_back(disc_of(map, voxels, voxels[order[k].second]));
    }
    Cube& cube = cubes_[c];
    const Bounds3 box = box_around(of_cube);
    cube_middles_[c] = 0.5 * (box.min + box.max);
    cube.half = (0.5 * (box.max - box.min)).cast<float>();
    for (std::size_t k = 0; k < of_cube.size(); ++k) {
      const Disc& disc = of_cube[k];
      const Eigen::Vector3f to = (disc.middle - cube_middles_[c]).cast<float>();
      const std::size_t lane = k % kLanes;
      Discs& some = discs_[cube.begin + k / kLanes];
      some.x[lane] = to.x();
      some.y[lane] = to.y();
      some.z[lane] = to.z();
      some.normal_x[lane] = disc.normal.x();
      some.normal_y[lane] = disc.normal.y();
      some.normal_z[lane] = disc.normal.z();
      some.radius[lane] = disc.radius;
      middles_[kLanes * cube.begin + k] = disc.middle;
    }
  });
  for (const Cube& cube : cubes_) widest_ = std::max(widest_, cube.half.head<2>().maxCoeff());
  plan_.emplace(cube_middles_, cube_middles_.size(),
                [](std::size_t k) { return static_cast<std::uint32_t>(k); });
}

}  // namespace vantage
