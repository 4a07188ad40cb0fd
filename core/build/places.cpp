#include "build/places.hpp"

#include <numeric>
#include <utility>

#include "build/plugin_checks.hpp"
#include "vantage/kit/voxel_points.hpp"

namespace vantage {
namespace {

Result<Places> ground_of(PointsView map, const GroundFilter& filter,
                         const std::optional<OutlierParams>& outliers) {
  Places places;
  places.points = map;
  VANTAGE_TRY(places.which, ground_in(map, filter, outliers));
  if (places.which.empty()) return no_ground();
  places.ground_points = places.which.size();
  return places;
}

Result<Places> only_reachable(Places places, PointsView trajectory, const ViewpointParams& params) {
  const PointsView map = places.points;
  VANTAGE_TRY(IndexList reachable,
              reachable_ground(map, places.which, trajectory, params.max_step));
  // Regions have viewpoints of their own over these voxels, and a voxel may lie in several.
  VANTAGE_TRY(const PointCloud before, voxel_centroids(map, places.which, params.voxel_size));
  VANTAGE_TRY(const PointCloud after, voxel_centroids(map, reachable, params.voxel_size));
  places.unreachable_voxels = before.size() - after.size();
  places.which = std::move(reachable);
  return places;
}

Result<Places> driven(PointsView trajectory, const ViewpointParams& params) {
  if (trajectory.empty()) {
    return fail(ErrorCode::invalid_input,
                "viewpoints.source is \"trajectory\", but there is no trajectory");
  }
  Places places;
  VANTAGE_TRY(places.own, places_along(trajectory, params));
  places.points = places.own;
  places.which.resize(places.own.size());
  std::iota(places.which.begin(), places.which.end(), 0U);
  return places;
}

}  // namespace

tl::unexpected<Error> no_ground() {
  return fail(ErrorCode::invalid_input,
              "no ground was found in the map, so no viewpoint can be placed; viewpoints.source "
              "= \"trajectory\" needs no ground");
}

Result<IndexList> ground_in(PointsView points, const GroundFilter& filter,
                            const std::optional<OutlierParams>& outliers) {
  IndexList stay;
  PointCloud candidates;
  if (outliers) {
    stay = without_outliers(points, *outliers);
    if (stay.empty()) return stay;
    candidates = select(points, stay);
    points = candidates;
  }
  VANTAGE_TRY(IndexList ground, filter.ground(points));
  VANTAGE_CHECK(check_indices(ground, points.size(), "ground"));
  if (outliers) {
    for (std::uint32_t& k : ground) k = stay[k];
  }
  return ground;
}

Result<Places> places_of(PointsView map, PointsView trajectory, const GroundFilter* ground,
                         const std::optional<OutlierParams>& outliers,
                         const ViewpointParams& params) {
  if (params.source == ViewpointSource::trajectory) return driven(trajectory, params);
  auto places = ground_of(map, *ground, outliers);
  if (!places || !params.reachable) return places;
  return only_reachable(*std::move(places), trajectory, params);
}

}  // namespace vantage
