#include "vantage/engine/viewpoints.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <variant>

#include "build/viewpoint_origin.hpp"
#include "vantage/kit/hash.hpp"
#include "vantage/kit/number_table.hpp"
#include "vantage/overloaded.hpp"

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
  Point first;
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
  if (!(place.cwiseAbs().maxCoeff() < kLimit)) return std::nullopt;
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

Result<void> check_voxel_size(double voxel_size) {
  if (voxel_size > 0.0 && std::isfinite(voxel_size)) return {};
  return fail(ErrorCode::invalid_input,
              "voxel size must be positive, not " + std::to_string(voxel_size));
}

/// The voxels that hold points, in the order of their keys.
/// @param number_of  returns the index of the i-th point in `points`, ascending
/// @param times      of the points; may be empty
template <class NumberOf>
Result<std::vector<Voxel>> voxels_of(PointsView points, std::size_t count,
                                     const NumberOf& number_of, double voxel_size,
                                     std::span<const double> times = {}) {
  VANTAGE_CHECK(check_voxel_size(voxel_size));
  std::vector<Voxel> voxels;
  NumberTable numbers;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t k = number_of(i);
    const auto key = key_at(points[k], voxel_size);
    if (!key) return no_voxel(k, voxel_size);
    const std::uint32_t number = number_of_voxel(numbers, *key, voxels);
    if (number == voxels.size()) voxels.push_back({.key = *key, .first = points[k]});
    Voxel& one = voxels[number];
    one.sum_of_offsets += points[k] - one.first;
    if (!times.empty()) one.sum_of_times += times[k];
    ++one.count;
  }
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

/// One point per voxel, the one nearest to the voxel's centre; the points keep their order.
template <class NumberOf>
Result<PointCloud> nearest_to_centres(PointsView points, std::size_t count,
                                      const NumberOf& number_of, double voxel_size) {
  VANTAGE_CHECK(check_voxel_size(voxel_size));
  struct Nearest {
    VoxelKey key;
    double distance;
    std::size_t number;
  };
  std::vector<Nearest> nearest;
  NumberTable voxel_numbers;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t k = number_of(i);
    const auto key = key_at(points[k], voxel_size);
    if (!key) return no_voxel(k, voxel_size);
    const Point corner =
        voxel_size * Point(static_cast<double>(key->x), static_cast<double>(key->y),
                           static_cast<double>(key->z));
    const double distance = (points[k] - corner - Point::Constant(voxel_size / 2)).squaredNorm();
    const std::uint32_t voxel = number_of_voxel(voxel_numbers, *key, nearest);
    if (voxel == nearest.size()) nearest.push_back({*key, distance, k});
    if (distance < nearest[voxel].distance) nearest[voxel] = {*key, distance, k};
  }
  std::vector<std::size_t> numbers;
  numbers.reserve(nearest.size());
  for (const Nearest& best : nearest) numbers.push_back(best.number);
  std::sort(numbers.begin(), numbers.end());
  PointCloud result;
  result.reserve(numbers.size());
  for (const std::size_t k : numbers) result.push_back(points[k]);
  return result;
}

template <class NumberOf>
Result<PointCloud> viewpoints(PointsView points, std::size_t count, const NumberOf& number_of,
                              const ViewpointParams& params) {
  const auto raised = [&](const PointCloud& places, double sensor_height) {
    PointCloud result;
    result.reserve(places.size() * params.height_offsets.size());
    for (const double offset : params.height_offsets) {
      const double height = sensor_height + offset;
      for (const Point& q : places) result.emplace_back(q.x(), q.y(), q.z() + height);
    }
    return result;
  };
  const auto over_ground = [&](double sensor_height) -> Result<PointCloud> {
    VANTAGE_TRY(const PointCloud places, centroids(points, count, number_of, params.voxel_size));
    return raised(places, sensor_height);  // Eq. 5
  };
  const auto along = [&]() -> Result<PointCloud> {
    VANTAGE_TRY(const PointCloud places,
                nearest_to_centres(points, count, number_of, params.voxel_size));
    return raised(places, 0.0);  // the sensor was there
  };
  return std::visit(
      Overloaded{[&](const OverGround& over) { return over_ground(over.sensor_height); },
                 [&](const OverReachableGround& over) { return over_ground(over.sensor_height); },
                 [&](const AlongTrajectory&) { return along(); }},
      origin_of(params));
}

bool has_twice(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return std::adjacent_find(values.begin(), values.end()) != values.end();
}

