#include "pulls.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>
#include <span>

namespace vantage::ndt {
namespace {

/// A Gaussian in the neighbourhood of a point.
struct Meeting {
  std::uint32_t gaussian, point;
};

/// Sorts by Gaussian, and keeps the order of points.
void sort_by_gaussian(std::vector<Meeting>& meetings, std::size_t gaussians) {
  constexpr unsigned kBits = 11;
  constexpr std::uint32_t kDigits = 1U << kBits;
  std::vector<Meeting> sorted(meetings.size());
  for (unsigned shift = 0; gaussians >> shift != 0; shift += kBits) {
    const auto digit = [&](const Meeting& m) { return m.gaussian >> shift & (kDigits - 1); };
    std::array<std::uint32_t, kDigits + 1> begin{};
    for (const Meeting& m : meetings) ++begin[digit(m) + 1];
    for (std::uint32_t d = 1; d < kDigits; ++d) begin[d] += begin[d - 1];
    for (const Meeting& m : meetings) sorted[begin[digit(m)]++] = m;
    meetings.swap(sorted);
  }
}

/// @param meetings  sorted
std::size_t gaussians_in(std::span<const Meeting> meetings) {
  std::size_t count = 0;
  for (std::size_t k = 0; k < meetings.size(); ++k) {
    if (k == 0 || meetings[k].gaussian != meetings[k - 1].gaussian) ++count;
  }
  return count;
}

/// Finds the Gaussians in the neighbourhood of points.
class Neighbourhood {
 public:
  explicit Neighbourhood(const Objective& objective)
      : map_(objective.map()), search_(objective.search()), blocks_(map_.view().blocks) {}

  /// Those of a point in the map frame [m], until the next call.
  [[nodiscard]] std::span<const std::uint32_t> of(const Point& at) {
    const auto voxel = voxel_of(at);
    // Consecutive points of a scan often share a voxel.
    if (voxel && voxel == last_) return std::span(found_).first(count_);
    last_ = voxel;
    count_ = 0;
    for (std::uint32_t s = 0; s < search_.size; ++s) {
      found_[count_] =
          voxel ? gaussian_at(*voxel, search_.steps[s]) : gaussian_at(at, search_.steps[s]);
      if (found_[count_] != kNoGaussian) ++count_;
    }
    return std::span(found_).first(count_);
  }

 private:
  using Step = std::int32_t[3];
  /// What key_of_shifted makes a key of.
  using Voxel = std::array<std::uint32_t, 3>;

  /// None if rounding could decide in which voxel a point lies that is an edge away, or if not all
  /// neighbours have keys.
  [[nodiscard]] std::optional<Voxel> voxel_of(const Point& at) const {
    constexpr double kMost = 1e8, kBeside = 1e-6;  // in voxels; 1e8 has an error of 1.5e-8
    Voxel voxel{};
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const double p = at[axis] / map_.options().resolution;
      if (!(std::abs(p) < kMost)) return std::nullopt;
      auto whole = static_cast<std::int64_t>(p);
      if (static_cast<double>(whole) > p) --whole;
      const double in_voxel = p - static_cast<double>(whole);
      const std::int64_t index =
          whole - static_cast<std::int64_t>(map_.origin_voxel()[axis]) + kHalfRange;
      if (!(in_voxel > kBeside && in_voxel < 1.0 - kBeside && index > 1 && index + 1 < kIndexEnd)) {
        return std::nullopt;
      }
      voxel[static_cast<std::size_t>(axis)] = static_cast<std::uint32_t>(index);
    }
    return voxel;
  }
  [[nodiscard]] std::uint32_t gaussian_at(const Voxel& voxel, const Step& step) {
    const VoxelKey key = key_of_shifted(voxel[0] + static_cast<std::uint32_t>(step[0]),
                                        voxel[1] + static_cast<std::uint32_t>(step[1]),
                                        voxel[2] + static_cast<std::uint32_t>(step[2]));
    if (key >> 6U != block_key_) {
      block_key_ = key >> 6U;
      block_ = &block_at(blocks_, block_key_);
    }
    return gaussian_in(*block_, key & 63U);
  }
  [[nodiscard]] std::uint32_t gaussian_at(const Point& at, const Step& step) const {
    const Eigen::Vector3d offset =
        map_.options().resolution * Eigen::Vector3d(step[0], step[1], step[2]);
    const VoxelKey key = map_.key_of(at + offset);
    return key == kNoVoxel ? kNoGaussian : map_.find(key);
  }

