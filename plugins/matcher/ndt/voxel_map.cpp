#include "voxel_map.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "parallel.hpp"

namespace vantage::ndt {
namespace {

/// Sums over the points of one voxel, relative to its centre: there they are small, and the
/// covariance loses no digits to cancellation.
struct Moments {
  VoxelKey key = kNoVoxel;
  std::uint32_t points = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double xx = 0.0, xy = 0.0, xz = 0.0, yy = 0.0, yz = 0.0, zz = 0.0;

  void add(const Eigen::Vector3d& d) noexcept {
    ++points;
    sum += d;
    xx += d.x() * d.x();
    xy += d.x() * d.y();
    xz += d.x() * d.z();
    yy += d.y() * d.y();
    yz += d.y() * d.z();
    zz += d.z() * d.z();
  }
};

/// Nothing for points that all coincide.
std::optional<Gaussian> gaussian_of(const Moments& m, const Eigen::Vector3d& centre,
                                    const VoxelMap::Options& options) {
  const double n = m.points;
  const Eigen::Vector3d mean = m.sum / n;
  Eigen::Matrix3d covariance;
  covariance << m.xx, m.xy, m.xz, m.xy, m.yy, m.yz, m.xz, m.yz, m.zz;
  covariance = (covariance - n * mean * mean.transpose()) / (n - 1.0);

  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  const double largest = solver.eigenvalues().z();
  // Below a millionth of the edge the spread is rounding of the coordinates, not shape.
  if (!(largest > 1e-12 * options.resolution * options.resolution)) return std::nullopt;
  const Eigen::Vector3d inverse_eigenvalues =
      solver.eigenvalues().cwiseMax(options.eigenvalue_floor * largest).cwiseInverse();
  const Eigen::Matrix3d c =
      solver.eigenvectors() * inverse_eigenvalues.asDiagonal() * solver.eigenvectors().transpose();
  return Gaussian{.mean = centre + mean,
                  .xx = c(0, 0),
                  .xy = c(0, 1),
                  .xz = c(0, 2),
                  .yy = c(1, 1),
                  .yz = c(1, 2),
                  .zz = c(2, 2)};
}

constexpr std::size_t kFirstCapacity = 1024;
constexpr std::size_t kVoxelChunk = 256;

}  // namespace

class VoxelMapBuilder {
 public:
  VoxelMapBuilder(const Bounds3& bounds, const VoxelMap::Options& options) : options_(options) {
    map_.resolution_ = options.resolution;
    map_.inverse_resolution_ = 1.0 / options.resolution;
    const Eigen::Vector3d centre = 0.5 * bounds.min + 0.5 * bounds.max;
    origin_index_ = (centre / options.resolution).array().round();
    map_.origin_ = origin_index_ * options.resolution;
    resize(kFirstCapacity);
  }

  Result<void> add(PointsView points) {
    std::uint32_t last = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Point& p = points[i];
      const Eigen::Vector3d index =
          (p / options_.resolution).array().floor() - origin_index_.array() + VoxelMap::kHalfRange;
      if (!((index.array() >= 1.0).all() && (index.array() < VoxelMap::kIndexEnd).all())) {
        return fail(ErrorCode::invalid_input,
                    "map point " + std::to_string(i) + " lies more than a million voxels of " +
                        std::to_string(options_.resolution) + " m from the map's centre");
      }
      const VoxelKey key = VoxelMap::pack(index);
      if (voxels_.empty() || voxels_[last].key != key) last = voxel(key);
      voxels_[last].add((p - map_.origin_) - centre_of(key));
    }
    return {};
  }

  Result<VoxelMap> finish() && {
    std::erase_if(voxels_, [&](const Moments& m) { return m.points < options_.min_points; });
    std::ranges::sort(voxels_, {}, &Moments::key);
    std::vector<std::optional<Gaussian>> gaussians(voxels_.size());
    for_each_chunk(voxels_.size(), kVoxelChunk,
                   [&](std::size_t, std::size_t begin, std::size_t end) {
                     for (std::size_t i = begin; i < end; ++i) {
                       gaussians[i] = gaussian_of(voxels_[i], centre_of(voxels_[i].key), options_);
                     }
                   });

    resize(std::max(kFirstCapacity, 2 * std::bit_ceil(voxels_.size())));
    map_.gaussians_.reserve(voxels_.size());
    map_.counts_.reserve(voxels_.size());
    for (std::size_t i = 0; i < voxels_.size(); ++i) {
      if (!gaussians[i]) continue;
      slot_of(voxels_[i].key) = {voxels_[i].key,
                                 static_cast<std::uint32_t>(map_.gaussians_.size())};
      map_.gaussians_.push_back(*gaussians[i]);
      map_.counts_.push_back(voxels_[i].points);
    }
    if (map_.gaussians_.empty()) {
      return fail(ErrorCode::too_few_matches,
                  "the map is too sparse: no voxel of " + std::to_string(options_.resolution) +
                      " m holds " + std::to_string(options_.min_points) + " distinct points");
    }
    return std::move(map_);
  }

 private:
  [[nodiscard]] Eigen::Vector3d centre_of(VoxelKey key) const noexcept {
    constexpr VoxelKey kMask = (VoxelKey{1} << 21U) - 1;
    const Eigen::Vector3d index(static_cast<double>(key >> 42U),
                                static_cast<double>((key >> 21U) & kMask),
                                static_cast<double>(key & kMask));
    return (index.array() - VoxelMap::kHalfRange + 0.5) * options_.resolution;
  }

  /// The slot that holds `key`, or the free one where it belongs.
  [[nodiscard]] VoxelMap::Slot& slot_of(VoxelKey key) noexcept {
    const std::size_t mask = map_.slots_.size() - 1;
    std::size_t slot = VoxelMap::hash(key) >> map_.shift_;
    while (map_.slots_[slot].key != key && map_.slots_[slot].key != kNoVoxel) {
      slot = (slot + 1) & mask;
    }
    return map_.slots_[slot];
  }

  /// Index in voxels_, which grows at a voxel's first point.
  [[nodiscard]] std::uint32_t voxel(VoxelKey key) {
    if (VoxelMap::Slot& slot = slot_of(key); slot.key == key) return slot.gaussian;
    const auto fresh = static_cast<std::uint32_t>(voxels_.size());
    voxels_.push_back({});
    voxels_.back().key = key;
    if (2 * voxels_.size() > map_.slots_.size()) {
      resize(2 * map_.slots_.size());
      for (std::uint32_t i = 0; i < voxels_.size(); ++i)
        slot_of(voxels_[i].key) = {voxels_[i].key, i};
    } else {
      slot_of(key) = {key, fresh};
    }
    return fresh;
  }

  void resize(std::size_t capacity) {
    map_.slots_.assign(capacity, {});
    map_.shift_ = static_cast<unsigned>(64 - std::countr_zero(capacity));
  }

  VoxelMap::Options options_;
  VoxelMap map_;
  Eigen::Vector3d origin_index_;
  std::vector<Moments> voxels_;
};

Result<VoxelMap> VoxelMap::build(PointsView map, const Options& options) {
  VANTAGE_CHECK(check_points(map, "the map"));
  VoxelMapBuilder builder(bounds_of(map), options);
  VANTAGE_CHECK(builder.add(map));
  return std::move(builder).finish();
}

}  // namespace vantage::ndt