/// The direction of travel at each position, in plan view, of length 1; all zero if the trajectory
/// goes nowhere.
std::vector<Eigen::Vector2d> directions_of(PointsView trajectory, double spacing) {
  const auto between = [&](std::size_t i, std::size_t j) -> Eigen::Vector2d {
    return (trajectory[j] - trajectory[i]).head<2>();
  };
  std::vector<std::size_t> knots;
  for (std::size_t k = 0; k < trajectory.size(); ++k) {
    if (knots.empty() || between(knots.back(), k).norm() >= spacing) knots.push_back(k);
  }
  std::vector<Eigen::Vector2d> directions(trajectory.size(), Eigen::Vector2d::Zero());
  if (knots.size() < 2) return directions;
  for (std::size_t i = 0; i < knots.size(); ++i) {
    const std::size_t before = knots[i > 0 ? i - 1 : 0];
    const std::size_t after = knots[std::min(i + 1, knots.size() - 1)];
    Eigen::Vector2d direction = between(before, after);
    // There and back: the direction after the turn counts.
    if (!(direction.norm() >= spacing / 2)) direction = between(knots[i], after);
    const std::size_t end = i + 1 < knots.size() ? after : trajectory.size();
    std::fill(directions.begin() + static_cast<std::ptrdiff_t>(knots[i]),
              directions.begin() + static_cast<std::ptrdiff_t>(end), direction.normalized());
  }
  return directions;
}

}  // namespace

Result<PointCloud> voxel_centroids(PointsView points, double voxel_size) {
  return centroids(
      points, points.size(), [](std::size_t i) { return i; }, voxel_size);
}

Result<TimedPoints> voxel_centroids(PointsView points, std::span<const double> times,
                                    double voxel_size) {
  VANTAGE_TRY(const std::vector<Voxel> voxels,
              voxels_of(
                  points, points.size(), [](std::size_t i) { return i; }, voxel_size, times));
  TimedPoints result;
  result.points.reserve(voxels.size());
  for (const Voxel& voxel : voxels) result.points.push_back(voxel.centroid());
  if (times.empty()) return result;
  result.times.reserve(voxels.size());
  for (const Voxel& voxel : voxels) result.times.push_back(voxel.time());
  return result;
}

Result<PointCloud> places_along(PointsView trajectory, const ViewpointParams& params) {
  VANTAGE_CHECK(check_voxel_size(params.voxel_size));
  VANTAGE_CHECK(check_points(trajectory, "the trajectory"));
  const auto directions = directions_of(trajectory, params.voxel_size / 2);
  PointCloud places;
  places.reserve(trajectory.size() * params.lateral_offsets.size());
  for (const double offset : params.lateral_offsets) {
    if (offset != 0.0 && directions.front().isZero()) {
      return fail(ErrorCode::invalid_input,
                  "the trajectory stays within half a voxel, so it has no direction of travel: "
                  "expected a longer trajectory, or no lateral_offsets");
    }
    for (std::size_t k = 0; k < trajectory.size(); ++k) {
      const Eigen::Vector2d& forward = directions[k];
      places.push_back(trajectory[k] + offset * Point(-forward.y(), forward.x(), 0.0));
    }
  }
  return places;
}

Result<PointCloud> viewpoints_over(PointsView points, const ViewpointParams& params) {
  return viewpoints(
      points, points.size(), [](std::size_t i) { return i; }, params);
}

Result<PointCloud> viewpoints_over(PointsView points, std::span<const std::uint32_t> which,
                                   const ViewpointParams& params) {
  return viewpoints(
      points, which.size(), [&](std::size_t i) { return which[i]; }, params);
}

Result<void> ViewpointParams::validate() const {
  const auto check = [](std::string_view key, const std::vector<double>& offsets) -> Result<void> {
    const std::string name = "'" + std::string(key) + "'";
    if (offsets.empty()) {
      return fail_at({key}, name + " is empty, so there is no viewpoint: expected at least 0.0");
    }
    if (has_twice(offsets)) return fail_at({key}, name + " names one offset twice");
    return {};
  };
  VANTAGE_CHECK(check("height_offsets", height_offsets));
  VANTAGE_CHECK(check("lateral_offsets", lateral_offsets));
  const ViewpointParams defaults;
  if (source == ViewpointSource::ground && lateral_offsets != defaults.lateral_offsets) {
    return fail_at(
        {"lateral_offsets"},
        "'lateral_offsets' are measured from a trajectory: expected source = \"trajectory\"");
  }
  if (source == ViewpointSource::trajectory && reachable) {
    return fail_at({"reachable"},
                   "'reachable' applies to ground, but source = \"trajectory\" uses no ground");
  }
  if (source == ViewpointSource::trajectory && sensor_height != defaults.sensor_height) {
    return fail_at({"sensor_height"},
                   "'sensor_height' is measured from the ground, but source = \"trajectory\" is "
                   "the sensor's own path: leave it out, or set 'height_offsets'");
  }
  return {};
}

ViewpointOrigin origin_of(const ViewpointParams& params) {
  switch (params.source) {
    case ViewpointSource::trajectory: return AlongTrajectory{params.lateral_offsets};
    case ViewpointSource::ground: break;
  }
  if (params.reachable) return OverReachableGround{params.sensor_height, params.max_step};
  return OverGround{params.sensor_height};
}

}  // namespace vantage