  const VoxelMap& map_;
  const kernel::Search& search_;
  BlockTable blocks_;
  std::uint64_t block_key_ = kNoVoxel;  // of the block of the last voxel
  const Block* block_ = nullptr;
  std::optional<Voxel> last_;
  std::array<std::uint32_t, std::size(kernel::Search{}.steps)> found_{};
  std::size_t count_ = 0;
};

/// Sums of E's terms of one Gaussian, differentiated.
class Sums {
 public:
  /// @param g  gradient for a translation
  /// @param A  Hessian for a translation
  /// @param y  the point seen from the sensor, axes of the map [m]: J = [I, -[y]x]
  void add(const Eigen::Vector3d& g, const Eigen::Matrix3d& A, const Eigen::Vector3d& y) {
    const Eigen::Vector3d torque = y.cross(g);
    Eigen::Matrix3d turned;  // the rotation's rows of J^T A
    for (Eigen::Index k = 0; k < 3; ++k) turned.col(k) = y.cross(A.col(k));
    const double outward = g.x() * y.x() + (g.y() * y.y() + g.z() * y.z());
    double* to = hessian_.data();
    for (Eigen::Index row = 0; row < 3; ++row) {
      gradient_[row] += g[row];
      gradient_[3 + row] += torque[row];
      for (Eigen::Index column = row; column < 3; ++column) *to++ += A(row, column);
      const Eigen::Vector3d mixed = y.cross(Eigen::Vector3d(A.row(row)));
      for (Eigen::Index column = 0; column < 3; ++column) *to++ += mixed[column];
    }
    for (Eigen::Index row = 0; row < 3; ++row) {
      const Eigen::Vector3d rotation = y.cross(Eigen::Vector3d(turned.row(row)));
      for (Eigen::Index column = row; column < 3; ++column) {
        // What the second derivatives of the rotation add.
        const double more = 0.5 * (g[row] * y[column] + g[column] * y[row]);
        *to++ += rotation[column] + (row == column ? more - outward : more);
      }
    }
    some_ = true;
  }
  [[nodiscard]] bool empty() const { return !some_; }
  [[nodiscard]] Pull pull_of(std::uint32_t gaussian) const {
    Pull pull{.element = gaussian};
    for (std::size_t k = 0; k < pull.gradient.size(); ++k) {
      pull.gradient[k] = static_cast<float>(gradient_[static_cast<Eigen::Index>(k)]);
    }
    for (std::size_t k = 0; k < pull.hessian.size(); ++k) {
      pull.hessian[k] = static_cast<float>(hessian_[k]);
    }
    return pull;
  }

 private:
  Vector6 gradient_ = Vector6::Zero();
  std::array<double, Pull::kUpper> hessian_{};  // upper triangle, row by row
  bool some_ = false;
};

/// E's terms of a Gaussian and the points that meet it.
/// @param turned  all points, seen from the sensor, axes of the map [m]
Sums sums_of(const Objective& objective, std::span<const Meeting> meetings, PointsView turned,
             const Point& sensor) {
  const VoxelMap& map = objective.map();
  const NdtCoefficients& d = objective.coefficients();
  const std::uint32_t i = meetings.front().gaussian;
  const double edge = map.options().resolution, per_edge = 1.0 / edge;
  const Gaussian gaussian = gaussian_of(map.cells()[i]);
  const Point mean =
      (map.origin_voxel() + VoxelMap::corner_of(map.keys()[i]) + gaussian.mean) * edge;
  Eigen::Matrix3d C;
  C << gaussian.xx, gaussian.xy, gaussian.xz, gaussian.xy, gaussian.yy, gaussian.yz, gaussian.xz,
      gaussian.yz, gaussian.zz;
  Sums sums;
  for (const Meeting& m : meetings) {
    const Eigen::Vector3d& y = turned[m.point];
    const Eigen::Vector3d q = (y + sensor - mean) * per_edge;  // in voxels
    if (objective.search().within_edge && !(q.squaredNorm() < 1.0)) continue;
    const Eigen::Vector3d u = C * q;
    const double scale = std::abs(d.d1) * d.d2 * std::exp(-0.5 * d.d2 * q.dot(u));
    const Eigen::Vector3d g = scale * per_edge * u;
    const Eigen::Matrix3d A = scale * per_edge * per_edge * (C - d.d2 * (u * u.transpose()));
    sums.add(g, A, y);
  }
  return sums;
}

}  // namespace

std::vector<Pull> pulls_on(const Objective& objective, PointsView scan, const Pose& T_map_scan) {
  const Eigen::Matrix3d R = T_map_scan.rotation.normalized().toRotationMatrix();
  const Point& sensor = T_map_scan.translation;
  Neighbourhood neighbourhood(objective);
  PointCloud turned;
  turned.reserve(scan.size());
  std::vector<Meeting> meetings;
  meetings.reserve(4 * scan.size());
  for (std::uint32_t k = 0; k < scan.size(); ++k) {
    turned.emplace_back(R * scan[k]);
    for (const std::uint32_t i : neighbourhood.of(turned[k] + sensor)) meetings.push_back({i, k});
  }
  sort_by_gaussian(meetings, objective.map().cells().size());
  std::vector<Pull> result;
  result.reserve(gaussians_in(meetings));
  for (std::size_t begin = 0, end = 0; begin < meetings.size(); begin = end) {
    const std::uint32_t i = meetings[begin].gaussian;
    while (end < meetings.size() && meetings[end].gaussian == i) ++end;
    const auto of_it = std::span(meetings).subspan(begin, end - begin);
    const Sums sums = sums_of(objective, of_it, turned, sensor);
    if (!sums.empty()) result.push_back(sums.pull_of(i));
  }
  return result;
}

}  // namespace vantage::ndt
