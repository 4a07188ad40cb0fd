#pragma once

#include <cstdint>

#include "vantage/api.hpp"
#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Answers a partitioner's questions about the map that it cuts. The answers come from the same
/// ground, viewpoints and visibility as the region maps, so a partitioner can choose regions by
/// what is seen in them. The number of threads does not change an answer.
/// Thread safety: const methods may run on one object from many threads at once.
class VANTAGE_API MapSurvey {
 public:
  virtual ~MapSurvey();

  /// Virtual viewpoints q over the ground of the whole map (Eqs. 4-5) or along its trajectory, map
  /// frame [m]; may be empty. A voxel on the border between two regions has one viewpoint here;
  /// later it has one viewpoint in each of the two regions.
  [[nodiscard]] virtual Result<PointCloud> viewpoints() const noexcept = 0;

  /// The box around the ground over which viewpoints stand [m]; `unsupported` along a trajectory.
  [[nodiscard]] virtual Result<Bounds3> ground_bounds() const noexcept = 0;

  /// B_q of Eq. 9: the points seen from one viewpoint, decided among all points of the map.
  /// @param viewpoint  map frame [m]; `invalid_input` if not finite
  /// @return           indices into the map, strictly ascending
  [[nodiscard]] virtual Result<IndexList> visible(const Point& viewpoint) const noexcept = 0;

  /// |V_ij| of Eq. 10: how many points the map of `region` will hold before thinning. It costs the
  /// visibility of the region, unless counting ends early; the build computes it again.
  /// @param region  counted as if it owned every place in its footprint and heights. If a region
  ///                with a lower id overlaps it, the map of the build differs
  /// @param enough  counting may end above this number of points: ask for no more than you need
  /// @return        the exact number if it is at most `enough`, otherwise any number above `enough`
  [[nodiscard]] virtual Result<std::uint64_t> observable_points(
      const Region& region, std::uint64_t enough) const noexcept = 0;
};

}  // namespace vantage
