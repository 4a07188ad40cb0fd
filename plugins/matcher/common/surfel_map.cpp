#include "surfel_map.hpp"

#include <tbb/parallel_sort.h>
#include <algorithm>
#include <string>
#include <tuple>
#include <utility>

#include "extent.hpp"
#include "parallel.hpp"

namespace vantage::matching {
namespace {

constexpr std::size_t kNormalChunk = 256;
constexpr double kHalfRange = 1 << 20;

/// Every third bit of the result is one of the lower 21 bits of `index`.
std::uint64_t spread(std::uint64_t index) noexcept {
  index = (index | index << 32U) & 0x001F00000000FFFFU;
  index = (index | index << 16U) & 0x001F0000FF0000FFU;
  index = (index | index << 8U) & 0x100F00F00F00F00FU;
  index = (index | index << 4U) & 0x10C30C30C30C30C3U;
  return (index | index << 2U) & 0x1249249249249249U;
}

struct Keyed {
  std::uint64_t voxel;
  Point local;

  [[nodiscard]] auto order() const { return std::tuple(voxel, local.x(), local.y(), local.z()); }
  friend bool operator<(const Keyed& a, const Keyed& b) { return a.order() < b.order(); }
};

/// Sorts by voxel.
Result<std::vector<Keyed>> sorted(PointsView map, const Point& origin, double edge) {
  const SurfelGrid grid(origin, edge);
  std::vector<Keyed> keyed;
  keyed.reserve(map.size());
  for (const Point& p : map) {
    const auto voxel = grid.voxel_of(p);
    if (!voxel) return fail(too_wide(map, edge));
    keyed.push_back({*voxel, p - origin});
  }
  tbb::parallel_sort(keyed.begin(), keyed.end());
  return keyed;
}

/// Points, how many of the map's points each stands for, and their voxel.
struct Counted {
  PointCloud points;
  std::vector<std::uint32_t> counts;
  std::vector<std::uint64_t> voxels;
};

Counted centroids(const std::vector<Keyed>& sorted) {
  Counted result;
  for (auto first = sorted.begin(); first != sorted.end();) {
    // Relative to one of the points, so that the mean of equal points is that point.
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    auto last = first;
    for (; last != sorted.end() && last->voxel == first->voxel; ++last) {
      sum += last->local - first->local;
    }
    result.points.push_back(first->local + sum / static_cast<double>(last - first));
    result.counts.push_back(static_cast<std::uint32_t>(last - first));
    result.voxels.push_back(first->voxel);
    first = last;
  }
  return result;
}

Counted distinct(const std::vector<Keyed>& sorted) {
  Counted result;
  for (const Keyed& keyed : sorted) {
    if (result.points.empty() || result.points.back() != keyed.local) {
      result.points.push_back(keyed.local);
      result.counts.push_back(0);
      result.voxels.push_back(keyed.voxel);
    }
    ++result.counts.back();
  }
  return result;
}

}  // namespace

std::optional<std::uint64_t> SurfelGrid::voxel_of(const Point& p) const noexcept {
  const Eigen::Vector3d index = (p / edge_).array().floor() - first_.array() + kHalfRange;
  if (!((index.array() >= 0.0).all() && (index.array() < 2.0 * kHalfRange).all())) return {};
  return spread(static_cast<std::uint64_t>(index.x())) << 2U |
         spread(static_cast<std::uint64_t>(index.y())) << 1U |
         spread(static_cast<std::uint64_t>(index.z()));
}

Result<SurfelMap> SurfelMap::build(PointsView map, const Options& options) {
  VANTAGE_CHECK(check_points(map, "the map"));
  const Bounds3 bounds = bounds_of(map);
  const double edge = options.edge();
  SurfelMap result;
  result.origin_ = ((0.5 * bounds.min + 0.5 * bounds.max) / edge).array().round() * edge;
  {
    VANTAGE_TRY(const std::vector<Keyed> keyed, sorted(map, result.origin_, edge));
    Counted counted = options.voxel > 0.0 ? centroids(keyed) : distinct(keyed);
    result.points_ = std::move(counted.points);
    result.points_.shrink_to_fit();
    result.counts_ = std::move(counted.counts);
    result.counts_.shrink_to_fit();
    result.voxels_ = std::move(counted.voxels);
    result.voxels_.shrink_to_fit();
  }

  result.normals_.resize(result.points_.size());
  result.tree_.emplace(result.points_);
  compute_normals(*result.tree_, result.points_, options.neighbours, result.normals_);
  if (options.planes_only) {
    const auto flat = [](const Eigen::Vector3d& normal) { return !normal.isZero(0.0); };
    if (!std::ranges::all_of(result.normals_, flat)) {
      std::size_t kept = 0;
      for (std::size_t i = 0; i < result.points_.size(); ++i) {
        if (!flat(result.normals_[i])) continue;
        result.points_[kept] = result.points_[i];
        result.counts_[kept] = result.counts_[i];
        result.voxels_[kept] = result.voxels_[i];
        result.normals_[kept++] = result.normals_[i];
      }
      result.points_.resize(kept);
      result.points_.shrink_to_fit();
      result.normals_.resize(kept);
      result.normals_.shrink_to_fit();
      result.counts_.resize(kept);
      result.counts_.shrink_to_fit();
      result.voxels_.resize(kept);
      result.voxels_.shrink_to_fit();
      if (kept == 0) {
        return fail(ErrorCode::too_few_matches, "the map has no surface: in no place are " +
                                                    std::to_string(options.neighbours) +
                                                    " neighbouring points spread over a plane");
      }
      result.tree_.emplace(result.points_);
    }
  }
  result.bounds_ = bounds_of(result.points_);
  return result;
}

SurfelMap::SurfelMap(const Point& origin, PointCloud points, std::vector<Eigen::Vector3d> normals)
    : origin_(origin),
      points_(std::move(points)),
      normals_(std::move(normals)),
      bounds_(bounds_of(points_)),
      tree_(points_) {}

Pose SurfelMap::to_local(Pose T_map_scan) const noexcept {
  T_map_scan.rotation.normalize();
  T_map_scan.translation -= origin_;
  return T_map_scan;
}

Pose SurfelMap::to_map(Pose T_local_scan) const noexcept {
  T_local_scan.translation += origin_;
  return T_local_scan;
}

std::size_t SurfelMap::bytes() const noexcept {
  return points_.capacity() * sizeof(Point) + normals_.capacity() * sizeof(Eigen::Vector3d) +
         counts_.capacity() * sizeof(std::uint32_t) + voxels_.capacity() * sizeof(std::uint64_t) +
         tree_->bytes();
}

void compute_normals(const PointTree& tree, PointsView points, std::uint32_t neighbours,
                     std::span<Eigen::Vector3d> normals) {
  for_each_chunk(points.size(), kNormalChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) normals[i] = tree.normal_at(points[i], neighbours);
  });
}

}  // namespace vantage::matching
