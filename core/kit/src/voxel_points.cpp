#include "vantage/kit/voxel_points.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include "vantage/kit/hash.hpp"
#include "vantage/kit/number_table.hpp"

namespace vantage {
namespace {

struct VoxelKey {
  std::int64_t z, y, x;
  friend auto operator<=>(const VoxelKey&, const VoxelKey&) = default;
};

std::uint64_t hash_of(const VoxelKey& key) { return CellHash{}(std::array{key.z, key.y, key.x}); }

/// The number of the key of one of `voxels`; their size for a new one.
template <class Keyed>
std::uint32_t number_of_voxel(NumberTable& numbers, const VoxelKey& key,
                              const std::vector<Keyed>& voxels) {
  return numbers.insert(
      hash_of(key), [&](std::uint32_t number) { return voxels[number].key == key; },
      [&](std::uint32_t number) { return hash_of(voxels[number].key); });
}

/// The points of one voxel. Offsets count from its first point, so that no digits are lost far from
/// the origin.
struct Voxel {
  VoxelKey key;
  Point first = Point::Zero();
  Point sum_of_offsets = Point::Zero();
  double sum_of_times = 0.0;
  std::uint64_t count = 0;

  [[nodiscard]] Point centroid() const {
    return first + sum_of_offsets / static_cast<double>(count);
  }
  [[nodiscard]] double time() const { return sum_of_times / static_cast<double>(count); }
};

/// The key of a point's voxel; nothing for a point without one.
std::optional<VoxelKey> key_at(const Point& point, double voxel_size) {
  constexpr double kLimit = 0x1p50;
  const Point place = point / voxel_size;
  // Not maxCoeff, which passes over a NaN that is not the first coordinate.
  if (!(place.array().abs() < kLimit).all()) return std::nullopt;
  const auto floor = [](double x) {
    const auto whole = static_cast<std::int64_t>(x);
    return whole - static_cast<std::int64_t>(x < static_cast<double>(whole));
  };
  return VoxelKey{floor(place.z()), floor(place.y()), floor(place.x())};
}

tl::unexpected<Error> no_voxel(std::size_t k, double voxel_size) {
  return fail(ErrorCode::invalid_input,
              "point " + std::to_string(k) +
                  " is not finite or too far from the origin for voxels of " +
                  std::to_string(voxel_size) + " m");
}

/// Calls add(voxel, k) for each point k and its voxel, which begins as `Keyed{key}`.
/// @param number_of  returns the index of the i-th of `count` points in `points`, ascending
/// @return           the voxels that hold points, in the order in which they come
template <class Keyed, class NumberOf, class Add>
Result<std::vector<Keyed>> in_voxels(PointsView points, std::size_t count,
                                     const NumberOf& number_of, double voxel_size, const Add& add) {
  VANTAGE_CHECK(check_voxel_size(voxel_size));
  std::vector<Keyed> voxels;
  NumberTable numbers;
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t k = number_of(i);
    const auto key = key_at(points[k], voxel_size);
    if (!key) return no_voxel(k, voxel_size);
    // Points that follow each other in a scan are often in one voxel.
    if (voxels.empty() || voxels[number].key != *key) {
      number = number_of_voxel(numbers, *key, voxels);
      if (number == voxels.size()) voxels.push_back({.key = *key});
    }
    add(voxels[number], k);
  }
  return voxels;
}

/// The voxels that hold points, in the order of their keys.
/// @param number_of  returns the index of the i-th point in `points`, ascending
/// @param times      of the points; may be empty
template <class NumberOf>
Result<std::vector<Voxel>> voxels_of(PointsView points, std::size_t count,
                                     const NumberOf& number_of, double voxel_size,
                                     std::span<const double> times = {}) {
  const auto add = [&](Voxel& voxel, std::size_t k) {
    if (voxel.count == 0) voxel.first = points[k];
    voxel.sum_of_offsets += points[k] - voxel.first;
    if (!times.empty()) voxel.sum_of_times += times[k];
    ++voxel.count;
  };
  VANTAGE_TRY(const std::vector<Voxel> voxels,
              in_voxels<Voxel>(points, count, number_of, voxel_size, add));
  std::vector<std::pair<VoxelKey, std::uint32_t>> order;
  order.reserve(voxels.size());
  for (const Voxel& one : voxels) order.emplace_back(one.key, order.size());
  std::sort(order.begin(), order.end());
  std::vector<Voxel> sorted;
  sorted.reserve(voxels.size());
  for (const auto& [key, number] : order) sorted.push_back(voxels[number]);
  return sorted;
}

template <class NumberOf>
Result<PointCloud> centroids(PointsView points, std::size_t count, const NumberOf& number_of,
                             double voxel_size) {
  VANTAGE_TRY(const std::vector<Voxel> voxels, voxels_of(points, count, number_of, voxel_size));
  PointCloud result;
  result.reserve(voxels.size());
  for (const Voxel& voxel : voxels) result.push_back(voxel.centroid());
  return result;
}

constexpr auto every = [](std::size_t i) { return i; };
auto those_of(std::span<const std::uint32_t> which) {
  return [which](std::size_t i) { return std::size_t{which[i]}; };
}

}  // namespace

Result<void> check_voxel_size(double voxel_size) {
  if (voxel_size > 0.0 && std::isfinite(voxel_size)) return {};
  return fail(ErrorCode::invalid_input,
              "voxel size must be positive, not " + std::to_string(voxel_size));
}

Result<PointCloud> voxel_centroids(PointsView points, double voxel_size) {
  return centroids(points, points.size(), every, voxel_size);
}

Result<PointCloud> voxel_centroids(PointsView points, std::span<const std::uint32_t> which,
                                   double voxel_size) {
  return centroids(points, which.size(), those_of(which), voxel_size);
}

Result<TimedPoints> voxel_centroids(PointsView points, std::span<const double> times,
                                    double voxel_size) {
  VANTAGE_TRY(const std::vector<Voxel> voxels,
              voxels_of(points, points.size(), every, voxel_size, times));
  TimedPoints result;
  result.points.reserve(voxels.size());
  for (const Voxel& voxel : voxels) result.points.push_back(voxel.centroid());
  if (times.empty()) return result;
  result.times.reserve(voxels.size());
  for (const Voxel& voxel : voxels) result.times.push_back(voxel.time());
  return result;
}

Result<PointCloud> nearest_to_voxel_centres(PointsView points, std::span<const std::uint32_t> which,
                                            double voxel_size) {
  struct Nearest {
    VoxelKey key;
    double distance = 0.0;
    std::optional<std::size_t> number = {};
  };
  const auto add = [&](Nearest& nearest, std::size_t k) {
    const Point corner =
        voxel_size * Point(static_cast<double>(nearest.key.x), static_cast<double>(nearest.key.y),
                           static_cast<double>(nearest.key.z));
    const double distance = (points[k] - corner - Point::Constant(voxel_size / 2)).squaredNorm();
    if (nearest.number && !(distance < nearest.distance)) return;
    nearest.distance = distance;
    nearest.number = k;
  };
  VANTAGE_TRY(const std::vector<Nearest> nearest,
              in_voxels<Nearest>(points, which.size(), those_of(which), voxel_size, add));
  std::vector<std::size_t> numbers;
  numbers.reserve(nearest.size());
  for (const Nearest& best : nearest) numbers.push_back(*best.number);
  std::sort(numbers.begin(), numbers.end());
  PointCloud result;
  result.reserve(numbers.size());
  for (const std::size_t k : numbers) result.push_back(points[k]);
  return result;
}

}  // namespace vantage
