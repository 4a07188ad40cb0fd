#include "vantage/build/viewpoints.hpp"

#include <algorithm>
#include <span>

#include "vantage/kit/voxel_points.hpp"

namespace vantage {
namespace {

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

Result<PointCloud> viewpoints_over(PointsView points, std::span<const std::uint32_t> which,
                                   const ViewpointParams& params) {
  const bool driven = params.source == ViewpointSource::trajectory;
  VANTAGE_TRY(const PointCloud places,
              driven ? nearest_to_voxel_centres(points, which, params.voxel_size)
                     : voxel_centroids(points, which, params.voxel_size));
  PointCloud viewpoints;
  viewpoints.reserve(places.size() * params.height_offsets.size());
  for (const double offset : params.height_offsets) {
    // Eq. 5; along a trajectory, places are those of the sensor.
    const double height = (driven ? 0.0 : params.sensor_height) + offset;
    for (const Point& q : places) viewpoints.emplace_back(q.x(), q.y(), q.z() + height);
  }
  return viewpoints;
}

}  // namespace vantage
